"""Two links that stay open for most of a run: an idle one, and one to the state port.

What ends or falls silent only after some time shows on no link that lives as long as a check. Owns
those links and when they may be kept; the verdicts are section K's.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from ..findings import Section
from .checks import ServerCheck
from .target import Target
from .watch import Watch
from .wire import RuleBroken, Unreachable, Wire

IDLE = "KS17"
"""The check that judges the idle link."""

LISTENING = "KS18"
"""The check that judges the state link."""

LEAST = 8.0
"""The links are at least so old when they are judged [s]."""

_SERVED_WITHIN = 1.0
_BEFOREHAND = (Section.FRAMING, Section.HEADER, Section.BYTE_ORDER)


class Vigil:
    """The links, where the target serves others beside them.

    A controller of one client a port would be blocked by them, and gets none.
    """

    def __init__(self, chosen: Sequence[ServerCheck]) -> None:
        """Make a vigil that has not begun; only checks that are chosen get a link."""
        self._wires: list[Wire] = []
        self._wanted = {entry.info.number for entry in chosen} & {IDLE, LISTENING}
        self._has_begun = not self._wanted

    async def before(self, entry: ServerCheck, target: Target) -> None:
        """Begin in time before a check: behind those that confuse the byte order on purpose.

        A server that goes by the order of an address may end its other links because of those.
        """
        if self._has_begun or entry.info.section in _BEFOREHAND:
            return
        self._has_begun = True
        try:
            if IDLE in self._wanted:
                await self._keep_idle(target)
            if LISTENING in self._wanted and target.options.state_port is not None:
                await self._keep_listening(target)
        except Unreachable:
            return  # the check that comes next will say so
        finally:
            await target.close()

    async def _keep_idle(self, target: Target) -> None:
        wire = await target.motion()
        try:
            await target.knock.ask(wire)
            await target.knock.ask(await target.motion())
            await target.knock.ask(wire)
        except (RuleBroken, Unreachable):
            return
        self._wires.append(target.keep(wire))
        target.idle_link = wire

    async def _keep_listening(self, target: Target) -> None:
        watch = await target.state()
        await watch.begin()
        try:
            other = await target.state()
        except Unreachable:
            return
        count = len(watch.frames)
        is_told = await other.until(lambda: bool(other.frames), _SERVED_WITHIN)
        if not is_told or not await watch.until(lambda: len(watch.frames) > count, _SERVED_WITHIN):
            return
        self._wires.append(target.keep(watch.wire))
        target.long_watch = watch

    async def end(self) -> None:
        """Close the links."""
        for wire in self._wires:
            wire.close()


async def old_enough(watch: Watch | Wire) -> None:
    """Wait until a link is old enough to be judged."""
    wire = watch.wire if isinstance(watch, Watch) else watch
    await asyncio.sleep(max(0.0, LEAST - wire.age))
