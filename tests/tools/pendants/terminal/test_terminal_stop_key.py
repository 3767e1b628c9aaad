"""A stop that was pressed is owed until it is confirmed, and nobody is left in doubt about it."""

import asyncio

import pytest
from rigs.cells.panel_rig import HELLO, PanelRig, snapshot
from rigs.peers.driven_pendant import driven

from openpendant.simplemsg.pendant import Hello, LinkState, SoftwareStop, StopChanged, StopKind
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.terminal import commands as do
from openpendant.tools.pendants.terminal import lcd, screen_text
from openpendant.tools.pendants.terminal.connection import TerminalConnection
from openpendant.tools.pendants.terminal.keyboard import STOP_KEY, Page
from openpendant.tools.pendants.terminal.panel import Panel

pytestmark = pytest.mark.virtual_clock

DOUBT = "STOP NOT CONFIRMED, use the robot's own hardware stop button: "


@pytest.fixture
def rig() -> PanelRig:
    return PanelRig()


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
        assert sent[greeted] is SoftwareStop
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
            await TerminalConnection(panel, connect).run()
    assert came[1] - came[0] == pytest.approx(12.0)
    assert panel.cell.absence == "no connection within 10 s; trying again in 2 s"
