"""Line of the keypad: frames in, what its keys did out, and the pages on their way to the display.

Owns what a frame may do: it can only take motion away, but for a KEY_DOWN that is fresh, announced
and alone. Owns the states of the line, its deadlines, which key counts as held, and that no key
counts after a start, a loss or too many keys before all of them were seen to be let go. Knows no
robot and no port: `now` is monotonic time in ns.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field
from enum import Enum
from typing import TypeAlias

from openpendant.simplemsg.serial_frames import (
    COLUMNS,
    PROTOCOL,
    ROWS,
    Ack,
    AckResult,
    AskHello,
    CarriedMessage,
    FrameReader,
    FrameWriter,
    HostBeat,
    KeyDown,
    KeyFlag,
    KeypadBeat,
    KeypadHello,
    KeypadWelcome,
    KeyUp,
    LcdPage,
    LcdRow,
    LineWay,
    SerialFrame,
    WelcomeFlag,
)

from .keys import STOP, STOP_BIT, keys_of, more_than_two

MS = 1_000_000

HELLO_NS = 3_000 * MS
"""A keypad that said no hello so long after the port was opened is none [ns]."""

ASK_NS = 1_000 * MS
"""A keypad that speaks and says no hello for so long is asked for one [ns]."""

HELD_NS = 125 * MS
"""What is held is released so long after the last frame [ns]."""

SLOW_HELD_NS = 250 * MS
"""Likewise, on a line that is too slow to hold a key."""

LOST_NS = 400 * MS
"""The line is lost so long after the last frame [ns]."""

OLDEST_NS = 100 * MS
"""A pressed key counts no more where its frame is older, by the keypad's own clock [ns]."""

HOST_BEAT_NS = 250 * MS
PAGE_NS = 200 * MS
"""Least time between two pages: five a second."""

ANSWER_NS = 100 * MS
"""A frame that is to be acknowledged is sent again so long after it has left the port [ns]."""

MOST_TRIES = 3

STILL_NS = 500 * MS
"""Where no key is down for so long, and no word came that all were let go, it is asked for [ns]."""

HOLDING_BAUD = 57_600
"""From this speed on a key can be held; below it there are increments only."""


class LineState(Enum):
    """States of the line."""

    CLOSED = "closed"
    GREETING = "waits for a hello"
    LET_GO = "waits until all keys are let go"
    READY = "ready"


class LineLoss(Enum):
    """Why a line that was open is given up."""

    SILENT = "nothing speaks"
    FOREIGN = "something else speaks"
    WRONG_VERSION = "another version"
    QUIET = "it fell silent"


@dataclass(frozen=True, slots=True)
class KeyPressed:
    """A key went down, and may do what it does."""

    key: int


@dataclass(frozen=True, slots=True)
class KeyReleased:
    """A key that was pressed is not held any more, for whatever reason."""

    key: int


@dataclass(frozen=True, slots=True)
class StopPressed:
    """The STOP key is closed; this counts in every state."""


@dataclass(frozen=True, slots=True)
class KeypadLives:
    """A frame of the keypad came.

    Attributes:
        enabling: the enabling button is held.
    """

    enabling: bool


@dataclass(frozen=True, slots=True)
class KeypadLinked:
    """A keypad said hello; what was held is released."""

    hello: KeypadHello


@dataclass(frozen=True, slots=True)
class LineLost:
    """The line is to be closed, and opened again later.

    Attributes:
        received: bytes that came since it was opened.
        protocol: version that the keypad speaks, where it is another.
    """

    why: LineLoss
    received: int = 0
    frames: int = 0
    protocol: int = PROTOCOL


@dataclass(frozen=True, slots=True)
class DisplaySilent:
    """The keypad acknowledges no page; told once until it does."""


LineEvent: TypeAlias = (
    KeyPressed | KeyReleased | StopPressed | KeypadLives | KeypadLinked | LineLost | DisplaySilent
)


