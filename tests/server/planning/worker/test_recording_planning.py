from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from rigs.cells.expectations import refusal_from

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.errors import BadArgument
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Array
from openpendant.motion.scene.scene import Scene, SceneObject, Sphere
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.point_speed import reduced_speed
from openpendant.server.planning.jobs import RecordingJob
from openpendant.server.planning.worker.job_planner import answer
from openpendant.server.planning.worker.recording_planning import (
    RecordingUnplayable,
    plan_recording,
)
from openpendant.server.store.recording_format import Extract, pack_rows
from openpendant.simplemsg.verdicts import VerdictCode as V

HOME = serial_robot("ur5").home_position
EXTRACT = Extract(8, (1, 2, 3, 4, 5, 6))
NOISE = 2e-4


@cache
def _kinematics() -> Kinematics:
    return Kinematics(serial_robot("ur5"))


def _waved(seconds: float = 6.0, amplitude: float = 0.3) -> tuple[Array, Array]:
    times = np.arange(round(seconds * 100) + 1) / 100
    phases = 2 * np.pi * times[:, np.newaxis] / (3.0 + np.arange(6))
    noise = np.random.default_rng(5).normal(0.0, NOISE, (len(times), 6))
    return times, np.array(HOME) + amplitude * np.sin(phases) + noise


def _job(times: Array, positions: Array) -> RecordingJob:
    rows = [(time, *row, 0.0) for time, row in zip(times.tolist(), positions.tolist(), strict=True)]
    return RecordingJob(1, HOME, "wave", (pack_rows(rows),), EXTRACT, 0.01)


WAVE = _job(*_waved())


def _distance(played: Array, samples: Array) -> float:
    gaps = [np.abs(played - sample).max(axis=1).min() for sample in samples]
    return float(max(gaps))


@pytest.mark.parametrize("factor", [0.1, 0.5, 1.0])
def test_a_slow_playback_takes_as_long_as_asked(factor: float) -> None:
    _, account = plan_recording(_kinematics(), replace(WAVE, factor=factor), ())
    assert account.asked == pytest.approx(6.0 / factor)
    # From rest to rest, so a ramp longer than the recording.
    assert account.asked <= account.possible <= account.asked + 1.0


def test_a_playback_faster_than_the_limits_is_slowed_down_and_says_so() -> None:
    slow = _job(*_waved(amplitude=0.9))
    motion, account = plan_recording(_kinematics(), replace(slow, factor=4.0), ())
    assert account.possible > account.asked * 1.05
    assert account.factor < 4.0
    certify(motion, _kinematics().limits, start=HOME)


def test_the_path_keeps_to_the_stated_tolerance() -> None:
    job = replace(WAVE, factor=0.5, tolerance=0.002)
    motion, account = plan_recording(_kinematics(), job, ())
    _, samples = _waved()
    assert account.deviation <= 0.002
    assert _distance(motion.position, samples[50:-50:20]) <= 0.002 + 2e-3


