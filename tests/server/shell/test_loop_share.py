"""The share of the loop that all clients have together: who goes on when, and what waits."""

import asyncio
from collections.abc import Callable

import pytest
from promises.promise_table import figure
from rigs.cells.byte_rig import ByteClient, ByteRig
from rigs.peers.server_clients import hello

from openpendant.server.shell.loop_share import LATE_NS, SHARE_NS, LoopShare
from openpendant.simplemsg import Ping
from openpendant.simplemsg.pendant import SoftwareStop, Verdict


class Turns:
    """Turns of connections that cost what they are given, and the iteration in which each was."""

    def __init__(self) -> None:
        self.share = LoopShare()
        self.iteration = 0
        self.had: list[tuple[str, int]] = []

    def wait(self, name: str, tag: int, cost: int = SHARE_NS) -> None:
        def go_on() -> None:
            self.had.append((name, self.iteration))
            self.share.spent += cost

        self.share.wait(tag, go_on)

    async def let(self, iterations: int) -> list[tuple[str, int]]:
        """Let the loop go on, and return who had a turn in which iteration of it."""
        self.had.clear()
        for self.iteration in range(1, iterations + 1):
            await asyncio.sleep(0)
        return self.had


async def test_promise_53_clients_together_take_no_more_than_a_share_of_an_iteration() -> None:
    turns = Turns()
    for number in range(6):
        turns.wait(f"c{number}", number, SHARE_NS // 2)
    assert await turns.let(3) == [(f"c{number}", number // 2 + 1) for number in range(6)]


async def test_whoever_has_cost_least_goes_before_who_has_waited_longest() -> None:
    turns = Turns()
    turns.wait("dear", 9_000_000)
    turns.wait("cheap", 10)
    turns.wait("dearer", 9_000_001)
    turns.wait("as cheap", 10)
    had = [name for name, _ in await turns.let(4)]
    assert had == ["cheap", "as cheap", "dear", "dearer"]


async def test_whoever_comes_later_begins_where_the_others_are_by_now() -> None:
    turns = Turns()
    turns.wait("dear", 5 * SHARE_NS)
    await turns.let(1)
    assert turns.share.served == 5 * SHARE_NS


async def test_who_asks_for_another_turn_has_it_after_a_look_at_the_sockets() -> None:
    turns = Turns()

    def again() -> None:
        turns.had.append(("first", turns.iteration))
        turns.share.wait(0, lambda: turns.had.append(("second", turns.iteration)))

    turns.share.wait(0, again)
    assert await turns.let(2) == [("first", 1), ("second", 2)]


async def test_a_share_that_is_used_up_is_whole_again_in_the_next_iteration() -> None:
    share = LoopShare()
    share.spent = SHARE_NS
    share.renew()
    await asyncio.sleep(0)
    assert share.spent == 0


def used_up(rig: ByteRig, *clients: ByteClient) -> LoopShare:
    share = LoopShare()
    share.spent = SHARE_NS
    for client in clients:
        client.shell._share = share
    return share


async def test_what_comes_beyond_the_share_is_handled_in_the_next_iteration_in_its_order() -> None:
    rig = ByteRig()
    client = rig.client()
    client.tell(hello())
    client.heard()
    used_up(rig, client)
    client.say(client.frames(Ping()) + client.frames(Ping())[:7])
    assert not client.heard()
    client.say(client.frames(Ping())[7:])
    assert not client.heard()
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert [type(each) for each in client.heard()] == [Ping, Ping]


async def test_promise_19_a_stop_beyond_the_share_acts_at_once() -> None:
    rig = ByteRig()
    client = rig.client()
    client.tell(hello())
    client.heard()
    used_up(rig, client)
    client.say(client.frames(SoftwareStop(7, "now")))
    assert rig.core.cell.stop is not None
    assert [each.request_id for each in client.heard() if isinstance(each, Verdict)] == [7]


@pytest.mark.parametrize("cut", [3, 7, 12])
async def test_promise_8_a_frame_that_began_beyond_the_share_has_to_end_in_time(cut: int) -> None:
    rig = ByteRig()
    client = rig.client()
    client.tell(hello())
    used_up(rig, client)
    client.say(client.frames(Ping())[:cut])
    await asyncio.sleep(0)
    late = rig.now + figure(8, "frame").ns
    client.shell.check_deadlines(late)
    assert not client.transport.is_over
    client.shell.check_deadlines(late + 1)
    assert client.transport.is_over


async def test_the_cost_of_a_turn_is_that_of_all_its_clients_together() -> None:
    rig = ByteRig()
    rig.each_look = SHARE_NS // 2
    first, second = rig.client(), rig.client()
    share = LoopShare()
    answers: list[Callable[[], bool]] = []
    for client in (first, second):
        client.tell(hello())
        client.heard()
        client.shell._share = share
        answers.append(lambda each=client: bool(each.heard()))  # type: ignore[misc]
    share.spent = 0
    first.tell(Ping())
    first.tell(Ping())
    assert answers[0]()
    second.tell(Ping())
    assert not answers[1]()
    await asyncio.sleep(0)
    assert answers[1]()


def delays(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return what the loop is told to wait for [s], from now on."""
    loop, told = asyncio.get_running_loop(), list[float]()

    def call_later(delay: float, callback: Callable[[], None]) -> asyncio.Handle:
        told.append(delay)
        return loop.call_soon(callback)

    monkeypatch.setattr(loop, "call_later", call_later)
    return told


@pytest.mark.parametrize(
    ("cost", "wait"), [(0, 0.0), (200_000, 0.001), (SHARE_NS, 0.005), (30 * SHARE_NS, 0.010)]
)
async def test_promise_53_clients_wait_for_the_robots_while_a_tick_is_late(
    cost: int, wait: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    told, turns = delays(monkeypatch), Turns()
    turns.share.ticked(LATE_NS + 1)
    turns.share.spent = cost
    turns.wait("held up", 0)
    assert told == [pytest.approx(wait)]
    assert await turns.let(1) == [("held up", 1)]


async def test_promise_53_they_wait_no_more_once_a_tick_is_on_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told, turns = delays(monkeypatch), Turns()
    for late in (LATE_NS + 1, LATE_NS):
        turns.share.ticked(late)
    turns.share.spent = SHARE_NS
    turns.wait("goes on", 0)
    assert await turns.let(1) == [("goes on", 1)]
    assert not told
