"""The calls of RoboAnalyzer's virtual robot server, by their names, on the pendant protocol.

    robot = RoboAnalyzerClient("127.0.0.1", 11010)
    robot.IncrementJointAngle(1, 10.0)
    robot.IncrementX(-25.0)
    robot.DisposeRobot()

Degrees and millimetres, joints counted from 1, as there. A, B and C are roll, pitch and yaw
*values* of the tool in base: `IncrementA` changes one of three numbers, which is not the same as a
jog about an axis (`PendantClient.jog_tool(a=...)`). Each call returns when the robot stands, and
raises `Refused` or `Aborted` with the reason where it may not or did not get there, `WrongArgument`
where an argument is none. Numbers may be floats throughout, as MATLAB's are: joint 1.0 is joint 1.
"""

from __future__ import annotations

import contextlib
import math
import ssl
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Self

from openpendant.simplemsg.pendant import Motion, OperatingMode, StateField
from openpendant.simplemsg.verdicts import VerdictCode

from ..client import DEFAULT_PORT, Pose
from ..connection_errors import ConnectionLost, PendantError, Refused, WrongArgument
from ..motions import quaternion_of, roll_pitch_yaw
from ..sync_client import SyncMotion, SyncPendantClient
from .values import (
    RobotDisplay,
    RobotPosture,
    chosen_cell,
    display_of,
    fraction,
    joint_index,
    number,
    numbers,
    posture_of,
    some_cell,
    text,
    whole,
)

_X, _Y, _Z = range(3)
_ROLL, _PITCH, _YAW = range(3)


