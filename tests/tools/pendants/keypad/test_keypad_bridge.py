"""The bridge on the virtual clock, between an emulated keypad and a scripted server."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Any

import pytest
from rigs.cells.panel_rig import snapshot
from rigs.peers.scripted_pendant_server import SESSION, ScriptedPendantServer

from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.serial_frames import KeypadHello, bytes_of
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.keypad.bridge import BACK_OFF, KeypadBridge, LineWords
from openpendant.tools.pendants.keypad.emulated_keypad import EmulatedKeypad
from openpendant.tools.pendants.keypad.keypad import Keypad
from openpendant.tools.pendants.keypad.keys import LABELS
from openpendant.tools.pendants.keypad.line import KeypadLine
from openpendant.tools.pendants.keypad.performer import KeypadPerformer
from openpendant.tools.pendants.keypad.serial_port import KeypadPortUnusable
from openpendant.tools.pendants.panel import commands as do
from openpendant.tools.pendants.panel.connection import PanelConnection

pytestmark = pytest.mark.virtual_clock


class Cable(asyncio.Transport):
    """The bridge's end of a cable, in memory."""

    def __init__(self, protocol: asyncio.Protocol, written: Callable[[bytes], None]) -> None:
        super().__init__()
        self._protocol: asyncio.Protocol | None = protocol
        self._written = written

    def write(self, data: Any) -> None:
        self._written(bytes(data))

    def get_write_buffer_size(self) -> int:
        return 0

    def is_closing(self) -> bool:
        return self._protocol is None

    def abort(self) -> None:
        protocol, self._protocol = self._protocol, None
        if protocol is not None:
            asyncio.get_running_loop().call_soon(protocol.connection_lost, None)

    def comes(self, data: bytes) -> None:
        if self._protocol is not None:
            self._protocol.data_received(data)


@dataclass
class KeypadBench:
    """A keypad on a desk, with its cable, a bridge, and a server that agrees to everything.

    Attributes:
        attempts: when the port was opened [s].
        said: lines for the user.
        speaks: what comes in the place of the keypad's bytes; None for these.
    """

    server: ScriptedPendantServer
    keypad: EmulatedKeypad = field(default_factory=EmulatedKeypad)
    attempts: list[float] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    speaks: bytes | None = None
    is_absent: bool = False
    hears: bool = True
    cable: Cable | None = None
    core: Keypad = field(default_factory=lambda: Keypad(KeypadLine()))

    @property
    def time(self) -> float:
        return asyncio.get_running_loop().time()

    def clock(self) -> int:
        return round(self.time * 1e9)

    async def open(self, protocol: Callable[[], asyncio.Protocol]) -> asyncio.Transport:
        self.attempts.append(self.time)
        if self.is_absent:
            raise KeypadPortUnusable("no such port")
        self.keypad.start(self.clock(), 2)
        self.cable = Cable(protocol(), self.keypad.receive)
        return self.cable

    async def live(self) -> None:
        """Let the keypad's time pass."""
        while True:
            self.keypad.tick(self.clock())
            said = self.keypad.output()
            if self.cable is not None and self.hears:
                if self.speaks is None:
                    self.cable.comes(said) if said else None
                elif self.speaks:
                    self.cable.comes(self.speaks)
            await asyncio.sleep(0.001)

    def pull(self) -> None:
        """Pull the cable: nothing comes any more, and the port is closed by the system."""
        assert self.cable is not None
        self.cable.abort()
        self.cable = None

    def press(self, label: str) -> None:
        self.keypad.press(LABELS.index(label))

    def let_go(self) -> None:
        self.keypad.pressed.clear()

    async def until_it_shows(self, row: str) -> None:
        async with asyncio.timeout(20):
            while self.keypad.lcd[0] != row:  # noqa: ASYNC110 - the glass tells nobody
                await asyncio.sleep(0.01)

    def kinds(self, since: int = 0) -> list[str]:
        """Return what came at the server from some place on, but for what always comes."""
        names = [type(message).__name__ for _, message in self.server.got[since:]]
        return [name for name in names if name not in ("AuthorityBeat", "Management", "Ping")]


