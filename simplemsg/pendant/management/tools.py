"""Operations on tools: their centre points in the flange, which one is selected, calibration.

Lengths are m. The tools have a revision, which every change names; `frames.show` tells it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, TypedDict

from ..roles import Permission
from .declaration import Content, Length, ReadAs, Real, Request, Revision, operation
from .poses import Placed
from .replies import Changed


class CalibratedTool(TypedDict):
    """A tool centre point, and how well the positions determine it.

    Attributes:
        position: x, y, z in the flange [m].
        residuals: how far each position's centre stays from the point that was touched [m].
        max_residual: the largest of them [m].
        uncertainty: of the centre point [m]; None where it cannot be told.
    """

    position: list[float]
    residuals: list[float]
    max_residual: float
    uncertainty: float | None


@operation("tools.import", needs=Permission.CHANGE_TOOLS)
class ImportTools(Request[Changed]):
    """Replace all tools by those of a file's content.

    Raises:
        Refused: REVISION_CONFLICT, BAD_FILE, FRAME_REFUSED, CHANGE_WHILE_MOVING.
    """

    content: Content
    """as in a file of schema `openpendant-frames/1`."""
    expected_revision: Revision
    """the one of the tools that the change was made from."""


@operation("tools.add", needs=Permission.CHANGE_TOOLS)
class AddTool(Request[Changed]):
    """Add a tool.

    Raises:
        Refused: REVISION_CONFLICT, FRAME_REFUSED, CHANGE_WHILE_MOVING.
    """

    name: str
    """name of the tool."""
    tcp: Placed
    """its centre point in the flange."""
    expected_revision: Revision
    """the one of the tools that the change was made from."""


@operation("tools.move", needs=Permission.CHANGE_TOOLS)
class MoveTool(Request[Changed]):
    """Give a tool another centre point.

    Raises:
        Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
    """

    name: str
    """name of the tool."""
    tcp: Placed
    """its centre point in the flange."""
    expected_revision: Revision
    """the one of the tools that the change was made from."""


@operation("tools.remove", needs=Permission.CHANGE_TOOLS)
class RemoveTool(Request[Changed]):
    """Remove a tool that is not selected.

    Raises:
        Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
    """

    name: str
    """name of the tool."""
    expected_revision: Revision
    """the one of the tools that the change was made from."""


@operation("tools.select", needs=Permission.CHANGE_TOOLS, overtaken=True)
class SelectTool(Request[Changed]):
    """Select a tool; in force once it is answered.

    Raises:
        Refused: REVISION_CONFLICT, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
    """

    name: str | None
    """name of the tool; None for the bare flange."""
    expected_revision: Revision
    """the one of the tools that the change was made from."""


@operation("tools.calibrate", needs=Permission.CHANGE_TOOLS)
class CalibrateTool(Request[CalibratedTool]):
    """Return the centre point of the tool that touched one point; keeps nothing, `add` does.

    Raises:
        Refused: POOR_GEOMETRY, WRONG_JOINT_COUNT.
    """

    positions: Annotated[
        Sequence[Sequence[float]], ReadAs(Annotated[tuple[tuple[Real, ...], ...], Length(4, 20)])
    ]
    """4 to 20 joint positions that touch it [rad, m for a linear axis]."""
