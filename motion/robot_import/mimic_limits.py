"""Mimic joint limits: the limits that followers impose on the joint that they follow.

Owns this rule only: a motor may go no further and no faster than the joints that follow it can, so
its range, speed and acceleration are narrowed to theirs, with a report. URDF does not state that
the limits of a mimic joint bind its leader, so it counts as an assumption. Values are [rad or m].
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeAlias

from ..description.schema import Term
from ..errors import RobotFileError
from .decisions import Decisions, ImportStep, on_screen
from .imported_chain import ImportedChain, ImportedJoint

Limits: TypeAlias = Mapping[str, float | None]
"""The fields lower, upper, velocity, acceleration and effort of a joint, by name."""

_RATES = (("velocity", "speed", "/s"), ("acceleration", "acceleration", "/s²"))


def narrowed_leaders(
    chain: ImportedChain, driven: Mapping[str, Limits], ramp: float, decisions: Decisions
) -> dict[str, Limits]:
    """Return the limits of the driven joints, narrowed to those of their followers.

    Args:
        chain: the chain; a follower of it that states no limits narrows nothing.
        driven: limits of the driven joints, by name; lower, upper and velocity are numbers.
        ramp: seconds to full speed, for an acceleration that is not stated.
        decisions: gets a report of each limit that is narrowed.

    Raises:
        RobotFileError: a follower's range leaves its leader none.
    """
    narrowed = dict(driven)
    motors = {joint.name: joint for joint in chain.driven}
    for joint in chain.joints:
        # The limits of a joint that several motors move together bind none of them alone.
        if joint.dependent is None or len(joint.dependent.terms) != 1:
            continue
        (term,) = joint.dependent.terms
        leader = motors[term.joint]
        limits = narrowed[leader.name]
        limits = _range(chain.file, leader, limits, joint, term, decisions)
        narrowed[leader.name] = _rates(leader, limits, joint, term, ramp, decisions)
    return narrowed


def _range(
    file: str,
    leader: ImportedJoint,
    limits: Limits,
    follower: ImportedJoint,
    term: Term,
    decisions: Decisions,
) -> Limits:
    if follower.lower is None or follower.upper is None or follower.dependent is None:
        return limits
    offset = follower.dependent.offset
    least, most = sorted((end - offset) / term.gain for end in (follower.lower, follower.upper))
    stated = (limits["lower"] or 0.0, limits["upper"] or 0.0)
    lower, upper = max(stated[0], least), min(stated[1], most)
    if (lower, upper) == stated:
        return limits
    own = _span(follower.lower, follower.upper, follower.unit)
    if not lower < upper:
        raise RobotFileError(
            file,
            f"joint {follower.name!r}.limit",
            f"is {own}, which {leader.name!r}, the joint it mimics, reaches nowhere between"
            f" {_span(*stated, leader.unit)}; accepted: limits that leave {leader.name!r} a range",
        )
    decisions.assumed(
        ImportStep.PLANNING,
        f"joint {leader.name!r} limits",
        f"narrowed to {_span(lower, upper, leader.unit)}, so that {follower.name!r}, which mimics"
        f" it, stays within its own {own}",
    )
    return {**limits, "lower": lower, "upper": upper}


def _rates(
    leader: ImportedJoint,
    limits: Limits,
    follower: ImportedJoint,
    term: Term,
    ramp: float,
    decisions: Decisions,
) -> Limits:
    narrowed = dict(limits)
    for (field, what, per), own in zip(
        _RATES, (follower.velocity, follower.acceleration), strict=True
    ):
        if own is None:
            continue
        stated = narrowed[field]
        if stated is None:
            stated = (narrowed["velocity"] or 0.0) / ramp
        if stated <= (allowed := own / abs(term.gain)):
            continue
        narrowed[field] = allowed
        decisions.assumed(
            ImportStep.PLANNING,
            f"joint {leader.name!r} {what}",
            f"narrowed to {on_screen(allowed, leader.unit)}{per}, so that {follower.name!r}, which"
            f" mimics it, keeps its own {on_screen(own, follower.unit)}{per}",
        )
    return narrowed


def _span(lower: float, upper: float, unit: str) -> str:
    return f"{on_screen(lower, unit)} to {on_screen(upper, unit)}"
