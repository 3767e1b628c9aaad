"""Recording planning: one certified motion from the samples of a recording, in a planning process.

Owns the slow approach to the first sample, the repeats, and which gaps are played across. Smoothing
and timing are `motion`'s: the path stays within the stated tolerance and the limits, however fast
the recording is played.
"""

from __future__ import annotations

import numpy as np

from openpendant.motion.errors import BadArgument
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.smoothing import SmoothedRecording, smooth
from openpendant.motion.pose import Array
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.joint_curves import COINCIDENT, JointSpline
from openpendant.motion.trajectory.point_speed import ToolSpeedLimit
from openpendant.motion.trajectory.trajectory import Trajectory, join
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal
from ...store.recording_format import GAP_PERIODS
from ..jobs import APPROACH_SPEED, TOLERANCES, PlaybackPlan, RecordingJob

MOST_DURATION = 1_800.0
"""Longest motion that is planned in one piece [s]; its samples take 25 MB for six joints."""

_MOST_ROUNDS = 5
_DENSITY = 8  # places on each span of the path that are compared with the samples


class RecordingUnplayable(Exception):
    """Recording that cannot be played as asked."""

    def __init__(self, refusal: Refusal) -> None:
        super().__init__(refusal.sentence)
        self.refusal = refusal


def plan_recording(
    kinematics: Kinematics, job: RecordingJob, caps: tuple[ToolSpeedLimit, ...]
) -> tuple[Trajectory, PlaybackPlan]:
    """Plan the playback of a recording from where the robot stands.

    Returns:
        One motion, and what of it was asked and is possible.

    Raises:
        RecordingUnplayable: it has a gap too long, or takes too long.
        MotionError: its samples are no motion of this robot.
    """
    limits = kinematics.limits
    times, positions = _rows(job)
    gaps = _gaps(job, times)
    smoothed, deviation = _smoothed(job, times, positions, kinematics)
    rules = smoothed.segment_rules(job.factor)
    play = time_path(smoothed.path, limits, segments=rules, tool_speed=caps)
    approach = _softly(kinematics, job.start, play.position[0], caps)
    again = _softly(kinematics, play.final, play.position[0], caps) if job.repeats > 1 else None
    back = 0.0 if again is None else again.duration
    first = 0.0 if approach is None else approach.duration
    total = first + job.repeats * play.duration + (job.repeats - 1) * back
    if total > MOST_DURATION:
        text = (
            f"playing {job.name!r} would take {total:.0f} s; accepted: up to {MOST_DURATION:g} s,"
            " with fewer repeats or a part of it"
        )
        raise RecordingUnplayable(
            Refusal(VerdictCode.NOT_TIMEABLE, text, value=total, limit=MOST_DURATION)
        )
    legs = [] if approach is None else [approach]
    for repeat in range(job.repeats):
        if repeat and again is not None:
            legs.append(again)
        legs.append(play)
    recorded = float(times[-1] - times[0])
    account = PlaybackPlan(
        samples=smoothed.samples,
        recorded=recorded,
        asked=recorded / job.factor,
        possible=play.duration,
        approach=first,
        total=total,
        deviation=deviation,
        dropped=smoothed.dropped,
        gaps=len(gaps),
        longest_gap=float(gaps.max()) if len(gaps) else 0.0,
    )
    return join(legs), account


def _smoothed(
    job: RecordingJob, times: Array, positions: Array, kinematics: Kinematics
) -> tuple[SmoothedRecording, float]:
    """Return a path that is as near to the samples as the samples are to it, and how near.

    Smoothing alone keeps each sample near the path, which may still run on beyond the place where
    the recording stood or turned.
    """
    *tried, last = TOLERANCES if job.tolerance is None else (job.tolerance,)
    for tolerance in tried:
        try:
            return _within(tolerance, times, positions, kinematics)
        except BadArgument:
            continue
    return _within(last, times, positions, kinematics)


def _within(
    tolerance: float, times: Array, positions: Array, kinematics: Kinematics
) -> tuple[SmoothedRecording, float]:
    """Return a path as `_smoothed` does.

    Raises:
        BadArgument: it cannot keep to the tolerance.
    """
    smoothing = tolerance
    for _ in range(_MOST_ROUNDS):
        smoothed = smooth(times, positions, smoothing, kinematics.limits)
        deviation = max(smoothed.deviation, _strays(smoothed, times - times[0], positions))
        if deviation <= tolerance:
            return smoothed, deviation
        smoothing /= 2.0
    raise BadArgument("tolerance", tolerance, f"{deviation:.3g} or more for this recording")


def _strays(smoothed: SmoothedRecording, clock: Array, samples: Array) -> float:
    """Return how far the path is from the lines between the samples, in any joint [rad or m]."""
    path, knots = smoothed.path, smoothed.knot_times
    ends = path.knots[path.waypoint_knots]
    first = np.searchsorted(clock, knots, side="right") - 1
    worst = 0.0
    for span in range(len(knots) - 1):
        places = path.evaluate(np.linspace(ends[span], ends[span + 1], _DENSITY))
        begin = first[max(span - 1, 0)]
        end = first[min(span + 2, len(first) - 1)]
        lines = samples[begin : end + 1]
        ways = np.diff(lines, axis=0)
        from_begin = places[:, np.newaxis] - lines[:-1]
        lengths = np.maximum((ways**2).sum(axis=1), 1e-300)
        along = np.clip((from_begin * ways).sum(axis=2) / lengths, 0.0, 1.0)
        beside = np.abs(from_begin - along[..., np.newaxis] * ways).max(axis=2)
        worst = max(worst, float(beside.min(axis=1).max()))
    return worst


def _rows(job: RecordingJob) -> tuple[Array, Array]:
    """Return the times (m,) and positions (m, n) of the part that is played."""
    width = job.extract.width
    pieces = [np.frombuffer(piece, dtype="<f8").reshape(-1, width) for piece in job.samples]
    rows = np.concatenate([np.empty((0, width)), *pieces])
    ends = np.inf if job.ends is None else job.ends
    rows = rows[(rows[:, 0] >= job.begins) & (rows[:, 0] <= ends)]
    if len(rows) < 2:
        span = f"{job.begins:g} s to " + ("its end" if job.ends is None else f"{job.ends:g} s")
        raise BadArgument("part of the recording", span, "a part with two samples or more")
    return rows[:, 0], rows[:, list(job.extract.joints)]


def _gaps(job: RecordingJob, times: Array) -> Array:
    """Return the (k,) gaps of the part that is played [s]; refuse one that is too long."""
    steps = np.diff(times)
    longest = int(np.argmax(steps))
    if steps[longest] > max(job.bridge, GAP_PERIODS * job.period):
        text = (
            f"from {times[longest]:.3f} s to {times[longest + 1]:.3f} s of {job.name!r} the"
            f" controller did not report; played across are gaps of up to {job.bridge:g} s"
        )
        raise RecordingUnplayable(
            Refusal(VerdictCode.RECORDING_GAP, text, value=float(steps[longest]), limit=job.bridge)
        )
    gaps: Array = steps[steps > GAP_PERIODS * job.period]
    return gaps


def _softly(
    kinematics: Kinematics,
    start: tuple[float, ...],
    first: Array,
    caps: tuple[ToolSpeedLimit, ...],
) -> Trajectory | None:
    """Return the slow approach to the first sample; None where the robot stands there."""
    if float(np.abs(np.array(start) - first).max()) < COINCIDENT:
        return None
    path = JointSpline([start, tuple(first.tolist())], kinematics.limits)
    return time_path(path, kinematics.limits, speed=APPROACH_SPEED, tool_speed=caps)