class RoboAnalyzerClient:
    """One robot of a pendant server, in RoboAnalyzer's words.

    It holds the motion authority from its making to `DisposeRobot`. In a manual mode it holds the
    enabling device (training) for the length of each call. The capitals are RoboAnalyzer's.
    After `DisposeRobot` every call raises `ConnectionLost`.
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
        tls: ssl.SSLContext | None = None,
        strict: bool = False,
        user: str = "",
        password: str | None = None,
        pairing: str | None = None,
    ) -> None:
        """Connect and select a robot.

        Args:
            robot: name of the robot to select, or of its cell; empty for the one of `cell`, or
                for the only one.
            cell: name of the cell to ask first; empty for any.
            speed: of every motion, a fraction of the joints' largest speed.
            client: name that others are shown; at most 32 bytes.
            tls: how to encrypt and whom to trust; None for an unencrypted connection.
            strict: refuse to log in where others could read the secret; see `PendantClient`.
            user: account, or with a pairing code the name of a guest, `client` if empty.
            pairing: code of a class, instead of a password; where the server has several cells,
                `cell` says which.

        Raises:
            Unreachable: nobody listens there, or it does not speak TLS.
            WrongArgument: the server has no such robot, or several; its cells are in the text.
            Refused: there is no such cell, the login is wrong, or somebody else moves the robot.
            ConnectionLost: the connection ended before the robot was selected.
        """
        self.speed = speed
        address = text(host, "the host"), whole(port, "the port")
        robot, cell = text(robot, "the robot"), text(cell, "the cell")

        # A function, not a partial: no `repr` of this object shows the password.
        def connected(cell: str) -> SyncPendantClient:
            return SyncPendantClient.connect(
                *address,
                client=client,
                cell=cell,
                state_rate=50.0,
                tls=tls,
                strict=strict,
                user=user,
                password=password,
                pairing=pairing,
            )

        self._connected = connected
        is_named = True
        try:
            self._connection: SyncPendantClient | None = connected(cell)
        except Refused as refused:
            # Of several cells none was named; any of them tells which there are.
            guest = "" if cell else some_cell(refused)
            if not guest:
                raise
            if pairing is not None:
                wanted = f"a pairing code is of one cell, say cell=: {refused.text}"
                raise WrongArgument(wanted) from None
            self._connection = connected(guest)
            is_named = False
        hello = self._pendant.hello
        try:
            if is_named and robot in ("", hello.robot, hello.cell):
                self._units = begun(self._pendant)
            else:
                self.LoadRobot(robot)
        except BaseException:
            self.DisposeRobot()
            raise

    @property
    def speed(self) -> float:
        """Speed of every motion, a fraction of the joints' largest speed, above 0, up to 1."""
        return self._speed

    @speed.setter
    def speed(self, value: float) -> None:
        self._speed = fraction(value, "the speed")

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.DisposeRobot()

    def ShowAvailableRobots(self) -> list[str]:
        """Return the names of the robots that the server serves."""
        return [cell["robot"] for cell in self._pendant.cells()["cells"]]

    def LoadRobot(self, name: str) -> None:
        """Select a robot by its name or that of its cell, and take control of it.

        Where that fails the robot of before stays selected.

        Raises:
            WrongArgument: the server has no such robot, or several; its cells are in the text.
            Refused: somebody else moves it.
        """
        before = self._pendant
        cell = chosen_cell(text(name, "the robot"), before.cells()["cells"])
        if cell == before.hello.cell:
            self._units = begun(before)
            return
        loaded = self._connected(cell)
        try:
            self._units = begun(loaded)
        except BaseException:
            loaded.close()
            raise
        self._connection = loaded
        before.close()

    def DisplayRobot(self) -> RobotDisplay:
        """Return what the selected robot is: its name and its joints with their limits."""
        return display_of(self._pendant.snapshot())

    def UpdateRobot(self) -> RobotPosture:
        """Return where the robot is now: joints, and the tool as X, Y, Z, A, B, C."""
        self._pendant.next_state()
        return posture_of(self._units, self._pendant.joints(), self._pendant.tool_pose())

    def DisposeRobot(self) -> None:
        """Give the robot back and end the connection; a second call does nothing."""
        connection, self._connection = self._connection, None
        if connection is not None:
            connection.close()

    def ClearTrace(self) -> None:
        """Have every display of this robot forget the trace of its tool so far."""
        self._pendant.trace.clear()

    def UpdateJointAngles(self, angles: Sequence[float]) -> None:
        """Move all joints to these positions [°, mm for a linear axis]."""
        given = numbers(angles, "angles", len(self._units))
        target = [value * unit for value, unit in zip(given, self._units, strict=True)]
        self._arrive(lambda: self._pendant.move_joints(target, speed=self.speed))

    def IncrementJointAngle(self, joint: float, increment: float) -> None:
        """Move one joint, counted from 1, by an increment [°, mm for a linear axis]."""
        index = joint_index(joint, len(self._units))
        increments = [0.0] * len(self._units)
        increments[index] = number(increment, "the increment")
        self.IncrementJointAngles(increments)

    def IncrementJointAngles(self, increments: Sequence[float]) -> None:
        """Move all joints by increments [°, mm for a linear axis]."""
        given = numbers(increments, "increments", len(self._units))
        self._pendant.next_state()
        here = self._pendant.joints()
        target = [
            value + increment * unit
            for value, increment, unit in zip(here, given, self._units, strict=True)
        ]
        self._arrive(lambda: self._pendant.move_joints(target, speed=self.speed))

    def SetHomePosition(self) -> None:
        """Move all joints to the robot's home position."""
        self._arrive(lambda: self._pendant.home(speed=self.speed))

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

    def _shift(self, axis: int, increment: float) -> None:
        metres = number(increment, "the increment") / 1000
        here = self._tool_pose()
        x, y, z = (value + metres * (index == axis) for index, value in enumerate(here.position))
        self._line_to(Pose((x, y, z), here.orientation))

    def _turn(self, angle: int, increment: float) -> None:
        degrees = number(increment, "the increment")
        here = self._tool_pose()
        angles = list(roll_pitch_yaw(here.orientation))
        angles[angle] += math.radians(degrees)
        self._line_to(Pose(here.position, quaternion_of(*angles)))

    def _line_to(self, pose: Pose) -> None:
        self._arrive(lambda: self._pendant.move_to_pose(pose, motion=Motion.LIN, speed=self.speed))

    def _arrive(self, move: Callable[[], SyncMotion]) -> None:
        """Start a motion and wait for its end; a robot at the target already has arrived.

        The enabling device (training) is held in the modes that need it.
        """
        pendant = self._pendant
        is_automatic = pendant.next_state().operating_mode == OperatingMode.AUTOMATIC
        with contextlib.nullcontext() if is_automatic else pendant.enabling():
            try:
                motion = move()
            except Refused as refused:
                if refused.code != VerdictCode.NO_MOTION:
                    raise
            else:
                motion.done()

    def _tool_pose(self) -> Pose:
        self._pendant.next_state()
        return self._pendant.tool_pose()

    @property
    def _pendant(self) -> SyncPendantClient:
        if self._connection is None:
            raise ConnectionLost("the robot was disposed of; make another RoboAnalyzerClient")
        return self._connection


_READY_WITHIN = 10.0


def begun(pendant: SyncPendantClient) -> list[float]:
    """Take control of a robot; return one degree or one millimetre of each joint, in rad or m.

    Raises:
        Refused: somebody else moves it.
        PendantError: its controller reports no position.
    """
    joints = pendant.snapshot()["joints"]
    pendant.take_control()
    try:
        pendant.wait_until(
            lambda state: bool(state.valid_fields & StateField.TOOL), within=_READY_WITHIN
        )
    except TimeoutError:
        text = f"the controller did not tell within {_READY_WITHIN:g} s where the robot stands"
        raise PendantError(f"{text}; openpendant why says what is missing") from None
    return [math.radians(1.0) if joint["unit"] == "rad" else 0.001 for joint in joints]
