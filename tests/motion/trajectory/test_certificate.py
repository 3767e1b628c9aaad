import json
import math
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.errors import BadArgument, CertificateRefused, WrongJointCount
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import Certificate, certify
from openpendant.motion.trajectory.joint_curves import JointSpline
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.motion.trajectory.trajectory import Trajectory

Array = NDArray[np.float64]

LIMITS = JointLimits(
    names=("turn", "tilt", "slide"),
    lower=(-3.0, -2.0, -1.0),
    upper=(3.0, 2.0, 1.0),
    velocity=(2.0, 1.5, 0.5),
    acceleration=(8.0, 6.0, 2.0),
    prismatic=(False, False, True),
)
START, GOAL = [0.0, 0.5, -0.2], [2.0, -0.5, 0.3]
MIDDLE = 40


@pytest.fixture
def move() -> Trajectory:
    return plan_joint_move(START, GOAL, LIMITS)


def altered(trajectory: Trajectory, **fields: Array) -> Trajectory:
    changed: dict[str, Any] = {name: np.array(value) for name, value in fields.items()}
    return replace(trajectory, **changed)


def put(field: Array, sample: int, joint: int, value: float) -> Array:
    changed = np.array(field)
    changed[sample, joint] = value
    return changed


def scaled(trajectory: Trajectory, factor: float) -> Trajectory:
    """The same motion, faster by a factor."""
    return altered(
        trajectory,
        times=trajectory.times / factor,
        velocity=trajectory.velocity * factor,
        acceleration=trajectory.acceleration * factor**2,
    )


def test_a_planned_move_gets_a_certificate_that_says_how_near_the_limits_it_comes(
    move: Trajectory,
) -> None:
    certificate = certify(move, LIMITS, start=START)

    assert certificate.valid
    assert certificate.samples == len(move.times)
    assert certificate.velocity.ratio == pytest.approx(np.abs(move.velocity[:, 0]).max() / 2.0)
    assert certificate.velocity.joint == "turn"
    assert certificate.position_margin == pytest.approx(0.7)
    assert certificate.position_joint == "slide"
    assert certificate.start_distance == 0.0
    assert certify(move, LIMITS).start_distance is None


def test_a_certificate_is_plain_data(move: Trajectory) -> None:
    data = json.loads(json.dumps(certify(move, LIMITS, start=START).as_dict()))
    assert data["valid"] is True
    assert set(data) == {"valid", *(field.name for field in fields(Certificate))}
    assert set(data["mean_acceleration"]) == {"ratio", "joint", "time"}


# Each fault is planted alone: what is altered, and the check that must find it.
FAULTS: list[tuple[str, Callable[[Trajectory], Trajectory]]] = [
    ("position", lambda m: altered(m, position=put(m.position, 9, 0, math.nextafter(3.0, 4.0)))),
    ("position", lambda m: altered(m, position=put(m.position, 9, 1, math.nextafter(-2.0, -3.0)))),
    ("finite", lambda m: altered(m, position=put(m.position, MIDDLE, 1, math.nan))),
    ("finite", lambda m: altered(m, position=put(m.position, MIDDLE, 1, math.inf))),
    ("finite", lambda m: altered(m, velocity=put(m.velocity, MIDDLE, 2, math.nan))),
    ("finite", lambda m: altered(m, velocity=put(m.velocity, MIDDLE, 2, -math.inf))),
    ("finite", lambda m: altered(m, acceleration=put(m.acceleration, 0, 0, math.nan))),
    ("finite", lambda m: altered(m, acceleration=put(m.acceleration, -1, 0, math.inf))),
    ("velocity", lambda m: altered(m, velocity=put(m.velocity, MIDDLE, 0, 2.0 * (1 + 1e-5)))),
    ("velocity", lambda m: altered(m, velocity=put(m.velocity, MIDDLE, 1, -1.5 * (1 + 1e-5)))),
    (
        "acceleration",
        lambda m: altered(m, acceleration=put(m.acceleration, MIDDLE, 2, -2.0 * (1 + 2e-3))),
    ),
    ("mean acceleration", lambda m: altered(m, velocity=put(m.velocity, MIDDLE, 0, 1.9))),
    (
        "consistency",
        lambda m: altered(m, position=m.position + (m.times > 0.5)[:, None] * [0, 2e-4, 0]),
    ),
    ("drift", lambda m: altered(m, velocity=m.velocity * 0.99)),
    ("drift", lambda m: altered(m, velocity=m.velocity * [1, 1, 0.99])),
    ("rest", lambda m: altered(m, velocity=put(m.velocity, 0, 0, 1e-9))),
    ("rest", lambda m: altered(m, velocity=put(m.velocity, -1, 2, -1e-9))),
    ("time", lambda m: altered(m, times=m.times + 0.01)),
    ("time", lambda m: altered(m, times=m.times[::-1])),
    ("time", lambda m: altered(m, times=np.where(m.times == m.times[9], m.times[8], m.times))),
    ("time", lambda m: altered(m, times=m.times + (m.times > 0.5) * 1e-8)),
    ("time", lambda m: altered(m, times=np.where(m.times > 0.5, math.nan, m.times))),
    ("time", lambda m: altered(m, times=m.times * 0.0)),
    ("velocity", lambda m: scaled(m, 1.05)),
]