@asynccontextmanager
async def desk(server: ScriptedPendantServer, **options: Any) -> AsyncIterator[KeypadBench]:
    server.answers |= {
        "snapshot": dict(snapshot()),
        "controller.describe": {"emulated": True},
        "recordings.list": {"recordings": [], "recording": None, "total": 0, "problem": ""},
    }
    made = KeypadBench(server, **options)

    async def connect() -> PendantClient:
        return await PendantClient.connect("127.0.0.1", server.port, enabling_deadline=0.15)

    connection = PanelConnection(
        made.core,
        connect,
        clock=made.clock,
        performer=lambda client, panel: KeypadPerformer(client, made.core),
    )
    bridge = KeypadBridge(
        made.core,
        connection.perform,
        made.open,
        LineWords("/dev/ttyX", 115_200, made.said.append),
        clock=made.clock,
    )
    tasks = [asyncio.ensure_future(each) for each in (connection.run(), bridge.run(), made.live())]
    try:
        yield made
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


@asynccontextmanager
async def ready(server: ScriptedPendantServer) -> AsyncIterator[KeypadBench]:
    """A desk whose keypad is in control."""
    server.holder = SESSION
    async with desk(server) as made:
        await made.until_it_shows("T1 JOINT      * en--")
        yield made


async def test_a_key_presses_with_enabling_ahead_and_beats_with_its_frames_alone(
    server: ScriptedPendantServer,
) -> None:
    async with ready(server) as made:
        before = len(server.got)
        made.press("1")
        await asyncio.sleep(0.5)
        kinds = made.kinds(before)
        # Let go and held first, then a sign in front of the press and of each beat.
        assert kinds[:4] == ["Enabling", "Enabling", "Enabling", "JogStart"]
        assert kinds[4::2] == ["Enabling"] * len(kinds[4::2])
        assert kinds[5::2] == ["JogBeat"] * len(kinds[5::2])
        assert 8 <= kinds.count("JogBeat") <= 11
        made.hears = False
        silent = made.time
        await asyncio.sleep(0.3)
        assert not [at for at in server.times(messages.JogBeat) if at > silent + 0.003]
        (released,) = server.times(messages.JogRelease)
        assert released - silent < 0.15


async def test_a_key_that_comes_up_releases_at_once_and_lets_enabling_go_at_rest(
    server: ScriptedPendantServer,
) -> None:
    async with ready(server) as made:
        made.press("1")
        await asyncio.sleep(0.2)
        made.let_go()
        released = made.time
        await asyncio.sleep(0.1)
        assert server.times(messages.JogRelease)[0] - released < 0.02
        assert server.all(messages.Enabling)[-1].position == messages.EnablingPosition.RELEASED
        assert made.kinds()[-1] == "Enabling"


async def test_a_second_key_takes_over_and_goes_on_alone(server: ScriptedPendantServer) -> None:
    async with ready(server) as made:
        made.press("1")
        await asyncio.sleep(0.1)
        made.press("5")
        await asyncio.sleep(0.1)
        server.end_jog(1, messages.JogEnd.REPLACED)
        made.keypad.let_go(0)
        await asyncio.sleep(0.1)
        aims = [start.values[:3] for start in server.all(messages.JogStart)]
    assert aims == [(1.0, 0.0, 0.0), (1.0, -1.0, 0.0), (0.0, -1.0, 0.0)]


