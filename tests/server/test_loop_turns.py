"""A burst of one pendant's requests holds up nobody else, and no stop behind it, for long."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import cast
from unittest.mock import Mock

import pytest
from server_clients import hello

from openpendant.server.client_connection import ClientConnection
from openpendant.server.clients import Clients
from openpendant.server.core import Port
from openpendant.server.loop_turns import BUDGET_NS, LoopTurns, stops_first
from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Message, Received, Role
from openpendant.simplemsg.journal import Journal
from openpendant.simplemsg.pendant import (
    Enabling,
    JogRelease,
    Management,
    ResetStop,
    SoftwareStop,
)

MS = 1_000_000
COSTLY_NS = 2_600_000
STOP = SoftwareStop(9, "space bar")


def check(number: int) -> Management:
    return Management(number, b'{"op": "programs.check"}')


def encoded(*messages: Message) -> bytes:
    wire = Connection(Role.CLIENT, PENDANT, byte_order=ByteOrder.LITTLE)
    return b"".join(wire.send(message) for message in messages)


@dataclass
class Desk:
    """Takes what the connections hand on, and needs a while for what is costly."""

    taken: list[tuple[int, Received]] = field(default_factory=list)
    now: int = 0
    costly_ns: int = COSTLY_NS

    def __post_init__(self) -> None:
        self.journal = Journal(lambda: self.now)
        self.turns = LoopTurns(lambda: self.now)

    def receive(self, session: int, received: Received, now: int) -> None:
        self.taken.append((session, received))
        if isinstance(received, Management):
            self.now += self.costly_ns

    def admit(self, client: ClientConnection) -> None:
        """Everybody may come in."""

    def failed(self, client: ClientConnection, error: Exception, now: int) -> None:
        raise error

    def connect(self, session: int) -> ClientConnection:
        client = ClientConnection(cast(Clients, self), Port.PENDANT)
        transport = Mock(spec=asyncio.Transport)
        transport.is_closing.return_value = False
        transport.get_extra_info.side_effect = lambda name: Mock() if name == "socket" else None
        client.connection_made(transport)
        client.session = session
        return client

    def requests(self) -> list[int]:
        return [each.request_id for _, each in self.taken if isinstance(each, Management)]


pytestmark = [pytest.mark.asyncio, pytest.mark.virtual_clock]
HELLO = hello("tester")


async def until(done: Callable[[], bool]) -> None:
    for _ in range(1_000):
        if done():
            return
        await asyncio.sleep(0)
    raise AssertionError("not done in a thousand turns of the loop")


async def test_a_burst_takes_no_more_of_a_turn_than_the_budget_and_one_request() -> None:
    desk = Desk()
    client = desk.connect(1)
    client.data_received(encoded(*map(check, range(64))))
    longest = desk.now
    while len(desk.taken) < 64:
        begun = desk.now
        await asyncio.sleep(0)
        longest = max(longest, desk.now - begun)
    assert longest <= BUDGET_NS + COSTLY_NS
    assert desk.requests() == list(range(64))


async def test_many_pendants_share_the_budget_of_a_turn() -> None:
    desk = Desk()
    for session in range(1, 41):
        desk.connect(session).data_received(encoded(*map(check, range(8))))
    assert desk.now <= BUDGET_NS + COSTLY_NS
    await until(lambda: len(desk.taken) == 320)
    for session in range(1, 41):
        own = [each.request_id for who, each in desk.taken if who == session]  # type: ignore[union-attr]
        assert own == list(range(8))


@pytest.mark.parametrize("prompt", [STOP, JogRelease(9, 1), Enabling(0)])
async def test_what_stops_a_robot_waits_for_no_turn(prompt: Message) -> None:
    desk = Desk()
    burst, other = desk.connect(1), desk.connect(2)
    burst.data_received(encoded(*map(check, range(64))))
    other.data_received(encoded(prompt))
    assert len(desk.taken) == 3
    assert desk.taken[-1] == (2, prompt)


async def test_a_request_of_another_pendant_waits_for_a_turn_and_not_for_the_burst() -> None:
    desk = Desk()
    burst, other = desk.connect(1), desk.connect(2)
    burst.data_received(encoded(*map(check, range(64))))
    other.data_received(encoded(check(900)))
    await until(lambda: 900 in desk.requests())
    assert desk.now <= 3 * (BUDGET_NS + COSTLY_NS)


async def test_requests_that_come_one_after_the_other_wait_for_nothing() -> None:
    desk = Desk()
    client = desk.connect(1)
    for number in range(10):
        client.data_received(encoded(check(number)))
        assert desk.requests()[-1] == number
        desk.now += 8 * MS


async def test_a_stop_overtakes_the_burst_of_its_own_connection() -> None:
    desk = Desk()
    desk.connect(1).data_received(encoded(*map(check, range(63)), STOP))
    assert desk.taken[0] == (1, STOP)
    await until(lambda: len(desk.taken) == 64)
    assert desk.requests() == list(range(63))


async def test_a_stop_far_behind_is_seen_before_most_of_the_burst_is_done() -> None:
    desk = Desk()
    desk.connect(1).data_received(encoded(*map(check, range(600)), STOP))
    await until(lambda: (1, STOP) in desk.taken)
    assert desk.now <= 10 * (BUDGET_NS + COSTLY_NS)


async def test_a_connection_reads_nothing_and_has_no_frame_deadline_while_it_waits() -> None:
    desk = Desk()
    client = desk.connect(1)
    transport = cast(Mock, client._transport)
    client.data_received(encoded(*map(check, range(20))) + encoded(check(20))[:7])
    transport.pause_reading.assert_called_once()
    client.check_deadlines(desk.now + 5_000 * MS)
    assert not transport.abort.called
    await until(lambda: len(desk.taken) == 20)
    calls = [name for name, *_ in transport.method_calls if name.endswith("_reading")]
    assert calls[-1] == "resume_reading"
    client.check_deadlines(desk.now + 5_000 * MS)
    assert transport.abort.called


async def test_what_a_lost_connection_left_is_not_done() -> None:
    desk = Desk()
    client = desk.connect(1)
    client._clients.dismiss = Mock()  # type: ignore[method-assign]
    client.data_received(encoded(*map(check, range(20))))
    done = len(desk.taken)
    client.connection_lost(None)
    for _ in range(10):
        await asyncio.sleep(0)
    assert len(desk.taken) == done


async def test_bytes_that_are_no_frame_close_only_behind_what_came_before_them() -> None:
    desk = Desk()
    client = desk.connect(1)
    client.data_received(encoded(*map(check, range(5))) + b"\xff" * 8)
    assert not client.is_closing
    await until(lambda: client.is_closing)
    assert desk.requests() == list(range(5))


@pytest.mark.parametrize(
    ("sent", "taken"),
    [
        ([check(1), check(2), STOP], [STOP, check(1), check(2)]),
        ([HELLO, check(1), STOP], [HELLO, STOP, check(1)]),
        ([check(1), ResetStop(3), check(2), STOP], [check(1), ResetStop(3), STOP, check(2)]),
        ([STOP, ResetStop(3), check(1)], [STOP, ResetStop(3), check(1)]),
        ([check(1), STOP, ResetStop(3)], [STOP, check(1), ResetStop(3)]),
    ],
)
async def test_a_stop_goes_first_but_past_no_hello_and_no_reset(
    sent: list[Received], taken: list[Received]
) -> None:
    assert list(stops_first(sent)) == taken
