"""Each rule of the limit certificate alone: samples that break just this one, or just keep it.

The samples are written down, 0.1 s apart, so every bound can be worked out by hand: a joint may
change its velocity by 0.4 rad/s from sample to sample, and be 0.01 rad beside its mean velocity.
Then planned motions, with a fault planted in each.
"""

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.motion.refusals import Refusal, refusals
from rigs.motion.three_joints import GOAL, START, THREE

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import BadArgument, CertificateRefused, WrongJointCount
from openpendant.motion.pose import Array
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import Certificate, certify
from openpendant.motion.trajectory.joint_curves import JointSpline
from openpendant.motion.trajectory.point_speed import ToolSpeedLimit
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import Trajectory

LIMITS = JointLimits(
    names=("base", "arm"),
    lower=(-9.0, -1.0),
    upper=(9.0, 2.0),
    velocity=(9.0, 0.8),
    acceleration=(90.0, 4.0),
    prismatic=(False, False),
)
H = 0.1

SPEEDS = (0.0, 0.4, 0.8, 0.8, 0.4, 0.0)
WAY = (0.0, 0.02, 0.08, 0.16, 0.22, 0.24)
GAINS = (4.0, 4.0, 0.0, -4.0, -4.0, 0.0)
STILL = (0.0,) * 6


def moved(
    position: Sequence[float], velocity: Sequence[float], acceleration: Sequence[float] = STILL
) -> Trajectory:
    """Return the samples of a motion of the arm, its base at rest."""
    base: Array = np.zeros(len(position))
    columns = [np.column_stack((base, values)) for values in (position, velocity, acceleration)]
    times: Array = np.array([H * place for place in range(len(position))])
    return Trajectory(times, columns[0], columns[1], columns[2], times[[0, -1]].copy())


def refused(
    trajectory: Trajectory, limits: JointLimits = LIMITS, **given: Any
) -> tuple[str, str, float, float]:
    """Return check, joint, value and limit of the refusal."""
    with pytest.raises(CertificateRefused) as refusal:
        certify(trajectory, limits, **given)
    error = refusal.value
    return error.check, error.joint, round(error.value, 9), round(error.limit, 9)


def with_value(values: Sequence[float], place: int, value: float) -> list[float]:
    changed = list(values)
    changed[place] = value
    return changed


def test_a_motion_on_its_limits_is_certified_with_how_near_it_comes() -> None:
    found = certify(moved(WAY, SPEEDS, GAINS), LIMITS)
    extremes = (found.velocity, found.acceleration, found.mean_velocity)
    for extreme, time in zip(extremes, (0.2, 0.0, 0.3), strict=True):
        assert extreme.joint == "arm"
        assert (extreme.ratio, extreme.time) == pytest.approx((1.0, time))
    assert found.mean_acceleration.ratio == pytest.approx(1.0)
    assert found.second_difference.ratio == pytest.approx(1.0)
    assert found.consistency.ratio == pytest.approx(0.0, abs=1e-9)
    assert found.drift.ratio == pytest.approx(0.0, abs=1e-9)
    assert found.position_margin == pytest.approx(1.0)
    assert found.position_joint == "arm"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_velocity_alone(side: float) -> None:
    speeds = with_value(SPEEDS, 2, 0.8 * (1.0 + 1.1e-6))
    motion = moved(np.multiply(side, WAY).tolist(), np.multiply(side, speeds).tolist(), GAINS)
    assert refused(motion) == ("velocity", "arm", 0.80000088, 0.8)
    certify(moved(WAY, with_value(SPEEDS, 2, 0.8 * (1.0 + 9e-7)), GAINS), LIMITS)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_acceleration_alone(side: float) -> None:
    motion = moved(WAY, SPEEDS, with_value(GAINS, 2, side * 4.005))
    assert refused(motion) == ("acceleration", "arm", 4.005, 4.0)
    certify(moved(WAY, SPEEDS, with_value(GAINS, 2, side * 4.0039)), LIMITS)


BETWEEN_SAMPLES = {
    # Positions that go on faster than any velocity says: by 0.0002 rad between two samples.
    "mean velocity": ((0.0, 0.02, 0.08, 0.1602, 0.2202, 0.2402), SPEEDS, GAINS, 0.802, 0.8),
    "mean acceleration": (
        (0.0, 0.015, 0.0655, 0.1365, 0.1895, 0.207),
        *((0.0, 0.3, 0.71, 0.71, 0.35, 0.0), STILL, 4.1, 4.0),
    ),
    # A sample on the way a millimetre behind: back where it should be with the next.
    "second difference": (with_value(WAY, 1, 0.019), SPEEDS, GAINS, 4.2, 4.0),
}


