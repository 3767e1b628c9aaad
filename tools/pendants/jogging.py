"""The client's jogs: by hold-to-run, by increments, and back again."""

from __future__ import annotations

from collections.abc import Mapping

from openpendant.simplemsg.pendant import JogEnded, JogSpace, JogStep, JogUndo

from .jog import Jog
from .joint_values import JogValues, slots
from .motions import MotionHandle
from .observing import Observing
from .press_line import PressLine
from .way_out import WayOut

DEFAULT_DEADLINE = 0.15
"""The server ends a press so long after its last beat, where nothing else is declared [s]."""


class Jogging(Observing):
    """Jogs. Speeds are parts of the cell's jog speed; angles are rad, lengths m."""

    _line: PressLine

    def _begin_work(self) -> None:
        self._line = PressLine(self._conversation, self._quotable_state, self.hello.dof)
        super()._begin_work()

    def _jog_ended(self, account: JogEnded) -> None:
        self._line.ended(account)

    def jog(
        self,
        joints: Mapping[int, float],
        *,
        deadline: float = DEFAULT_DEADLINE,
        longest: float | None = None,
    ) -> Jog:
        """Return a jog of one or several joints: `async with pendant.jog(joints={0: 0.5}):`.

        Args:
            joints: part of the jog speed by joint index from 0, -1 to 1.
            deadline: the robot ramps to rest so long after a beat was missed, 0.05 to 0.25 s.
            longest: let go by itself so long after the last call of `aim` or `hold` [s].

        Returns:
            A context manager that presses on entry and releases on exit.

        Raises:
            WrongArgument: the robot has no such joint.
        """
        return self._jog(JogValues.of_joints(joints, self.hello.dof), deadline, longest)

    def jog_tool(
        self,
        *,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        a: float = 0.0,
        b: float = 0.0,
        c: float = 0.0,
        frame: str = "base",
        deadline: float = DEFAULT_DEADLINE,
        longest: float | None = None,
    ) -> Jog:
        """Return a jog of the tool: `async with pendant.jog_tool(x=0.5, frame="tool"):`.

        Args:
            x: part of the jog speed along the frame's x axis, -1 to 1.
            y: likewise along y.
            z: likewise along z.
            a: part of the rotation speed about the frame's x axis, -1 to 1.
            b: likewise about y.
            c: likewise about z.
            frame: base, tool or a named frame.
            deadline: the robot ramps to rest so long after a beat was missed, 0.05 to 0.25 s.
            longest: let go by itself so long after the last call of `aim` or `hold` [s].

        Returns:
            A context manager that presses on entry and releases on exit.
        """
        return self._jog(JogValues.of_tool((x, y, z, a, b, c), frame), deadline, longest)

    def jog_out(
        self, way: WayOut, *, deadline: float = DEFAULT_DEADLINE, longest: float | None = None
    ) -> Jog:
        """Return the jog of a key that `retreat` named.

        Args:
            way: one of its ways.
            deadline: the robot ramps to rest so long after a beat was missed, 0.05 to 0.25 s.
            longest: let go by itself so long after the last call of `aim` or `hold` [s].

        Returns:
            A context manager that presses on entry and releases on exit.
        """
        values = way["values"]
        if way["space"] == JogSpace.TOOL:
            aim = JogValues.of_tool(tuple(values), way["frame"])
        else:
            aim = JogValues.of_joints(dict(enumerate(values)), self.hello.dof)
        return self._jog(aim, deadline, longest)

    def _jog(self, aim: JogValues, deadline: float, longest: float | None) -> Jog:
        return Jog(self._line, aim, deadline, longest)

    async def step(self, joints: Mapping[int, float], *, speed: float = 1.0) -> MotionHandle:
        """Move one or several joints by increments.

        Args:
            joints: increments by joint index from 0 [rad, m for a linear axis].
            speed: fraction of the jog speed, above 0, up to 1.

        Returns:
            The motion, accepted and begun.

        Raises:
            Refused: out of range, not in control, the mode or the enabling device forbids it, …
            WrongArgument: the robot has no such joint.
            ConnectionLost: the connection ended.
        """
        return await self._step(JogValues.of_joints(joints, self.hello.dof), speed)

    async def step_tool(
        self,
        *,
        x: float = 0.0,
        y: float = 0.0,
        z: float = 0.0,
        a: float = 0.0,
        b: float = 0.0,
        c: float = 0.0,
        frame: str = "base",
        speed: float = 1.0,
    ) -> MotionHandle:
        """Move the tool by an increment, in a straight line.

        Args:
            x: increment along the frame's x axis [m].
            y: likewise along y.
            z: likewise along z.
            a: rotation about the frame's x axis [rad].
            b: likewise about y.
            c: likewise about z.
            frame: base, tool or a named frame.
            speed: fraction of the jog speed, above 0, up to 1.

        Returns:
            The motion, accepted and begun.

        Raises:
            Refused: unreachable, nobody knows the frame, not in control, …
            ConnectionLost: the connection ended.
        """
        return await self._step(JogValues.of_tool((x, y, z, a, b, c), frame), speed)

    async def _step(self, by: JogValues, speed: float) -> MotionHandle:
        return await self._begin(
            lambda request_id: JogStep(
                request_id=request_id,
                speed=speed,
                space=by.space,
                frame=by.frame,
                value_count=len(by.values),
                values=slots(by.values),
            )
        )

    async def undo_jog(self, *, speed: float = 1.0) -> MotionHandle:
        """Move back along the way of the last jog or step.

        Raises:
            Refused: there is no jog to take back, not in control, …
            ConnectionLost: the connection ended.
        """
        return await self._begin(lambda request_id: JogUndo(request_id=request_id, speed=speed))
