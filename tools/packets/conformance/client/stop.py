"""Checks of a client's stops: their form, and their absence when the controller reports trouble."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import pairwise

from openpendant.simplemsg import CommType, JointTrajPt, JointTrajPtFull, Status, TriState

from .check import (
    NO_TRAJECTORY,
    Habit,
    Moment,
    Observation,
    Observed,
    Problem,
    client_check,
    rule_check,
)
from .setup import TRIGGERED, Purpose
from .trace import TracedFrame
from .trajectories import BEGINNINGS, SentPoint, SentTrajectory

NO_STOP = "the client sent no STOP"
LEAST_SEQUENCE = -4

REACTION_NS = 250_000_000
"""A client has this long to read a report and act on it."""

SILENCE_NS = 1_000_000_000
"""The ROS-I action server calls a controller dead after so long without feedback."""

STATUS_IGNORED = "industrial_robot_client: the streamer does not look at robot_status"
STATE_IGNORED = "industrial_robot_client: the streamer does not know whether there are reports"


def _stops(seen: Observed) -> list[TracedFrame]:
    return seen.motions.stops


@rule_check("SC01", _stops, NO_STOP)
def _stop_is_request(frame: TracedFrame, _: Observed) -> Problem | None:
    is_request = frame.comm_type == CommType.REQUEST
    return None if is_request else f"communication type {frame.comm_type}"


@rule_check("SC02", _stops, NO_STOP)
def _stop_is_empty(frame: TracedFrame, _: Observed) -> Problem | None:
    match frame.message:
        case JointTrajPt(joints=joints, velocity=velocity, duration=duration):
            clean = not any((*joints, velocity, duration))
        case JointTrajPtFull(positions=positions, velocities=velocities, time=time):
            clean = not any((*positions, *velocities, time))
        case _:
            clean = True
    return None if clean else "STOP with values"


@client_check("SC03", NO_STOP)
def _stop_ends(seen: Observed) -> Iterable[Observation]:
    """Look at the first point after each stop."""
    after = {id(t.after_stop): t for t in seen.trajectories() if t.after_stop is not None}
    for stop in _stops(seen):
        trajectory = after.get(id(stop))
        if trajectory is None:
            yield stop, None
            continue
        first = trajectory.steps[0].sequence
        yield trajectory, None if first in BEGINNINGS else f"sequence {first} after STOP"


@rule_check("SC04", Observed.points, NO_TRAJECTORY)
def _sequence_known(step: SentPoint, _: Observed) -> Problem | None:
    return f"sequence {step.sequence}" if step.sequence < LEAST_SEQUENCE else None


@client_check("SC05", "the client closed no motion link while the robot moved")
def _stops_before_leaving(seen: Observed) -> Iterable[Observation]:
    """Look at motion links that the client closed while motion was reported."""
    stopped = [frame.time for frame in _stops(seen)]
    for link in seen.trace.links_for(Purpose.MOTION):
        sent = [step for step in seen.points() if step.frame.link is link]
        if not sent or not link.closed_by_client or link.closed is None:
            continue
        status = seen.reports.status_at(link.closed)
        if status is None or status.in_motion != TriState.TRUE:
            continue
        last = sent[-1]
        did = any(last.frame.time <= time <= link.closed for time in stopped)
        yield last, None if did else "the link was closed in motion, without STOP"


@client_check("QC01", "no emergency stop was reported during a trajectory")
def _heeds_emergency_stop(seen: Observed) -> Iterable[Observation]:
    for began, ended in seen.reports.spells(lambda status: status.e_stopped == TriState.TRUE):
        for trajectory in _in_progress(seen, began):
            late = _sent_between(trajectory, began + REACTION_NS, ended)
            yield _late(trajectory, late, STATUS_IGNORED, "after an emergency stop was reported")


def _never_while(number: str, holds: Callable[[Status], bool], words: str) -> None:
    """Register a check that no trajectory begins in a spell of a condition.

    Where none begins in a spell, that is what should be; but only a spell that a trajectory, or an
    attempt at one, could have fallen into says anything.
    """

    @client_check(number, f"no trajectory was wanted while {words}")
    def look(seen: Observed) -> Iterable[Observation]:
        for began, ended in seen.reports.spells(holds):
            if ended - began <= REACTION_NS:
                continue
            late = [t for t in seen.trajectories() if began + REACTION_NS < t.begins < ended]
            for trajectory in late:
                yield _late(trajectory, trajectory.steps[:1], STATUS_IGNORED, f"although {words}")
            for event in seen.trace.events:
                if event.text == TRIGGERED and began <= event.time < ended and not late:
                    yield Moment(event.time), None


_never_while(
    "QC02",
    lambda status: status.motion_possible == TriState.FALSE,
    "motion was reported not to be possible",
)
_never_while(
    "QC03",
    lambda status: status.drives_powered == TriState.FALSE,
    "the drives were reported without power",
)


@client_check("QC04", "the reports did not cease during a trajectory")
def _heeds_silence(seen: Observed) -> Iterable[Observation]:
    """Look at trajectories during which the joint reports ceased for longer than a second."""
    times = [report.time for report in seen.reports.joints]
    for last, following in pairwise([*times, seen.trace.ended]):
        if following - last <= SILENCE_NS + REACTION_NS:
            continue
        for trajectory in _in_progress(seen, last):
            late = _sent_between(trajectory, last + SILENCE_NS + REACTION_NS, following)
            yield _late(trajectory, late, STATE_IGNORED, "more than 1 s after the last report")


@client_check("QC05", "no state connection was lost during a trajectory")
def _heeds_lost_state(seen: Observed) -> Iterable[Observation]:
    for link in seen.trace.links_for(Purpose.STATE):
        if link.closed is None or link.closed_by_client:
            continue
        for trajectory in _in_progress(seen, link.closed):
            back = _next_state_link(seen, link.closed)
            late = _sent_between(trajectory, link.closed + SILENCE_NS + REACTION_NS, back)
            yield _late(trajectory, late, STATE_IGNORED, "after the state connection was lost")


@client_check("QC06", "no reports, or no trajectory")
def _waits_for_report(seen: Observed) -> Iterable[Observation]:
    for trajectory in seen.trajectories() if seen.reports.joints else ():
        blind = seen.reports.last_joints(trajectory.begins) is None
        late = trajectory.steps[:1] if blind else []
        yield _late(trajectory, late, STATE_IGNORED, "before any report")


def _next_state_link(seen: Observed, time: int) -> int | None:
    opened = [link.opened for link in seen.trace.links_for(Purpose.STATE) if link.opened]
    return min((moment for moment in opened if moment > time), default=None)


def _in_progress(seen: Observed, time: int) -> list[SentTrajectory]:
    """Return the trajectories that were being sent at a time, as far as one can tell."""
    return [
        trajectory
        for trajectory in seen.motions.trajectories
        if trajectory.begins <= time + REACTION_NS
        and time <= trajectory.steps[-1].frame.time + REACTION_NS
        and (trajectory.stop is None or time <= trajectory.stop.time)
    ]


def _sent_between(trajectory: SentTrajectory, after: int, before: int | None) -> list[SentPoint]:
    return [
        step
        for step in trajectory.steps
        if after < step.frame.time and (before is None or step.frame.time < before)
    ]


def _late(trajectory: SentTrajectory, late: list[SentPoint], habit: str, words: str) -> Observation:
    """Return whether points came too late; excuse the one client that is known for it."""
    if not late:
        return trajectory, None
    step = late[0]
    detail = f"sequence {step.sequence} {words}"
    return step, detail if step.is_full else Habit(habit, detail)
