"""When a robot counts as standing: by speeds, by places where speeds are noise, and since when."""

import math
import random
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import pytest
from rigs.cells.controller_reports import joint_report, status
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import expect, known
from rigs.cells.server_rig import LIMITS, MS
from rigs.cells.watched_motions import is_stop, moving, why
from rigs.peers.server_clients import Pendant

from openpendant.motion.trajectory.time_scaling import RAMP
from openpendant.server.access.audit import AuditEntry, AuditEvent
from openpendant.server.cell.execution.feedback import Feedback
from openpendant.server.cell.execution.motion_watch import StandstillWatch
from openpendant.server.settings.cell_settings import ControllerLink, ControllerPath
from openpendant.simplemsg import (
    JointFeedback,
    JointPosition,
    Received,
    Status,
    TriState,
    ValidField,
    joint_array,
)
from openpendant.simplemsg.pendant import Activity, AuthorityBeat
from openpendant.simplemsg.pendant import MotionControlAction as Action
from openpendant.simplemsg.verdicts import VerdictCode as V


def take(
    feedback: Feedback, at: int, position: Sequence[float], velocity: Sequence[float] = (0.0, 0.0)
) -> None:
    """Report joints at a time [ms]."""
    feedback.take(joint_report(position, velocity), at * MS)


def keep(feedback: Feedback, times: range, place: Sequence[float] = (0.0, 0.0)) -> None:
    """Report one place and noisy speeds at some times [ms]."""
    for at in times:
        take(feedback, at, place, (0.04, 0.04))


@pytest.fixture
def feedback() -> Feedback:
    return Feedback(2, ControllerLink())


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize(("speed", "stands"), [(0.0009, True), (0.0011, False), (0.3, False)])
def test_each_joint_must_be_slower_than_a_thousandth(
    feedback: Feedback, joint: int, sign: float, speed: float, stands: bool
) -> None:
    velocity = [0.0, 0.0]
    velocity[joint] = sign * speed
    take(feedback, 0, (0.0, 0.0), velocity)
    assert (feedback.is_standing, feedback.joints_rest) == (stands, stands)


def test_two_joints_that_stand_each_by_itself_stand() -> None:
    feedback = Feedback(2, ControllerLink())
    take(feedback, 0, (0.0, 0.0), (0.0009, 0.0009))  # together farther than a thousandth
    assert feedback.is_standing


def test_speeds_that_nobody_knows_tell_nothing(feedback: Feedback) -> None:
    feedback.take(JointPosition(0, joint_array((0.0, 0.0))), 0)
    assert not feedback.velocity_known
    assert not feedback.joints_rest
    assert not feedback.has_come_to_rest(-1)


@pytest.mark.parametrize(("moving", "stands"), [(1, False), (0, True), (-1, True)])
def test_a_controller_that_calls_itself_moving_moves(
    feedback: Feedback, moving: int, stands: bool
) -> None:
    take(feedback, 0, (0.0, 0.0))
    feedback.take(status(moving=moving), 0)
    assert feedback.is_standing is stands
    assert feedback.has_come_to_rest(-1) is stands
    assert feedback.joints_rest


