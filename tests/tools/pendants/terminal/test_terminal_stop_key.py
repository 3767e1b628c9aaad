"""The terminal pendant's stop: from any key on, before a login, and across connections."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from itertools import pairwise

import pytest
from rigs.cells.panel_rig import HELLO, PanelRig, snapshot
from rigs.peers.scripted_pendant_server import ScriptedPendantServer, scripted_server

from openpendant.simplemsg.pendant import (
    Declare,
    Hello,
    LinkState,
    Login,
    Outcome,
    OutcomeKind,
    SoftwareStop,
    StopChanged,
    StopKind,
)
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import (
    ConnectionLost,
    PendantClient,
    PendantError,
    Refused,
    WrongArgument,
)
from openpendant.tools.pendants.panel import commands as do
from openpendant.tools.pendants.panel import lcd
from openpendant.tools.pendants.panel.connection import (
    LONGEST_PAUSE,
    RETRY,
    LogIn,
    PanelConnection,
    as_nobody,
)
from openpendant.tools.pendants.panel.keyboard import STOP_KEY, Page
from openpendant.tools.pendants.panel.panel import Panel
from openpendant.tools.pendants.terminal import screen_text

pytestmark = pytest.mark.virtual_clock


def loop_ns() -> int:
    return int(asyncio.get_running_loop().time() * 1e9)


class Driven:
    """A pendant on a connection to a scripted server, on the clock of the loop."""

    ran: asyncio.Task[None]

    def __init__(self, server: ScriptedPendantServer, log_in: LogIn = as_nobody) -> None:
        self.server = server
        self.panel = Panel()
        self.connection = PanelConnection(self.panel, self.connect, log_in, loop_ns)

    async def connect(self) -> PendantClient:
        return await PendantClient.connect("127.0.0.1", self.server.port, state_rate=25)

    async def tick(self) -> None:
        while True:
            self.connection.perform(self.panel.tick(loop_ns()))
            await asyncio.sleep(0.04)

    def strike(self, key: str) -> None:
        self.connection.perform(self.panel.key(key, loop_ns()))

    @property
    def banner(self) -> str:
        return screen_text.banner(self.panel, loop_ns())

    @property
    def reasons(self) -> list[str]:
        return [stop.reason for stop in self.server.all(SoftwareStop)]

    async def until(self, holds: Callable[[], object], within: float) -> float:
        """Wait until something holds, at most so long; return how long it took [s]."""
        began = asyncio.get_running_loop().time()
        async with asyncio.timeout(within):
            while True:
                if holds():
                    return asyncio.get_running_loop().time() - began
                await asyncio.sleep(0.01)


@asynccontextmanager
async def driven(log_in: LogIn = as_nobody, *, stops_first: bool = False) -> AsyncIterator[Driven]:
    """Yield a pendant that is connected; or one whose stop was pressed before it could be."""
    async with scripted_server() as server:
        server.answers["snapshot"] = {**snapshot()}
        made = Driven(server, log_in)
        if stops_first:
            made.strike(STOP_KEY)
        made.ran = asyncio.create_task(made.connection.run())
        ticking = asyncio.create_task(made.tick())
        try:
            if not stops_first:
                await made.until(lambda: made.panel.cell.state is not None, 5.0)
            yield made
        finally:
            for task in (made.ran, ticking):
                task.cancel()
            await asyncio.gather(made.ran, ticking, return_exceptions=True)


DOUBT = "STOP NOT CONFIRMED, use the robot's own hardware stop button: "


def press(rig: PanelRig) -> do.StopRobot:
    """Press the stop key on a link that seems to stand."""
    (stop,) = rig.panel.key(STOP_KEY, rig.now)
    assert isinstance(stop, do.StopRobot)
    return stop


def banner(rig: PanelRig) -> str:
    return screen_text.banner(rig.panel, rig.now)


def connect_anew(rig: PanelRig) -> list[do.Command]:
    """Let a new connection stand, and return what leaves on it."""
    first = rig.panel.greeted()
    rig.panel.cell.connected(HELLO, snapshot())
    asked = [*first, *rig.panel.connected()]
    rig.state()
    return asked


def test_a_stop_that_is_answered_is_in_no_doubt(rig: PanelRig) -> None:
    rig.panel.stop_key.confirmed(press(rig).press)
    rig.wait(1000)
    assert "NOT CONFIRMED" not in banner(rig)
    assert not any("CONFIRMED" in line for line in rig.panel.messages.lines)
    rig.panel.lost("cable")
    assert connect_anew(rig) == []


def test_a_stop_without_an_answer_is_called_unconfirmed_after_0_3_s(rig: PanelRig) -> None:
    press(rig)
    rig.wait(280)
    assert "NOT CONFIRMED" not in banner(rig)
    rig.wait(20)
    assert banner(rig) == f"{DOUBT}no answer for 0.3 s"
    assert rig.said == banner(rig)
    for page in Page:
        rig.panel.page = page
        assert lcd.page(rig.panel, rig.now)[0].rstrip() == "STOP NOT CONFIRMED"


@pytest.mark.parametrize(
    ("since", "link", "why"),
    [
        (400, LinkState.UP, "the server is silent for 0.4 s"),
        (0, LinkState.STALE, "◐ server–controller: stale"),
    ],
)
def test_on_a_silent_server_it_is_called_so_at_once_and_leaves_all_the_same(
    rig: PanelRig, since: int, link: LinkState, why: str
) -> None:
    rig.state(link=link)
    rig.wait(since, fresh=False)
    press(rig)
    assert banner(rig) == rig.said == f"{DOUBT}{why}"


def test_a_stop_that_was_swallowed_leaves_again_on_the_new_connection(rig: PanelRig) -> None:
    pressed = press(rig)
    rig.wait(15_000, fresh=False)
    rig.panel.lost("the server said nothing for 15 s")
    assert banner(rig).startswith(f"{DOUBT}no link, it leaves again once linked")
    again = connect_anew(rig)
    assert again[0] == do.StopRobot("space bar, sent again")
    assert {stop.press for stop in again if isinstance(stop, do.StopRobot)} == {pressed.press}
    rig.panel.stop_key.confirmed(pressed.press)
    assert rig.said == "the stop is confirmed"
    assert "NOT CONFIRMED" not in banner(rig)


def test_a_stop_that_was_pressed_without_a_link_leaves_once_linked() -> None:
    rig = PanelRig(connected=False)
    assert rig.strike(STOP_KEY) == []
    assert rig.said.startswith(f"{DOUBT}no link")
    (stop, *_) = connect_anew(rig)
    assert isinstance(stop, do.StopRobot)


def test_a_refusal_leaves_the_stop_owed_and_is_told_with_the_button(rig: PanelRig) -> None:
    rig.panel.stop_key.refused(press(rig).press, "HELLO_FIRST: who are you?")
    assert banner(rig) == f"{DOUBT}HELLO_FIRST: who are you?"
    assert rig.panel.greeted() == [do.StopRobot("space bar, sent again")]


def test_what_is_owed_leaves_every_second_and_what_was_refused_does_not(rig: PanelRig) -> None:
    stop = press(rig)
    assert rig.wait(980) == []
    assert rig.wait(20) == [do.StopRobot("space bar, sent again")]
    assert len(rig.wait(3000)) == 3
    rig.panel.stop_key.refused(stop.press, "refused")
    assert rig.wait(3000) == []


@pytest.mark.parametrize("kind", [StopKind.SOFTWARE, StopKind.PROTECTIVE])
def test_the_news_of_a_latched_stop_confirms_it(rig: PanelRig, kind: StopKind) -> None:
    press(rig)
    rig.wait(400)
    rig.panel.stop_changed(StopChanged(stop=kind, session=7, client="terminal", reason="space bar"))
    assert "NOT CONFIRMED" not in banner(rig)
    assert rig.panel.greeted() == []


def test_the_news_of_a_reset_confirms_nothing(rig: PanelRig) -> None:
    press(rig)
    rig.panel.stop_changed(StopChanged(stop=StopKind.NONE, session=9, client="b", reason=""))
    rig.wait(400)
    assert "NOT CONFIRMED" in banner(rig)


def test_the_answer_to_an_earlier_press_does_not_confirm_the_last(rig: PanelRig) -> None:
    first, second = press(rig), press(rig)
    rig.panel.stop_key.confirmed(first.press)
    rig.wait(400)
    assert "NOT CONFIRMED" in banner(rig)
    rig.panel.stop_key.confirmed(second.press)
    assert "NOT CONFIRMED" not in banner(rig)


# With a server.


async def test_a_server_that_swallows_the_stop_gets_it_again_on_the_next_connection() -> None:
    async with driven() as pendant:
        pendant.server.mutes = True
        pendant.strike(STOP_KEY)
        await pendant.until(lambda: pendant.reasons, 1.0)
        assert await pendant.until(lambda: pendant.banner.startswith(DOUBT), 0.5) <= 0.4
        # It stays said until the client gives the silent connection up, and from then on too.
        while pendant.panel.cell.is_connected:
            assert pendant.banner.startswith(DOUBT)
            await asyncio.sleep(0.1)
        swallowed = len(pendant.reasons)
        pendant.server.mutes = False
        await pendant.until(lambda: len(pendant.reasons) > swallowed, 30.0)
        assert pendant.reasons[-1] == "space bar, sent again"
        sent = [type(message) for _, message in pendant.server.got]
        greeted = len(sent) - sent[::-1].index(Hello)
        assert sent[greeted : greeted + 2] == [Declare, SoftwareStop]  # the stop is faster
        await pendant.until(lambda: pendant.panel.cell.state and pendant.panel.cell.age, 5.0)
        await pendant.until(lambda: not pendant.banner.startswith("STOP"), 5.0)
        assert "the stop is confirmed" in pendant.panel.messages.lines
        # Once confirmed it is owed no more: nothing stops the robot a second time.
        told = len(pendant.reasons)
        pendant.server.hang_up()
        await pendant.until(lambda: not pendant.panel.cell.is_connected, 5.0)
        await pendant.until(lambda: pendant.panel.cell.is_connected, 30.0)
        assert len(pendant.reasons) == told


async def test_a_server_that_wakes_before_it_is_given_up_gets_it_again_too() -> None:
    async with driven() as pendant:
        pendant.server.mutes = True
        pendant.strike(STOP_KEY)
        await pendant.until(lambda: pendant.reasons, 1.0)
        await pendant.until(lambda: pendant.banner.startswith(DOUBT), 0.5)
        pendant.server.mutes = False
        await pendant.until(lambda: not pendant.banner.startswith("STOP"), 1.5)
        assert pendant.reasons == ["space bar", "space bar, sent again"]
        assert pendant.panel.cell.is_connected


async def test_a_stop_that_a_server_refuses_is_told_as_not_confirmed() -> None:
    async with driven() as pendant:
        pendant.server.refusals[SoftwareStop] = (VerdictCode.BAD_ARGUMENT, "no such reason")
        pendant.strike(STOP_KEY)
        await pendant.until(lambda: "BAD_ARGUMENT: no such reason" in pendant.banner, 0.25)
        assert pendant.banner.startswith(DOUBT)
        pendant.strike(STOP_KEY)
        await pendant.until(lambda: not pendant.banner.startswith("STOP"), 1.0)


async def test_an_attempt_to_connect_that_hangs_is_made_anew() -> None:
    came: list[float] = []

    async def connect() -> PendantClient:
        came.append(asyncio.get_running_loop().time())
        await asyncio.sleep(120)
        raise AssertionError("nobody waits so long")

    panel = Panel()
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(13.0):
            await PanelConnection(panel, connect).run()
    assert came[1] - came[0] == pytest.approx(12.0)
    assert panel.cell.absence == "no connection within 10 s; trying again in 2 s"


STOP_AGAIN = "space bar, sent again"


async def pair(client: PendantClient) -> None:
    await client.login("kim", pairing="ABC234")


async def log_in_slowly(client: PendantClient) -> None:
    """As in a class of thirty that comes back after a restart of the server."""
    await asyncio.sleep(8.0)
    await client.login("kim", password="correct horse")


def refused(code: V) -> Refused:
    return Refused(code, "scripted", -1, 0.0, 0.0)


def failing(failure: PendantError, attempts: list[str]) -> LogIn:
    async def log_in(_: PendantClient) -> None:
        attempts.append("tried")
        raise failure

    return log_in


def sent(pendant: Driven) -> list[type]:
    asked = (Hello, SoftwareStop, Login)
    return [type(message) for _, message in pendant.server.got if isinstance(message, asked)]


async def test_an_owed_stop_leaves_between_the_hello_and_the_login() -> None:
    async with driven(pair, stops_first=True) as pendant:
        await pendant.until(lambda: pendant.panel.cell.is_connected, 1.0)
        assert sent(pendant)[:3] == [Hello, SoftwareStop, Login]
        await pendant.until(lambda: not pendant.panel.stop_key.is_owed, 1.0)


async def test_a_code_that_has_expired_ends_the_pendant_with_the_stop_confirmed() -> None:
    async with driven(pair, stops_first=True) as pendant:
        pendant.server.refusals[Login] = (V.PAIRING_WRONG, "")
        with pytest.raises(Refused):
            await asyncio.wait_for(pendant.ran, 5.0)
        assert sent(pendant) == [Hello, SoftwareStop, Login]
        assert not pendant.panel.stop_key.is_owed


@pytest.mark.parametrize(
    "failure",
    [
        refused(V.PAIRING_WRONG),
        refused(V.LOGIN_FAILED),
        refused(V.LOGIN_NEEDED),
        WrongArgument("the name is too long"),
    ],
)
async def test_a_hopeless_login_ends_the_pendant_only_once_the_stop_is_answered(
    failure: PendantError,
) -> None:
    async with driven(failing(failure, []), stops_first=True) as pendant:
        pendant.server.mutes = True
        pendant.server.mutes_all_but = Hello
        await asyncio.sleep(5.0)
        assert not pendant.ran.done()
        assert pendant.banner.startswith("STOP NOT CONFIRMED")
        assert str(failure) in pendant.banner
        pendant.server.mutes = False
        with pytest.raises(type(failure)):
            await asyncio.wait_for(pendant.ran, 2.0)
        assert not pendant.panel.stop_key.is_owed


async def test_a_stop_that_is_refused_does_not_keep_a_hopeless_login_waiting() -> None:
    async with driven(failing(refused(V.PAIRING_WRONG), []), stops_first=True) as pendant:
        pendant.server.refusals[SoftwareStop] = (V.BAD_ARGUMENT, "no such reason")
        with pytest.raises(Refused):
            await asyncio.wait_for(pendant.ran, 1.0)
        assert pendant.panel.stop_key.is_owed


async def test_a_hopeless_login_without_a_stop_ends_the_pendant_at_once() -> None:
    log_in = failing(refused(V.PAIRING_WRONG), [])
    async with driven() as pendant:
        another = PanelConnection(Panel(), pendant.connect, log_in)
        with pytest.raises(Refused):
            await asyncio.wait_for(another.run(), 0.1)


async def test_a_connection_that_is_lost_before_the_answer_is_made_anew_for_the_stop() -> None:
    attempts: list[str] = []
    failure = refused(V.PAIRING_WRONG)
    async with driven(failing(failure, attempts), stops_first=True) as pendant:
        pendant.server.mutes = True
        pendant.server.mutes_all_but = Hello
        await pendant.until(lambda: pendant.reasons, 1.0)
        pendant.server.hang_up()
        await pendant.until(lambda: not pendant.panel.cell.is_greeted, 1.0)
        pendant.server.mutes = False
        before = len(pendant.reasons)
        with pytest.raises(Refused):
            await asyncio.wait_for(pendant.ran, 5.0)
        assert pendant.reasons[before:] == [STOP_AGAIN]
        assert not pendant.panel.stop_key.is_owed
        assert attempts == ["tried"]  # wrong codes are counted, and lock a whole class out


async def test_whoever_is_locked_out_has_the_stop_heard_and_comes_again() -> None:
    async with driven(pair, stops_first=True) as pendant:
        pendant.server.refusals[Login] = (V.LOCKED_OUT, "")
        await pendant.until(lambda: not pendant.panel.stop_key.is_owed, 1.0)
        await pendant.until(lambda: pendant.panel.cell.is_connected, 5.0)
        assert sent(pendant) == [Hello, SoftwareStop, Login, Hello, Login]


async def test_the_space_bar_stops_while_a_login_waits_and_no_other_key_does_anything() -> None:
    async with driven(log_in_slowly, stops_first=True) as pendant:
        await pendant.until(lambda: not pendant.panel.stop_key.is_owed, 1.0)
        before = len(pendant.reasons)
        pendant.strike(STOP_KEY)
        await pendant.until(lambda: len(pendant.reasons) > before, 0.1)
        await pendant.until(lambda: not pendant.panel.stop_key.is_owed, 0.1)
        assert not pendant.panel.cell.is_connected
        assert "the space bar or F8 stops" in pendant.banner
        assert lcd.page(pendant.panel, 0)[0].rstrip() == "NO LOGIN"
        now = round(1e9 * asyncio.get_running_loop().time())
        for key in "cxvq08":
            asked = [*pendant.panel.key(key, now), *pendant.panel.key("1", now)]
            assert [each for each in asked if not isinstance(each, do.StopRobot)] == []
        await pendant.until(lambda: pendant.panel.cell.is_connected, 10.0)


async def test_a_login_that_ends_while_a_stop_waits_ends_the_pendant_after_its_answer() -> None:
    async with driven() as pendant:
        await pendant.until(lambda: pendant.panel.cell.is_connected, 1.0)
        pendant.strike("v")
        pendant.server.mutes = True
        pendant.strike(STOP_KEY)
        pendant.server.send(
            Outcome(0, OutcomeKind.ABORTED, V.LOGIN_NEEDED, -1, 0, 0, 0, 0, "the lesson is over")
        )
        await pendant.until(lambda: "the lesson is over" in pendant.banner, 6.0)
        assert not pendant.panel.enabling.is_on
        assert not pendant.ran.done()
        pendant.server.mutes = False
        with pytest.raises(Refused):
            await asyncio.wait_for(pendant.ran, 2.0)
        assert not pendant.panel.stop_key.is_owed


@pytest.mark.virtual_clock
@pytest.mark.parametrize(
    ("failure", "pause"),
    [
        (OSError("nobody listens"), RETRY),
        (ConnectionLost("broken"), RETRY),
        (Refused(VerdictCode.NO_PLACE, "more than 256 connections", -1, 5.0, 0.0), 5.0),
        (Refused(VerdictCode.NO_PLACE, "", -1, 0.0, 0.0), RETRY),
        (Refused(VerdictCode.NO_PLACE, "", -1, 3e38, 0.0), LONGEST_PAUSE),
        (Refused(VerdictCode.ADDRESS_BARRED, "an admin has barred it", -1, 7.0, 0.0), 7.0),
        (Refused(VerdictCode.ACCOUNT_FULL, "", -1, 64.0, 64.0), LONGEST_PAUSE),
        (Refused(VerdictCode.CELL_FAULTED, "", -1, 5.0, 0.0), RETRY),
    ],
)
async def test_it_comes_again_when_the_server_says_and_else_after_a_while(
    failure: Exception, pause: float
) -> None:
    loop = asyncio.get_running_loop()
    came: list[float] = []

    async def connect() -> PendantClient:
        came.append(loop.time())
        raise failure

    panel = Panel()
    with suppress(TimeoutError):
        async with asyncio.timeout(2.5 * pause):
            await PanelConnection(panel, connect).run()
    assert [later - first for first, later in pairwise(came)] == [
        pytest.approx(pause),
        pytest.approx(pause),
    ]
    assert f"in {pause:g} s" in panel.messages.newest
