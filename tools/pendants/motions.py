"""Poses and motions as the client library hands them out."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

from openpendant.simplemsg.pendant import Outcome, OutcomeKind

from .failures import Aborted


@dataclass(frozen=True, slots=True)
class Pose:
    """Where the tool is.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w.
        frame: frame in which both are given.
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


class MotionHandle:
    """A motion that the server accepted and began.

    Attributes:
        request_id: its number.
    """

    def __init__(self, request_id: int, outcome: asyncio.Future[Outcome]) -> None:
        """Made by the client's move methods."""
        self.request_id = request_id
        self._outcome = outcome

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
