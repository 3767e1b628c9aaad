"""Checks of what a client makes of the answers to its points, and of answers that never come."""

from __future__ import annotations

from bisect import bisect_right
from itertools import pairwise

from openpendant.simplemsg import CommType, MsgType

from ..findings import Finding
from .check import ClientCheck, Habit, Observed, Problem, Tally, client_check
from .trajectories import Answer

PATIENCE_NS = 5_000_000_000
"""A client that waits longer for the answer to a point waits for ever."""


@client_check(
    "RC12",
    "a reply of another type is not taken for the answer",
    "industrial_core joint_traj_pt_message: the reply is of type 11 (Fanuc: 10, Motoman: 2002)",
)
def minds_the_type(seen: Observed) -> Finding:
    """Look at what follows a reply of another type."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        following = dict(trajectory.pairs)
        for step in trajectory.advancing:
            if step.answer is not Answer.WRONG_TYPE:
                continue
            on = following.get(step)
            problem: Problem | None = None
            if on is not None and on.frame.msg_type == MsgType.JOINT_TRAJ_PT:
                name = "industrial_robot_client: any frame counts as the answer"
                problem = Habit(name, f"{on.where} the next point follows")
            elif on is not None:
                problem = f"{on.where} the next point follows"
            tally.look(step, problem)
    return tally.finding("no point was answered with another type")


@client_check(
    "RC13",
    "an unreadable reply is not taken for success",
    "industrial_core simple_message.cpp: a reply with code 0 is invalid",
)
def minds_the_code(seen: Observed) -> Finding:
    """Look at what follows a reply with reply code 0."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        for step, on in zip(trajectory.steps, [*trajectory.steps[1:], None], strict=True):
            if step.answer is not Answer.UNREADABLE:
                continue
            problem: Problem | None = None
            if on is not None and on.repeats is step:
                name = "industrial_robot_client: the same point again after an invalid reply"
                problem = Habit(name, f"sequence {on.sequence} again")
            elif on is not None:
                problem = f"sequence {on.sequence} follows as if it had been taken"
            tally.look(step, problem)
    return tally.finding("no point was answered with reply code 0")


@client_check(
    "MC17",
    "a refused point ends its trajectory",
    "REP-I0006: failure means that the request was not taken; what follows would jump",
)
def refusal_ends(seen: Observed) -> Finding:
    """Look at what follows a refused point."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        following = dict(pairwise(trajectory.steps))
        for step in trajectory.steps:
            if step.answer is not Answer.REFUSED:
                continue
            on = following.get(step)
            problem: Problem | None = None
            if on is not None and on.frame.msg_type == MsgType.JOINT_TRAJ_PT:
                name = "industrial_robot_client: FAILURE is ignored, the next point follows"
                problem = Habit(name, f"sequence {on.sequence} after {step.sequence} was refused")
            elif on is not None:
                problem = f"sequence {on.sequence} follows although {step.sequence} was refused"
            tally.look(step, problem)
    return tally.finding("no point was refused")


@client_check(
    "MC18",
    "a streamed trajectory is not left in its middle in silence",
    "observed: industrial_robot_client waits without limit for a reply; then STOP waits, too",
)
def reacts_to_silence(seen: Observed) -> Finding:
    """Look at what the client does within 5 s of a point that is never answered."""
    frames = [*seen.motions.stops, *(step.frame for step in seen.motions.steps)]
    moves = sorted(frames, key=lambda frame: frame.number)
    tally = Tally()
    for step in seen.motions.steps:
        sent, link, reply = step.frame.time, step.frame.link, step.reply
        if step.frame.comm_type != CommType.REQUEST:
            continue
        at = bisect_right(moves, step.frame.number, key=lambda frame: frame.number)
        act = moves[at] if at < len(moves) else None
        ends = [seen.trace.ended if link.closed is None else link.closed]
        ends += [frame.time for frame in (act, reply) if frame is not None]
        waited = min(ends) - sent
        left = reply is None and link.closed_by_client
        gave_up = left or (act is not None and (reply is None or act.number < reply.number))
        if waited >= PATIENCE_NS:
            name = "industrial_robot_client: waits without limit for the answer to a point"
            tally.look(step, Habit(name, f"nothing for {waited / 1e9:.1f} s"))
        elif gave_up:
            tally.look(step, None)
    return tally.finding("every point was answered soon, or the link was lost before")


CHECKS: tuple[ClientCheck, ...] = (
    minds_the_type,
    minds_the_code,
    refusal_ends,
    reacts_to_silence,
)
