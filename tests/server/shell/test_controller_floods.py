"""A controller that says more than can be handled: turns, what waits, when it is too old."""

import asyncio
import json
import socket
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
from rigs.cells.controller_reports import joint_report
from rigs.cells.server_rig import MS

from openpendant.server.events.events import ControllerGarbled, ControllerReport, Event
from openpendant.server.settings.cell_settings import ControllerLink, ControllerPath
from openpendant.server.shell import controller_connection
from openpendant.server.shell.controller_connection import (
    READ_AHEAD,
    TURN_NS,
    UNREAD,
    ControllerConnection,
)
from openpendant.server.shell.inbox import Observations
from openpendant.simplemsg import (
    PENDANT,
    JointFeedback,
    Message,
    Ping,
    accepted,
    codec_for,
)
from openpendant.simplemsg.journal import Journal

CODEC = codec_for(PENDANT)
FOURTH = TURN_NS // 4
"""Processor time that a message costs in these tests [ns]: the fourth is the last of a turn."""

ABORT_AGE = ControllerLink().abort_age_ns


def report(number: int) -> Message:
    return joint_report([number])


def reports(*numbers: int) -> bytes:
    return b"".join(map(CODEC.encode, map(report, numbers)))


@dataclass
class Flood:
    """A connection whose clock, loop and core are the test's."""

    connection: ControllerConnection
    transport: Mock
    clock: SimpleNamespace
    seen: list[Event]
    turns: list[Callable[[], object]]
    lines: list[str] = field(default_factory=list)

    def say(self, data: bytes, after: int = MS) -> None:
        self.clock.now += after
        self.connection.data_received(data)

    def go_on(self, after: int = MS) -> None:
        """Let the next turn of the loop come; there must be one, and one only."""
        self.clock.now += after
        (turn,) = self.turns
        self.turns.clear()
        turn()

    @property
    def places(self) -> list[float]:
        """Where the robot was in each report that was handed on."""
        return [
            event.message.positions[0]
            for event in self.seen
            if isinstance(event, ControllerReport) and isinstance(event.message, JointFeedback)
        ]

    @property
    def problems(self) -> list[str]:
        return [event.problem for event in self.seen if isinstance(event, ControllerGarbled)]


class Lines:
    """The stream of a journal."""

    def __init__(self, lines: list[str]) -> None:
        self._lines = lines

    def write(self, *parts: object) -> None:
        self._lines.append("".join(map(str, parts)))


@pytest.fixture
def flood(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Flood]]:
    with socket.socket() as wire:

        def make(*, path: ControllerPath = ControllerPath.STATE, journal: bool = False) -> Flood:
            clock, seen = SimpleNamespace(now=0, spent=0), list[Event]()
            turns: list[Callable[[], object]] = []

            def deliver(event: Event, now: int) -> None:
                seen.append(event)
                clock.spent += FOURTH

            kept, lines = Journal(), list[str]()
            if journal:
                kept.keep(Lines(lines), Mock(), 0, kind="server", started="")
            inbox = Mock(is_noted=journal)
            inbox.entrance.return_value = deliver
            inbox.wire_bytes.side_effect = lambda link, data: clock.now
            transport = Mock(spec=asyncio.Transport)
            transport.get_extra_info.return_value = wire
            transport.is_closing.return_value = False
            transport.get_write_buffer_size.return_value = 0
            loop = Mock(call_soon=turns.append)
            monkeypatch.setattr(controller_connection, "thread_time_ns", lambda: clock.spent)
            monkeypatch.setattr(asyncio, "get_running_loop", lambda: loop)
            connection = ControllerConnection(
                inbox, Observations(kept), 0, "", path, ControllerLink()
            )
            connection.connection_made(transport)
            return Flood(connection, transport, clock, seen, turns, lines)

        yield make


def test_a_turn_ends_by_time_and_the_next_one_goes_on_where_it_ended(
    flood: Callable[..., Flood],
) -> None:
    controller = flood()
    controller.say(reports(*range(10)))
    assert controller.places == [0, 1, 2, 3]
    controller.go_on()
    assert controller.places == list(range(8))
    controller.go_on()
    assert controller.places == list(range(10))
    assert controller.turns == []


def test_what_fits_into_a_turn_is_handled_in_it(flood: Callable[..., Flood]) -> None:
    controller = flood()
    controller.say(reports(*range(4)))
    assert controller.places == list(range(4))
    assert controller.turns == []


