"""The controller's own check of every point, and what the referee writes down."""

import itertools
import math
import struct
from collections.abc import Callable, Sequence

import pytest
from rigs.cells.controller_rig import (
    FAILURE,
    LIMITS,
    MS,
    SUCCESS,
    ControllerRig,
    float32,
    full_point,
    ratio_point,
)

from openpendant.controller_emulator.core.admission import Tolerances
from openpendant.controller_emulator.core.referee import Referee, Violation
from openpendant.controller_emulator.error_codes import ERROR_OF, ErrorCode, ViolationKind
from openpendant.controller_emulator.interpolation.servo import StartRule
from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import JointTrajPt, JointTrajPtFull, Malformed, MsgType, ValidField
from openpendant.simplemsg.errors import BodyFault

Point = JointTrajPt | JointTrajPtFull
STANDING = full_point(0, 0.0, (0.0, 0.0))


def next_float32(value: float) -> float:
    (bits,) = struct.unpack("<i", struct.pack("<f", value))
    (above,) = struct.unpack("<f", struct.pack("<i", bits + 1))
    return float(above)


def too_much(at: Callable[[float], tuple[float, float]]) -> dict[ViolationKind, Sequence[Point]]:
    """Return points of which the last is too much for the joint that `at` moves, its way."""
    none, half = at(0.0), at(0.5)
    return {
        ViolationKind.RANGE: [ratio_point(0, at(2.001), 5.0)],
        ViolationKind.VELOCITY: [STANDING, full_point(1, 1.0, half, at(2.001))],
        ViolationKind.POSITION_STEP: [ratio_point(0, at(2.0), 0.9)],
        ViolationKind.ACCELERATION: [
            full_point(0, 0.0, none, acceleration=none),
            full_point(1, 1.0, half, half, at(4.01)),
        ],
        ViolationKind.VELOCITY_STEP: [STANDING, full_point(1, 0.1, at(0.02), at(0.41))],
        ViolationKind.START_POSITION: [full_point(0, 0.0, at(0.011))],
        ViolationKind.START_VELOCITY: [full_point(0, 0.0, none, at(0.1))],
    }


VIOLATIONS: list[tuple[ViolationKind, Sequence[Point]]] = [
    *too_much(lambda value: (value, 0.0)).items(),
    *too_much(lambda value: (0.0, -value)).items(),
    (ViolationKind.NOT_FINITE, [ratio_point(0, (math.nan, 0.0), 1.0)]),
    (ViolationKind.SEQUENCE, [STANDING, full_point(2, 1.0, (0.1, 0.0))]),
    (ViolationKind.TIME, [STANDING, full_point(1, 0.0, (0.0, 0.1))]),
]


@pytest.mark.parametrize(("kind", "points"), VIOLATIONS)
def test_each_violation_is_refused_counted_and_shown_in_status(
    kind: ViolationKind, points: Sequence[Point], rig: ControllerRig
) -> None:
    *good, bad = points
    assert rig.stream(*good) == [SUCCESS] * len(good)
    assert rig.code(bad) == FAILURE
    assert rig.violations == {kind: 1}
    assert rig.status.in_error == 1
    assert rig.status.error_code == ERROR_OF[kind]
    rig.wait(2000)
    assert rig.position == (0.0, 0.0)


def test_every_violation_is_tried_and_has_an_error_code_of_its_own_or_its_family() -> None:
    assert set(ERROR_OF) == set(ViolationKind) == {kind for kind, _ in VIOLATIONS}
    assert ErrorCode.NONE not in ERROR_OF.values()


def test_a_bad_point_during_motion_stops_on_a_ramp(rig: ControllerRig) -> None:
    rig.stream(STANDING, full_point(1, 1.0, (0.5, 0.0), (1.0, 0.0)))
    rig.wait(900)
    speed = rig.velocity[0]
    assert rig.code(full_point(2, 2.0, (2.5, 0.0), (1.0, 0.0))) == FAILURE
    assert rig.velocity[0] == speed
    assert all(abs(state[2][0]) <= LIMITS.acceleration[0] for state in rig.states(500))
    assert rig.velocity == (0.0, 0.0)


def test_a_violation_carries_joint_value_limit_sequence_time_and_link(rig: ControllerRig) -> None:
    rig.wait(250)
    rig.code(ratio_point(0, (0.0, -2.5), 5.0), link=4)
    beyond = Violation(ViolationKind.RANGE, "elbow", -2.5, -2.0, 0, 0.25, 4)
    assert rig.controller.referee.kept == [beyond]


UNEVEN = JointLimits(("j",), (-0.1,), (0.1,), (0.7,), (1.1,), (False,))


