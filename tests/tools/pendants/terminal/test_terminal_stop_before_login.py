"""A stop waits for no login, and whoever is turned away stays until it is answered."""

import asyncio

import pytest
from rigs.peers.driven_pendant import Driven, driven

from openpendant.simplemsg.pendant import Hello, Login, Outcome, OutcomeKind, SoftwareStop
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import PendantClient, PendantError, Refused, WrongArgument
from openpendant.tools.pendants.terminal import commands as do
from openpendant.tools.pendants.terminal import lcd
from openpendant.tools.pendants.terminal.connection import LogIn, TerminalConnection
from openpendant.tools.pendants.terminal.keyboard import STOP_KEY
from openpendant.tools.pendants.terminal.panel import Panel

pytestmark = pytest.mark.virtual_clock

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
        another = TerminalConnection(Panel(), pendant.connect, log_in)
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
        assert "the space bar stops" in pendant.banner
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
