"""The jogs of the blocking client: each lets go by itself, unless the program calls it again."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping

from .jogging import DEFAULT_DEADLINE
from .sync_motions import SyncJog, SyncMotion
from .sync_session import SyncSession
from .way_out import WayOut

LONGEST_JOG = 2.0
"""A jog lets go by itself so long after the program's last call [s]."""


class SyncJogging(SyncSession):
    """Jogs, with the arguments of `Jogging`."""

    def jog(
        self,
        joints: Mapping[int, float],
        *,
        deadline: float = DEFAULT_DEADLINE,
        longest: float | None = LONGEST_JOG,
    ) -> contextlib.AbstractContextManager[SyncJog]:
        """Jog one or several joints for the length of the context."""
        jog = self.background.jog(joints, deadline=deadline, longest=longest)
        return SyncJog.held(self._thread, jog)

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
        longest: float | None = LONGEST_JOG,
    ) -> contextlib.AbstractContextManager[SyncJog]:
        """Jog the tool along and about the axes of a frame for the length of the context."""
        jog = self.background.jog_tool(
            x=x, y=y, z=z, a=a, b=b, c=c, frame=frame, deadline=deadline, longest=longest
        )
        return SyncJog.held(self._thread, jog)

    def jog_out(
        self,
        way: WayOut,
        *,
        deadline: float = DEFAULT_DEADLINE,
        longest: float | None = LONGEST_JOG,
    ) -> contextlib.AbstractContextManager[SyncJog]:
        """Jog by a key that `retreat` named for the length of the context."""
        jog = self.background.jog_out(way, deadline=deadline, longest=longest)
        return SyncJog.held(self._thread, jog)

    def step(self, joints: Mapping[int, float], *, speed: float = 1.0) -> SyncMotion:
        """Move one or several joints by increments [rad, m for a linear axis]."""
        return self._motion(self.background.step(joints, speed=speed))

    def step_tool(
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
    ) -> SyncMotion:
        """Move the tool by an increment [m, rad], in a straight line."""
        return self._motion(
            self.background.step_tool(x=x, y=y, z=z, a=a, b=b, c=c, frame=frame, speed=speed)
        )

    def undo_jog(self, *, speed: float = 1.0) -> SyncMotion:
        """Move back along the way of the last jog or step."""
        return self._motion(self.background.undo_jog(speed=speed))