async def test_a_press_that_the_server_ends_needs_a_key_up(server: ScriptedPendantServer) -> None:
    async with ready(server) as made:
        made.press("1")
        await asyncio.sleep(0.1)
        server.end_jog(1, messages.JogEnd.STOPPED, VerdictCode.STOPPED)
        await asyncio.sleep(1.0)
        assert len(server.all(messages.JogStart)) == 1
        assert made.keypad.lcd[0] == "LET GO OF ALL KEYS  "
        made.let_go()
        await asyncio.sleep(0.1)
        made.press("1")
        await asyncio.sleep(0.1)
        assert len(server.all(messages.JogStart)) == 2


async def test_stop_reaches_the_server_before_anything_else_of_its_frame(
    server: ScriptedPendantServer,
) -> None:
    async with ready(server) as made:
        made.press("1")
        await asyncio.sleep(0.1)
        before = len(server.got)
        made.press("D")
        await asyncio.sleep(0.05)
        came = [kind for kind in made.kinds(before) if kind not in ("Enabling", "JogBeat")]
        assert came[:2] == ["SoftwareStop", "JogRelease"]


async def test_a_line_that_was_unplugged_is_opened_again_and_needs_a_key_up(
    server: ScriptedPendantServer,
) -> None:
    async with ready(server) as made:
        made.press("1")
        await asyncio.sleep(0.1)
        pulled = made.time
        made.pull()
        await asyncio.sleep(2.0)
        assert server.times(messages.JogRelease)[0] - pulled < 0.01
        assert len(server.all(messages.JogStart)) == 1
        assert made.said[-2:] == [
            "unplugged; what it held was released. Trying again",
            "ready (firmware 1.0)",
        ]


async def test_promise_25_the_port_is_opened_ever_more_rarely_and_one_line_says_why(
    server: ScriptedPendantServer,
) -> None:
    async with desk(server, is_absent=True) as made:
        await asyncio.sleep(30)
        waits = [after - at for at, after in zip(made.attempts, made.attempts[1:], strict=False)]
        assert waits == pytest.approx([*BACK_OFF, 5.0, 5.0, 5.0][: len(waits)], abs=0.001)
        assert len(waits) >= 7
        assert made.said == ["no such port"]
        made.is_absent = False
        await asyncio.sleep(6)
        assert made.said[1:] == ["ready (firmware 1.0)"]
        # After ten seconds of ready the next loss begins with the shortest time again.
        await asyncio.sleep(11)
        made.is_absent = True
        made.pull()
        count = len(made.attempts)
        await asyncio.sleep(1.0)
        assert len(made.attempts) == count + 1


HELLO_2 = bytes_of(KeypadHello(2, 1, 0, 0, 20, 4, 0, 0, 0), 1)


@pytest.mark.parametrize(
    ("speaks", "said"),
    [
        (b"", "nothing speaks on /dev/ttyX within 3 s; power, cable, firmware"),
        (b"\x55" * 7, "something speaks on /dev/ttyX, but not this protocol ("),
        (HELLO_2, "the firmware speaks protocol 2, this bridge 1; flash the firmware of"),
    ],
    ids=["silent", "foreign", "another version"],
)
async def test_what_is_no_keypad_is_named_once_and_tried_again(
    server: ScriptedPendantServer, speaks: bytes, said: str
) -> None:
    async with desk(server, speaks=speaks) as made:
        await asyncio.sleep(20)
        assert len(made.attempts) >= 4
        assert made.said[0].startswith(said)
        assert len(made.said) == 1
    assert server.all(messages.JogStart) == []


async def test_a_keypad_that_falls_silent_is_given_up_within_half_a_second(
    server: ScriptedPendantServer,
) -> None:
    async with ready(server) as made:
        made.hears = False
        silent = made.time
        while not any("0.4 s" in line for line in made.said):  # noqa: ASYNC110
            await asyncio.sleep(0.001)
        assert made.time - silent < 0.5
        assert made.core.line_news() == []


