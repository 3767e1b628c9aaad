from __future__ import annotations

from dataclasses import replace

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import LIMITS
from rigs.cells.watched_motions import is_stop, moving, why

from openpendant.server.access.audit import AuditEntry, AuditEvent
from openpendant.server.cell.execution.motion_watch import StandstillWatch
from openpendant.server.events.effects import Effect, LogLine
from openpendant.simplemsg.pendant import Activity

MS = 1_000_000


def told(speed: float, seconds: float, period_ms: int = 10) -> list[tuple[int, float]]:
    watch = StandstillWatch(LIMITS)
    found = []
    for at in range(0, round(seconds * 1e3) + 1, period_ms):
        moved = watch.take((speed * at / 1e3, 0.0), at * MS)
        if moved is not None:
            found.append((at, round(moved.way, 6)))
    return found


@pytest.mark.parametrize(
    ("speed", "expected"), [(0.0, []), (0.0199, []), (0.021, [(960, 0.02016)]), (0.5, [(40, 0.02)])]
)
def test_two_hundredths_of_a_radian_within_a_second_are_a_motion(
    speed: float, expected: list[tuple[int, float]]
) -> None:
    assert told(speed, 3.0) == expected


def test_a_motion_is_told_once_and_the_next_after_a_second_of_rest() -> None:
    watch = StandstillWatch(LIMITS)
    places = [0.0] * 50 + [0.1] * 90 + [0.2] * 150 + [0.3] * 10
    when = [
        number
        for number, place in enumerate(places)
        if watch.take((place, 0.0), number * 10 * MS) is not None
    ]
    assert when == [50, 290]


def test_a_sliding_joint_moves_by_half_as_many_metres() -> None:
    watch = StandstillWatch(replace(LIMITS, prismatic=(False, True)))
    assert watch.take((0.0, 0.0), 0) is None
    assert watch.take((0.019, 0.0099), 10 * MS) is None
    moved = watch.take((0.019, 0.0101), 20 * MS)
    assert moved is not None
    assert (moved.joint, moved.unit) == (1, "m")


def test_it_begins_anew_where_the_robot_was_commanded_or_not_seen_meanwhile() -> None:
    watch = StandstillWatch(LIMITS)
    assert watch.take((0.0, 0.0), 0) is None
    watch.begin_anew()
    assert watch.take((1.0, 0.0), 10 * MS) is None


class LoggedCell(EmulatedCell):
    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        self.lines = getattr(self, "lines", [])
        self.lines += [item.text for item in outgoing if isinstance(item, LogLine)]
        return super().perform(outgoing)


def test_promise_52_a_robot_that_is_moved_at_rest_is_logged_and_told_and_not_stopped() -> None:
    cell = LoggedCell()
    noted: list[AuditEntry] = []
    cell.core._trail._record = noted.append
    cell.wait(500)
    assert why(cell)["remarks"] == []
    begins = cell.now
    cell.reported = lambda at, now: (at[0], at[1] + 0.1 * (now - begins) / 1e9, *at[2:])
    cell.wait(300)
    (line,) = cell.lines
    assert line == ("joint 2 moved by 0.0200 rad within 0.20 s without a command of this server")
    (entry,) = noted
    assert (entry.event, entry.detail["text"]) == (AuditEvent.MOVED_UNCOMMANDED, line)
    assert not any(map(is_stop, cell.sent))
    assert cell.core.cell.stop is None
    cell.wait(4_000)
    remarks = why(cell)["remarks"]
    assert isinstance(remarks, list)
    assert remarks[0].startswith("4 s ago joint 2 moved by 0.0200 rad")
    assert "controller's own pendant" in remarks[0]


def test_promise_52_what_a_robot_does_when_it_is_commanded_is_no_motion_without_a_command() -> None:
    it = moving(speed=1.0)
    it.wait(3_000)
    it.pendant.stop()
    it.wait(2_000)
    assert it.cell.core.cell.driving.uncommanded is None


def test_a_robot_that_is_moved_after_its_motion_has_ended_is_not_stopped() -> None:
    cell = LoggedCell()
    pendant = cell.holder()
    pendant.move(*(value + 0.05 for value in cell.position))
    cell.wait(3_000)
    assert cell.core.cell.activity is Activity.IDLE
    sent, begins = len(cell.sent), cell.now
    cell.reported = lambda at, now: (at[0], at[1] + 0.1 * (now - begins) / 1e9, *at[2:])
    cell.wait(1_000)
    assert len(cell.lines) == 1
    assert cell.core.cell.stop is None
    assert not any(map(is_stop, cell.sent[sent:]))


def test_the_next_motion_that_is_commanded_ends_the_tale() -> None:
    cell = LoggedCell()
    begins = cell.now
    cell.reported = lambda at, now: (at[0], at[1] + min(0.1 * (now - begins) / 1e9, 0.05), *at[2:])
    cell.wait(2_000)
    assert why(cell)["remarks"] != []
    begins = 0
    cell.reported = None
    cell.wait(1_500)
    pendant = cell.holder()
    pendant.move(*(value + 0.05 for value in cell.position))
    assert why(cell)["remarks"] == []
