"""A run over a journal: every event happens again, and every byte that leaves is compared.

Owns which events happen and what the run adds up to. The comparison is `reenactment`'s.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import Callable
from contextvars import Context
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..console import PacketToolError
from .journal_file import Header, JournalEvent, JournalFile
from .reenactment import Difference, MakeProcess, ReenactedProcess, ReplayedJournal

_CONTEXT = 5


@dataclass(slots=True)
class RerunOutcome:
    """Result of a run over a journal.

    Attributes:
        header: of the journal.
        events: how many events happened again.
        last: time of the last of them since the start [ns].
        bytes_in: bytes that came in.
        bytes_out: bytes that left, all equal.
        frames: pieces in which they left.
        seconds: how long the run took [s].
        state: what the process knew at the end.
        difference: the first difference, None where there was none.
        before: the last events before the difference, it included.
        is_cut: the journal has no end.
    """

    header: Header
    events: int = 0
    last: int = 0
    bytes_in: int = 0
    bytes_out: int = 0
    frames: int = 0
    seconds: float = 0.0
    state: dict[str, Any] = field(default_factory=dict)
    difference: Difference | None = None
    before: deque[JournalEvent] = field(default_factory=lambda: deque(maxlen=_CONTEXT))
    is_cut: bool = False


@dataclass(frozen=True, slots=True)
class Until:
    """End of a run: after the last event up to a time [ns], or after an event by number."""

    time: int | None = None
    number: int | None = None

    def is_before(self, happening: JournalEvent) -> bool:
        """Return True if the run ends before an event."""
        if self.number is not None:
            return happening.number > self.number
        return self.time is not None and happening.time > self.time


class StillLoop(asyncio.SelectorEventLoop):
    """A loop on which nothing happens by itself: what is to happen is in the journal.

    Attributes:
        is_still: callbacks and timers are forgotten.
    """

    is_still = False

    def call_soon(  # type: ignore[override]  # the stubs' type variables cannot be repeated here
        self, callback: Callable[..., object], *args: Any, context: Context | None = None
    ) -> asyncio.Handle:
        """Forget the callback while the loop is still."""
        handle = asyncio.Handle(callback, args, self, context)
        return handle if self.is_still else super().call_soon(callback, *args, context=context)

    def call_at(  # type: ignore[override]
        self,
        when: float,
        callback: Callable[..., object],
        *args: Any,
        context: Context | None = None,
    ) -> asyncio.TimerHandle:
        """Forget the timer while the loop is still."""
        if self.is_still:
            return asyncio.TimerHandle(when, callback, args, self, context)
        return super().call_at(when, callback, *args, context=context)


def rerun(path: Path, until: Until | None = None) -> RerunOutcome:
    """Execute a journal again.

    Args:
        path: the journal.
        until: where to end; the journal's end where left out.

    Raises:
        JournalError: it is no journal, or a damaged one.
        OSError: it cannot be read.
    """
    loop = StillLoop()

    async def live_again() -> RerunOutcome:
        # The process that is played wants a running loop.
        loop.is_still = True
        try:
            return _rerun(path, until or Until())
        finally:
            loop.is_still = False

    try:
        return loop.run_until_complete(live_again())
    finally:
        loop.close()


def _rerun(path: Path, limit: Until) -> RerunOutcome:
    began = time.perf_counter()
    with path.open("rb") as stream:
        journal = JournalFile(path, stream)
        replayed = ReplayedJournal(journal.header)
        process = _process_of(journal.header)(journal.header, replayed)
        outcome = RerunOutcome(journal.header)
        try:
            for happening in journal.happenings():
                if limit.is_before(happening):
                    break
                _play(process, replayed, happening, outcome)
        except Difference as difference:
            outcome.difference = difference
        outcome.is_cut = journal.is_cut
    outcome.bytes_out, outcome.frames = replayed.bytes_out, replayed.frames
    outcome.state = process.state()
    outcome.seconds = time.perf_counter() - began
    return outcome


def _play(
    process: ReenactedProcess,
    replayed: ReplayedJournal,
    happening: JournalEvent,
    outcome: RerunOutcome,
) -> None:
    outcome.before.append(happening)
    outcome.last = happening.time
    outcome.bytes_in += len(happening.data)
    with replayed.expecting(happening):
        process.play(happening)
    outcome.events += 1


def _process_of(header: Header) -> MakeProcess:
    # Either is imported only when it is wanted: an emulator's journal needs no Pinocchio.
    match header.kind:
        case "server":
            from .reenacted_server import ReenactedServer

            return ReenactedServer
        case "emulator":
            from .reenacted_emulator import ReenactedEmulator

            return ReenactedEmulator
    raise PacketToolError(f"a journal of {header.kind!r} is not known here")
