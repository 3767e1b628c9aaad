"""Checks of the velocities of full points: at rest at both ends, leading along the way between."""

from __future__ import annotations

import math
from collections.abc import Iterator

from openpendant.simplemsg import MOTOMAN, MsgType, TriState, ValidField

from ..findings import Finding
from .check import ClientCheck, Habit, Observed, Problem, Tally, client_check, each
from .limits import ROUNDING
from .trajectories import Answer, Part, Trajectory

LEAST_WAY = 0.01
"""A joint that goes less far, over all, is not judged by its velocities [rad or m]."""

LEAST_SHARE, LARGEST_SHARE = -0.25, 2.0
"""What velocities add up to, over the way: 0 where each point is a stop, 1.5 in the steepest cubic
without overshoot."""

ENDED_FOR_NS = 1_000_000_000
"""A trajectory without another point for so long is over."""


@client_check(
    "LC07",
    "the first point of a full trajectory is at rest",
    "observed: motoman_driver's controller starts at once with the velocity of the first point",
)
def starts_at_rest(seen: Observed) -> Finding:
    """Look at the velocities of each first point."""
    is_motoman = seen.trace.setup.dialect is MOTOMAN

    def rule(trajectory: Trajectory) -> Problem | None:
        for part in trajectory.steps[0].parts:
            fastest = max(map(abs, part.velocities), default=0.0)
            if part.valid & ValidField.VELOCITY and not fastest <= ROUNDING:
                text = f"it begins with a velocity of {fastest:g}"
                name = "motoman_driver: the velocity of the first point is passed on as it is"
                return Habit(name, text) if is_motoman else text
        return None

    full = [
        item
        for item in seen.motions.trajectories
        if item.steps[0].frame.msg_type != MsgType.JOINT_TRAJ_PT
    ]
    return each(full, rule, "the client sent no point of type 14 or 2016")


@client_check(
    "LC09",
    "velocities of full points lead from one position to the next",
    "REP-I0006, JOINT_TRAJ_PT_FULL; motoman_driver's controller interpolates with both",
)
def velocities_lead_there(seen: Observed) -> Finding:
    """Compare what the velocities of a trajectory add up to with its way, joint by joint."""
    tally = Tally()
    for trajectory in seen.motions.trajectories:
        problem = _misled(trajectory)
        if problem is not None:
            tally.look(trajectory, problem or None)
    return tally.finding("no full trajectory with velocities has a way to go")


def _misled(trajectory: Trajectory) -> str | None:
    """Return what is wrong with the velocities; empty for nothing, None where none are given."""
    ways: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for before, after in trajectory.pairs:
        for one, other in zip(before.parts, after.parts, strict=False):
            for joint, led, went in _led_and_went(one, other):
                ways.setdefault((one.group, joint), []).append((led, went))
    judged = False
    for (_, joint), pairs in ways.items():
        scale = sum(went * went for _, went in pairs)
        if not scale > LEAST_WAY * LEAST_WAY:
            continue
        judged = True
        share = sum(led * went for led, went in pairs) / scale
        if not LEAST_SHARE <= share <= LARGEST_SHARE:
            return f"the velocities of joint {joint + 1} lead {share:.3g} times as far as it goes"
    return "" if judged else None


def _led_and_went(one: Part, other: Part) -> Iterator[tuple[int, float, float]]:
    """Yield joint, way by the mean velocity and way by the positions, from point to point."""
    meant = ValidField.TIME | ValidField.POSITION | ValidField.VELOCITY
    if one.valid & meant != meant or other.valid & meant != meant:
        return
    if one.time is None or other.time is None or not other.time > one.time:
        return
    for joint, (start, goal) in enumerate(zip(one.positions, other.positions, strict=True)):
        mean = (one.velocities[joint] + other.velocities[joint]) / 2
        led, went = mean * (other.time - one.time), goal - start
        if math.isfinite(led) and math.isfinite(went):
            yield joint, led, went


@client_check(
    "LC10",
    "a full trajectory that was sent to its end ends at rest",
    "observed: motoman_driver's controller stands at once behind the last point",
)
def ends_at_rest(seen: Observed) -> Finding:
    """Look at the velocities of the last point of what nothing cut short."""
    is_motoman = seen.trace.setup.dialect is MOTOMAN

    def rule(trajectory: Trajectory) -> Problem | None:
        for part in trajectory.steps[-1].parts:
            fastest = max(map(abs, part.velocities), default=0.0)
            if part.valid & ValidField.VELOCITY and not fastest <= ROUNDING:
                text = f"it ends with a velocity of {fastest:g}"
                name = "motoman_driver: the velocity of the last point is passed on as it is"
                return Habit(name, text) if is_motoman else text
        return None

    whole = [item for item in seen.motions.trajectories if _is_whole(item, seen)]
    return each(whole, rule, "no full trajectory was seen to its end")


def _is_whole(trajectory: Trajectory, seen: Observed) -> bool:
    """Tell whether a full trajectory ended because its points did, as far as can be seen."""
    last = trajectory.steps[-1]
    if last.frame.msg_type == MsgType.JOINT_TRAJ_PT or trajectory.stop is not None:
        return False
    later = [item.begins for item in seen.motions.trajectories if item.begins > last.frame.time]
    closed = [link.closed for link in seen.trace.links.values() if link.closed is not None]
    until = min([seen.trace.ended, *later, *(time for time in closed if time > last.frame.time)])
    status = seen.reports.status_at(last.frame.time + ENDED_FOR_NS)
    is_sound = status is None or status.e_stopped != TriState.TRUE
    is_quiet = until - last.frame.time >= ENDED_FOR_NS
    return last.answer is Answer.TAKEN and is_sound and is_quiet


CHECKS: tuple[ClientCheck, ...] = (
    starts_at_rest,
    velocities_lead_there,
    ends_at_rest,
)