@pytest.mark.parametrize(("lateness", "least", "most"), [(0.0, 0.0, 0.002), (0.04, 0.002, 0.01)])
def test_without_a_stated_tolerance_the_path_is_as_near_as_it_can_be(
    lateness: float, least: float, most: float
) -> None:
    """Reports that come unevenly, of a joint that goes there and back, as in the example."""
    true = np.arange(400) / 100
    way = 0.3 * np.abs(np.sin(np.pi * true / 2.0))
    positions = np.array(HOME) + way[:, np.newaxis] * np.array([1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    late = np.random.default_rng(3).uniform(0.0, lateness, len(true))
    times = np.maximum.accumulate(true + late) + 1e-6 * np.arange(len(true))
    _, account = plan_recording(_kinematics(), _job(times, positions), ())
    assert least <= account.deviation <= most


def test_the_way_to_the_first_sample_is_slow_and_announced() -> None:
    """Feature T10: at most a tenth of the joints' speed limits."""
    aside = tuple(value + 0.5 for value in HOME)
    motion, account = plan_recording(_kinematics(), replace(WAVE, start=aside), ())
    approach = motion.times <= account.approach
    limits = np.array(_kinematics().limits.velocity)
    assert account.approach > 1.0
    assert (np.abs(motion.velocity[approach]) <= 0.1 * limits * (1 + 1e-6)).all()
    assert motion.position[0].tolist() == list(aside)


def test_repeats_come_back_softly_to_the_first_sample() -> None:
    once, account = plan_recording(_kinematics(), WAVE, ())
    thrice, all_told = plan_recording(_kinematics(), replace(WAVE, repeats=3), ())
    assert thrice.duration == pytest.approx(all_told.total)
    assert thrice.duration > 3 * account.possible
    assert thrice.final == pytest.approx(once.final)
    certify(thrice, _kinematics().limits, start=HOME)


@pytest.mark.parametrize("off", [0.0, 1e-7, 8e-6])
def test_a_robot_that_stands_at_the_first_sample_but_for_rounding_goes_no_way_there(
    off: float,
) -> None:
    times = np.arange(201) / 100
    line = np.array(HOME) + 0.1 * times[:, np.newaxis] * np.eye(6)[0]
    job = replace(_job(times, line), start=(HOME[0] + off, *HOME[1:]))
    motion, account = plan_recording(_kinematics(), job, ())
    assert account.approach == 0.0
    certify(motion, _kinematics().limits, start=job.start)


def test_a_part_is_played_alone() -> None:
    _, account = plan_recording(_kinematics(), replace(WAVE, begins=1.0, ends=3.0), ())
    assert account.recorded == pytest.approx(2.0)
    assert account.samples == 201


def test_a_part_without_samples_is_refused() -> None:
    with pytest.raises(BadArgument, match="two samples"):
        plan_recording(_kinematics(), replace(WAVE, begins=99.0), ())


def test_a_long_gap_is_refused_with_its_place() -> None:
    times, positions = _waved()
    kept = (times < 2.0) | (times > 2.5)
    with pytest.raises(RecordingUnplayable, match=r"1\.990 s to 2\.510 s") as caught:
        plan_recording(_kinematics(), _job(times[kept], positions[kept]), ())
    assert caught.value.refusal.code is V.RECORDING_GAP


def test_a_short_gap_is_played_across_and_told() -> None:
    times, positions = _waved()
    kept = (times < 2.0) | (times > 2.1)
    _, account = plan_recording(_kinematics(), _job(times[kept], positions[kept]), ())
    assert account.gaps == 1
    assert account.longest_gap == pytest.approx(0.12)


def test_a_playback_that_would_never_end_is_refused() -> None:
    with pytest.raises(RecordingUnplayable, match="fewer repeats"):
        plan_recording(_kinematics(), replace(WAVE, repeats=1_000), ())


def test_reduced_speed_holds_for_tool_and_elbow() -> None:
    caps = reduced_speed(_kinematics(), 0.05)
    motion, account = plan_recording(_kinematics(), replace(WAVE, factor=4.0), caps)
    certify(motion, _kinematics().limits, start=HOME, tool_speed=caps)
    assert account.possible > account.asked


def test_the_planning_process_answers_with_motion_certificate_and_account() -> None:
    planned = answer("ur5", WAVE)
    assert isinstance(planned.result, tuple)
    assert planned.playback is not None
    assert planned.playback.recorded == pytest.approx(6.0)


def test_a_playback_into_an_object_is_refused_with_both_bodies() -> None:
    x, y, z = _kinematics().forward(_waved()[1][150]).position.tolist()
    ball = SceneObject("ball", Sphere(0.02), (x, y, z))
    refused = refusal_from(answer("ur5", replace(WAVE, scene=Scene((ball,)))).result)
    assert refused.code is V.PATH_IN_COLLISION
    assert "ball" in refused.text


def test_a_minute_is_planned_in_one_piece() -> None:
    assert isinstance(answer("ur5", _job(*_waved(60.0))).result, tuple)


@pytest.mark.soak
def test_the_longest_recording_in_one_piece_is_planned_in_time() -> None:
    """Ten minutes are 60,000 rows; the planner gives up after 30 s."""
    planned = answer("ur5", _job(*_waved(600.0)))
    assert isinstance(planned.result, tuple)
    assert planned.plan_time < 15.0
