"""The client's authority, modes, speeds, enabling (training) and stops, and its single motions."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable, Sequence
from types import TracebackType
from typing import Self

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityAction,
    AuthorityBeat,
    AuthorityChanged,
    AuthorityReason,
    AuthorityWanted,
    Enabling,
    EnablingPosition,
    Execute,
    Home,
    JointMove,
    JointPath,
    JointWaypoint,
    Motion,
    MotionControl,
    MotionControlAction,
    OperatingMode,
    PoseMove,
    PosePath,
    PoseWaypoint,
    Prepare,
    PrepareAction,
    ProgramRun,
    ResetStop,
    RunKind,
    SetMode,
    SetSpeed,
    SoftwareStop,
)

from .connection_errors import ConnectionLost, PendantError, Refused, WrongArgument
from .motions import MotionHandle, Pose
from .press import slots
from .session import PendantSession, end_task

BEAT_PERIOD = 0.05
"""Enabling and jog presses are repeated so often while they are held [s]."""

_SPARE = BEAT_PERIOD / 5
"""A device whose signs go out with the beats of a press waits so much longer for the next [s]."""


class EnablingDevice:
    """The enabling device (training) of this connection; no safety device.

    A context manager: half pressed inside, let go outside. The positions are repeated by the event
    loop, so a program that hangs has let go as far as the server is concerned.
    """

    def __init__(
        self, write: Callable[[Message], None], in_use: Callable[[EnablingDevice | None], None]
    ) -> None:
        """Make one that is let go.

        Args:
            in_use: told that this one is the connection's from now on, and None after its end.
        """
        self.position = EnablingPosition.RELEASED
        self._write = write
        self._in_use = in_use
        self._due = 0.0
        self._repeating: asyncio.Task[None] | None = None

    async def __aenter__(self) -> Self:
        # After a stop the server wants to see it let go before it counts as held again.
        self.let_go()
        self.hold()
        self._in_use(self)
        self._repeating = self._begin_repeating()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._in_use(None)
        await end_task(self._repeating)
        with contextlib.suppress(ConnectionLost):
            self.let_go()

    def hold(self) -> None:
        """Press it half way: what the mode allows may move."""
        self._put(EnablingPosition.HELD)

    def press_through(self) -> None:
        """Press it through, as in a fright; the robot stops until it was let go."""
        self._put(EnablingPosition.PANIC)

    def let_go(self) -> None:
        """Let it go; what moves is stopped, in the modes that need it."""
        self._put(EnablingPosition.RELEASED)

    def _carried(self) -> Sequence[Message]:
        """Return its sign where it is held, for a write that goes out now; the next may wait."""
        if self.position is not EnablingPosition.HELD:
            return ()
        self._due = asyncio.get_running_loop().time() + BEAT_PERIOD + _SPARE
        return (Enabling(position=self.position),)

    def _put(self, position: EnablingPosition) -> None:
        self.position = position
        self._write(Enabling(position=position))
        self._due = asyncio.get_running_loop().time() + BEAT_PERIOD

    def _begin_repeating(self) -> asyncio.Task[None] | None:
        return asyncio.get_running_loop().create_task(self._repeat())

    async def _repeat(self) -> None:
        loop = asyncio.get_running_loop()
        with contextlib.suppress(ConnectionLost):
            while True:
                await asyncio.sleep(self._due - loop.time())
                if loop.time() >= self._due:
                    self._put(self.position)


class FedEnabling(EnablingDevice):
    """An enabling device (training) whose signs come from a device that beats by itself.

    No timer repeats them: `beat` sends one, and each beat of a `FedJog` carries one along.
    """

    def beat(self) -> None:
        """Send its sign, where it is held.

        Raises:
            ConnectionLost: the connection ended.
        """
        if self.position is EnablingPosition.HELD:
            self.hold()

    def _begin_repeating(self) -> None:
        return None


class Operating(PendantSession):
    """The client's calls of authority, mode, speeds, enabling (training) and stops."""

    _beating: asyncio.Task[None] | None = None
    _in_control = False
    _device: EnablingDevice | None = None

    @property
    def in_control(self) -> bool:
        """True while this connection holds the motion authority, by the messages received."""
        return self._in_control and self._conversation.error is None

    async def close(self) -> None:
        """End the connection; what it was moving is stopped by the server."""
        await end_task(self._beating)
        await super().close()

    async def take_control(self, *, force: bool = False) -> None:
        """Request the motion authority and keep it with beats until released.

        Args:
            force: take it over from whoever has it; needs the role, and the automatic mode.

        Raises:
            Refused: somebody else has it.
            ConnectionLost: the connection ended.
        """
        action = AuthorityAction.FORCE if force else AuthorityAction.REQUEST
        await self._ask(lambda request_id: Authority(request_id=request_id, action=action))
        self._in_control = True
        await end_task(self._beating)
        self._beating = asyncio.get_running_loop().create_task(
            self._beat(self.hello.authority_timeout / 3)
        )

    async def _beat(self, period: float) -> None:
        with contextlib.suppress(ConnectionLost):
            while True:
                await asyncio.sleep(period)
                self._conversation.write(AuthorityBeat())

    async def release_control(self) -> None:
        """Give the motion authority back.

        Raises:
            Refused: we do not have it.
            ConnectionLost: the connection ended.
        """
        await end_task(self._beating)
        action = AuthorityAction.RELEASE
        await self._ask(lambda request_id: Authority(request_id=request_id, action=action))
        self._in_control = False

    @contextlib.asynccontextmanager
    async def control(
        self,
        *,
        force: bool = False,
        wanted: Callable[[AuthorityWanted], None] | None = None,
    ) -> AsyncIterator[None]:
        """Hold the motion authority for the length of the context.

        Args:
            force: take it over from whoever has it; needs the role, and the automatic mode.
            wanted: called when somebody asks for it; takes the place of `on_wanted` meanwhile.
        """
        await self.take_control(force=force)
        before = self.on_wanted
        if wanted is not None:
            self.on_wanted = wanted
        try:
            yield
        finally:
            self.on_wanted = before
            with contextlib.suppress(PendantError):
                await self.release_control()

    def _authority_moved(self, change: AuthorityChanged) -> None:
        is_ours = change.holder == self.hello.session
        self._set_control(is_ours and change.reason != AuthorityReason.LOGGED_OUT)

    def _sent_away(self, why: Refused) -> None:
        super()._sent_away(why)
        self._set_control(False)  # who may not look on may not move

    def _set_control(self, is_ours: bool) -> None:
        self._in_control = is_ours
        if not is_ours and self._beating is not None:
            self._beating.cancel()

    def enabling(self) -> EnablingDevice:
        """Return the enabling device (training): `async with pendant.enabling():`."""
        return EnablingDevice(self._conversation.write, self._use)

    def fed_enabling(self) -> FedEnabling:
        """Return the enabling device (training) of a device that beats by itself."""
        return FedEnabling(self._conversation.write, self._use)

    def _use(self, device: EnablingDevice | None) -> None:
        self._device = device

    def _enabling_sign(self) -> Sequence[Message]:
        return () if self._device is None else self._device._carried()

    async def set_mode(self, mode: OperatingMode) -> None:
        """Set the mode of operation; what moves is stopped.

        Raises:
            Refused: not in control, or the controller's own selector rules.
            ConnectionLost: the connection ended.
        """
        await self._ask(lambda request_id: SetMode(request_id=request_id, mode=mode))

    async def set_speed(self, override: float, *, tool_speed: float = 0.0) -> None:
        """Set the speed override, which acts on the running motion too, and the tool's cap.

        Args:
            override: fraction of the planned speed, 0.001 to 1. 0 pauses what moves; raised again,
                it stands until `resume`.
            tool_speed: cap of tool and elbow [m/s]; 0 leaves it as it is, and in automatic only
                0 is taken: nothing is capped there.

        Raises:
            Refused: not in control, or a value is out of bounds.
            ConnectionLost: the connection ended.
        """
        await self._ask(
            lambda request_id: SetSpeed(
                request_id=request_id, override=override, tool_speed=tool_speed
            )
        )

    async def pause(self) -> None:
        """Bring the motion or program to rest on its path.

        Raises:
            Refused: not in control, or nothing moves that could be paused.
            ConnectionLost: the connection ended.
        """
        await self._control_motion(MotionControlAction.PAUSE)

    async def resume(self) -> None:
        """Let what is paused go on along its path.

        Raises:
            Refused: not in control, not enabled where the mode asks for it, or nothing is paused.
            ConnectionLost: the connection ended.
        """
        await self._control_motion(MotionControlAction.RESUME)

    async def program_stop(self) -> None:
        """End the motion or program; nothing is latched.

        Raises:
            Refused: not in control, or nothing runs.
            ConnectionLost: the connection ended.
        """
        await self._control_motion(MotionControlAction.PROGRAM_STOP)

    async def _control_motion(self, action: MotionControlAction) -> None:
        await self._ask(lambda request_id: MotionControl(request_id=request_id, action=action))

    async def stop(self, reason: str = "stop") -> None:
        """Stop the robot and latch the software stop; anybody may. It is no safety device.

        Raises:
            ConnectionLost: the connection ended.
        """
        await self._ask(lambda request_id: SoftwareStop(request_id=request_id, reason=reason))

    async def reset_stop(self) -> None:
        """Unlatch the stop; moves nothing.

        Raises:
            Refused: we do not have the motion authority, or the robot still moves.
            ConnectionLost: the connection ended.
        """
        await self._ask(lambda request_id: ResetStop(request_id=request_id))