class TestNoisySpeeds:
    """Below 0.05 rad/s the places decide: no joint farther than 0.0002 rad in 200 ms."""

    @pytest.mark.parametrize(("ms", "rests"), [(190, False), (200, True), (500, True)])
    def test_a_joint_rests_that_kept_its_place_for_200_ms(
        self, feedback: Feedback, ms: int, rests: bool
    ) -> None:
        for at in range(0, ms + 10, 10):
            take(feedback, at, (0.0, 0.00019 * (at % 20 == 0)), (0.04, -0.04))
        assert feedback.joints_rest is rests

    @pytest.mark.parametrize("joint", [0, 1])
    @pytest.mark.parametrize("way", [0.00021, -0.00021])
    def test_a_joint_that_left_its_place_begins_anew(
        self, feedback: Feedback, joint: int, way: float
    ) -> None:
        place = [0.0, 0.0]
        place[joint] = way
        keep(feedback, range(0, 200, 10))
        take(feedback, 200, place, (0.04, 0.04))
        assert not feedback.joints_rest
        keep(feedback, range(210, 400, 10), place)
        assert not feedback.joints_rest
        take(feedback, 400, place, (0.04, 0.04))
        assert feedback.joints_rest

    def test_two_joints_that_keep_their_places_each_by_itself_rest(
        self, feedback: Feedback
    ) -> None:
        for at in range(0, 210, 10):
            moved = 0.00019 * (at % 20 == 0)  # together farther than 0.0002
            take(feedback, at, (moved, moved), (0.04, 0.04))
        assert feedback.joints_rest

    def test_a_joint_that_creeps_never_rests(self, feedback: Feedback) -> None:
        for at in range(0, 3_000, 10):
            take(feedback, at, (0.0, 2e-5 * at / 10), (0.002, 0.002))
            assert not feedback.joints_rest

    @pytest.mark.parametrize(("speed", "rests"), [(0.049, True), (0.051, False), (-0.051, False)])
    def test_a_speed_from_0_05_on_is_none_that_noise_explains(
        self, feedback: Feedback, speed: float, rests: bool
    ) -> None:
        for at in range(0, 310, 10):
            take(feedback, at, (0.0, 0.0), (0.0, speed))
        assert feedback.joints_rest is rests

    def test_after_a_stop_its_places_count_from_then_on(self, feedback: Feedback) -> None:
        keep(feedback, range(0, 500, 10))
        assert not feedback.has_come_to_rest(400 * MS)
        keep(feedback, range(500, 610, 10))
        assert feedback.has_come_to_rest(400 * MS)

    def test_nothing_of_before_a_lost_connection_counts(self, feedback: Feedback) -> None:
        keep(feedback, range(0, 300, 10))
        feedback.forget()
        take(feedback, 300, (0.0, 0.0), (0.04, 0.04))
        assert not feedback.joints_rest


def test_a_stop_ends_only_by_a_report_from_after_it(feedback: Feedback) -> None:
    take(feedback, 100, (0.0, 0.0))
    assert not feedback.has_come_to_rest(100 * MS)
    take(feedback, 101, (0.0, 0.0))
    assert feedback.has_come_to_rest(100 * MS)


def test_a_motion_ends_only_by_a_report_from_its_end_on(feedback: Feedback) -> None:
    take(feedback, 99, (0.0, 0.0))
    assert not feedback.stands_after(100 * MS, 300 * MS)
    take(feedback, 100, (0.0, 0.0))
    assert feedback.stands_after(100 * MS, 300 * MS)


@pytest.mark.parametrize("value", [math.nan, math.inf, 1001.0])
def test_a_speed_that_no_joint_has_is_worked_out_from_places(
    feedback: Feedback, value: float
) -> None:
    take(feedback, 0, (0.0, 0.0))
    take(feedback, 10, (0.0, 0.01), (0.0, value))
    assert feedback.velocity == pytest.approx((0.0, 1.0))
    assert not feedback.is_standing


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
    moved = known(watch.take((0.019, 0.0101), 20 * MS))
    assert (moved.joint, moved.unit) == (1, "m")


def test_it_begins_anew_where_the_robot_was_commanded_or_not_seen_meanwhile() -> None:
    watch = StandstillWatch(LIMITS)
    assert watch.take((0.0, 0.0), 0) is None
    watch.begin_anew()
    assert watch.take((1.0, 0.0), 10 * MS) is None


def test_promise_52_a_robot_that_is_moved_at_rest_is_logged_and_told_and_not_stopped() -> None:
    cell = EmulatedCell()
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
    remarks = expect(list, why(cell)["remarks"])
    assert remarks[0].startswith("4 s ago Lower-Arm moved by 0.0200 rad")
    assert "controller's own pendant" in remarks[0]


def test_promise_52_what_a_robot_does_when_it_is_commanded_is_no_motion_without_a_command() -> None:
    it = moving(speed=1.0)
    it.wait(3_000)
    it.pendant.stop()
    it.wait(2_000)
    assert it.cell.core.cell.driving.uncommanded is None


def test_a_robot_that_is_moved_after_its_motion_has_ended_is_not_stopped() -> None:
    cell = EmulatedCell()
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
    cell = EmulatedCell()
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


