"""The calls of RoboAnalyzer's virtual robot server, by their names, on the pendant protocol.

    robot = RoboAnalyzerClient("127.0.0.1", 11010)
    robot.IncrementJointAngle(1, 10.0)
    robot.IncrementX(-25.0)
    robot.DisposeRobot()

Degrees and millimetres, joints counted from 1, as there. A, B and C are roll, pitch and yaw
*values* of the tool in base: `IncrementA` changes one of three numbers, which is not the same as a
jog about an axis (`PendantClient.jog_tool(a=...)`). Each call returns when the robot stands, and
raises `Refused` or `Aborted` with the reason where it may not or did not get there.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from types import TracebackType
from typing import Self

from openpendant.simplemsg.pendant import Motion, OperatingMode, StateField
from openpendant.simplemsg.verdicts import VerdictCode

from .attitude import quaternion_of, roll_pitch_yaw
from .cell_choice import chosen_cell, some_cell
from .client import DEFAULT_PORT, Pose
from .failures import Refused, WrongArgument
from .roboanalyzer_robots import RobotDisplay, RobotPosture, display_of, posture_of
from .sync_client import SyncPendantClient
from .sync_motions import SyncMotion

_READY_WITHIN = 10.0

_X, _Y, _Z = range(3)
_ROLL, _PITCH, _YAW = range(3)


class RoboAnalyzerClient:
    """One robot of a pendant server, in RoboAnalyzer's words.

    It holds the motion authority from its making to `DisposeRobot`. In a manual mode it holds the
    enabling device (training) for the length of each call. The capitals are RoboAnalyzer's.

    Attributes:
        speed: of every motion, a fraction of the joints' largest speed, above 0, up to 1.
    """

    def __init__(
        self,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        robot: str = "",
        *,
        cell: str = "",
        speed: float = 0.2,
        client: str = "RoboAnalyzer",
    ) -> None:
        """Connect and select a robot.

        Args:
            host: address of the pendant server.
            port: its pendant port.
            robot: name of the robot to select, or of its cell; empty for the one of `cell`, or
                for the only one.
            cell: name of the cell to ask first; empty for any.
            speed: of every motion, a fraction of the joints' largest speed.
            client: name that others are shown; at most 32 bytes.

        Raises:
            OSError: nobody listens there.
            WrongArgument: the server has no such robot, or several; its cells are in the text.
            Refused: there is no such cell, or somebody else moves the robot.
        """
        self.speed = speed
        self._address = (host, port, client)
        is_named = True
        try:
            self._pendant = self._connected(cell)
        except Refused as refused:
            # Of several cells none was named; any of them tells which there are.
            guest = "" if cell else some_cell(refused)
            if not guest:
                raise
            self._pendant = self._connected(guest)
            is_named = False
        hello = self._pendant.hello
        try:
            if is_named and robot in ("", hello.robot, hello.cell):
                self._begin()
            else:
                self.LoadRobot(robot)
        except BaseException:
            self._pendant.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.DisposeRobot()

    # Robots.

    def ShowAvailableRobots(self) -> list[str]:
        """Return the names of the robots that the server serves."""
        return [cell["robot"] for cell in self._pendant.cells()["cells"]]

    def LoadRobot(self, name: str) -> None:
        """Select a robot by its name or that of its cell, and take control of it.

        Raises:
            WrongArgument: the server has no such robot, or several; its cells are in the text.
            Refused: somebody else moves it.
        """
        cell = chosen_cell(name, self._pendant.cells()["cells"])
        self._pendant.close()
        self._pendant = self._connected(cell)
        self._begin()

    def DisplayRobot(self) -> RobotDisplay:
        """Return what the selected robot is: its name and its joints with their limits."""
        return display_of(self._pendant.snapshot())

    def UpdateRobot(self) -> RobotPosture:
        """Return where the robot is now: joints, and the tool as X, Y, Z, A, B, C."""
        self._pendant.next_state()
        return posture_of(self._units, self._pendant.joints(), self._pendant.tool_pose())

    def DisposeRobot(self) -> None:
        """Give the robot back and end the connection; a second call does nothing."""
        self._pendant.close()

    # The trace.

    def ClearTrace(self) -> None:
        """Have every display of this robot forget the trace of its tool so far."""
        self._pendant.trace.clear()

    # Joints.

    def UpdateJointAngles(self, angles: Sequence[float]) -> None:
        """Move all joints to these positions [°, mm for a linear axis]."""
        if len(angles) != len(self._units):
            raise WrongArgument(f"{len(angles)} angles; the robot has {len(self._units)} joints")
        target = [value * unit for value, unit in zip(angles, self._units, strict=True)]
        with self._enabled():
            _arrive(lambda: self._pendant.move_joints(target, speed=self.speed))

    def IncrementJointAngle(self, joint: int, increment: float) -> None:
        """Move one joint, counted from 1, by an increment [°, mm for a linear axis]."""
        if not 1 <= joint <= len(self._units):
            raise WrongArgument(f"no joint {joint}; the robot has joints 1 to {len(self._units)}")
        increments = [0.0] * len(self._units)
        increments[joint - 1] = increment
        self.IncrementJointAngles(increments)

    def IncrementJointAngles(self, increments: Sequence[float]) -> None:
        """Move all joints by increments [°, mm for a linear axis]."""
        if len(increments) != len(self._units):
            text = f"{len(increments)} increments; the robot has {len(self._units)} joints"
            raise WrongArgument(text)
        self._pendant.next_state()
        here = self._pendant.joints()
        target = [
            value + increment * unit
            for value, increment, unit in zip(here, increments, self._units, strict=True)
        ]
        with self._enabled():
            _arrive(lambda: self._pendant.move_joints(target, speed=self.speed))

    def SetHomePosition(self) -> None:
        """Move all joints to the robot's home position."""
        with self._enabled():
            _arrive(lambda: self._pendant.home(speed=self.speed))

    # The tool, in base.

    def IncrementX(self, increment: float) -> None:
        """Move the tool along the X axis of base [mm], in a straight line."""
        self._shift(_X, increment)

    def IncrementY(self, increment: float) -> None:
        """Move the tool along the Y axis of base [mm], in a straight line."""
        self._shift(_Y, increment)

    def IncrementZ(self, increment: float) -> None:
        """Move the tool along the Z axis of base [mm], in a straight line."""
        self._shift(_Z, increment)

    def IncrementA(self, increment: float) -> None:
        """Change the tool's roll value [°]; its point stays where it is."""
        self._turn(_ROLL, increment)

    def IncrementB(self, increment: float) -> None:
        """Change the tool's pitch value [°]; its point stays where it is."""
        self._turn(_PITCH, increment)

    def IncrementC(self, increment: float) -> None:
        """Change the tool's yaw value [°]; its point stays where it is."""
        self._turn(_YAW, increment)

    def _shift(self, axis: int, millimetres: float) -> None:
        here = self._tool_pose()
        x, y, z = (
            value + millimetres / 1000 * (index == axis)
            for index, value in enumerate(here.position)
        )
        self._line_to(Pose((x, y, z), here.orientation))

    def _turn(self, angle: int, degrees: float) -> None:
        here = self._tool_pose()
        angles = list(roll_pitch_yaw(here.orientation))
        angles[angle] += math.radians(degrees)
        self._line_to(Pose(here.position, quaternion_of(*angles)))

    def _line_to(self, pose: Pose) -> None:
        with self._enabled():
            _arrive(lambda: self._pendant.move_to_pose(pose, motion=Motion.LIN, speed=self.speed))

    def _tool_pose(self) -> Pose:
        self._pendant.next_state()
        return self._pendant.tool_pose()

    # The connection.

    def _connected(self, cell: str) -> SyncPendantClient:
        host, port, client = self._address
        return SyncPendantClient.connect(host, port, client=client, cell=cell, state_rate=50.0)

    def _begin(self) -> None:
        """Take control of the robot; do not keep a connection that may not."""
        try:
            joints = self._pendant.snapshot()["joints"]
            self._units = [
                math.radians(1.0) if joint["unit"] == "rad" else 0.001 for joint in joints
            ]
            self._pendant.take_control()
            self._pendant.wait_until(
                lambda state: bool(state.valid_fields & StateField.TOOL), within=_READY_WITHIN
            )
        except BaseException:
            self._pendant.close()
            raise

    @contextlib.contextmanager
    def _enabled(self) -> Iterator[None]:
        """Hold the enabling device (training) where the mode wants it."""
        state = self._pendant.next_state()
        if state.operating_mode == OperatingMode.AUTOMATIC:
            yield
            return
        with self._pendant.enabling():
            yield


def _arrive(move: Callable[[], SyncMotion]) -> None:
    """Begin a motion and wait for its end; a robot that is there already has arrived."""
    try:
        motion = move()
    except Refused as refused:
        if refused.code != VerdictCode.NO_MOTION:
            raise
        return
    motion.done()