@pytest.mark.parametrize("check", BETWEEN_SAMPLES)
def test_a_bound_between_samples_alone(check: str) -> None:
    way, speeds, gains, value, limit = BETWEEN_SAMPLES[check]
    assert refused(moved(way, speeds, gains)) == (check, "arm", value, limit)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_jump_alone(side: float) -> None:
    """A robot at rest by its velocities, which is elsewhere from one sample on."""
    way = [0.0, 0.0, 0.0, side * 0.0101, side * 0.0101, side * 0.0101]
    assert refused(moved(way, STILL)) == ("consistency", "arm", 0.0101, 0.01)
    certify(moved([value * 0.99 for value in way], STILL), LIMITS)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_drift_alone(side: float) -> None:
    """A robot at rest by its velocities that creeps, in each interval by less than a jump."""
    way = [side * 0.0099 * place for place in range(6)]
    check, joint, value, limit = refused(moved(way, STILL))
    assert (check, joint, value, limit) == ("drift", "arm", round(side * 0.0495, 9), 0.04)
    certify(moved(way[:5], STILL[:5], STILL[:5]), LIMITS)


def test_a_drift_that_the_variation_of_the_acceleration_explains_is_none() -> None:
    way = [0.0099 * place for place in range(6)]
    certify(moved(way, STILL, (4.0, -4.0, 4.0, -4.0, 4.0, -4.0)), LIMITS)


@pytest.mark.parametrize(
    ("shift", "value", "limit"), [(2.0 - 0.23, 2.01, 2.0), (-1.0 - 0.01, -1.01, -1.0)]
)
def test_a_position_alone(shift: float, value: float, limit: float) -> None:
    way = [shift + value for value in WAY]
    assert refused(moved(way, SPEEDS, GAINS)) == ("position", "arm", value, limit)


@pytest.mark.parametrize("place", [0, -1])
def test_rest_at_both_ends_alone(place: int) -> None:
    motion = moved(WAY, with_value(SPEEDS, place, 1e-9), GAINS)
    assert refused(motion) == ("rest", "arm", 1e-9, 0.0)
    if place == 0:
        certify(motion, LIMITS, start_velocity=[0.0, 1e-9])


@pytest.mark.parametrize("off", [0.0101, -0.0101])
def test_the_start_alone(off: float) -> None:
    found = refused(moved(WAY, SPEEDS, GAINS), start=[0.0, off])
    assert found == ("start", "arm", 0.0101, 0.01)
    assert certify(moved(WAY, SPEEDS, GAINS), LIMITS, start=[0.0, 0.009]).start_distance == 0.009


@pytest.mark.parametrize(
    "times",
    [
        (0.1, 0.2, 0.3, 0.4, 0.5, 0.6),
        (0.0, 0.1, 0.2, 0.300001, 0.4, 0.5),
        (0.0, -0.1, -0.2, -0.3, -0.4, -0.5),
    ],
)
def test_time_alone(times: tuple[float, ...]) -> None:
    motion = replace(moved(WAY, SPEEDS, GAINS), times=np.array(times))
    assert refused(motion)[0] == "time"


def slow(point: Callable[[Array], Array], limit: float = 0.25) -> ToolSpeedLimit:
    return ToolSpeedLimit("tool", point, limit)


def along(joints: Array) -> Array:
    """A point that goes one metre along x with one radian of the arm."""
    return np.column_stack((joints[:, 1], 0.0 * joints[:, 0], 0.0 * joints[:, 0]))


def slanting(joints: Array) -> Array:
    """A point that goes one metre along x and one along z with one radian of the arm."""
    return np.column_stack((joints[:, 1], 0.0 * joints[:, 0], joints[:, 1]))


def standing(joints: Array) -> Array:
    return np.zeros((len(joints), 3))


FAST_AT_ONE_SAMPLE = moved((0.0, 0.01, 0.033, 0.056, 0.066), (0.0, 0.2, 0.26, 0.2, 0.0), STILL[:5])
"""At 0.26 m/s at a sample, and on no way between two faster than 0.23."""

EVENLY = (0.0, 0.25, 0.25, 0.25, 0.0)
FAST_ON_ONE_WAY = moved((0.0, 0.0125, 0.0385, 0.0635, 0.076), EVENLY, STILL[:5])
"""At 0.25 m/s at the samples, and at 0.26 on the way between the second and the third."""

SLOW = moved((0.0, 0.0125, 0.0375, 0.0625, 0.075), EVENLY, STILL[:5])
"""At 0.25 m/s at most."""


ELBOW = ToolSpeedLimit("elbow", along, 0.2)


