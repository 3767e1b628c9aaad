"""The client library for programs without asyncio: notebooks, scripts, other languages' bridges.

    with SyncPendantClient.connect("127.0.0.1", 11010, client="notebook") as pendant:
        with pendant.control():
            pendant.move_joints([0.0, -1.2, 1.2, -1.5, -1.5, 0.0], speed=0.2).done()

Every call has the name, the arguments and the errors of `PendantClient`, and blocks. The connection
lives on a thread of its own, so its beats go on while your program computes, and would go on while
it hangs: therefore a jog lets go by itself (`longest`), unless the program calls it again.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Mapping, Sequence

from openpendant.simplemsg.pendant import (
    AccountRole,
    AuthorityWanted,
    Motion,
    OperatingMode,
    RunKind,
)
from openpendant.simplemsg.pendant.management.cell import WayOut

from .client import EnablingDevice, Pose
from .jog import DEFAULT_DEADLINE
from .sync_managing import SyncManaging
from .sync_session import SyncJog, SyncMotion, SyncSession

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


class SyncPendantClient(SyncManaging, SyncJogging):
    """One connection to a pendant server, with blocking calls.

    Safe to share between threads: each call waits for its own answer. Where one thread closes it,
    the calls of the others fail with `ConnectionLost`. Callbacks are those of `background`, and
    run on its thread: they must not block, nor call this client.

    Attributes:
        background: the client on the private thread.
    """

    # Who may come in; for admins.

    def issue_pairing_code(self) -> str:
        """Return a code that makes whoever types it an operator of this cell."""
        return self._thread.call(self.background.issue_pairing_code())

    def end_pairing(self) -> None:
        """End the cell's code and what its guests may do."""
        self._thread.call(self.background.end_pairing())

    def add_account(self, name: str, role: AccountRole | str, password: str) -> None:
        """Add an account; returns when it is kept."""
        self._thread.call(self.background.add_account(name, role, password))

    def set_password(self, name: str, password: str) -> None:
        """Give an account another password, which logs out whoever uses it."""
        self._thread.call(self.background.set_password(name, password))

    # Authority, modes and stops.

    def take_control(self, *, force: bool = False) -> None:
        """Request the motion authority and keep it until released."""
        self._thread.call(self.background.take_control(force=force))

    def release_control(self) -> None:
        """Give the motion authority back."""
        self._thread.call(self.background.release_control())

    def control(
        self, *, force: bool = False, wanted: Callable[[AuthorityWanted], None] | None = None
    ) -> contextlib.AbstractContextManager[None]:
        """Hold the motion authority for the length of the context."""
        return self._thread.entered(self.background.control(force=force, wanted=wanted))

    def enabling(self) -> contextlib.AbstractContextManager[EnablingDevice]:
        """Hold the enabling device (training) half pressed for the length of the context."""
        return self._thread.entered(self.background.enabling())

    def set_mode(self, mode: OperatingMode) -> None:
        """Set the mode of operation; what moves is stopped."""
        self._thread.call(self.background.set_mode(mode))

    def set_speed(self, override: float, *, tool_speed: float = 0.0) -> None:
        """Set the speed override, which acts on the running motion too, and the tool's cap."""
        self._thread.call(self.background.set_speed(override, tool_speed=tool_speed))

    def pause(self) -> None:
        """Bring the motion or program to rest on its path."""
        self._thread.call(self.background.pause())

    def resume(self) -> None:
        """Let what is paused go on along its path."""
        self._thread.call(self.background.resume())

    def program_stop(self) -> None:
        """End the motion or program; nothing is latched."""
        self._thread.call(self.background.program_stop())

    def stop(self, reason: str = "stop") -> None:
        """Stop the robot and latch the software stop; anybody may. It is no safety device."""
        self._thread.call(self.background.stop(reason))

    def reset_stop(self) -> None:
        """Unlatch the stop; moves nothing."""
        self._thread.call(self.background.reset_stop())

    # Motions.

    def move_joints(self, joints: Sequence[float], *, speed: float = 0.1) -> SyncMotion:
        """Move all joints in a straight joint line."""
        return self._motion(self.background.move_joints(joints, speed=speed))

    def move_to_pose(
        self, pose: Pose, *, motion: Motion = Motion.PTP, speed: float = 0.1
    ) -> SyncMotion:
        """Move the tool to a pose, by PTP or in a straight line (`Motion.LIN`)."""
        return self._motion(self.background.move_to_pose(pose, motion=motion, speed=speed))

    def follow_joints(
        self, waypoints: Sequence[Sequence[float]], *, speed: float = 0.1
    ) -> SyncMotion:
        """Move through joint positions without stopping; where the robot stands is implied."""
        return self._motion(self.background.follow_joints(waypoints, speed=speed))

    def follow_poses(
        self, poses: Sequence[Pose], *, motion: Motion = Motion.PTP, speed: float = 0.1
    ) -> SyncMotion:
        """Move the tool through poses: PTP passes them without stopping, LIN stops at each."""
        return self._motion(self.background.follow_poses(poses, motion=motion, speed=speed))

    def home(self, target: str = "home", *, speed: float = 0.1) -> SyncMotion:
        """Move all joints to a named position of the robot, `home` or `zero`."""
        return self._motion(self.background.home(target, speed=speed))

    def run_program(
        self,
        name: str,
        *,
        run: RunKind = RunKind.ALL,
        line: int = 0,
        loops: int = 1,
        speed: float = 1.0,
        revision: int = 0,
    ) -> SyncMotion:
        """Run a stored program, or one step of it; `done` tells when that has ended."""
        return self._motion(
            self.background.run_program(
                name, run=run, line=line, loops=loops, speed=speed, revision=revision
            )
        )