class KeypadClock:
    """Age of frames by the keypad's own clock, which counts milliseconds modulo 65,536.

    A frame that waited in an adapter, or in a bridge that stood still, is older than the least
    delay that was seen lately.
    """

    _WINDOW = 10
    """Seconds for which a delay is remembered."""

    def __init__(self) -> None:
        self._reference = 0
        self._least: deque[tuple[int, int]] = deque()

    def age(self, time: int, now: int) -> int:
        """Return how much later than others a frame came [ns].

        Args:
            time: of the frame [ms].
        """
        arrived = now // MS
        if not self._least:
            self._reference = (arrived - time) % 65_536
        delay = (arrived - time - self._reference + 32_768) % 65_536 - 32_768
        second = arrived // 1000
        while self._least and self._least[0][0] <= second - self._WINDOW:
            self._least.popleft()
        if self._least and self._least[-1][0] == second:
            self._least[-1] = (second, min(delay, self._least[-1][1]))
        else:
            self._least.append((second, delay))
        return (delay - min(each for _, each in self._least)) * MS


@dataclass(slots=True)
class _OpenTransfer:
    """A frame that the keypad has not acknowledged yet."""

    frame: KeypadWelcome | LcdRow | LcdPage
    sequence: int
    due: int
    tries: int = 1


