import math
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.example_counts import few
from rigs.motion.loaded_robots import serial_robot

from openpendant.motion.errors import BadArgument, NoMotion, NotFinite, OutOfRange, WrongJointCount
from openpendant.motion.paths.smoothing import SmoothedRecording, smooth
from openpendant.motion.pose import Array
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointSpline

LIMITS = serial_robot("ur5").limits


def recording(count: int = 1000, noise: float = 1e-3, seed: int = 1) -> tuple[Array, Array]:
    """Times at 100 Hz, and a sweep of all joints that stands still for half a second."""
    random = np.random.default_rng(seed)
    times: Array = np.linspace(0.0, (count - 1) * 0.01, count)
    moving = np.where((times > 2.0) & (times < 2.5), 2.0, times)
    swing = np.sin(moving[:, np.newaxis] * random.uniform(0.2, 0.8, 6) + random.uniform(0, 6, 6))
    return times, swing + random.normal(0.0, 1.0, (count, 6)) * noise


def distance(path: JointSpline, samples: Array) -> float:
    """The greatest distance of a sample from the path, by looking densely around the nearest place.

    It is the distance to a place of the path, so never less than the true one.
    """
    step = path.length / 4000
    coarse = np.linspace(0.0, path.length, 4001)
    places = path.evaluate(coarse)
    found = []
    for sample in samples:
        nearest = coarse[np.abs(places - sample).max(axis=1).argmin()]
        around = np.linspace(nearest - 2.0 * step, nearest + 2.0 * step, 201)
        near = path.evaluate(np.clip(around, 0.0, path.length))
        found.append(float(np.abs(near - sample).max(axis=1).min()))
    return max(found)


@cache
def smoothed_recording(count: int, noise: float = 1e-3) -> SmoothedRecording:
    times, samples = recording(count, noise)
    return smooth(times, samples, 4e-3, LIMITS)


@cache
def fastest_playback() -> float:
    return time_path(smoothed_recording(3000).path, LIMITS).duration


