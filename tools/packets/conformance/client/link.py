"""Checks of connections: how often, how many, and what happens after one was lost."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise

from openpendant.simplemsg import CommType

from ..check import CannotJudge
from .check import Habit, Moment, Observation, Observed, client_check
from .setup import CONNECTED, RESTARTED, Purpose
from .trace import TracedFrame, TracedLink
from .trajectories import BEGINNINGS, PointAnswer, SentPoint, SentTrajectory

MOST_CONNECTS = 10
"""Connects to one port within a second."""

SECOND_NS = 1_000_000_000


@client_check("KC01", "the trace shows no connecting")
def _connects_calmly(seen: Observed) -> Iterable[Observation]:
    for port in sorted({link.port for link in seen.trace.links.values()}):
        times = [
            event.time
            for event in seen.trace.events
            if event.text.startswith(CONNECTED) and event.port == port
        ]
        for index, time in enumerate(times):
            within = sum(time <= other < time + SECOND_NS for other in times[index:])
            too_often = within > MOST_CONNECTS
            yield Moment(time), f"{within} connects to port {port}" if too_often else None


def _across_links(seen: Observed) -> Iterator[tuple[SentPoint, SentPoint]]:
    """Yield each last point on a connection with the next of its trajectory, on another one."""
    for trajectory in seen.motions.trajectories:
        for before, after in pairwise(trajectory.steps):
            if before.frame.link is not after.frame.link:
                yield before, after


@client_check("KC02", "no connection was lost during a trajectory")
def _skips_nothing(seen: Observed) -> Iterable[Observation]:
    for before, after in _across_links(seen):
        skipped = after.repeats is None and before.answer is PointAnswer.NONE
        skipped = skipped and before.frame.comm_type == CommType.REQUEST
        text = f"sequence {after.sequence} follows, {before.sequence} was never answered"
        yield after, text if skipped else None
    for trajectory in seen.motions.trajectories:
        if _is_abandoned(trajectory):
            yield trajectory, None


def _is_abandoned(trajectory: SentTrajectory) -> bool:
    """Return True if it ended with an unanswered point on a link that was lost."""
    last = trajectory.steps[-1]
    lost = last.frame.link.closed is not None and not last.frame.link.closed_by_client
    return last.answer is PointAnswer.NONE and lost


@client_check("KC03", "no trajectory went on over another connection")
def _goes_on_in_order(seen: Observed) -> Iterable[Observation]:
    for before, after in _across_links(seen):
        is_next = after.sequence in (before.sequence, before.index + 1)
        text = f"sequence {after.sequence} follows {before.sequence} on another connection"
        yield after, None if is_next else text


@client_check("KC04", "the client sent no points")
def _one_motion_link(seen: Observed) -> Iterable[Observation]:
    if len(seen.trace.links_for(Purpose.MOTION)) < 2:
        raise CannotJudge("the client had one motion connection only")
    carriers: list[TracedLink] = []
    for step in seen.motions.steps:
        link = step.frame.link
        others = [other for other in carriers if other is not link]
        open_now = [other for other in others if _is_open(other, step.frame)]
        yield step, f"points on {open_now[0].name}, too" if open_now else None
        if link not in carriers:
            carriers.append(link)


def _is_open(link: TracedLink, frame: TracedFrame) -> bool:
    """Return True if another connection was open and still used for points after this frame."""
    if link.closed is not None and link.closed <= frame.time:
        return False
    return any(other.from_client and other.time > frame.time for other in reversed(link.frames))


@client_check("KC05", "the controller was not restarted during a trajectory")
def _restart_ends(seen: Observed) -> Iterable[Observation]:
    restarts = [event.time for event in seen.trace.events if event.text == RESTARTED]
    for time in restarts:
        for trajectory in seen.motions.trajectories:
            if trajectory.begins > time:
                continue
            late = [step for step in trajectory.steps if step.frame.time > time]
            if not late:
                yield trajectory.steps[-1], None
                continue
            text = f"sequence {late[0].sequence} at a restarted controller"
            name = "industrial_robot_client: the unanswered point again after a reconnect"
            yield late[0], text if late[0].repeats is None else Habit(name, text)


@client_check("KC06", "no point was sent after a motion connection was lost")
def _resumes_or_restarts(seen: Observed) -> Iterable[Observation]:
    lost = any(
        link.closed is not None and not link.closed_by_client
        for link in seen.trace.links_for(Purpose.MOTION)
    )
    if not lost:
        raise CannotJudge("no motion connection was lost")
    firsts: dict[int, SentPoint] = {}
    for step in seen.motions.steps:
        firsts.setdefault(id(step.frame.link), step)
    for step in list(firsts.values())[1:]:
        goes_on = any(step in t.steps[1:] for t in seen.motions.trajectories)
        text = f"sequence {step.sequence} on a new connection belongs to no trajectory"
        yield step, None if goes_on or step.sequence in BEGINNINGS else text