@dataclass(slots=True)
class KeypadLine:
    """One line to a keypad.

    Attributes:
        baud: speed of the line; below 57,600 no key can be held.
        debounce: a key counts as down once it was so for so long [ms].
        mask: keys that the last frame showed.
        features: what the keypad is fitted with.
        too_many: more than two keys were down, and not all were let go since.
        host_flags: what is told with each beat of the bridge.
    """

    baud: int = 115_200
    debounce: int = 5
    state: LineState = LineState.CLOSED
    mask: int = 0
    features: int = 0
    too_many: bool = False
    host_flags: int = 0
    _held: int = 0
    _reader: FrameReader = field(default_factory=lambda: FrameReader(LineWay.TO_HOST))
    _writer: FrameWriter = field(default_factory=FrameWriter)
    _clock: KeypadClock = field(default_factory=KeypadClock)
    _out: bytearray = field(default_factory=bytearray)
    _since: int = 0
    _heard: int = 0
    _asked: int = 0
    _beaten: int = 0
    _idle_since: int = 0
    _welcomed: bool = False
    _open: _OpenTransfer | None = None
    _wanted: tuple[bytes, ...] = (b" " * COLUMNS,) * ROWS
    _shown: list[bytes | None] = field(default_factory=lambda: [None] * ROWS)
    _rows_left: list[int] = field(default_factory=list)
    _page_at: int = 0
    _is_page_owed: bool = False
    _failed_pages: int = 0

    @property
    def is_slow(self) -> bool:
        """True where the line is too slow to hold a key."""
        return self.baud < HOLDING_BAUD

    @property
    def is_open(self) -> bool:
        """True while the port is open, as far as is known."""
        return self.state is not LineState.CLOSED

    @property
    def is_linked(self) -> bool:
        """True once a keypad of our version said hello."""
        return self.state in (LineState.LET_GO, LineState.READY)

    @property
    def held(self) -> tuple[int, ...]:
        """The keys that were pressed and are still down."""
        return keys_of(self._held)

    @property
    def bad(self) -> int:
        """Pieces since the port was opened that were no frame."""
        return self._reader.counts.bad

    @property
    def missing(self) -> int:
        """Frames that never came since the port was opened, by their sequence."""
        return self._reader.counts.missing

    def output(self) -> bytes:
        """Return what is to be written to the port now."""
        out, self._out = bytes(self._out), bytearray()
        return out

    def opened(self, now: int) -> None:
        """Take that the port is open; say nothing until the keypad does.

        Opening resets the board, and its boot loader must not take a frame for its own.
        """
        self._reader = FrameReader(LineWay.TO_HOST)
        self._out.clear()
        self._forget()
        self.state = LineState.GREETING
        self._since = self._heard = self._asked = now

    def closed(self) -> list[LineEvent]:
        """Take that the port is closed; return what is released."""
        released = self._release()
        self._forget()
        self.state = LineState.CLOSED
        return released

    def let_go_first(self) -> list[LineEvent]:
        """Let no held key count any more until all were let go; nothing changes where none is."""
        released = self._release()
        if self.state is LineState.READY and self.mask:
            self.state = LineState.LET_GO
        return released

    def show(self, page: tuple[str, ...]) -> None:
        """Take the page that the display is to show; the latest wins."""
        self._wanted = tuple(row.encode("ascii") for row in page)

    def receive(self, data: bytes, now: int) -> list[LineEvent]:
        """Take bytes of the port and return what happened."""
        events = self._silence(now)
        if not self.is_open:
            return events
        for _, frame in self._reader.receive(data):
            if self.is_open:
                events += self._take(frame, now)
        return events

    def tick(self, now: int) -> list[LineEvent]:
        """Advance the time: deadlines, pages, beats of the bridge."""
        events = self._silence(now)
        if self.is_linked:
            events += self._advance_transfer(now)
            if now - self._beaten >= HOST_BEAT_NS:
                self._beaten = now
                self._write(HostBeat(self.host_flags))
        return events

    def _silence(self, now: int) -> list[LineEvent]:
        """Return what the keypad's silence ends."""
        quiet = now - self._heard
        if self.state is LineState.GREETING:
            return self._unanswered(now) if now - self._since >= HELLO_NS else []
        if not self.is_linked:
            return []
        if quiet >= LOST_NS:
            return [*self.closed(), LineLost(LineLoss.QUIET)]
        if self._held and quiet >= (SLOW_HELD_NS if self.is_slow else HELD_NS):
            return self.let_go_first()
        return []

    def _unanswered(self, now: int) -> list[LineEvent]:
        counts = self._reader.counts
        why = LineLoss.FOREIGN if counts.received else LineLoss.SILENT
        self.closed()
        return [LineLost(why, counts.received, counts.frames)]

    def _take(self, frame: SerialFrame, now: int) -> list[LineEvent]:
        self._heard = now
        match frame:
            case KeypadHello():
                return self._greet(frame, now)
            case KeyDown() | KeyUp() | KeypadBeat():
                return self._take_keys(frame, now)
            case Ack():
                return self._acknowledged(frame, now)
            case CarriedMessage():
                return []
        return []

    def _greet(self, hello: KeypadHello, now: int) -> list[LineEvent]:
        """Take a hello: a start, or a start anew of a keypad that was linked."""
        if hello.protocol != PROTOCOL:
            return [
                *self.closed(),
                LineLost(LineLoss.WRONG_VERSION, protocol=hello.protocol),
            ]
        events = self._release()
        self._forget()
        self._clock.age(hello.time, now)
        self.state, self.features = LineState.LET_GO, hello.features
        self._beaten, self._idle_since = now, now
        events += self._stop_of(hello.mask, is_struck=False)
        self.mask = hello.mask
        self._welcome(now)
        return [*events, KeypadLinked(hello)]

    def _welcome(self, now: int) -> None:
        beat = 100 if self.is_slow else 50
        self._welcomed = False
        self._send(KeypadWelcome(PROTOCOL, beat, self.debounce, WelcomeFlag.BACK_LIGHT), now)

    def _take_keys(self, frame: KeyDown | KeyUp | KeypadBeat, now: int) -> list[LineEvent]:
        age = self._clock.age(frame.time, now)
        is_down = isinstance(frame, KeyDown)
        events = self._stop_of(frame.mask, is_struck=is_down and frame.key == STOP)
        before, self.mask = self.mask, frame.mask
        if self.state is LineState.GREETING:
            self._ask_hello(now)
            return events
        events += self._take_away(self._held & ~frame.mask)
        if frame.flags & KeyFlag.TOO_MANY_KEYS or more_than_two(frame.mask):
            self.too_many = True
            events += self._release()
            self.state = LineState.LET_GO
        elif is_down and age < OLDEST_NS and self._is_announced(frame.key):
            self._held |= 1 << frame.key
            if frame.key != STOP:
                events.append(KeyPressed(frame.key))
        if frame.mask or before:
            self._idle_since = now
        self._look_for_empty(frame, now)
        if frame.flags & KeyFlag.PAGE_INCOMPLETE and self._open is None and self._welcomed:
            self._shown = [None] * ROWS
        if isinstance(frame, KeypadBeat) and self._is_page_owed:
            self._is_page_owed = False
        return [*events, KeypadLives(bool(frame.flags & KeyFlag.ENABLING_HELD))]

    def _is_announced(self, key: int) -> bool:
        """Return True if a pressed key joins those that count, and no other is down."""
        bit = 1 << key if key <= STOP else 0
        return (
            self.state is LineState.READY
            and bool(bit & self.mask)
            and not bit & self._held
            and self.mask & ~bit == self._held
        )

    def _look_for_empty(self, frame: KeyDown | KeyUp | KeypadBeat, now: int) -> None:
        """Leave LET_GO where a key-up says that all are up; a beat does not say it."""
        if self.state is not LineState.LET_GO or frame.mask or not self._welcomed:
            return
        if isinstance(frame, KeyUp) and not frame.flags & KeyFlag.TOO_MANY_KEYS:
            self.state, self.too_many = LineState.READY, False
        elif self._open is None and now - self._idle_since >= STILL_NS:
            # The key-up was lost: the firmware says it again after each welcome.
            self._idle_since = now
            self._welcome(now)

    def _stop_of(self, mask: int, *, is_struck: bool) -> list[LineEvent]:
        """Return the stop of a mask that shows the STOP key, which it did not before."""
        is_new = mask & STOP_BIT and not self.mask & STOP_BIT
        return [StopPressed()] if is_struck or is_new else []

    def _ask_hello(self, now: int) -> None:
        if now - self._asked >= ASK_NS:
            self._asked = now
            self._write(AskHello())

    def _take_away(self, keys: int) -> list[LineEvent]:
        self._held &= ~keys
        return [KeyReleased(key) for key in keys_of(keys)]

    def _release(self) -> list[LineEvent]:
        return self._take_away(self._held)

    def _forget(self) -> None:
        """Forget all of a keypad that is gone, or has started anew."""
        self._held = self.mask = self.features = 0
        self.too_many = False
        self._clock = KeypadClock()
        self._open, self._welcomed = None, False
        self._shown, self._rows_left = [None] * ROWS, []
        self._is_page_owed, self._failed_pages = False, 0
        self._page_at = 0

    # Pages.

    def _write(self, frame: SerialFrame) -> int:
        sequence, line = self._writer.write(frame)
        self._out += line
        return sequence

    def _send(self, frame: KeypadWelcome | LcdRow | LcdPage, now: int, tries: int = 1) -> None:
        before = len(self._out)
        sequence = self._write(frame)
        on_line = (len(self._out) - before) * 10 * 1_000_000_000 // self.baud
        self._open = _OpenTransfer(frame, sequence, now + ANSWER_NS + on_line, tries)

    def _acknowledged(self, ack: Ack, now: int) -> list[LineEvent]:
        transfer = self._open
        if transfer is None or ack.sequence != transfer.sequence:
            return []
        if ack.result == AckResult.WRONG_VERSION:
            return [*self.closed(), LineLost(LineLoss.WRONG_VERSION, protocol=0)]
        if ack.result != AckResult.DONE:
            return []  # sent again when its time is over
        self._open = None
        match transfer.frame:
            case KeypadWelcome():
                self._welcomed = True
                self._idle_since = now
            case LcdRow(row=row, text=text):
                self._shown[row] = text
            case LcdPage(text=text):
                self._shown = [text[at : at + COLUMNS] for at in range(0, len(text), COLUMNS)]
        self._failed_pages = 0
        self._send_rows(now)
        return []

    def _advance_transfer(self, now: int) -> list[LineEvent]:
        """Send a frame again that was not acknowledged, or the next part of a page."""
        transfer = self._open
        if transfer is None:
            self._begin_page(now)
            return []
        if now < transfer.due:
            return []
        if isinstance(transfer.frame, KeypadWelcome) or transfer.tries < MOST_TRIES:
            self._send(transfer.frame, now, transfer.tries + 1)
            return []
        self._open, self._rows_left = None, []
        self._shown, self._is_page_owed = [None] * ROWS, True
        self._failed_pages += 1
        return [DisplaySilent()] if self._failed_pages == MOST_TRIES else []

    def _begin_page(self, now: int) -> None:
        if not self._welcomed or self._is_page_owed or now - self._page_at < PAGE_NS:
            return
        changed = [row for row in range(ROWS) if self._shown[row] != self._wanted[row]]
        if not changed:
            return
        self._page_at = now
        if len(changed) > 2:
            self._send(LcdPage(b"".join(self._wanted)), now)
        else:
            self._rows_left = changed
            self._send_rows(now)

    def _send_rows(self, now: int) -> None:
        if self._rows_left and self._open is None:
            row = self._rows_left.pop(0)
            self._send(LcdRow(row, self._wanted[row]), now)