@pytest.mark.parametrize(("check", "plant"), FAULTS)
def test_each_planted_fault_is_refused_by_its_check(
    move: Trajectory, check: str, plant: Callable[[Trajectory], Trajectory]
) -> None:
    with pytest.raises(CertificateRefused) as refusal:
        certify(plant(move), LIMITS)
    assert refusal.value.check == check


def test_a_refusal_names_joint_value_limit_and_time(move: Trajectory) -> None:
    with pytest.raises(CertificateRefused) as refusal:
        certify(altered(move, velocity=put(move.velocity, MIDDLE, 2, 0.6)), LIMITS)
    error = refusal.value
    assert (error.check, error.joint, error.value, error.limit) == ("velocity", "slide", 0.6, 0.5)
    assert error.time == pytest.approx(MIDDLE * 0.01)
    assert error.unit == "m/s"


def test_the_mean_velocity_is_checked_where_the_samples_of_it_look_slow() -> None:
    # Positions that run at 0.6 m/s beside velocities that never exceed 0.4.
    times: Array = np.linspace(0.0, 2.0, 201)
    wave = np.minimum(np.minimum(times, times[::-1]), 0.2) * 2.0
    position = np.zeros((201, 3))
    position[1:, 2] = np.cumsum(wave[1:] + wave[:-1]) * 0.0075 - 0.9
    position[0, 2] = -0.9
    velocity = np.zeros((201, 3))
    velocity[:, 2] = wave
    still = np.zeros((201, 3))
    lying = Trajectory(times, position, velocity, still, times[[0, -1]].copy())
    loose = replace(LIMITS, acceleration=(80.0, 60.0, 1000.0))

    with pytest.raises(CertificateRefused) as refusal:
        certify(lying, loose)

    assert refusal.value.check == "mean velocity"
    assert refusal.value.value == pytest.approx(0.6)


def test_positions_on_the_very_limit_are_certified() -> None:
    certify(plan_joint_move(LIMITS.lower, LIMITS.upper, LIMITS), LIMITS)


def test_velocities_within_the_tolerance_are_certified(move: Trajectory) -> None:
    fast = np.abs(move.velocity[:, 0]).max()
    certify(move, replace(LIMITS, velocity=(fast / (1.0 + 9e-7), 1.5, 0.5)))
    with pytest.raises(CertificateRefused):
        certify(move, replace(LIMITS, velocity=(fast / (1.0 + 1.1e-6), 1.5, 0.5)))


@pytest.mark.parametrize(("off", "accepted"), [(0.0099, True), (0.0101, False), (math.nan, False)])
def test_the_motion_must_start_where_the_robot_stands(
    move: Trajectory, off: float, accepted: bool
) -> None:
    start = [START[0], START[1] - off, START[2]]
    if accepted:
        assert certify(move, LIMITS, start=start).start_distance == pytest.approx(off)
        return
    with pytest.raises(Exception, match=r"start|finite"):
        certify(move, LIMITS, start=start)


def test_the_trajectory_of_another_robot_is_refused(move: Trajectory) -> None:
    with pytest.raises(WrongJointCount):
        certify(
            altered(
                move,
                **{
                    name: getattr(move, name)[:, :2]
                    for name in ("position", "velocity", "acceleration")
                },
            ),
            LIMITS,
        )
    with pytest.raises(WrongJointCount):
        certify(move, LIMITS, start=[0.0])


def test_a_single_sample_is_no_motion(move: Trajectory) -> None:
    fields = ("times", "position", "velocity", "acceleration")
    with pytest.raises(BadArgument, match="two samples"):
        certify(altered(move, **{name: getattr(move, name)[:1] for name in fields}), LIMITS)


def test_standing_still_is_certified() -> None:
    times: Array = np.linspace(0.0, 0.04, 5)
    still = np.zeros((5, 3))
    certify(Trajectory(times, still, still, still, times[[0, -1]]), LIMITS, start=[0.0] * 3)


def test_a_curve_with_every_joint_busy_loses_its_certificate_when_run_faster() -> None:
    trajectory = time_path(JointSpline(np.random.default_rng(5).uniform(-0.6, 0.6, (8, 3))), LIMITS)
    certify(trajectory, LIMITS)
    with pytest.raises(CertificateRefused):
        certify(scaled(trajectory, 1.02), LIMITS)


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