@pytest.mark.parametrize(
    ("motion", "points", "refusal"),
    [
        (FAST_AT_ONE_SAMPLE, [slow(along)], ("the tool", 0.26, 0.25)),
        (FAST_ON_ONE_WAY, [slow(along)], ("the tool", 0.26, 0.25)),
        (SLOW, [slow(slanting)], ("the tool", 0.353553391, 0.25)),
        (SLOW, [slow(standing), ELBOW], ("the elbow", 0.25, 0.2)),
        (SLOW, [ELBOW, slow(standing)], ("the elbow", 0.25, 0.2)),
    ],
    ids=["at a sample", "between two samples", "of all axes", "of the last", "of the first"],
)
def test_the_speed_of_a_point_alone(
    motion: Trajectory, points: list[ToolSpeedLimit], refusal: tuple[str, float, float]
) -> None:
    assert refused(motion, tool_speed=points) == ("tool speed", *refusal)


def test_a_tool_on_its_limit_is_certified() -> None:
    found: Certificate = certify(SLOW, LIMITS, tool_speed=[slow(along)])
    (point,) = found.tool_speed
    assert (point.point, point.limit) == ("tool", 0.25)
    assert point.ratio == pytest.approx(1.0)


@pytest.mark.parametrize(("tolerated", "is_refused"), [(5e-7, False), (1e-5, True)])
def test_the_tools_limit_is_kept_but_for_a_millionth(tolerated: float, is_refused: bool) -> None:
    point = slow(along, 0.25 / (1.0 + tolerated))
    if is_refused:
        assert refused(SLOW, tool_speed=[point])[:2] == ("tool speed", "the tool")
    else:
        certify(SLOW, LIMITS, tool_speed=[point])


@pytest.mark.parametrize("place", [0, 5])
def test_a_jerk_alone(place: int) -> None:
    motion = moved(STILL, STILL, with_value(STILL, place, 3.0))
    assert refused(motion, jerk=[1000.0, 29.9]) == ("jerk", "arm", 30.0, 29.9)
    assert certify(motion, LIMITS, jerk=[1000.0, 30.0]).jerk is not None


MOVE = plan_joint_move(START, GOAL, THREE)
MIDDLE = 40


def put(field: Array, sample: int, joint: int, value: float) -> Array:
    changed = np.array(field)
    changed[sample, joint] = value
    return changed


def scaled(trajectory: Trajectory, factor: float) -> Trajectory:
    """The same motion, faster by a factor."""
    faster, sharper = trajectory.velocity * factor, trajectory.acceleration * factor**2
    times = trajectory.times / factor
    return replace(trajectory, times=times, velocity=faster, acceleration=sharper)


def test_a_certificate_says_how_near_its_limits_a_move_comes() -> None:
    certificate = certify(MOVE, THREE, start=START)
    assert certificate.valid
    assert certificate.samples == len(MOVE.times)
    assert certificate.velocity.ratio == pytest.approx(np.abs(MOVE.velocity[:, 0]).max() / 2.0)
    assert certificate.velocity.joint == "turn"
    assert certificate.position_margin == pytest.approx(0.7)
    assert certificate.position_joint == "slide"
    assert certificate.start_distance == 0.0
    assert certify(MOVE, THREE).start_distance is None


def test_a_certificate_is_plain_data() -> None:
    data = json.loads(json.dumps(certify(MOVE, THREE, start=START).as_dict()))
    assert data["valid"] is True
    assert set(data) == {"valid", *(field.name for field in fields(Certificate))}
    assert set(data["mean_acceleration"]) == {"ratio", "joint", "time"}


# Each fault is planted alone: what is altered, and the check that must find it. Those of the rules
# above are not repeated.
FAULTS: list[tuple[str, Callable[[Trajectory], Trajectory]]] = [
    ("position", lambda m: replace(m, position=put(m.position, 9, 0, math.nextafter(3.0, 4.0)))),
    ("position", lambda m: replace(m, position=put(m.position, 9, 1, math.nextafter(-2.0, -3.0)))),
    ("finite", lambda m: replace(m, position=put(m.position, MIDDLE, 1, math.nan))),
    ("finite", lambda m: replace(m, position=put(m.position, MIDDLE, 1, math.inf))),
    ("finite", lambda m: replace(m, velocity=put(m.velocity, MIDDLE, 2, math.nan))),
    ("finite", lambda m: replace(m, velocity=put(m.velocity, MIDDLE, 2, -math.inf))),
    ("finite", lambda m: replace(m, acceleration=put(m.acceleration, 0, 0, math.nan))),
    ("finite", lambda m: replace(m, acceleration=put(m.acceleration, -1, 0, math.inf))),
    ("time", lambda m: replace(m, times=m.times[::-1])),
    ("time", lambda m: replace(m, times=np.where(m.times == m.times[9], m.times[8], m.times))),
    ("time", lambda m: replace(m, times=m.times + (m.times > 0.5) * 1e-8)),
    ("time", lambda m: replace(m, times=np.where(m.times > 0.5, math.nan, m.times))),
    ("time", lambda m: replace(m, times=m.times * 0.0)),
    ("velocity", lambda m: scaled(m, 1.05)),
]


