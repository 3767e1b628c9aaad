"""Operations on the controller's inputs and outputs, which count from 0."""

from __future__ import annotations

from typing import TypedDict

from ..roles import Permission
from .declaration import Request, operation
from .replies import Done


class SignalValues(TypedDict):
    """All inputs and outputs as last read, counted from 0.

    Attributes:
        offered: whether the controller offers any to the server.
        inputs: values.
        outputs: values.
    """

    offered: bool
    inputs: list[bool]
    outputs: list[bool]


@operation("signals.read", needs=Permission.OBSERVE)
class ReadAllSignals(Request[SignalValues]):
    """Return all inputs and outputs."""


@operation("signals.set", needs=Permission.SET_OUTPUT, in_order=True)
class SetSignal(Request[Done]):
    """Give an output a value; answered once the controller has done it.

    Raises:
        Refused: NO_SIGNAL, SIGNALS_UNAVAILABLE, CONTROLLER_REFUSED.
    """

    output: int
    """its number, from 0."""
    value: bool
    """on or off."""
