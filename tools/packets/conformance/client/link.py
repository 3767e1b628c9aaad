"""Checks of connections: how often, how many, and what happens after one was lost."""

from __future__ import annotations

from itertools import pairwise

from openpendant.simplemsg import CommType

from ..check import CheckFinding, not_applicable
from .check import Habit, Moment, Observed, Problem, Tally, client_check, each
from .setup import CONNECTED, RESTARTED, Purpose
from .trace import TracedFrame, TracedLink
from .trajectories import BEGINNINGS, PointAnswer, SentPoint, SentTrajectory

MOST_CONNECTS = 10
"""Connects to one port within a second."""

SECOND_NS = 1_000_000_000


@client_check("KC01")
def connects_calmly(seen: Observed) -> CheckFinding:
    """Count the connects to each port within any second."""
    tally = Tally()
    for port in sorted({link.port for link in seen.trace.links.values()}):
        times = [
            event.time
            for event in seen.trace.events
            if event.text.startswith(CONNECTED) and event.port == port
        ]
        for index, time in enumerate(times):
            within = sum(time <= other < time + SECOND_NS for other in times[index:])
            too_often = within > MOST_CONNECTS
            tally.look(Moment(time), f"{within} connects to port {port}" if too_often else None)
    return tally.finding("the trace shows no connecting")


@client_check("KC02")
def skips_nothing(seen: Observed) -> CheckFinding:
    """Look at the first point of a trajectory on a new connection."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        for before, after in pairwise(trajectory.steps):
            if before.frame.link is after.frame.link:
                continue
            skipped = after.repeats is None and before.answer is PointAnswer.NONE
            skipped = skipped and before.frame.comm_type == CommType.REQUEST
            text = f"sequence {after.sequence} follows, {before.sequence} was never answered"
            tally.look(after, text if skipped else None)
    for trajectory in _abandoned(seen):
        tally.look(trajectory, None)
    return tally.finding("no connection was lost during a trajectory")


@client_check("KC03")
def goes_on_in_order(seen: Observed) -> CheckFinding:
    """Compare sequence numbers across connections."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        for before, after in pairwise(trajectory.steps):
            if before.frame.link is after.frame.link:
                continue
            is_next = after.sequence in (before.sequence, before.index + 1)
            text = f"sequence {after.sequence} follows {before.sequence} on another connection"
            tally.look(after, None if is_next else text)
    return tally.finding("no trajectory went on over another connection")


@client_check("KC04")
def one_motion_link(seen: Observed) -> CheckFinding:
    """Look for points on two connections that were open together."""
    tally = Tally()
    carriers: list[TracedLink] = []
    for step in seen.motions.steps:
        link = step.frame.link
        others = [other for other in carriers if other is not link]
        open_now = [other for other in others if _is_open(other, step.frame)]
        tally.look(step, f"points on {open_now[0].name}, too" if open_now else None)
        if link not in carriers:
            carriers.append(link)
    if len(seen.trace.links_for(Purpose.MOTION)) < 2:
        return not_applicable("the client had one motion connection only")
    return tally.finding("the client sent no points")


def _is_open(link: TracedLink, frame: TracedFrame) -> bool:
    """Return True if another connection was open and still used for points after this frame."""
    if link.closed is not None and link.closed <= frame.time:
        return False
    return any(other.from_client and other.time > frame.time for other in reversed(link.frames))


@client_check("KC05")
def restart_ends(seen: Observed) -> CheckFinding:
    """Look at the points that follow a restart of the controller."""
    tally = Tally()
    for event in seen.trace.events:
        if event.text != RESTARTED:
            continue
        for trajectory in seen.motions.trajectories:
            if trajectory.begins > event.time:
                continue
            late = [step for step in trajectory.steps if step.frame.time > event.time]
            problem: Problem | None = None
            if late and late[0].repeats is not None:
                name = "industrial_robot_client: the unanswered point again after a reconnect"
                problem = Habit(name, f"sequence {late[0].sequence} at a restarted controller")
            elif late:
                problem = f"sequence {late[0].sequence} at a restarted controller"
            tally.look(late[0] if late else trajectory.steps[-1], problem)
    return tally.finding("the controller was not restarted during a trajectory")


@client_check("KC06")
def resumes_or_restarts(seen: Observed) -> CheckFinding:
    """Look at the first point on each connection that follows a lost one."""

    def rule(step: SentPoint) -> Problem | None:
        if step.sequence in BEGINNINGS or any(
            step in t.steps[1:] for t in seen.motions.trajectories
        ):
            return None
        return f"sequence {step.sequence} on a new connection belongs to no trajectory"

    lost = any(
        link.closed is not None and not link.closed_by_client
        for link in seen.trace.links_for(Purpose.MOTION)
    )
    if not lost:
        return not_applicable("no motion connection was lost")
    firsts: dict[int, SentPoint] = {}
    for step in seen.motions.steps:
        firsts.setdefault(id(step.frame.link), step)
    return each(
        list(firsts.values())[1:], rule, "no point was sent after a motion connection was lost"
    )


def _abandoned(seen: Observed) -> list[SentTrajectory]:
    """Return the trajectories that ended with an unanswered point on a link that was lost."""
    return [
        trajectory
        for trajectory in seen.motions.trajectories
        if trajectory.steps[-1].answer is PointAnswer.NONE
        and trajectory.steps[-1].frame.link.closed is not None
        and not trajectory.steps[-1].frame.link.closed_by_client
    ]