class Moves(PendantSession):
    """Motions; each returns once it was accepted and has begun, and its `done` tells the end."""

    async def move_joints(self, joints: Sequence[float], *, speed: float = 0.1) -> MotionHandle:
        """Move all joints in a straight joint line.

        Args:
            joints: (n,) target, controller side [rad, m for a linear axis].
            speed: fraction of the joints' largest speed, above 0, up to 1.

        Raises:
            Refused: out of range, wrong joint count, not in control, robot busy, …
            WrongArgument: more joints than a message has room for.
            ConnectionLost: the connection ended.
        """
        target = slots(joints)
        return await self._begin(
            lambda request_id: JointMove(
                request_id=request_id, speed=speed, joint_count=len(joints), joints=target
            )
        )

    async def move_to_pose(
        self, pose: Pose, *, motion: Motion = Motion.PTP, speed: float = 0.1
    ) -> MotionHandle:
        """Move the tool to a pose, by PTP or in a straight line (`Motion.LIN`).

        Raises:
            Refused: unreachable, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        return await self._begin(
            lambda request_id: PoseMove(
                request_id=request_id,
                motion=motion,
                speed=speed,
                frame=pose.frame,
                position=pose.position,
                orientation=pose.orientation,
            )
        )

    async def follow_joints(
        self, waypoints: Sequence[Sequence[float]], *, speed: float = 0.1
    ) -> MotionHandle:
        """Move through joint positions without stopping; where the robot stands is implied.

        Raises:
            Refused: out of range, not in control, robot busy, …
            WrongArgument: no waypoints, or waypoints of different lengths.
            ConnectionLost: the connection ended.
        """
        counts = {len(point) for point in waypoints}
        if len(counts) != 1:
            raise WrongArgument(f"the waypoints of one path hold {sorted(counts)} joints each")
        path = tuple(JointWaypoint(joints=slots(point)) for point in waypoints)
        return await self._begin(
            lambda request_id: JointPath(
                request_id=request_id, speed=speed, joint_count=counts.pop(), waypoints=path
            )
        )

    async def follow_poses(
        self, poses: Sequence[Pose], *, motion: Motion = Motion.PTP, speed: float = 0.1
    ) -> MotionHandle:
        """Move the tool through poses: PTP passes them without stopping, LIN stops at each.

        Raises:
            WrongArgument: no poses, or poses in several frames.
            Refused: a pose is unreachable, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        frames = {pose.frame for pose in poses}
        if len(frames) != 1:
            raise WrongArgument(f"the poses of one path need one frame, not {sorted(frames)}")
        path = tuple(
            PoseWaypoint(position=pose.position, orientation=pose.orientation) for pose in poses
        )
        return await self._begin(
            lambda request_id: PosePath(
                request_id=request_id,
                motion=motion,
                speed=speed,
                frame=frames.pop(),
                waypoints=path,
            )
        )

    async def home(self, target: str = "home", *, speed: float = 0.1) -> MotionHandle:
        """Move all joints to a named position: `home`, `zero`, or another of `positions.list`.

        Done at once where the robot stands there already.

        Raises:
            Refused: there is no such position, the robot may not stand there, not in control, robot
                busy, …
            ConnectionLost: the connection ended.
        """
        return await self._begin(
            lambda request_id: Home(request_id=request_id, speed=speed, target=target)
        )

    async def execute(self, plan: int, *, override_is_one: bool = False) -> MotionHandle:
        """Execute a plan of `plans.make` once, sample by sample, as `plans.samples` shows it.

        Args:
            plan: its number.
            override_is_one: be refused unless the speed override is 1, for a measured run.

        Raises:
            Refused: PLAN_STALE, anything that it was made from has changed; PLAN_UNKNOWN; not in
                control, robot busy, …, which leaves the plan as it is.
            ConnectionLost: the connection ended.
        """
        return await self._begin(
            lambda request_id: Execute(
                request_id=request_id, plan=plan, override_is_one=int(override_is_one)
            )
        )

    async def prepare(
        self, action: PrepareAction = PrepareAction.PREPARE, *, token: int = 0
    ) -> MotionHandle:
        """Have the controller prepared, or a single step of that taken; `done` tells when it is.

        Args:
            action: what is to be done; `controller.describe` tells what the controller takes.
            token: the value of the refusal CONFIRM_FIRST, once a person has confirmed; else 0.

        Raises:
            Refused: BAD_ARGUMENT, the controller has nothing to prepare; CONFIRM_FIRST, …
            ConnectionLost: the connection ended.
        """
        return await self._begin(
            lambda request_id: Prepare(request_id=request_id, action=action, token=token)
        )

    async def run_program(
        self,
        name: str,
        *,
        run: RunKind = RunKind.ALL,
        line: int = 0,
        loops: int = 1,
        speed: float = 1.0,
        revision: int = 0,
    ) -> MotionHandle:
        """Run a stored program, or one step of it; `done` tells when that has ended.

        Args:
            name: of the program.
            run: all of it, or one step forward or backward.
            line: line to begin at; 0 for where it stands, or the first.
            loops: how often; 0 for until it is stopped.
            speed: fraction of the programmed speeds, above 0, up to 1.
            revision: the only one that may be run, as the pendant shows it, from 1; 0 for the
                newest. In a run that is paused: the one that it began with; 0 for whichever.

        Raises:
            Refused: REVISION_CONFLICT, another revision is kept, or is under way; nobody knows the
                program, it cannot run from there, not in control, …
            ConnectionLost: the connection ended.
        """
        return await self._begin(
            lambda request_id: ProgramRun(
                request_id=request_id,
                run=run,
                line=line,
                loops=loops,
                revision=revision,
                speed=speed,
                program=name,
            )
        )