def test_what_comes_meanwhile_waits_behind_what_came_before(flood: Callable[..., Flood]) -> None:
    controller = flood()
    controller.say(reports(0, 1, 2, 3, 4, 5))
    controller.say(reports(6))
    half = CODEC.encode(report(7))
    controller.say(half[:30])
    assert controller.places == [0, 1, 2, 3]
    controller.go_on()
    assert controller.places == list(range(7))
    controller.say(half[30:])
    assert controller.places == list(range(8))


def test_the_answers_of_a_cut_turn_are_still_judged_as_if_each_came_alone(
    flood: Callable[..., Flood],
) -> None:
    controller = flood(path=ControllerPath.MOTION)
    for _ in range(6):
        assert controller.connection.send(Ping())
    reply = accepted(Ping())
    controller.say(CODEC.encode(reply) * 6)
    controller.go_on()
    pending = [event.pending for event in controller.seen if isinstance(event, ControllerReport)]
    assert pending == [5, 4, 3, 2, 1, 0]


def test_while_much_waits_no_more_is_read(flood: Callable[..., Flood]) -> None:
    controller = flood()
    many = READ_AHEAD // len(reports(0))
    controller.say(reports(*range(6)))
    controller.say(reports(*range(many)))
    controller.transport.pause_reading.assert_not_called()
    controller.say(reports(0))
    controller.transport.pause_reading.assert_called_once_with()
    while controller.turns:
        controller.go_on(after=0)
    assert len(controller.places) == 6 + many + 1
    controller.transport.resume_reading.assert_called_once_with()


def test_where_a_turn_ended_is_in_the_journal(flood: Callable[..., Flood]) -> None:
    controller = flood(journal=True)
    controller.say(reports(*range(6)))
    controller.go_on()
    asked = [line for line in map(json.loads, controller.lines) if "ask" in line]
    assert asked == [{"ask": "turn", "link": "state/4"}]


def swamped(controller: Flood, turns: int, apart: int) -> None:
    """Have it say more than can be handled, for so many turns."""
    for _ in range(turns):
        controller.say(reports(*range(6)), after=apart)
        controller.go_on(after=0)


def test_a_controller_that_is_behind_for_longer_than_feedback_may_be_old_is_given_up(
    flood: Callable[..., Flood],
) -> None:
    controller = flood()
    steps = ABORT_AGE // (5 * MS)
    swamped(controller, steps + 1, 5 * MS)  # from 5 ms on, so that the last is 250 ms behind it
    assert controller.problems == []
    controller.say(reports(*range(6)), after=5 * MS)
    text = "it says more than can be handled: messages have waited for 255 ms"
    assert controller.problems == [text]
    controller.transport.close.assert_called_once_with()
    assert controller.turns == []


def test_nothing_of_a_given_up_connection_is_handed_on(flood: Callable[..., Flood]) -> None:
    controller = flood()
    controller.say(reports(*range(20)))
    before = len(controller.seen)
    controller.connection.drop("a test")
    controller.go_on()
    assert len(controller.seen) == before


def test_bursts_with_rest_between_them_are_no_flood(flood: Callable[..., Flood]) -> None:
    controller = flood()
    swamped(controller, 100, 20 * MS)
    assert controller.problems == []


def test_a_turn_in_which_all_was_handled_makes_up_for_those_before(
    flood: Callable[..., Flood],
) -> None:
    controller = flood()
    for _ in range(100):
        swamped(controller, 5, 5 * MS)
        controller.say(reports(0), after=5 * MS)
    assert controller.problems == []


def test_a_new_connection_begins_with_nothing_that_waits(flood: Callable[..., Flood]) -> None:
    controller = flood()
    controller.say(reports(*range(6)))
    controller.connection.connection_lost(None)
    controller.connection.connection_made(controller.transport)
    controller.turns.clear()
    controller.say(reports(9))
    assert controller.places == [0, 1, 2, 3, 9]


def test_a_frame_out_of_bounds_behind_a_cut_turn_is_told_in_its_turn(
    flood: Callable[..., Flood],
) -> None:
    controller = flood()
    controller.say(reports(*range(6)) + (1 << 30).to_bytes(4, "little"))
    assert controller.problems == []
    controller.go_on()
    assert controller.places == list(range(6))
    assert len(controller.problems) == 1
    assert "1073741824" in controller.problems[0]


def test_a_controller_that_reads_nothing_is_given_up(flood: Callable[..., Flood]) -> None:
    controller = flood(journal=True)
    unread = controller.transport.get_write_buffer_size
    unread.return_value = UNREAD
    assert controller.connection.send(Ping())
    controller.transport.abort.assert_not_called()
    unread.return_value = UNREAD + 1
    controller.connection.send(Ping())
    controller.transport.abort.assert_called_once_with()
    assert not controller.connection.is_up
    assert '{"ask": "flooded", "link": "state"}\n' in controller.lines
