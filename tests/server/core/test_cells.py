from collections.abc import Sequence
from typing import Any, NamedTuple
from unittest.mock import Mock

import pytest
from rigs.cells.expectations import only
from rigs.cells.server_rig import LIMITS, MS, NoTool, worked_out
from rigs.peers.server_clients import hello

from openpendant.server.core.cell_core import CellCore
from openpendant.server.core.server_core import ServerCore
from openpendant.server.endpoints.pendant.access_requests import Identity
from openpendant.server.events.effects import Close, Effect, Send, SendStop
from openpendant.server.events.events import (
    TICK,
    ClientEvent,
    Closed,
    Opened,
    Port,
    Received,
    ShutDown,
)
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.watchdog import watchdog_main
from openpendant.simplemsg import Message, Ping
from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSION,
    Hello,
    HelloReply,
    SoftwareStop,
    StopChanged,
    StopKind,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

NOW = 1_000 * MS
GUEST = 7


def core(name: str) -> CellCore:
    identity = Identity(name, "two-joints", "openpendant test")
    return CellCore(make_settings({"name": name}, "test"), LIMITS, identity, NoTool())


class Handled(NamedTuple):
    cell: int
    outgoing: list[Effect]


class Room:
    def __init__(self, names: Sequence[str]) -> None:
        self.failed: list[Effect] = []
        self._server = ServerCore([core(name) for name in names])
        self.cores = self._server.cores

    def handle(self, event: ClientEvent, cell: int | None = None) -> Handled:
        number, out = 0, []
        for number, each in self._server.route(event, cell):
            out += worked_out(self.cores[number].handle(each, NOW))
        return Handled(number, out)

    @property
    def is_moving(self) -> bool:
        return self._server.is_moving


def room(*names: str) -> Room:
    cells = Room(names)
    cells.handle(Opened(GUEST, Port.PENDANT, "127.0.0.1"))
    return cells


def asking_for(cell: str, version: int = PROTOCOL_VERSION) -> Hello:
    return Hello(version, 0.0, cell, "tester")


def sent(outgoing: list[Effect]) -> list[Message]:
    return [item.message for item in outgoing if isinstance(item, Send)]


def refusal(outgoing: list[Effect]) -> Verdict:
    answer = only(Verdict, sent(outgoing))
    assert any(item.session == GUEST for item in outgoing if isinstance(item, Close))
    return answer


@pytest.mark.parametrize(("name", "number"), [("left", 0), ("middle", 1), ("right", 2)])
def test_hello_leads_to_the_cell_that_it_names(name: str, number: int) -> None:
    cells = room("left", "middle", "right")
    routed = cells.handle(Received(GUEST, asking_for(name)))
    answer = only(HelloReply, sent(routed.outgoing))
    assert (routed.cell, answer.cell) == (number, name)


def test_what_follows_hello_reaches_that_cell_and_no_other() -> None:
    cells = room("left", "right")
    cells.handle(Received(GUEST, asking_for("right")))
    routed = cells.handle(Received(GUEST, SoftwareStop(1, "enough")))
    assert routed.cell == 1
    assert [core.cell.stop is not None for core in cells.cores] == [False, True]


def test_a_second_hello_does_not_lead_to_another_cell() -> None:
    cells = room("left", "right")
    cells.handle(Received(GUEST, asking_for("right")))
    routed = cells.handle(Received(GUEST, asking_for("left")))
    answer = only(Verdict, sent(routed.outgoing))
    assert (routed.cell, answer.code) == (1, V.BAD_ARGUMENT)


def test_the_only_cell_needs_no_name() -> None:
    only(HelloReply, sent(room("cell").handle(Received(GUEST, hello("tester", 0.0))).outgoing))


@pytest.mark.parametrize("name", ["", "nowhere"])
def test_no_name_or_an_unknown_one_is_refused_with_the_names_there_are(name: str) -> None:
    answer = refusal(room("left", "right").handle(Received(GUEST, asking_for(name))).outgoing)
    assert answer.code == V.UNKNOWN_CELL
    assert "left, right" in answer.text


def test_the_refusal_of_a_large_room_lists_some_names_and_counts_the_rest() -> None:
    cells = room(*(f"robot {number}" for number in range(1, 31)))
    answer = refusal(cells.handle(Received(GUEST, asking_for("nowhere"))).outgoing)
    assert "robot 1, robot 2, " in answer.text
    assert answer.text.endswith(" more")


