"""Checks of how a client stops the robot."""

from __future__ import annotations

from openpendant.simplemsg import CommType, JointTrajPt, JointTrajPtFull, TriState

from ..check import CheckFinding
from .check import Observed, Problem, Tally, client_check, each
from .setup import Purpose
from .trace import TracedFrame
from .trajectories import BEGINNINGS, SentPoint, SentTrajectory

NO_STOP = "the client sent no STOP"
LEAST_SEQUENCE = -4


@client_check("SC01")
def stop_is_request(seen: Observed) -> CheckFinding:
    """Look at the communication type of each stop."""
    return each(
        seen.motions.stops,
        lambda f: None if f.comm_type == CommType.REQUEST else f"communication type {f.comm_type}",
        NO_STOP,
    )


@client_check("SC02")
def stop_is_empty(seen: Observed) -> CheckFinding:
    """Look at the values of each stop."""

    def rule(frame: TracedFrame) -> Problem | None:
        match frame.message:
            case JointTrajPt(joints=joints, velocity=velocity, duration=duration):
                clean = not any((*joints, velocity, duration))
            case JointTrajPtFull(positions=positions, velocities=velocities, time=time):
                clean = not any((*positions, *velocities, time))
            case _:
                clean = True
        return None if clean else "STOP with values"

    return each(seen.motions.stops, rule, NO_STOP)


@client_check("SC03")
def stop_ends(seen: Observed) -> CheckFinding:
    """Look at the first point after each stop."""

    def rule(trajectory: SentTrajectory) -> Problem | None:
        first = trajectory.steps[0].sequence
        if first in BEGINNINGS:
            return None
        return f"sequence {first} after STOP"

    tally = Tally()
    after = {id(t.after_stop): t for t in seen.motions.trajectories if t.after_stop is not None}
    for stop in seen.motions.stops:
        trajectory = after.get(id(stop))
        tally.look(trajectory or stop, rule(trajectory) if trajectory else None)
    return tally.finding(NO_STOP)


@client_check("SC04")
def sequence_known(seen: Observed) -> CheckFinding:
    """Look for sequence numbers that mean nothing."""

    def rule(step: SentPoint) -> Problem | None:
        return f"sequence {step.sequence}" if step.sequence < LEAST_SEQUENCE else None

    return each(seen.motions.steps, rule, "the client sent no trajectory")


@client_check("SC05")
def stops_before_leaving(seen: Observed) -> CheckFinding:
    """Look at motion links that the client closed while motion was reported."""
    tally = Tally()
    stopped = [frame.time for frame in seen.motions.stops]
    for link in seen.trace.links_for(Purpose.MOTION):
        points = [step for step in seen.motions.steps if step.frame.link is link]
        if not points or not link.closed_by_client or link.closed is None:
            continue
        status = seen.reports.status_at(link.closed)
        if status is None or status.in_motion != TriState.TRUE:
            continue
        last = points[-1]
        did = any(last.frame.time <= time <= link.closed for time in stopped)
        tally.look(last, None if did else "the link was closed in motion, without STOP")
    return tally.finding("the client closed no motion link while the robot moved")