@pytest.mark.parametrize(("check", "plant"), FAULTS)
def test_each_planted_fault_is_refused_by_its_check(
    check: str, plant: Callable[[Trajectory], Trajectory]
) -> None:
    assert refused(plant(MOVE), THREE)[0] == check


def test_a_refusal_names_joint_value_limit_and_time() -> None:
    with pytest.raises(CertificateRefused) as refusal:
        certify(replace(MOVE, velocity=put(MOVE.velocity, MIDDLE, 2, 0.6)), THREE)
    error = refusal.value
    assert (error.check, error.joint, error.value, error.limit) == ("velocity", "slide", 0.6, 0.5)
    assert error.time == pytest.approx(MIDDLE * 0.01)
    assert error.unit == "m/s"


def test_positions_on_the_very_limit_are_certified() -> None:
    certify(plan_joint_move(THREE.lower, THREE.upper, THREE), THREE)


def cut(rows: slice, joints: slice) -> Trajectory:
    """Return some of the rows and joints of the motion."""
    fields = ("position", "velocity", "acceleration")
    changed: dict[str, Any] = {name: getattr(MOVE, name)[rows, joints] for name in fields}
    return replace(MOVE, times=MOVE.times[rows], **changed)


ALL = slice(None)


@refusals(
    ("no number", lambda: certify(MOVE, THREE, start=[math.nan, 0, 0]), Exception, "start|finite"),
    ("two joints", lambda: certify(cut(ALL, slice(2)), THREE), WrongJointCount, ""),
    ("a start of one joint", lambda: certify(MOVE, THREE, start=[0.0]), WrongJointCount, ""),
    ("one sample", lambda: certify(cut(slice(1), ALL), THREE), BadArgument, "two samples"),
)
def test_what_is_no_motion_of_the_robot_is_refused(refusal: Refusal) -> None:
    refusal.check()


def test_standing_still_is_certified() -> None:
    times: Array = np.linspace(0.0, 0.04, 5)
    still = np.zeros((5, 3))
    certify(Trajectory(times, still, still, still, times[[0, -1]]), THREE, start=[0.0] * 3)


def test_a_curve_with_every_joint_busy_loses_its_certificate_when_run_faster() -> None:
    trajectory = time_path(JointSpline(np.random.default_rng(5).uniform(-0.6, 0.6, (8, 3))), THREE)
    certify(trajectory, THREE)
    with pytest.raises(CertificateRefused):
        certify(scaled(trajectory, 1.02), THREE)


@given(
    bursts=st.lists(
        st.tuples(st.floats(-1.0, 1.0), st.floats(0.004, 0.3)), min_size=1, max_size=12
    ),
    shift=st.floats(0.0, 0.0099),
)
def test_no_motion_that_keeps_the_limits_is_refused(
    bursts: list[tuple[float, float]], shift: float
) -> None:
    # Constant accelerations for any times, then the same backwards: back to rest. None of the
    # switches falls on a sample.
    gains = np.array([gain for gain, _ in bursts] + [-gain for gain, _ in reversed(bursts)])
    lasts = np.array([last for _, last in bursts] + [last for _, last in reversed(bursts)])
    lasts[0] += shift
    lasts[-1] += shift
    limits = JointLimits(("j",), (-1e3,), (1e3,), (1e3,), (1.0,), (False,))
    switches = np.concatenate(([0.0], np.cumsum(lasts)))
    speeds = np.concatenate(([0.0], np.cumsum(gains * lasts)))
    places = np.concatenate(([0.0], np.cumsum(speeds[:-1] * lasts + gains * lasts**2 / 2.0)))
    samples = math.ceil(switches[-1] / 0.01)
    times: Array = np.linspace(0.0, samples * 0.01, samples + 1)
    burst = np.minimum(np.searchsorted(switches, times, side="right") - 1, len(gains) - 1)
    since = np.minimum(times, switches[-1]) - switches[burst]
    gain = gains[burst]
    velocity = speeds[burst] + gain * since
    velocity[[0, -1]] = 0.0
    position = places[burst] + speeds[burst] * since + gain * since**2 / 2.0
    columns = np.stack((position, velocity, gain))[:, :, np.newaxis]

    certify(Trajectory(times, columns[0], columns[1], columns[2], times[[0, -1]]), limits)
