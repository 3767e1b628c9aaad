"""Planning step (step 2) of a new robot: limits, home, and the pairs left out of collision checks.

Owns the data that planning needs beyond the model, and the rules for each where the description has
none. Values are chain-side unless said; screens show degrees and millimetres.

Owns also the search for a home without contact, and the rules of the schema's `allowed_collisions`:
neighbours; pairs further apart whose bounding shapes overlap so often that every alarm would be
false; and, as a last resort, pairs that touch at home. The sampling uses the same collision model
as planning.

Owns also the rule that a motor may go no further and no faster than the joints that follow it can,
so its range, speed and acceleration are narrowed to theirs, with a report. URDF does not state that
the limits of a mimic joint bind its leader, so it counts as an assumption.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..description.robot import SerialRobot
from ..description.schema import AllowedReason, Term
from ..errors import BadArgument, RobotFileError, WrongJointCount
from ..pose import Array
from .decisions import (
    RAMP,
    Decisions,
    ImportStep,
    MissingFact,
    assumed_limits,
    on_screen,
    typed_range,
    typed_rate,
    typed_values,
)
from .imported_chain import ImportedChain, ImportedJoint

if TYPE_CHECKING:
    from ..scene.collision import CollisionModel


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


Pairs = tuple[tuple[str, str, AllowedReason], ...]

OVERLAP_SHARE = 0.27
"""Least share of positions with contact at which a pair with one link between counts as coarse."""
ALWAYS_SHARE = 0.95
"""Least share of positions with contact at which any pair counts as coarse."""

_SAMPLES = 300
_HOME_TRIALS = 300


def neighbours(links: Sequence[str], shaped: Sequence[str]) -> Pairs:
    """Return each pair of successive links that have shapes; `links` are root to tip."""
    with_shapes = [link for link in links if link in shaped]
    return tuple((first, second, AllowedReason.ADJACENT) for first, second in pairwise(with_shapes))


def overlapping(robot: SerialRobot) -> Pairs:
    """Return pairs that touch in too many random positions for a contact to be real."""
    model = _collision_model(robot)
    random = np.random.default_rng(0)
    counts: Counter[tuple[str, str]] = Counter()
    for position in random.uniform(robot.limits.lower, robot.limits.upper, (_SAMPLES, robot.dof)):
        counts.update(_contacts(model, position))
    shaped = [link for link in robot.links if link in robot.collision]
    found = []
    for (first, second), count in sorted(counts.items()):
        apart = abs(shaped.index(first) - shaped.index(second))
        if count >= (OVERLAP_SHARE if apart <= 2 else ALWAYS_SHARE) * _SAMPLES:
            found.append((first, second, AllowedReason.OVERLAP))
    return tuple(found)


def touching(robot: SerialRobot, position: Sequence[float]) -> tuple[tuple[str, str], ...]:
    """Return the pairs of links that touch at a controller-side joint position."""
    return tuple(sorted(_contacts(_collision_model(robot), np.array(position))))


def free_home(robot: SerialRobot) -> Array | None:
    """Return the (n,) random position nearest to home where nothing touches, or None."""
    model = _collision_model(robot)
    random = np.random.default_rng(0)
    lower, upper = np.array(robot.limits.lower), np.array(robot.limits.upper)
    trials = random.uniform(lower, upper, (_HOME_TRIALS, robot.dof))
    effort = np.abs((trials - np.array(robot.home_position)) / (upper - lower)).sum(axis=1)
    for index in np.argsort(effort):
        position: Array = np.round(trials[index], 2)
        if (lower <= position).all() and (position <= upper).all() and not model.collides(position):
            return position
    return None


def _contacts(model: CollisionModel, position: Array) -> set[tuple[str, str]]:
    clearances = model.clearances(position).tolist()
    return {pair for pair, free in zip(model.pairs, clearances, strict=True) if free <= 0.0}


def _collision_model(robot: SerialRobot) -> CollisionModel:
    # Imported here, since a robot without shapes needs no pinocchio to be imported.
    from ..kinematics.serial import Kinematics
    from ..scene.collision import CollisionModel

    return CollisionModel(Kinematics(robot))


_STEP = ImportStep.PLANNING


def limits(chain: ImportedChain, decisions: Decisions) -> dict[str, Any]:
    """Return the fields `joints` and `acceleration_ramp_s` of a robot file."""
    driven = {joint.name: _driven_joint(joint, decisions) for joint in chain.driven}
    ramp = RAMP
    if any(joint.acceleration is None for joint in chain.driven):
        ramp = decisions.decide(
            MissingFact(
                _STEP,
                "acceleration_ramp_s",
                "seconds from rest to full speed",
                "acceleration = speed / ramp where it is not stated",
            ),
            RAMP,
            lambda seconds: f"{seconds:g} s",
            _seconds,
        )
    driven = narrowed_leaders(chain, driven, ramp, decisions)
    joints = [
        _joint(joint, driven[joint.name] if joint.driven else _followed(joint, driven))
        for joint in chain.joints
    ]
    return {"joints": joints, "acceleration_ramp_s": ramp}


def home(
    chain: ImportedChain,
    wished: tuple[float, ...] | None,
    coupling: int,
    content: Mapping[str, Any],
    decisions: Decisions,
) -> dict[str, Any]:
    """Return the field `home` of a robot file.

    Args:
        chain: the chain; its own home is used where none is wished.
        wished: chain-side joint values [rad or m].
        coupling: factor of joint 2 in joint 3.
        content: the robot file so far, with its joints.
        decisions: decides it where it is not stated.

    Raises:
        RobotFileError: a stated home has not one value per driven joint.
    """
    stated = chain.home if wished is None else wished
    if stated is not None:
        if len(stated) != len(chain.driven):
            problem = str(WrongJointCount(len(stated), len(chain.driven)))
            raise RobotFileError(chain.file, "home", problem)
        decisions.done(_STEP, "home", _in_words(stated, chain))
        return {"home": list(stated)}
    bounds = {joint["name"]: joint for joint in content["joints"]}
    controller = [
        0.0 if joint["lower"] < 0.0 < joint["upper"] else (joint["lower"] + joint["upper"]) / 2.0
        for joint in (bounds[each.name] for each in chain.driven)
    ]
    if coupling:
        controller[2] += coupling * controller[1]
    values = decisions.decide(
        MissingFact(
            _STEP,
            "home",
            f"{len(chain.driven)} joint values in degrees or mm",
            "zero, or the middle of a range without zero inside",
        ),
        tuple(controller),
        lambda values: _in_words(values, chain),
        lambda text: typed_values(text, tuple(joint.unit for joint in chain.driven)),
    )
    return {"home": list(values)}


def allowed_pairs(robot: SerialRobot, home_is_stated: bool, decisions: Decisions) -> dict[str, Any]:
    """Return the fields `allowed_collisions` and `home`, such that nothing touches at home."""
    if not robot.collision:
        decisions.done(_STEP, "self-collision", "no shapes, so nothing is checked")
        return {}
    pairs: Pairs = neighbours(robot.links, tuple(robot.collision))
    overlaps = overlapping(_allowing(robot, pairs))
    if overlaps:
        decisions.assumed(
            _STEP, "self-collision", f"never checked, they nearly always overlap: {_list(overlaps)}"
        )
    pairs = (*pairs, *overlaps)
    values = robot.home
    robot = _allowing(robot, pairs)
    if contacts := touching(robot, robot.home_position):
        names = ", ".join(" and ".join(pair) for pair in contacts)
        free = None if home_is_stated else free_home(robot)
        if free is None:
            pairs = (*pairs, *((*pair, AllowedReason.HOME) for pair in contacts))
            decisions.assumed(
                _STEP, "self-collision", f"never checked, they touch at home: {names}"
            )
        else:
            values = robot.to_model(free.tolist())
            nearest = f"the nearest position found where nothing does is {list(values)}"
            decisions.assumed(_STEP, "home", f"{names} touch there; {nearest}")
    decisions.done(
        _STEP,
        "self-collision",
        f"all pairs of links are checked but {len(pairs)}, neighbours above all",
    )
    return {
        "home": list(values),
        "allowed_collisions": [[first, second, reason.value] for first, second, reason in pairs],
    }


def checked_home(robot: SerialRobot, is_stated: bool, decisions: Decisions) -> dict[str, Any]:
    """Return the field `home`: one from which each first increment of the tool works, if possible.

    A stated home stays, and so does one where no better is found; the report says so.
    """
    from .home_search import home_to_jog_from, refused_in_words

    found, own = home_to_jog_from(robot)
    if own.is_good:
        each = " and ".join(f"{own.possible(frame)} of 12 in {frame}" for frame in ("base", "tool"))
        decisions.done(_STEP, "home", f"every first increment that the arm can do works: {each}")
        return {}
    why = refused_in_words(own)
    if is_stated:
        decisions.assumed(_STEP, "home", f"kept as stated, though {why}; see robots home-check")
        return {}
    if found is None:
        nowhere = "no position was found from which every first increment works"
        decisions.assumed(_STEP, "home", f"{nowhere}; from this one {why}")
        return {}
    values = robot.to_model(found.tolist())
    shown = ", ".join(
        on_screen(value, joint_unit)
        for value, joint_unit in zip(
            values, map(robot.limits.unit, range(robot.limits.dof)), strict=True
        )
    )
    decisions.assumed(_STEP, "home", f"{shown}, the nearest from which all work; before, {why}")
    return {"home": list(values)}


def _allowing(robot: SerialRobot, pairs: Pairs) -> SerialRobot:
    return robot.model_copy(update={"allowed_collisions": pairs})


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = 0.0
    if not 1e-3 <= seconds <= 1e3:
        raise BadArgument("ramp", text, "0.001 to 1000 seconds")
    return seconds


def _driven_joint(joint: ImportedJoint, decisions: Decisions) -> Limits:
    assumed, unit = assumed_limits(joint), joint.unit
    where = f"joint {joint.name!r}"
    screen = "mm" if unit == "m" else "degrees"
    if joint.lower is not None and joint.upper is not None:
        lower, upper = joint.lower, joint.upper
        decisions.done(_STEP, f"{where} limits", _span(lower, upper, unit))
    else:
        lower, upper = decisions.decide(
            MissingFact(
                _STEP, f"{where} limits", f"least and greatest position in {screen}", assumed.rule
            ),
            (assumed.lower, assumed.upper),
            lambda pair: _span(*pair, unit),
            lambda text: typed_range(text, unit),
        )
    velocity = joint.velocity
    if velocity is None:
        velocity = decisions.decide(
            MissingFact(_STEP, f"{where} speed", f"greatest speed in {screen}/s", "a cautious one"),
            assumed.velocity,
            lambda speed: f"{on_screen(speed, unit)}/s",
            lambda text: typed_rate(text, unit),
        )
    return {
        "lower": lower,
        "upper": upper,
        "velocity": velocity,
        "acceleration": joint.acceleration,
        "effort": joint.effort,
    }


def _followed(joint: ImportedJoint, driven: Mapping[str, Limits]) -> Limits:
    # Without a stated range, a follower has the range of its leaders' motion.
    if joint.dependent is None:
        return {}
    lower = upper = joint.dependent.offset
    velocity = 0.0
    for term in joint.dependent.terms:
        leader = driven[term.joint]
        bounds = sorted(term.gain * (leader[field] or 0.0) for field in ("lower", "upper"))
        lower, upper = lower + bounds[0], upper + bounds[1]
        velocity += abs(term.gain) * (leader["velocity"] or 0.0)
    stated = joint.lower is not None and joint.upper is not None
    return {
        "lower": joint.lower if stated else lower,
        "upper": joint.upper if stated else upper,
        "velocity": joint.velocity or velocity,
    }


def _joint(joint: ImportedJoint, limits: Limits) -> dict[str, Any]:
    described: dict[str, Any] = {
        "name": joint.name,
        "type": joint.type.value,
        "parent": joint.parent,
        "child": joint.child,
        "origin": joint.origin.model_dump(mode="json"),
    }
    if joint.axis is not None:
        described["axis"] = list(joint.axis)
    described |= limits
    if joint.dependent is not None:
        described["dependent"] = joint.dependent.model_dump(mode="json")
    return described


def _in_words(values: tuple[float, ...], chain: ImportedChain) -> str:
    return ", ".join(
        on_screen(value, joint.unit) for value, joint in zip(values, chain.driven, strict=True)
    )


def _list(pairs: Pairs) -> str:
    return ", ".join(f"{first} and {second}" for first, second, _ in pairs)
