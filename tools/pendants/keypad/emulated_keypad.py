"""Emulated keypad: the firmware's state machine in Python, with the same bytes, without a port.

Owns the matrix with its ghosts, the debounce, the conversation with the bridge and the display, as
`firmware/` has them. `now` is monotonic time in ns; the keypad's own clock counts from its start.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

from openpendant.simplemsg.serial_frames import (
    ACKNOWLEDGED,
    COLUMNS,
    NO_KEY,
    PROTOCOL,
    ROWS,
    Ack,
    AckResult,
    AskHello,
    FrameReader,
    FrameWriter,
    KeyDown,
    KeyFlag,
    KeypadBeat,
    KeypadFeature,
    KeypadHello,
    KeypadWelcome,
    KeyUp,
    LcdPage,
    LcdRow,
    LineWay,
    SerialFrame,
)

from .keys import KEYS, LABELS, STOP, STOP_BIT, more_than_two

MS = 1_000_000

FIRMWARE = (1, 0)
"""The version that an emulated keypad says it has, and shows."""

_UP_SCANS, _STOP_SCANS, _BUTTON_DOWN, _BUTTON_UP = 10, 2, 5, 2
_FIRST_HELLO, _HELLO_PERIOD, _SILENCE = 15, 1_000, 1_000
_LET_GO = 20
_GAP = 20
_PAIR = 2
_MOST_MISSED = 2_000
"""A keypad that stood still for more milliseconds does not scan for all of them."""


def closed_cells(pressed: set[int]) -> int:
    """Return the mask of the cells that read closed: ghosts among them, where three are pressed."""
    groups: list[tuple[set[int], set[int]]] = []
    for key in pressed:
        rows, columns = {key // 4}, {key % 4}
        for group in [each for each in groups if each[0] & rows or each[1] & columns]:
            groups.remove(group)
            rows, columns = rows | group[0], columns | group[1]
        groups.append((rows, columns))
    return sum(
        1 << 4 * row + column for rows, columns in groups for row in rows for column in columns
    )


@dataclass(frozen=True, slots=True)
class _KeyEvent:
    """A debounced change, as it was when it was noticed."""

    key: int
    is_down: bool
    flags: int
    mask: int
    time: int


@dataclass(slots=True)
class EmulatedKeypad:
    """One keypad.

    Attributes:
        baud: stands on the page of its own.
        button_fitted: it has an enabling button.
        characters: its jumper for plain characters is set: one for each key, in place of frames.
        pressed: the keys that a finger is on.
        button: the enabling button is held.
        lcd: what the display shows.
    """

    baud: int = 115_200
    button_fitted: bool = True
    characters: bool = False
    pressed: set[int] = field(default_factory=set)
    button: bool = False
    lcd: list[str] = field(default_factory=lambda: [" " * COLUMNS] * ROWS)
    _started: int | None = None
    _time: int = 0
    _out: bytearray = field(default_factory=bytearray)
    _reader: FrameReader = field(default_factory=lambda: FrameReader(LineWay.TO_DEVICE))
    _writer: FrameWriter = field(default_factory=FrameWriter)
    # Keys.
    _down: int = 0
    _closed_before: int = 0
    _unequal: list[int] = field(default_factory=lambda: [0] * KEYS)
    _button_unequal: int = 0
    _flags: int = 0
    _debounce: int = 5
    _open_for: int = 0
    _events: deque[_KeyEvent] = field(default_factory=deque)
    # The conversation.
    _reset_cause: int = 1
    _beat_period: int = 50
    _rows_shown: int = 0
    _has_bridge: bool = False
    _owes_hello: bool = False
    _owes_let_go: bool = False
    _acks: deque[Ack] = field(default_factory=deque)
    _heard_at: int = 0
    _beat_at: int = 0
    _hello_at: int = 0
    _flags_told: int = 0
    _bad_told: int = 0
    # Plain characters.
    _owed: list[str] = field(default_factory=list)
    _owes_stop: bool = False
    _was_empty: bool = False
    _sent_at: int = -_GAP
    _answer: str = ""

    def start(self, now: int, reset_cause: int = 1) -> None:
        """Switch it on, or start it anew [ns]; fingers stay where they are.

        Args:
            reset_cause: 1 power, 2 the reset button or an opened port, 8 the watchdog.
        """
        fresh = EmulatedKeypad(self.baud, self.button_fitted, self.characters)
        for name in self.__slots__:
            if name not in ("pressed", "button"):
                setattr(self, name, getattr(fresh, name))
        self._started, self._reset_cause = now, reset_cause
        self._owes_let_go = True
        if self.characters:
            self._put(0, "PLAIN CHARACTERS", self._version(), "", "")
        else:
            self._lose_bridge()

    def press(self, key: int) -> None:
        """Put a finger on a key."""
        self.pressed.add(key)

    def let_go(self, key: int) -> None:
        """Take the finger off a key."""
        self.pressed.discard(key)

    def output(self) -> bytes:
        """Return what it sends now."""
        out, self._out = bytes(self._out), bytearray()
        return out

    def receive(self, data: bytes) -> None:
        """Take bytes of the bridge, as of the last `tick`."""
        if self._started is None:
            return
        if self.characters:
            self._take_answer(data)
            return
        for sequence, frame in self._reader.receive(data):
            self._obey(sequence, frame)

    def tick(self, now: int) -> None:
        """Let its milliseconds pass up to now [ns]."""
        if self._started is None:
            return
        until = (now - self._started) // MS
        self._time = max(self._time, until - _MOST_MISSED)
        while self._time < until:
            self._time += 1
            self._scan()
            if self.characters:
                self._pass_characters()
            else:
                self._pass()

    # The matrix.

    def _scan(self) -> None:
        self._read_button()
        closed = closed_cells(self.pressed)
        if closed | self._down | self._closed_before:
            changed = self._debounced(closed)
            self._judge_number(closed, changed)
            self._note_all(changed)
            self._open_for = 0
        else:
            self._open_for += 1
        self._closed_before = closed

    def _debounced(self, closed: int) -> int:
        changed = 0
        for key in range(KEYS):
            bit = 1 << key
            if not (closed ^ self._down) & bit:
                self._unequal[key] = 0
                continue
            down = _STOP_SCANS if key == STOP else self._debounce
            self._unequal[key] += 1
            if self._unequal[key] >= (down if closed & bit else _UP_SCANS):
                self._unequal[key] = 0
                changed |= bit
        return changed

    def _judge_number(self, closed: int, changed: int) -> None:
        """Count cells before they are debounced, so that the first of three keys counts never."""
        if more_than_two((closed & self._closed_before) | self._down):
            self._flags |= KeyFlag.TOO_MANY_KEYS
        if not closed and not self._down & ~changed:
            self._flags &= ~KeyFlag.TOO_MANY_KEYS

    def _note_all(self, changed: int) -> None:
        """Note the changes of one scan: STOP first, then what was let go, then what was pressed."""
        ups, downs = changed & self._down & ~STOP_BIT, changed & ~self._down & ~STOP_BIT
        for order in (changed & STOP_BIT, ups, downs):
            for key in range(KEYS):
                if order >> key & 1:
                    self._down ^= 1 << key
                    is_down = bool(self._down >> key & 1)
                    told = (self._flags, self._down, self._time)
                    self._events.append(_KeyEvent(key, is_down, *told))

    def _read_button(self) -> None:
        is_held = bool(self._flags & KeyFlag.ENABLING_HELD)
        if (self.button and self.button_fitted) == is_held:
            self._button_unequal = 0
            return
        self._button_unequal += 1
        if self._button_unequal >= (_BUTTON_UP if is_held else _BUTTON_DOWN):
            self._button_unequal = 0
            self._flags ^= KeyFlag.ENABLING_HELD

    # The conversation with the bridge.

    def _obey(self, sequence: int, frame: SerialFrame) -> None:
        self._has_bridge, self._heard_at = True, self._time
        result = AckResult.DONE
        match frame:
            case KeypadWelcome():
                result = self._take_welcome(frame)
            case LcdRow(row=row, text=text):
                if row < ROWS:
                    self.lcd[row] = _shown(text)
                    self._rows_shown |= 1 << row
                else:
                    result = AckResult.WRONG_PLACE
            case LcdPage(text=text):
                self.lcd = [_shown(text[at : at + COLUMNS]) for at in range(0, len(text), COLUMNS)]
                self._rows_shown = (1 << ROWS) - 1
            case AskHello():
                self._owes_hello = True
        if frame.KIND in ACKNOWLEDGED:
            self._acks.append(Ack(sequence, result))

    def _take_welcome(self, welcome: KeypadWelcome) -> AckResult:
        if welcome.protocol != PROTOCOL:
            return AckResult.WRONG_VERSION
        if not (20 <= welcome.beat <= 250 and 5 <= welcome.debounce <= 20):
            return AckResult.WRONG_PLACE
        self._beat_period, self._debounce = welcome.beat, welcome.debounce
        self._open_for, self._owes_let_go = 0, True
        return AckResult.DONE

    def _lose_bridge(self) -> None:
        self._has_bridge, self._rows_shown = False, 0
        self._owes_hello, self._hello_at = True, self._time
        self._put(0, "NO BRIDGE", "USE THE ROBOT'S OWN", "STOP BUTTON", self._version())

    def _version(self) -> str:
        return f"keypad {FIRMWARE[0]}.{FIRMWARE[1]}{self.baud:>9}"

    def _put(self, first: int, *rows: str) -> None:
        for row, text in enumerate(rows, first):
            self.lcd[row] = f"{text:<{COLUMNS}}"

    def _pass(self) -> None:
        if self._has_bridge and self._time - self._heard_at >= _SILENCE:
            self._lose_bridge()
        if not self._has_bridge and self._time - self._hello_at >= _HELLO_PERIOD:
            self._hello_at, self._owes_hello = self._time, True
        if self._events:
            while self._events:
                self._send_event(self._events.popleft())
            return
        self._send_one_of_the_rest()

    def _send_event(self, event: _KeyEvent) -> None:
        frame = KeyDown if event.is_down else KeyUp
        self._send(frame(event.key, self._flags_of(event.flags), event.mask, event.time % 65_536))

    def _send_one_of_the_rest(self) -> None:
        """Send a beat, or one of the frames that can wait for one."""
        since = self._time - self._beat_at
        if since >= self._beat_period or self._flags != self._flags_told:
            steady = self._beat_period <= since < 2 * self._beat_period
            self._beat_at = self._beat_at + self._beat_period if steady else self._time
            self._flags_told = self._flags
            self._send(KeypadBeat(*self._state()))
            self._bad_told = self._reader.counts.bad
        elif self._owes_let_go and self._open_for >= _LET_GO:
            self._owes_let_go = False
            self._send(KeyUp(*self._state()))
        elif self._owes_hello and self._time >= _FIRST_HELLO:
            self._owes_hello = False
            self._send(self._hello())
        elif self._acks:
            self._send(self._acks.popleft())

    def _hello(self) -> KeypadHello:
        features = KeypadFeature.ENABLING_BUTTON if self.button_fitted else 0
        return KeypadHello(
            PROTOCOL,
            *FIRMWARE,
            self._reset_cause,
            COLUMNS,
            ROWS,
            features,
            self._down,
            self._time % 65_536,
        )

    def _state(self) -> tuple[int, int, int, int]:
        return NO_KEY, self._flags_of(self._flags), self._down, self._time % 65_536

    def _flags_of(self, flags: int) -> int:
        if self._reader.counts.bad > self._bad_told:
            flags |= KeyFlag.RUBBISH_RECEIVED
        if self._rows_shown != (1 << ROWS) - 1:
            flags |= KeyFlag.PAGE_INCOMPLETE
        return flags

    def _send(self, frame: SerialFrame) -> None:
        self._out += self._writer.write(frame)[1]

    # Plain characters.

    def _pass_characters(self) -> None:
        while self._events:
            event = self._events.popleft()
            if event.is_down and event.key == STOP:
                self._owes_stop = True
                self._owed.clear()
            elif event.is_down and self._was_empty and len(self._owed) < _PAIR:
                if not event.flags & KeyFlag.TOO_MANY_KEYS:
                    self._owed.append(LABELS[event.key])
        self._was_empty = self._was_empty or self._open_for >= _LET_GO
        if self._time - self._sent_at < _GAP or not (self._owes_stop or self._owed):
            return
        self._sent_at = self._time
        sent = LABELS[STOP] if self._owes_stop else self._owed.pop(0)
        self._owes_stop = False
        self._out += sent.encode()

    def _take_answer(self, data: bytes) -> None:
        for byte in data:
            if byte in b"\r\n":
                if self._answer:
                    self._put(2, self._answer[:COLUMNS], self._answer[COLUMNS:])
                self._answer = ""
            elif len(self._answer) < 2 * COLUMNS:
                self._answer += _shown(bytes((byte,)))


def _shown(text: bytes) -> str:
    """Return what the glass shows of bytes."""
    return "".join(chr(byte) if 0x20 <= byte < 0x7F else "?" for byte in text)
