"""Operations on the trace: the way of the tool."""

from __future__ import annotations

from dataclasses import field
from typing import Annotated, TypedDict

from ..roles import Permission
from .declaration import Count, Request, operation
from .replies import Done


class Trace(TypedDict):
    """The way of the tool since the trace was cleared.

    Attributes:
        points: up to 800 of them: x, y, z in base [m].
        total: how many there are.
    """

    points: list[list[float]]
    total: int


@operation("trace.show", needs=Permission.OBSERVE)
class ShowTrace(Request[Trace]):
    """Return the way of the tool since the trace was cleared."""

    first: Annotated[int, Count(0)] = field(default=0, kw_only=True)
    """points to leave out at the beginning."""


@operation("trace.clear", needs=Permission.RUN_PROGRAM, overtaken=False)
class ClearTrace(Request[Done]):
    """Forget the way of the tool."""
