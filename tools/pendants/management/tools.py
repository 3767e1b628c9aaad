"""Tools: their centre points in the flange, which one is selected, and calibration.

Lengths are m. The tools have a revision, which every change names; `frames.show` tells it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypedDict

from .calls import Request, asks, call
from .frames import AnyPose, Changed


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


class ToolCalls:
    """The operations on tools."""

    @call
    def add(self, name: str, tcp: AnyPose, expected_revision: int) -> Request[Changed]:
        """Add a tool.

        Args:
            name: name of the tool.
            tcp: its centre point in the flange.
            expected_revision: the one of the tools that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, FRAME_REFUSED, CHANGE_WHILE_MOVING.
        """
        return asks("tools.add", name=name, tcp=tcp, expected_revision=expected_revision)

    @call
    def move(self, name: str, tcp: AnyPose, expected_revision: int) -> Request[Changed]:
        """Give a tool another centre point.

        Args:
            name: name of the tool.
            tcp: its centre point in the flange.
            expected_revision: the one of the tools that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
        """
        return asks("tools.move", name=name, tcp=tcp, expected_revision=expected_revision)

    @call
    def remove(self, name: str, expected_revision: int) -> Request[Changed]:
        """Remove a tool that is not selected.

        Args:
            name: name of the tool.
            expected_revision: the one of the tools that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, FRAME_REFUSED, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
        """
        return asks("tools.remove", name=name, expected_revision=expected_revision)

    @call
    def select(self, name: str | None, expected_revision: int) -> Request[Changed]:
        """Select a tool; in force once it is answered.

        Args:
            name: name of the tool; None for the bare flange.
            expected_revision: the one of the tools that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, UNKNOWN_FRAME, CHANGE_WHILE_MOVING.
        """
        return asks("tools.select", name=name, expected_revision=expected_revision)

    @call
    def calibrate(self, positions: Sequence[Sequence[float]]) -> Request[CalibratedTool]:
        """Return the centre point of the tool that touched one point; keeps nothing, `add` does.

        Args:
            positions: 4 to 20 joint positions that touch it [rad, m for a linear axis].

        Raises:
            Refused: POOR_GEOMETRY, WRONG_JOINT_COUNT.
        """
        return asks("tools.calibrate", positions=positions)

    @call
    def import_(self, content: Mapping[str, Any], expected_revision: int) -> Request[Changed]:
        """Replace all tools by those of a file's content.

        Args:
            content: as in a file of schema `openpendant-frames/1`.
            expected_revision: the one of the tools that the change was made from.

        Raises:
            Refused: REVISION_CONFLICT, BAD_FILE, FRAME_REFUSED, CHANGE_WHILE_MOVING.
        """
        return asks("tools.import", content=content, expected_revision=expected_revision)
