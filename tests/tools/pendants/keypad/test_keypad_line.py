"""The line by itself: which frames lead from state to state."""

import pytest

from openpendant.simplemsg.serial_frames import (
    Ack,
    FrameReader,
    FrameWriter,
    KeyDown,
    KeyFlag,
    KeypadBeat,
    KeypadHello,
    KeypadWelcome,
    KeyUp,
    LineWay,
    SerialFrame,
)
from openpendant.tools.pendants.keypad.line import (
    KeypadLine,
    KeyPressed,
    KeyReleased,
    LineEvent,
    LineLoss,
    LineLost,
    LineState,
)

MS = 1_000_000


class Wire:
    """A line, and the frames that a test sends on it."""

    def __init__(self, baud: int = 115_200) -> None:
        self.line = KeypadLine(baud)
        self.now = 50_000 * MS
        self._writer = FrameWriter()
        self._reader = FrameReader(LineWay.TO_DEVICE)
        self.line.opened(self.now)

    @property
    def time(self) -> int:
        return self.now // MS % 65_536

    def state(self) -> LineState:
        return self.line.state

    def send(self, frame: SerialFrame, after: int = 1) -> list[LineEvent]:
        self.now += after * MS
        return self.line.receive(self._writer.write(frame)[1], self.now)

    def written(self) -> list[tuple[int, SerialFrame]]:
        return self._reader.receive(self.line.output())

    def hello(self, protocol: int = 1) -> list[LineEvent]:
        return self.send(KeypadHello(protocol, 1, 0, 1, 20, 4, 0, 0, self.time))

    def welcomed(self) -> None:
        self.hello()
        ((sequence, welcome),) = self.written()
        assert isinstance(welcome, KeypadWelcome)
        self.send(Ack(sequence, 0))

    def key(self, kind: type[KeyDown | KeyUp], key: int, mask: int) -> list[LineEvent]:
        return self.send(kind(key, 0, mask, (self.time + 1) % 65_536))

    def beat(self, mask: int = 0, flags: int = 0, after: int = 50) -> list[LineEvent]:
        return self.send(KeypadBeat(255, flags, mask, (self.time + after) % 65_536), after)

    def ready(self) -> None:
        self.welcomed()
        self.key(KeyUp, 255, 0)
        assert self.state() is LineState.READY


@pytest.fixture
def wire() -> Wire:
    return Wire()


def kinds(events: list[LineEvent]) -> list[type[LineEvent]]:
    return [type(each) for each in events]


def test_a_bridge_says_nothing_before_the_keypad_does(wire: Wire) -> None:
    for _ in range(100):
        wire.now += 20 * MS
        wire.line.tick(wire.now)
    assert wire.written() == []
    wire.hello()
    ((_, welcome),) = wire.written()
    assert welcome == KeypadWelcome(1, 50, 5, 1)


def test_a_slow_line_asks_for_rarer_beats() -> None:
    wire = Wire(9_600)
    wire.hello()
    ((_, welcome),) = wire.written()
    assert welcome == KeypadWelcome(1, 100, 5, 1)


def test_all_up_counts_once_the_welcome_was_answered(wire: Wire) -> None:
    wire.hello()
    wire.key(KeyUp, 255, 0)
    assert wire.state() is LineState.LET_GO
    ((sequence, _),) = wire.written()
    wire.send(Ack(sequence, 0))
    wire.key(KeyUp, 255, 0)
    assert wire.state() is LineState.READY


def test_a_beat_without_keys_does_not_say_that_all_were_let_go(wire: Wire) -> None:
    wire.welcomed()
    for _ in range(6):
        wire.beat()
    assert wire.state() is LineState.LET_GO


def test_where_the_word_that_all_are_up_was_lost_the_keypad_is_welcomed_again(wire: Wire) -> None:
    wire.welcomed()
    for _ in range(12):
        wire.beat()
    assert KeypadWelcome(1, 50, 5, 1) in [frame for _, frame in wire.written()]
    assert wire.state() is LineState.LET_GO


@pytest.mark.parametrize(("protocol", "event"), [(2, LineLost(LineLoss.WRONG_VERSION, protocol=2))])
def test_another_version_is_no_link(wire: Wire, protocol: int, event: LineEvent) -> None:
    assert wire.hello(protocol) == [event]
    assert wire.state() is LineState.CLOSED


def test_a_keypad_that_refuses_our_version_is_no_link(wire: Wire) -> None:
    wire.hello()
    ((sequence, _),) = wire.written()
    assert wire.send(Ack(sequence, 5)) == [LineLost(LineLoss.WRONG_VERSION, protocol=0)]


def test_a_keypad_that_speaks_without_a_hello_is_asked_for_one(wire: Wire) -> None:
    for _ in range(25):
        wire.beat()
    asked = [frame.KIND for _, frame in wire.written()]
    assert asked == [0x85]


def test_the_flag_of_too_many_keys_releases_what_is_held(wire: Wire) -> None:
    """It comes before the third key is debounced, with a mask of two."""
    wire.ready()
    wire.key(KeyDown, 0, 1)
    events = wire.beat(mask=1, flags=KeyFlag.TOO_MANY_KEYS, after=10)
    assert KeyReleased(0) in events
    assert wire.state() is LineState.LET_GO
    wire.key(KeyUp, 0, 0)
    assert wire.state() is LineState.READY
    assert not wire.line.too_many


def test_a_bridge_that_stood_still_takes_nothing_of_what_waited_for_it(wire: Wire) -> None:
    wire.ready()
    waiting: list[SerialFrame] = [
        KeyDown(0, 0, 1, wire.time),
        KeyUp(0, 0, 0, wire.time + 300),
        KeyDown(1, 0, 2, wire.time + 600),
    ]
    data = b"".join(wire._writer.write(frame)[1] for frame in waiting)
    wire.now += 700 * MS
    events = wire.line.receive(data, wire.now)
    assert KeyPressed not in kinds(events)
    assert events == [LineLost(LineLoss.QUIET)]


def test_a_key_that_is_not_in_its_own_mask_does_nothing(wire: Wire) -> None:
    wire.ready()
    assert KeyPressed not in kinds(wire.key(KeyDown, 0, 0))
    assert KeyPressed not in kinds(wire.key(KeyDown, 40, 1))


def test_the_clock_of_the_keypad_may_wrap(wire: Wire) -> None:
    wire.now = 65_400 * MS
    wire.line.opened(wire.now)
    wire.ready()
    for _ in range(5):
        wire.beat()
    assert wire.time < 1_000
    assert KeyPressed in kinds(wire.key(KeyDown, 0, 1))
