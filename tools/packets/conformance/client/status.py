"""Checks of what the client does when the controller reports trouble, or reports nothing."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

from openpendant.simplemsg import MsgType, Status, TriState

from ..check import CheckFinding
from .check import Habit, Moment, Observed, Tally, client_check
from .setup import TRIGGERED, Purpose
from .trajectories import SentPoint, SentTrajectory

REACTION_NS = 250_000_000
"""A client has this long to read a report and act on it."""

SILENCE_NS = 1_000_000_000
"""The ROS-I action server calls a controller dead after so long without feedback."""

STATUS_IGNORED = "industrial_robot_client: the streamer does not look at robot_status"
STATE_IGNORED = "industrial_robot_client: the streamer does not know whether there are reports"

Condition = Callable[[Status], bool]


@client_check("QC01")
def heeds_emergency_stop(seen: Observed) -> CheckFinding:
    """Look at trajectories during which an emergency stop was reported."""
    tally = Tally()
    for began, ended in seen.reports.spells(lambda status: status.e_stopped == TriState.TRUE):
        for trajectory in _in_progress(seen, began):
            late = _sent_between(trajectory, began + REACTION_NS, ended)
            _note(tally, trajectory, late, STATUS_IGNORED, "after an emergency stop was reported")
    return tally.finding("no emergency stop was reported during a trajectory")


@client_check("QC02")
def heeds_motion_possible(seen: Observed) -> CheckFinding:
    """Look at the beginnings of trajectories while motion_possible was false."""
    return _begins_while(
        seen,
        lambda status: status.motion_possible == TriState.FALSE,
        "motion was reported not to be possible",
    )


@client_check("QC03")
def heeds_power(seen: Observed) -> CheckFinding:
    """Look at the beginnings of trajectories while drives_powered was false."""
    return _begins_while(
        seen,
        lambda status: status.drives_powered == TriState.FALSE,
        "the drives were reported without power",
    )


@client_check("QC04")
def heeds_silence(seen: Observed) -> CheckFinding:
    """Look at trajectories during which the joint reports ceased for longer than a second."""
    tally = Tally()
    times = [report.time for report in seen.reports.joints]
    for last, following in pairwise([*times, seen.trace.ended]):
        if following - last <= SILENCE_NS + REACTION_NS:
            continue
        for trajectory in _in_progress(seen, last):
            late = _sent_between(trajectory, last + SILENCE_NS + REACTION_NS, following)
            _note(tally, trajectory, late, STATE_IGNORED, "more than 1 s after the last report")
    return tally.finding("the reports did not cease during a trajectory")


@client_check("QC05")
def heeds_lost_state(seen: Observed) -> CheckFinding:
    """Look at trajectories during which the controller closed the state connection."""
    tally = Tally()
    for link in seen.trace.links_for(Purpose.STATE):
        if link.closed is None or link.closed_by_client:
            continue
        for trajectory in _in_progress(seen, link.closed):
            back = _next_state_link(seen, link.closed)
            late = _sent_between(trajectory, link.closed + SILENCE_NS + REACTION_NS, back)
            _note(tally, trajectory, late, STATE_IGNORED, "after the state connection was lost")
    return tally.finding("no state connection was lost during a trajectory")


@client_check("QC06")
def waits_for_report(seen: Observed) -> CheckFinding:
    """Look whether there was a report before each trajectory."""
    tally = Tally()
    for trajectory in seen.motions.trajectories if seen.reports.joints else ():
        blind = seen.reports.last_joints(trajectory.begins) is None
        late = trajectory.steps[:1] if blind else []
        _note(tally, trajectory, late, STATE_IGNORED, "before any report")
    return tally.finding("no reports, or no trajectory")


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


def _begins_while(seen: Observed, holds: Condition, words: str) -> CheckFinding:
    """Judge the beginnings of trajectories in the spells of a condition.

    Where none begins in a spell, that is what should be; but only a spell that a trajectory, or an
    attempt at one, could have fallen into says anything.
    """
    tally = Tally()
    for began, ended in seen.reports.spells(holds):
        if ended - began <= REACTION_NS:
            continue
        late = [
            trajectory
            for trajectory in seen.motions.trajectories
            if began + REACTION_NS < trajectory.begins < ended
        ]
        for trajectory in late:
            _note(tally, trajectory, trajectory.steps[:1], STATUS_IGNORED, f"although {words}")
        for event in seen.trace.events:
            if event.text == TRIGGERED and began <= event.time < ended and not late:
                tally.look(Moment(event.time), None)
    return tally.finding(f"no trajectory was wanted while {words}")


def _note(
    tally: Tally, trajectory: SentTrajectory, late: list[SentPoint], habit: str, words: str
) -> None:
    """Note whether points came too late; excuse the one client that is known for it."""
    if not late:
        tally.look(trajectory, None)
        return
    step = late[0]
    detail = f"sequence {step.sequence} {words}"
    excused = step.frame.msg_type == MsgType.JOINT_TRAJ_PT
    tally.look(step, Habit(habit, detail) if excused else detail)
