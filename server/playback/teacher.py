"""Points that are taught: where the robot stood when asked becomes an edit of a program.

Owns in which frame and with which tool: the program's own for a new point, those of the point for
one that is touched up. Saves nothing.
"""

from __future__ import annotations

from dataclasses import replace

from ..programs.edits import RecordPoint, TouchUp
from ..programs.points import TeachPoint
from ..programs.program import Program, check_robot
from ..refusal import Refusal
from ..robot_cell import RobotCell
from ..robot_view import RobotView
from . import operations as op
from .taught_points import Standing, standing_now, taught_point


class NotTaught(Exception):
    """A point cannot be taught; the refusal says why."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.sentence)
        self.refusal = refusal


class Teacher:
    """Teaches points of one robot."""

    def __init__(self, cell: RobotCell, robot: RobotView, robot_name: str) -> None:
        """Make a teacher.

        Args:
            cell: knows where the robot stands.
            robot: its mathematics.
            robot_name: its name.
        """
        self._cell = cell
        self._robot = robot
        self._robot_name = robot_name

    def standing(self, now: int) -> Standing | Refusal:
        """Return where the robot stands, for a point that is asked for now, or why there is none.

        Args:
            now: monotonic time, ns.
        """
        return standing_now(self._cell, self._robot, now)

    def record(self, head: Program, asked: op.RecordPoint, at: Standing) -> RecordPoint:
        """Return the edit that adds a point where the robot stood.

        Args:
            head: the program; of its points one is enough, of its statements none.
            asked: what to add.
            at: where it stood when that was asked.

        Raises:
            NotTaught: there is no such frame or tool.
            ProgramError: the program is of another robot, or the name is refused.
        """
        point = replace(self._taught(head, asked.point, at), comment=asked.comment)
        return RecordPoint(point, asked.move, asked.at)

    def touch_up(self, head: Program, asked: op.TouchUpPoint, at: Standing) -> TouchUp:
        """Return the edit that puts a point where the robot stood.

        Args:
            head: the program; of its points the one in question is enough.
            asked: which point.
            at: where it stood when that was asked.

        Raises:
            NotTaught: there is no such frame or tool.
            ProgramError: as of `record`, or there is no such point.
        """
        before = head.point(asked.point).pose
        point = self._taught(
            head,
            asked.point,
            at,
            frame=None if before is None else before.frame,
            tool=None if before is None else before.tool,
        )
        return TouchUp(point.name, point.joints, point.pose, point.configuration)

    def _taught(
        self,
        program: Program,
        name: str,
        at: Standing,
        frame: str | None = None,
        tool: str | None = None,
    ) -> TeachPoint:
        """Return the point where the robot stood, in the program's own frame if none is named."""
        check_robot(program, self._robot_name, self._cell.limits)
        point = taught_point(at, self._robot, name, frame or program.frame, tool or program.tool)
        if isinstance(point, Refusal):
            raise NotTaught(point)
        return point