@pytest.mark.parametrize(
    ("value", "code"),
    [
        (0.1, SUCCESS),
        (float32(0.1), SUCCESS),
        (-float32(0.1), SUCCESS),
        (next_float32(float32(0.1)), FAILURE),
        (-next_float32(float32(0.1)), FAILURE),
    ],
)
def test_a_bound_rounded_to_four_bytes_is_legal_and_the_next_not(value: float, code: int) -> None:
    rig = ControllerRig(limits=UNEVEN, start=(0.0,))
    assert float32(0.1) > 0.1
    assert rig.code(ratio_point(0, (value,), 2.0)) == code


@pytest.mark.parametrize(
    ("factor", "code"), [(1.0, SUCCESS), (1 + 1e-6, SUCCESS), (1 + 1e-5, FAILURE)]
)
def test_a_stated_velocity_may_exceed_its_limit_by_a_millionth(factor: float, code: int) -> None:
    rig = ControllerRig()
    rig.code(STANDING)
    assert rig.code(full_point(1, 1.0, (1.0, 0.0), (float32(2.0 * factor), 0.0))) == code


@pytest.mark.parametrize(("factor", "code"), [(1.0, SUCCESS), (1.0009, SUCCESS), (1.002, FAILURE)])
def test_velocity_over_time_may_exceed_the_acceleration_limit_by_a_thousandth(
    factor: float, code: int
) -> None:
    rig = ControllerRig()
    rig.code(STANDING)
    a = 4.0 * factor
    assert rig.code(full_point(1, 0.25, (a / 32, 0.0), (a / 4, 0.0))) == code


@pytest.mark.parametrize(("gap", "code"), [(0.0, 1), (0.0099, 1), (-0.0099, 1), (0.0101, 2)])
def test_a_first_point_must_be_near_the_robot(gap: float, code: int) -> None:
    assert ControllerRig().code(full_point(0, 0.0, (0.0, gap))) == code


def test_a_small_gap_to_the_first_point_is_closed_before_the_clock_starts() -> None:
    rig = ControllerRig()
    rig.stream(full_point(0, 0.0, (0.008, 0.0)), full_point(1, 1.0, (0.1, 0.0)))
    states = rig.states(1200)
    assert max(abs(state[2][0]) for state in states) <= LIMITS.acceleration[0]
    assert states[-1][0][0] == pytest.approx(0.1, abs=1e-7)


def test_a_single_point_that_cannot_be_a_point_of_rest_in_its_time_is_not_moved_to() -> None:
    # From rest to passing it at speed is possible, so it may be taken: a next one might have come.
    rig = ControllerRig(start_rule=StartRule(points=2, lead=0, wait=20 * MS, patience=0))
    assert rig.code(ratio_point(0, (0.4, 0.0), 0.5)) == SUCCESS
    rig.wait(1000)
    assert rig.position == (0.0, 0.0)
    assert rig.violations == {ViolationKind.VELOCITY_STEP: 1}
    assert rig.status.error_code == ErrorCode.ACCELERATION_LIMIT


def test_a_trajectory_cannot_start_behind_a_point_that_will_be_passed_at_speed() -> None:
    # Its velocity was left open, and is one at which the robot cannot stand: nothing came in time.
    rig = ControllerRig(start_rule=StartRule(points=3, lead=0, wait=MS, patience=MS))
    places = ((0.0, 0.0), (0.02, 0.1), (0.06, 0.1))
    rig.stream(*(ratio_point(n, (q, 0.0), time) for n, (q, time) in enumerate(places)))
    rig.wait(150)
    assert rig.code(ratio_point(0, (0.065, 0.0), 0.5)) == FAILURE
    assert rig.violations == {ViolationKind.START_VELOCITY: 1}


def test_positions_and_velocities_that_no_motion_can_join_are_refused(rig: ControllerRig) -> None:
    rig.code(STANDING)
    assert rig.code(full_point(1, 1.0, (1.5, 0.0), (0.0, 0.0))) == FAILURE
    (violation,) = rig.controller.referee.kept
    assert violation.kind is ViolationKind.VELOCITY_STEP
    # Half a radian short of a second at 2 rad/s: two ramps of a quarter second each.
    assert violation.value == pytest.approx(8.0, rel=1e-4)


@pytest.mark.parametrize(
    "bad",
    [
        ratio_point(0, (0.0, 0.0), math.inf),
        ratio_point(0, (0.0, 0.0), 1.0, velocity=math.nan),
        full_point(0, math.nan, (0.0, 0.0)),
        full_point(0, 1.0, (0.0, 0.0), (math.inf, 0.0)),
        full_point(0, 1.0, (0.0, 0.0), (0.0, 0.0), (0.0, -math.inf)),
        ratio_point(0, (0.0,) * 9 + (math.nan,), 1.0),
    ],
)
def test_no_number_of_a_point_may_be_infinite_or_none(bad: Point, rig: ControllerRig) -> None:
    assert rig.code(bad) == FAILURE
    assert rig.violations == {ViolationKind.NOT_FINITE: 1}