def test_a_refused_guest_is_heard_no_more() -> None:
    cells = room("left", "right")
    cells.handle(Received(GUEST, asking_for("nowhere")))
    assert cells.handle(Received(GUEST, asking_for("left"))).outgoing == []
    assert cells.handle(Closed(GUEST)).outgoing == []


def test_before_hello_a_ping_is_answered_and_a_request_refused() -> None:
    cells = room("left", "right")
    only(Ping, sent(cells.handle(Received(GUEST, Ping())).outgoing))
    refused = cells.handle(Received(GUEST, SoftwareStop(1, "enough"))).outgoing
    assert only(Verdict, sent(refused)).code == V.HELLO_FIRST


def test_another_version_is_refused_before_the_cell_is_looked_for() -> None:
    cells = room("left", "right")
    answer = refusal(cells.handle(Received(GUEST, asking_for("nowhere", 99))).outgoing)
    assert answer.code == V.VERSION


def test_a_connection_that_says_no_hello_is_closed_in_time() -> None:
    cells = room("left", "right")
    first, second = (core.handle(TICK, NOW + 2_001 * MS) for core in cells.cores)
    assert (first, second) == ([Close(GUEST, "no hello in time")], [])


def test_a_guest_that_went_on_counts_nowhere_else() -> None:
    cells = room("left", "right")
    cells.handle(Received(GUEST, asking_for("right")))
    late = NOW + 2_001 * MS
    assert [core.handle(TICK, late) for core in cells.cores] == [[], []]


def test_a_ros_connection_belongs_to_the_cell_whose_port_it_is() -> None:
    cells = room("left", "right")
    assert cells.handle(Opened(8, Port.ROS_MOTION, "127.0.0.1"), cell=1).cell == 1
    assert cells.handle(Closed(8)).cell == 1


# A fault of the server in one cell.


@pytest.fixture
def faulted() -> Room:
    """Two cells, of which the first failed with a guest in it."""
    cells = room("left", "right")
    cells.handle(Received(GUEST, asking_for("left")))
    cells.failed = cells.cores[0].fail("ValueError: boom", NOW)
    return cells


def test_a_fault_stops_the_robot_first_and_parts_with_every_pendant(faulted: Room) -> None:
    out = faulted.failed
    assert isinstance(out[0], SendStop)
    assert only(StopChanged, sent(out)).stop == StopKind.PROTECTIVE
    assert isinstance(out[-1], Close)
    assert "boom" in out[-1].reason


def test_a_faulted_cell_says_nothing_more_and_welcomes_nobody(faulted: Room) -> None:
    assert faulted.cores[0].fail("again", NOW) == []
    assert faulted.cores[0].handle(TICK, NOW + 10 * MS) == []
    faulted.handle(Closed(GUEST))
    faulted.handle(Opened(GUEST, Port.PENDANT, "127.0.0.1"))
    answer = refusal(faulted.handle(Received(GUEST, asking_for("left"))).outgoing)
    assert answer.code == V.CELL_FAULTED


def test_the_other_cells_go_on_beside_a_faulted_one(faulted: Room) -> None:
    faulted.handle(Opened(8, Port.PENDANT, "127.0.0.1"))
    routed = faulted.handle(Received(8, asking_for("right")))
    assert routed.cell == 1
    assert isinstance(sent(routed.outgoing)[0], HelloReply)


def test_a_faulted_cell_does_not_hold_up_the_end_of_the_server(faulted: Room) -> None:
    assert not faulted.is_moving
    assert faulted.cores[0].handle(ShutDown(), NOW) == []


def stopped(cells: int, monkeypatch: pytest.MonkeyPatch) -> tuple[list[int], list[int]]:
    """Have the watchdog stop cells; return how often it stopped each, and what it told."""
    told: list[int] = []
    monkeypatch.setattr(watchdog_main, "_tell", told.append)
    process: Any = watchdog_main._Child.__new__(watchdog_main._Child)
    process._connections, process._say = [Mock() for _ in range(4)], Mock()
    process._stop(cells, "no beat", 0)
    return [each.stop.call_count for each in process._connections], told


@pytest.mark.parametrize(
    ("cells", "stops"),
    [
        (0b0001, [1, 0, 0, 0]),
        (0b0010, [0, 1, 0, 0]),
        (0b1010, [0, 1, 0, 1]),
        (0b1111, [1] * 4),
        (0, [0] * 4),
    ],
)
def test_each_cell_that_may_move_is_stopped_and_told_and_no_other(
    cells: int, stops: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert stopped(cells, monkeypatch) == (stops, [cells] if cells else [])
