"""Reenactment of a journal by the process that wrote it: the same code and time, no I/O.

Owns the run, in which every event happens again, and the comparison: what leaves must be, byte for
byte and in order, what left then. The time and the answers of the world come from the journal;
connections are transports that lead nowhere. What a server or an emulator is, `reenacted_server`
and `reenacted_emulator` know.
"""

from __future__ import annotations

import asyncio
import socket
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import Context
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from pydantic import ValidationError

from openpendant.simplemsg.journal import Journal, LateText

from ..console import PacketToolError
from ..reading.progress import watched
from .journal_file import (
    BytesOut,
    Effect,
    GrantedQuestion,
    Header,
    JournalError,
    JournalEvent,
    JournalFile,
)


class ReenactedProcess(Protocol):
    """A reenacted process."""

    def play(self, happening: JournalEvent) -> None:
        """Let an event happen."""

    def state(self) -> dict[str, Any]:
        """Return what it knows now, as plain JSON data."""


MakeProcess = Callable[[Header, "ReplayedJournal"], ReenactedProcess]


class Difference(BaseException):
    """The process did not do what its journal says.

    No `Exception`, so that no part of the application takes it for a fault of its own.

    Attributes:
        expected: what followed from it then; None where nothing more did.
        actual: what followed now; None where nothing more did.
    """

    def __init__(
        self, happening: JournalEvent, expected: Effect | str | None, actual: Effect | str | None
    ) -> None:
        super().__init__(f"event {happening.number} at {happening.time / 1e9:.6f} s")
        self.happening = happening
        self.expected = expected
        self.actual = actual


class ReplayedJournal(Journal):
    """A journal that tells the recorded time and answers, and compares instead of writing.

    Attributes:
        now: recorded time of the event that is to happen, of the start before the first [ns]; the
            process that is played has no other clock.
    """

    def __init__(self, header: Header) -> None:
        super().__init__()
        self.is_kept = True  # what was noted then must be compared now
        self._start = self.now = header.now
        self._happening: JournalEvent | None = None
        self._awaits_event = False
        self._effects: deque[Effect] = deque()
        self.frames = 0
        self.bytes_out = 0

    @contextmanager
    def expecting(self, happening: JournalEvent) -> Iterator[None]:
        """Compare all that follows from an event while the context lasts; raise Difference."""
        self._happening = happening
        self.now = self._start + happening.time
        self._effects.extend(happening.effects)
        self._awaits_event = True
        yield
        if self._awaits_event:
            raise Difference(happening, f"the event {happening.event!r}", None)
        if self._effects:
            raise Difference(happening, self._effects[0], None)

    def begin(
        self,
        now: int,
        event: str,
        link: str | int = "",
        data: bytes = b"",
        more: Mapping[str, Any] = {},
    ) -> None:
        """Compare an event with the one that happened; raise Difference where it is another."""
        expected = self._current
        if not self._awaits_event or (event, str(link)) != (expected.event, expected.link):
            what = f"the event {expected.event!r} of link {expected.link!r}"
            raise Difference(expected, what, f"the event {event!r} of link {str(link)!r}")
        self._awaits_event = False

    def out(self, link: str | int, data: bytes | LateText) -> None:
        """Compare bytes that leave with those that left; raise Difference where they differ."""
        data = bytes(data)
        actual = BytesOut(str(link), data)
        expected = self._effects.popleft() if self._effects else None
        if expected != actual:
            raise Difference(self._current, expected, actual)
        self.frames += 1
        self.bytes_out += len(data)

    def answer(self, question: str, link: str | int, answer: bool) -> bool:
        """Return what the world answered then."""
        if self._effects and self._effects[0] == GrantedQuestion(question, str(link)):
            self._effects.popleft()
            return True
        return False

    @property
    def _current(self) -> JournalEvent:
        assert self._happening is not None, "nothing happens outside of an event"
        return self._happening


class NullTransport(asyncio.Transport):
    """A transport that leads nowhere; what is written was compared before."""

    def __init__(self, address: str = "") -> None:
        super().__init__({"peername": (address, 0), "socket": _NoSocket()})

    def write(self, data: bytes | bytearray | memoryview) -> None:
        """Forget the bytes."""

    def get_write_buffer_size(self) -> int:
        """Return 0; whether the peer kept up is in the journal."""
        return 0

    def is_closing(self) -> bool:
        """Return False; whether the kernel closed it is in the journal."""
        return False

    def close(self) -> None:
        """Do nothing: the journal says when the connection ended."""

    def abort(self) -> None:
        """Do nothing: the journal says when the connection ended."""

    def pause_reading(self) -> None:
        """Do nothing: the journal says what was read when."""

    def resume_reading(self) -> None:
        """Do nothing: the journal says what was read when."""


class _NoSocket:
    """No socket that options could be set on."""

    family = socket.AF_UNSPEC


_MOST_DIGITS = 18


def is_number(link: str) -> bool:
    """Return True if the link of an event is the number of something."""
    return link.isascii() and link.isdigit() and len(link) <= _MOST_DIGITS


def unknown_event(happening: JournalEvent) -> JournalError:
    """Return the error for an event that this version does not know."""
    return JournalError(f"event {happening.number}: {happening.event!r} is not known here")


def unusable_settings(error: ValidationError) -> JournalError:
    """Return the error for settings that this version does not take."""
    first = error.errors(include_url=False, include_context=False)[0]
    where = ".".join(str(part) for part in first["loc"])
    return JournalError(f"its settings: {where}: {first['msg']}")


_CONTEXT = 5


@dataclass(slots=True)
class RerunOutcome:
    """Result of a run over a journal.

    Attributes:
        last: time of the last of them since the start [ns].
        bytes_out: bytes that left, all equal.
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
    """A loop on which nothing happens by itself: what is to happen is in the journal."""

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
    with path.open("rb") as opened, watched(opened) as (stream, _):
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