def test_finite_numbers_whose_sum_is_not_are_judged_by_the_range(rig: ControllerRig) -> None:
    assert rig.code(full_point(0, 0.0, (1e308, 1e308))) == FAILURE
    assert rig.violations == {ViolationKind.RANGE: 1}


def test_numbers_that_are_marked_invalid_are_not_looked_at(rig: ControllerRig) -> None:
    fields = ValidField.TIME | ValidField.POSITION
    point = full_point(0, 1.0, (0.1, 0.0), (math.nan, 99.0), valid_fields=fields)
    assert rig.code(point) == SUCCESS


@pytest.mark.parametrize("velocity", [-0.1, 1.1])
def test_a_speed_ratio_outside_0_to_1_is_refused(velocity: float, rig: ControllerRig) -> None:
    assert rig.code(ratio_point(0, (0.0, 0.0), 1.0, velocity=velocity)) == FAILURE
    assert rig.violations == {ViolationKind.VELOCITY: 1}


@pytest.mark.parametrize("time", [-1.0, 1e9])
def test_times_out_of_all_reason_are_refused(time: float) -> None:
    for point in (ratio_point(0, (0.0, 0.0), time), full_point(0, time, (0.0, 0.0))):
        rig = ControllerRig()
        assert rig.code(point) == FAILURE
        assert rig.violations == {ViolationKind.TIME: 1}


@pytest.mark.parametrize(
    "point",
    [
        full_point(0, 0.0, (0.0, 0.0), robot_id=1),
        full_point(0, 0.0, (0.0, 0.0), valid_fields=ValidField.POSITION),
        full_point(0, 0.0, (0.0, 0.0), valid_fields=ValidField.TIME),
    ],
)
def test_a_point_of_another_group_or_without_time_or_position_is_unusable(point: Point) -> None:
    rig = ControllerRig()
    assert rig.code(point) == FAILURE
    assert rig.status.error_code == ErrorCode.POINT_UNUSABLE
    assert not rig.violations


def test_values_beyond_the_robots_joints_are_only_worth_a_warning(rig: ControllerRig) -> None:
    assert rig.code(ratio_point(0, (0.0, 0.0, 7.0), 1.0)) == SUCCESS
    assert rig.controller.referee.events["stray-joint-values"] == 1


def test_a_malformed_point_is_refused_and_the_motion_goes_on(rig: ControllerRig) -> None:
    rig.stream(STANDING, full_point(1, 1.0, (0.5, 0.0)))
    rig.wait(100)
    fault = BodyFault("short", MsgType.JOINT_TRAJ_PT, 2, 0)
    assert rig.code(Malformed(MsgType.JOINT_TRAJ_PT, 2, fault)) == FAILURE
    rig.wait(900)
    assert rig.position == (0.5, 0.0)


def test_the_referee_stores_the_first_and_counts_them_all() -> None:
    referee = Referee(keep=2)
    for n in range(5):
        referee.note(Violation(ViolationKind.NOT_FINITE, "j", math.nan, 0.0, n, 0.0, 1))
    assert referee.as_dict()["violations"] == 5
    assert [violation.sequence for violation in referee.kept] == [0, 1]
    assert referee.kept[0].as_dict()["value"] == "nan"
    assert "and 3 more" in str(referee)


def test_the_tolerances_are_the_promised_ones() -> None:
    tolerances = Tolerances()
    assert (tolerances.velocity, tolerances.acceleration) == (1e-6, 1e-3)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("place", "code"), [(1.88, SUCCESS), (1.885, FAILURE)])
def test_a_joint_must_be_able_to_stop_before_the_end_of_its_range(
    side: float, place: float, code: int
) -> None:
    """At 1 rad/s and 4.2 rad/s², 5 % above its limit, it needs 0.119 rad of the way to 2 rad."""
    rig = ControllerRig()
    rig.stream(STANDING, full_point(1, 2.0, (side * 1.5, 0.0), (side * 1.0, 0.0)))
    there = full_point(2, 2.0 + place - 1.5, (side * place, 0.0), (side * 1.0, 0.0))
    assert rig.code(there) == code
    assert rig.violations == ({} if code == SUCCESS else {ViolationKind.RANGE: 1})


def test_a_gap_to_the_first_point_is_closed_by_a_motion_and_by_no_jump(rig: ControllerRig) -> None:
    assert rig.code(full_point(0, 0.0, (0.008, 0.0))) == SUCCESS
    places = [0.0, *(state[0][0] for state in rig.states(300))]
    assert places[-1] == pytest.approx(0.008, abs=1e-6)
    steps = [after - before for before, after in itertools.pairwise(places)]
    # From rest and back to rest at no more than the limit: the speed never exceeds √(a·d).
    assert max(steps) <= (LIMITS.acceleration[0] * 0.008) ** 0.5 * 1e-3