@pytest.mark.parametrize(
    ("count", "noise", "tolerance", "most_knots"),
    [
        (300, 1e-4, 4e-4, 80),
        (1000, 1e-3, 4e-3, 80),
        (1000, 0.0, 1e-3, 110),
        (3000, 3e-3, 12e-3, 100),
        (5000, 1e-4, 5e-4, 300),
    ],
)
def test_no_sample_is_further_from_the_path_than_the_tolerance(
    count: int, noise: float, tolerance: float, most_knots: int
) -> None:
    times, samples = recording(count, noise)
    smoothed = smooth(times, samples, tolerance, LIMITS)
    assert smoothed.deviation <= tolerance
    step = smoothed.path.length / 200_000
    assert distance(smoothed.path, samples[:: count // 20]) <= smoothed.deviation + step
    assert len(smoothed.knot_times) <= most_knots
    assert (smoothed.samples, smoothed.dropped) == (count, 0)


def test_smoothing_makes_a_noisy_recording_several_times_as_fast() -> None:
    times, samples = recording()
    rough = time_path(JointSpline(samples, LIMITS), LIMITS)
    fine = time_path(smooth(times, samples, 4e-3, LIMITS).path, LIMITS)
    certify(fine, LIMITS)
    assert fine.duration < 0.25 * rough.duration


@pytest.mark.parametrize("playback", [0.1, 0.5, 1.0, 2.0, 4.0])
def test_playback_takes_the_recorded_time_over_its_speed_or_the_limits(playback: float) -> None:
    (times, _), smoothed = recording(3000, 1e-3), smoothed_recording(3000)
    fastest = fastest_playback()
    played = time_path(smoothed.path, LIMITS, segments=smoothed.segment_rules(playback))
    certify(played, LIMITS)
    wanted = float(times[-1]) / playback
    assert max(wanted, fastest) - 1e-6 <= played.duration <= 1.25 * max(wanted, fastest)


def test_a_pause_in_the_recording_is_a_pause_in_the_playback() -> None:
    times, samples = recording(600, 1e-4)
    smoothed = smooth(times, samples, 1e-3, LIMITS)
    played = time_path(smoothed.path, LIMITS, segments=smoothed.segment_rules(1.0))
    slow = np.abs(played.velocity).max(axis=1) < 0.05
    assert slow.sum() * 0.01 >= 0.3


def test_times_that_repeat_or_go_back_are_dropped_and_counted() -> None:
    times, samples = recording(500)
    at = [100, 200, 300]
    broken = np.insert(times, at, [times[99], times[150], times[299] - 1e-9])
    smoothed = smooth(broken, np.insert(samples, at, samples[at] + 0.5, axis=0), 4e-3)
    assert (smoothed.samples, smoothed.dropped) == (500, 3)
    assert distance(smoothed.path, samples[::25]) <= 4e-3 * 1.01


def test_noise_at_a_limit_is_put_on_it() -> None:
    times: Array = np.linspace(0.0, 3.99, 400)
    samples = np.zeros((400, 6))
    samples[:, 0] = np.minimum(LIMITS.upper[0] - 1.0 + times / 2.0, LIMITS.upper[0])
    samples += np.random.default_rng(0).normal(0.0, 1e-4, samples.shape)
    certify(time_path(smooth(times, samples, 1e-2, LIMITS).path, LIMITS), LIMITS)


@few(8)
@given(
    seed=st.integers(0, 10**6),
    count=st.integers(2, 300),
    noise=st.sampled_from([0.0, 1e-4, 1e-2]),
    tolerance=st.sampled_from([1e-5, 1e-3, 0.1]),
)
def test_every_recording_is_met_to_the_tolerance_or_refused(
    seed: int, count: int, noise: float, tolerance: float
) -> None:
    random = np.random.default_rng(seed)
    times = np.cumsum(random.choice([0.0, 0.001, 0.01, 0.5], count))
    samples = np.cumsum(random.normal(0.0, 0.01, (count, 3)), axis=0)
    samples += random.normal(0.0, 1.0, samples.shape) * noise
    try:
        smoothed: SmoothedRecording = smooth(times, samples, tolerance)
    except (NoMotion, BadArgument):
        return

    assert smoothed.deviation <= tolerance
    assert smoothed.samples + smoothed.dropped == count


@pytest.mark.parametrize(
    ("kind", "times", "positions", "tolerance"),
    [
        (BadArgument, [0.0, 1.0], [[0.0] * 6, [1.0] * 6], 0.0),
        (BadArgument, [0.0, 1.0], [[0.0] * 6, [1.0] * 6], math.nan),
        (BadArgument, [0.0], [[0.0] * 6, [1.0] * 6], 0.01),
        (BadArgument, [], [], 0.01),
        (BadArgument, [0.0], [[0.0] * 6], 0.01),
        (BadArgument, [1.0, 1.0, 0.5], [[0.0] * 6, [1.0] * 6, [0.5] * 6], 0.01),
        (BadArgument, [0.0, 4000.0], [[0.0] * 6, [1.0] * 6], 0.01),
        (NotFinite, [0.0, math.nan], [[0.0] * 6, [1.0] * 6], 0.01),
        (NotFinite, [0.0, 1.0], [[0.0] * 6, [math.inf] * 6], 0.01),
        (WrongJointCount, [0.0, 1.0], [[0.0] * 6, [1.0] * 5], 0.01),
        (WrongJointCount, [0.0, 1.0], [[0.0] * 5, [1.0] * 5], 0.01),
        (NoMotion, [0.0, 1.0], [[0.0] * 6, [0.005] * 6], 0.01),
        (OutOfRange, [0.0, 1.0], [[0.0] * 6, [7.0] * 6], 0.01),
    ],
)
def test_what_is_no_recording_is_refused(
    kind: type[Exception], times: list[float], positions: list[list[float]], tolerance: float
) -> None:
    with pytest.raises(kind):
        smooth(times, positions, tolerance, LIMITS)


@pytest.mark.parametrize("playback", [0.0, 0.05, 4.1, -1.0, math.nan])
def test_a_playback_speed_outside_a_tenth_to_four_is_refused(playback: float) -> None:
    with pytest.raises(BadArgument, match="playback"):
        smoothed_recording(300).segment_rules(playback)
