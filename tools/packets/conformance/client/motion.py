"""Checks of the order of trajectory points: beginnings, sequence numbers, repetitions, ends."""

from __future__ import annotations

from openpendant.simplemsg import CommType, SpecialSequence

from ..findings import Finding
from .check import ClientCheck, Habit, Observed, Problem, Tally, client_check, each
from .trajectories import BEGINNINGS, Answer, Step, Trajectory

NO_TRAJECTORY = "the client sent no trajectory"


@client_check(
    "MC01",
    "a trajectory begins with its first point",
    "REP-I0006, sequence: 0 when streaming; industrial_core joint_traj_pt.h: -1 when downloading",
)
def begins_at_first(seen: Observed) -> Finding:
    """Look at the first sequence number of each trajectory."""

    def rule(trajectory: Trajectory) -> Problem | None:
        first = trajectory.steps[0].sequence
        return None if first in BEGINNINGS else f"it begins with sequence {first}"

    fresh = [item for item in seen.motions.trajectories if item.after_stop is None]
    return each(fresh, rule, NO_TRAJECTORY)


@client_check(
    "MC02",
    "sequence numbers increase by one",
    "REP-I0006: a server aborts on a point out of order; industrial_core streams 0 to n-1",
)
def increases_by_one(seen: Observed) -> Finding:
    """Compare each sequence number with the one before."""

    def rule(pair: tuple[Step, Step]) -> Problem | None:
        before, after = pair
        if after.sequence in (before.index + 1, SpecialSequence.END):
            return None
        return f"sequence {after.sequence} follows {before.sequence}"

    tally = Tally()
    for trajectory in seen.motions.trajectories:
        for pair in trajectory.pairs:
            tally.look(pair[1], rule(pair))
    return tally.finding("no trajectory has two points")


@client_check(
    "MC03",
    "a downloaded trajectory ends with sequence -3",
    "industrial_core joint_trajectory_downloader; abb_driver moves on -3 only",
)
def download_ends(seen: Observed) -> Finding:
    """Look at the last sequence number of downloads."""

    def rule(trajectory: Trajectory) -> Problem | None:
        last = trajectory.steps[-1]
        if last.sequence != SpecialSequence.END:
            was_cut = trajectory.stop is not None or last.frame.link.closed is not None
            return None if was_cut else f"the last point has sequence {last.sequence}"
        first = trajectory.steps[0]
        if len(trajectory.steps) == 2 and last.parts[0].positions == first.parts[0].positions:
            name = "industrial_robot_client: a single point is downloaded twice, as -1 and -3"
            return Habit(name, "one point, sent twice")
        return None

    downloads = [item for item in seen.motions.trajectories if item.is_download]
    return each(downloads, rule, "the client downloads nothing")


@client_check(
    "MC04",
    "streamed points are requests, downloaded ones topics",
    "industrial_core joint_trajectory_streamer, joint_trajectory_downloader",
)
def comm_type_fits(seen: Observed) -> Finding:
    """Look at the communication type of each point."""

    def rule(trajectory: Trajectory) -> Problem | None:
        wanted = CommType.TOPIC if trajectory.is_download else CommType.REQUEST
        wrong = [step for step in trajectory.steps if step.frame.comm_type != wanted]
        if not wrong:
            return None
        step = wrong[0]
        kind = "download" if trajectory.is_download else "stream"
        return f"sequence {step.sequence} of a {kind} has communication type {step.frame.comm_type}"

    return each(seen.motions.trajectories, rule, NO_TRAJECTORY)


@client_check(
    "MC05",
    "a point is sent again only where its answer was lost or said so",
    "observed: the stock client repeats after a lost link; motoman_driver after BUSY",
)
def repeats_with_reason(seen: Observed) -> Finding:
    """Look at each point that has the sequence number of the one before."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        last = trajectory.advancing[-1].sequence
        for step in trajectory.steps:
            if step.repeats is not None:
                tally.look(step, _repetition(step, step.repeats, last))
    return tally.finding("no point was sent twice")


def _repetition(step: Step, before: Step, last: int) -> Problem | None:
    match before.answer:
        case Answer.BUSY:
            return None
        case Answer.NONE if before.frame.link is not step.frame.link:
            return None
        case Answer.UNREADABLE:
            name = "industrial_robot_client: the same point again after an invalid reply"
            return Habit(name, f"sequence {step.sequence} again")
        case Answer.TAKEN if step.sequence == last and step.frame.data == before.frame.data:
            name = "industrial_robot_client: the last message repeated up to min_buffer_size"
            return Habit(name, f"sequence {step.sequence} again")
    return f"sequence {step.sequence} again, although its answer was: {before.answer.value}"


@client_check(
    "MC06",
    "a point that is sent again is unchanged",
    "observed: the stock client repeats the message as it was",
)
def repeats_unchanged(seen: Observed) -> Finding:
    """Compare repetitions with what they repeat, byte by byte."""

    def rule(step: Step) -> Problem | None:
        assert step.repeats is not None
        same = step.frame.data == step.repeats.frame.data
        return None if same else f"sequence {step.sequence} again with other values"

    repeated = [step for step in seen.motions.steps if step.repeats is not None]
    return each(repeated, rule, "no point was sent twice")


@client_check(
    "MC16",
    "all points of a trajectory are of one message type",
    "industrial_core joint_trajectory_streamer: one message class a client",
)
def one_type(seen: Observed) -> Finding:
    """Compare the types of a trajectory's points."""

    def rule(trajectory: Trajectory) -> Problem | None:
        types = {step.frame.msg_type for step in trajectory.steps}
        return f"types {sorted(types)}" if len(types) > 1 else None

    return each(seen.motions.trajectories, rule, NO_TRAJECTORY)


CHECKS: tuple[ClientCheck, ...] = (
    begins_at_first,
    increases_by_one,
    download_ends,
    comm_type_fits,
    repeats_with_reason,
    repeats_unchanged,
    one_type,
)