async def test_a_server_that_is_lost_under_a_held_key_ends_neither_line_nor_bridge(
    server: ScriptedPendantServer,
) -> None:
    async with ready(server) as made:
        made.press("1")
        await asyncio.sleep(0.1)
        server.hang_up()
        await asyncio.sleep(0.5)
        assert made.keypad.lcd[0] == "LET GO OF ALL KEYS  "
        made.let_go()
        await asyncio.sleep(0.3)
        assert made.keypad.lcd[0] == "NO LINK             "
        await asyncio.sleep(3.0)
        assert len(server.all(messages.Hello)) == 2
        assert made.said == ["ready (firmware 1.0)"]
        assert len(server.all(messages.JogStart)) == 1


async def test_a_sign_that_comes_as_the_connection_ends_breaks_nothing(
    server: ScriptedPendantServer, pendant: PendantClient
) -> None:
    """Its waiters have not been told yet, and the port must not hear of it."""
    performer = KeypadPerformer(pendant, Keypad(KeypadLine()))
    performer.perform([do.PressJog(do.JOINTS, ((0, 1),))])
    await asyncio.sleep(0.1)
    assert server.all(messages.JogStart)
    pendant._conversation._end(None)
    performer.perform([do.FeedBeat(), do.ReleaseJog(), do.FeedBeat()])
    await performer.close()


async def test_a_resumed_motion_goes_on_while_its_key_is_held(
    server: ScriptedPendantServer,
) -> None:
    async with ready(server) as made:
        server.activity = messages.Activity.PAUSED
        made.press("C")
        await asyncio.sleep(0.9)
        made.let_go()
        await asyncio.sleep(0.1)
        made.press("0")
        await asyncio.sleep(0.1)
        server.activity = messages.Activity.MOVING
        await asyncio.sleep(0.5)
        made.let_go()
        await asyncio.sleep(0.3)
        controls = [each.action for each in server.all(messages.MotionControl)]
        # Enabling is held until it stands: what moves without would latch a stop.
        assert server.all(messages.Enabling)[-1].position == messages.EnablingPosition.HELD
        server.activity = messages.Activity.IDLE
        await asyncio.sleep(0.3)
        assert server.all(messages.Enabling)[-1].position == messages.EnablingPosition.RELEASED
    assert controls == [
        messages.MotionControlAction.RESUME,
        messages.MotionControlAction.PROGRAM_STOP,
    ]


async def test_a_motion_whose_key_is_let_go_before_its_plan_came_is_not_enabled(
    server: ScriptedPendantServer,
) -> None:
    async with ready(server) as made:
        made.press("C")
        await asyncio.sleep(0.9)
        made.let_go()
        await asyncio.sleep(0.1)
        server.mutes = True
        made.press("7")
        await asyncio.sleep(0.1)
        assert server.all(messages.Home)
        made.let_go()
        await asyncio.sleep(0.05)
        assert server.all(messages.Enabling)[-1].position == messages.EnablingPosition.RELEASED
        assert server.one(messages.MotionControl).action == (
            messages.MotionControlAction.PROGRAM_STOP
        )


async def test_bad_frames_are_told_with_their_number(server: ScriptedPendantServer) -> None:
    async with ready(server) as made:
        assert made.cable is not None
        for _ in range(3):
            made.cable.comes(b"\x01\x02\x03\0")
        await asyncio.sleep(11)
        assert made.said[-1] == "3 bad frames in the last 10 s: cable, ground or baud"


@pytest.mark.parametrize(
    ("port", "said"),
    [
        ("/dev/ttyACM0", "/dev/ttyACM0 was closed before a keypad said hello"),
        (
            "socket://127.0.0.1:4001",
            "socket://127.0.0.1:4001 was closed at once: no page shows its keypad, or another"
            " bridge has it. Trying every 0.5 to 5 s",
        ),
    ],
)
def test_a_line_that_is_closed_before_a_hello_is_told_once(port: str, said: str) -> None:
    told: list[str] = []
    words = LineWords(port, 115_200, told.append)
    words.closed_early()
    words.closed_early()
    assert told == [said]
