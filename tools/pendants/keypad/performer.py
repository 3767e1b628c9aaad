"""Performer of the keypad: its held keys as calls of the client library, fed by its frames.

Owns the order of the calls: a press leaves in the turn in which its key came, a release at once,
and a beat only where a frame of the keypad came. One enabling device (training) is held from the
first held key until the last motion of one has ended. Decides nothing.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Iterable
from dataclasses import dataclass, field

from openpendant.simplemsg.pendant import Activity, OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode

from ..client import Aborted, FedEnabling, FedJog, PendantClient, Refused
from ..jog import DEFAULT_DEADLINE
from ..motions import MotionHandle
from ..panel import commands as do
from ..panel.commands import JOINTS, CellList, Command
from ..panel.jog_pad import TOOL_AXES
from ..panel.performer import Performer
from .keypad import Keypad

_LONGEST = 86_400.0
"""A key is not held for a day [s]."""


@dataclass(slots=True)
class _HeldJog:
    """The jog of held keys.

    Attributes:
        is_let_go: all its keys came up.
    """

    jog: FedJog
    is_let_go: bool = False

    def let_go(self) -> None:
        """Release at once."""
        self.is_let_go = True
        self.jog.let_go()


@dataclass(slots=True)
class _HeldMotion:
    """The motion of a held key.

    Attributes:
        has_begun: the server has begun it.
    """

    has_begun: bool = False
    is_let_go: bool = False
    let_go: asyncio.Event = field(default_factory=asyncio.Event)


class KeypadPerformer(Performer):
    """The commands of one keypad that run on one connection."""

    def __init__(
        self, client: PendantClient, keypad: Keypad, deadline: float = DEFAULT_DEADLINE
    ) -> None:
        """Perform nothing yet.

        Args:
            deadline: the server ends a press so long after its last beat [s].
        """
        super().__init__(client, keypad)
        self._keypad = keypad
        self._deadline = deadline
        self._held_jog: _HeldJog | None = None
        self._held_motion: _HeldMotion | None = None
        self._device: FedEnabling | None = None
        self._holders = 0

    def perform(self, commands: Iterable[Command]) -> None:
        """Start to carry out commands; returns at once. Nothing overtakes a stop."""
        left = list(commands)
        for place, command in enumerate(left):
            match command:
                case do.StopRobot():
                    super().perform([command])
                    # It leaves in the next turn of the loop, and the rest in the same one behind.
                    asyncio.get_running_loop().call_soon(self.perform, left[place + 1 :])
                    return
                case do.PressJog():
                    self._press(command)
                case do.AimJog():
                    self._aim(command)
                case do.FeedBeat():
                    self._feed()
                case do.ReleaseJog():
                    self._release()
                case do.HoldMotion():
                    held = self._held_motion = _HeldMotion()
                    self._begin(self._hold(command, held))
                case do.LetGoMotion():
                    self._let_go_motion()
                case _:
                    super().perform([command])

    # Jogs.

    def _press(self, press: do.PressJog) -> None:
        if not self._client.has_quotable_state:
            # The library would wait for a state, and move for a key that was let go long ago.
            self._keypad.messages.add("STALE: no jog on values that are too old for a held key")
            self._keypad.jog_over()
            return
        frame, values = press.frame, self._values(press.frame, press.axes)
        jog = self._client.fed_jog(values, frame=frame, deadline=self._deadline)
        held = self._held_jog = _HeldJog(jog)
        self._begin(self._jogged_while_held(held))

    def _values(self, frame: str, axes: Iterable[tuple[int, int]]) -> list[float]:
        count = self._client.hello.dof if frame == JOINTS else len(TOOL_AXES)
        signs = dict(axes)
        return [float(signs.get(axis, 0)) for axis in range(count)]

    async def _jogged_while_held(self, held: _HeldJog) -> None:
        try:
            async with self._enabled(), held.jog:
                await held.jog.hold(_LONGEST)
        except Refused as refused:
            if not (held.is_let_go and refused.code == VerdictCode.PRESS_DEAD):
                raise
        finally:
            if self._held_jog is held:
                self._held_jog = None
                if not held.is_let_go:
                    self._keypad.jog_over()

    def _aim(self, aim: do.AimJog) -> None:
        held = self._held_jog
        if held is not None and not held.is_let_go:
            self._begin(self._aimed(held, aim))

    async def _aimed(self, held: _HeldJog, aim: do.AimJog) -> None:
        try:
            await held.jog.aim_at(self._values(aim.frame, aim.axes), aim.frame)
        except Refused as refused:
            if held.is_let_go or refused.code == VerdictCode.PRESS_DEAD:
                return  # whoever waits for the jog tells why it is over
            # It goes on as it was aimed before, which is not what the keys say now.
            held.let_go()
            self._keypad.jog_over()
            raise

    def _feed(self) -> None:
        """Hand on a sign of the keypad: a beat, and the enabling device in front of it."""
        held = self._held_jog
        if held is not None and not held.is_let_go:
            held.jog.beat()
        elif self._device is not None:
            self._device.beat()

    def _release(self) -> None:
        if self._held_jog is not None:
            self._held_jog.let_go()

    @contextlib.asynccontextmanager
    async def _enabled(self) -> AsyncIterator[None]:
        """Hold the enabling device (training) together with others, in the manual modes."""
        if self._keypad.cell.mode is OperatingMode.AUTOMATIC:
            yield
            return
        self._holders += 1
        try:
            if self._device is None:
                self._device = self._client.fed_enabling()
                await self._device.__aenter__()
            yield
        finally:
            self._holders -= 1
            if not self._holders and self._device is not None:
                device, self._device = self._device, None
                await device.__aexit__(None, None, None)

    # Motions that are held to run.

    async def _hold(self, command: do.HoldMotion, held: _HeldMotion) -> None:
        try:
            async with self._enabled():
                await self._moved_while_held(command, held)
        except Aborted as aborted:
            if not held.is_let_go:
                raise
            self._keypad.messages.add(f"ended where its key was let go: {aborted}")
        except Refused:
            if not held.is_let_go:
                raise
        finally:
            if self._held_motion is held:
                self._held_motion = None
            self._keypad.motion_over()

    async def _moved_while_held(self, command: do.HoldMotion, held: _HeldMotion) -> None:
        if isinstance(command.motion, do.ResumeRobot):
            await self._client.resume()
            held.has_begun = True
            await self._let_go_or_ended(held)
            return
        motion, name = await self._motion(command.motion)
        held.has_begun = True
        self._keypad.messages.add(f"{name} began")
        if held.is_let_go:
            await self._stop_program()
        await motion.done()
        self._keypad.messages.add(f"{name} ended")

    async def _let_go_or_ended(self, held: _HeldMotion) -> None:
        """Wait until the key of a resumed motion was let go, or the motion has ended."""
        letting_go = asyncio.ensure_future(held.let_go.wait())
        ended = asyncio.ensure_future(
            self._client.wait_until(lambda s: s.activity == Activity.IDLE, within=_LONGEST)
        )
        try:
            await asyncio.wait({letting_go, ended}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            letting_go.cancel()
            ended.cancel()
            await asyncio.gather(letting_go, ended, return_exceptions=True)

    def _let_go_motion(self) -> None:
        held = self._held_motion
        if held is None or held.is_let_go:
            return
        held.is_let_go = True
        held.let_go.set()
        if self._device is not None and not held.has_begun:
            # What is still planned must not begin when its plan comes.
            self._device.let_go()
        self._begin(self._stop_program())

    async def _stop_program(self) -> None:
        try:
            await self._client.program_stop()
        except Refused as refused:
            if refused.code != VerdictCode.NOTHING_TO_CONTROL:
                raise

    # The rest.

    async def _ended(self, motion: MotionHandle, name: str) -> None:
        try:
            await super()._ended(motion, name)
        finally:
            self._keypad.step_over()

    async def _change(self, command: do.ChangesList) -> None:
        await super()._change(command)
        if isinstance(command, do.RecordMotion | do.EndRecording):
            told = await self._client.recordings.list()
            self._keypad.told_list(CellList.RECORDINGS, told)

    async def _carry_out(self, command: Command) -> None:
        if isinstance(command, do.AskRetreat):
            self._keypad.ways_out(await self._holds())
        else:
            await super()._carry_out(command)
