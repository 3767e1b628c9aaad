"""Poses, orientations, motions and how they ended, as the client library hands them out.

R = Rz(yaw) Ry(pitch) Rx(roll), the convention of ROS and of RoboAnalyzer's A, B and C.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from dataclasses import dataclass

from openpendant.simplemsg.pendant import JogEnd, JogEnded, Outcome, OutcomeKind

from .connection_errors import Aborted, PendantError, Unanswered

Quaternion = tuple[float, float, float, float]


def roll_pitch_yaw(quaternion: Sequence[float]) -> tuple[float, float, float]:
    """Return roll, pitch, yaw [rad] of a unit quaternion; pitch is within ±π/2."""
    x, y, z, w = quaternion
    roll = math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x))))
    yaw = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return roll, pitch, yaw


def quaternion_of(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the unit quaternion of roll, pitch, yaw [rad]."""
    cr, sr = math.cos(roll / 2), math.sin(roll / 2)
    cp, sp = math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return (
        cy * cp * sr - sy * sp * cr,
        cy * sp * cr + sy * cp * sr,
        sy * cp * cr - cy * sp * sr,
        cy * cp * cr + sy * sp * sr,
    )


_REST_WITHIN = 35.0
"""A robot that was let go stands long before; no word of it for so long is a fault [s]."""

JOG_ENDS = {
    JogEnd.RELEASED: "it was released",
    JogEnd.SILENT: "the server heard no beat within its deadline",
    JogEnd.CONNECTION_LOST: "its connection was lost",
    JogEnd.REPLACED: "another press took over",
    JogEnd.STOPPED: "the robot was stopped",
}
"""Reasons for the end of a press, in words."""


@dataclass(frozen=True, slots=True)
class Pose:
    """The place and the orientation of the tool.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w.
    """

    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    frame: str = "base"


@dataclass(frozen=True, slots=True)
class MotionResult:
    """A completed motion.

    Attributes:
        plan_time: time that planning took [s].
        motion_time: planned duration [s].
    """

    plan_time: float
    motion_time: float


@dataclass(frozen=True, slots=True)
class JogAccount:
    """Account of the end of a press and of the robot's way to rest.

    Attributes:
        stop_time: from the end of the press to rest [s].
        joint_distance: farthest that a joint went in that time [rad, m for a linear axis].
        tool_distance: way of the tool in that time [m].
        positions: (n,) where the joints stand [rad, m].
    """

    press: int
    reason: JogEnd
    stop_time: float
    joint_distance: float
    tool_distance: float
    positions: tuple[float, ...]

    @classmethod
    def of(cls, message: JogEnded, dof: int) -> JogAccount:
        """Read the server's account of a robot with so many joints."""
        return cls(
            message.press,
            JogEnd(message.reason),
            message.stop_time,
            message.joint_distance,
            message.tool_distance,
            message.positions[:dof],
        )


class MotionHandle:
    """A motion that the server accepted and began."""

    def __init__(self, request_id: int, outcome: asyncio.Future[Outcome]) -> None:
        self.request_id = request_id
        self._outcome = outcome

    @property
    def is_over(self) -> bool:
        """True once it has ended, for any reason."""
        return self._outcome.done()

    async def done(self) -> MotionResult:
        """Wait until the motion ended; cancelling the wait does not stop the robot.

        Raises:
            Aborted: the motion did not arrive.
            ConnectionLost: the connection ended first.
        """
        outcome = await asyncio.shield(self._outcome)
        if outcome.outcome != OutcomeKind.COMPLETED:
            raise Aborted(outcome.code, outcome.text, outcome.joint, outcome.value, outcome.limit)
        return MotionResult(outcome.plan_time, outcome.motion_time)

    async def over_within(self, seconds: float) -> bool:
        """Wait for the end, at most so long; return whether it came."""
        await asyncio.wait({self._outcome}, timeout=seconds)
        return self.is_over


class PressHandle(MotionHandle):
    """The motion of one press of a jog."""

    def __init__(
        self, press: int, motion: MotionHandle, account: asyncio.Future[JogAccount]
    ) -> None:
        super().__init__(motion.request_id, motion._outcome)
        self.press = press
        self._account = account

    @property
    def account(self) -> JogAccount | None:
        """Account of how the robot came to rest; None before."""
        return self._account.result() if self._account.done() else None

    def forget(self) -> None:
        """Expect no end any more: it has never started."""
        self._outcome.cancel()
        self._account.cancel()

    async def rested(self) -> JogAccount:
        """Wait until the robot stands again, once it was let go.

        Raises:
            Aborted: something else than the release ended it: a stop, the enabling device, …
            Unanswered: the server did not say within 35 s that the robot stands.
            ConnectionLost: the connection ended first.
        """
        if not await self.over_within(_REST_WITHIN):
            text = f"no word within {_REST_WITHIN:g} s that the robot stands"
            raise Unanswered(f"{text}; look at it before you ask for anything")
        await self.done()
        if self.account is None:
            raise PendantError(f"the server gave no account of press {self.press}")
        return self.account