LEAD_NS = round(ControllerLink().lead * 1e9)
SHOWN_NS = round((RAMP + 0.2) * 1e9)
"""From the pause to its ramp's end, and from there until it shows, where the limits allow it."""


class ShiveringCell(EmulatedCell):
    def __init__(
        self, *, speed_noise: float = 0.0, place_noise: float = 0.0, has_speeds: bool = True
    ) -> None:
        self.chance = random.Random(5)
        self.speed_noise, self.place_noise, self.has_speeds = speed_noise, place_noise, has_speeds
        super().__init__()

    def noisy(self, values: tuple[float, ...], noise: float) -> tuple[float, ...]:
        return joint_array([value + self.chance.uniform(-noise, noise) for value in values[:6]])

    def _hear(self, path: ControllerPath, received: Received) -> None:
        match received:
            case JointFeedback() if not self.has_speeds:
                received = replace(received, valid_fields=ValidField.POSITION)
            case JointFeedback():
                speeds = self.noisy(received.velocities, self.speed_noise)
                received = replace(received, velocities=speeds)
            case Status():
                # One that tells nothing of motion leaves it to its joints.
                received = replace(received, in_motion=TriState.UNKNOWN)
        if isinstance(received, JointFeedback):
            places = self.noisy(received.positions, self.place_noise)
            received = replace(received, positions=places)
        if not isinstance(received, JointPosition):
            super()._hear(path, received)

    def activity(self) -> Activity:
        return self.core.cell.activity

    def until_shown(self) -> int | None:
        """Return how long after the joints rested PAUSED showed [ns]; None after 3 s."""
        rested = None
        for _ in range(600):
            self.wait(5)
            if rested is None and not any(self.controller.motion(self.now)[1]):
                rested = self.now
            if self.activity() is Activity.PAUSED:
                return max(self.now - (rested or self.now), 0)
        return None


NOISES: dict[str, dict[str, Any]] = {
    "exact": {},
    "noisy speeds": {"speed_noise": 0.04},
    "no speeds": {"has_speeds": False},
    "noisy places and no speeds": {"has_speeds": False, "place_noise": 5e-5},
}


def paused(cell: ShiveringCell, after: int) -> Pendant:
    cell.wait(300)
    pendant = cell.holder()
    assert pendant.move(*(value + 0.8 for value in cell.position), speed=0.3) is V.ACCEPTED
    cell.wait(after)
    assert cell.activity() is Activity.MOVING
    pendant.send(AuthorityBeat())
    assert pendant.control(Action.PAUSE) is V.ACCEPTED
    assert cell.activity() is Activity.PAUSING
    return pendant


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("after", [60, 230, 500])
def test_a_pause_shows_within_0_2_s_of_rest(noise: str, after: int) -> None:
    cell = ShiveringCell(**NOISES[noise])
    paused(cell, after)
    began = cell.now
    late = known(cell.until_shown())
    assert late <= 200 * MS
    # What had left ahead of the robot runs first, then the ramp.
    assert cell.now - began <= LEAD_NS + SHOWN_NS + 50 * MS


def test_a_robot_that_shivers_for_ever_is_paused_all_the_same() -> None:
    cell = ShiveringCell()
    paused(cell, 300)
    cell.speed_noise, cell.place_noise = 0.5, 9e-4
    late = known(cell.until_shown())
    assert late <= 1_000 * MS


def test_with_noisy_speeds_a_paused_motion_goes_on_arrives_and_stops() -> None:
    cell = ShiveringCell(speed_noise=0.04)
    pendant = paused(cell, 300)
    assert cell.until_shown() is not None
    assert pendant.control(Action.RESUME) is V.ACCEPTED
    for _ in range(20):
        cell.wait(100)
        pendant.send(AuthorityBeat())
    assert [code for _, code in pendant.outcomes()] == [V.ACCEPTED]
    assert pendant.move(*(value - 0.8 for value in cell.position)) is V.ACCEPTED
    cell.wait(200)
    pendant.stop()
    assert cell.activity() is Activity.STOPPING
    cell.wait(600)
    assert cell.activity() is Activity.IDLE
    assert not any(cell.controller.motion(cell.now)[1])
