"""Rules of a robot file between several fields.

Owns every rule that a single field's type cannot express. Each rule yields (field, problem) pairs;
the problem names the value found and what would be accepted. Reads robots, changes nothing.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from .field_problems import Problem
from .schema import (
    OWN_NAMES,
    CouplingType,
    FixedJoint,
    Joint,
    ParallelFacts,
    Placement,
    SerialFacts,
    Variable,
)

MAX_DOF = 10  # a simple-message joint vector holds ten values

# Beyond these a file is far more likely to hold degrees or millimetres than such a machine.
MAX_ANGLE = 8.0 * math.pi
MAX_ANGULAR_SPEED = 60.0
MAX_LENGTH = 100.0
MAX_LINEAR_SPEED = 20.0
MAX_FIXED_ANGLE = 2.0 * math.pi + 1e-6

MAX_GAIN = 1e3

_AXIS_LENGTHS = (1e-3, 1e3)
_LEG_TOLERANCE = 1e-6


def serial_problems(robot: SerialFacts) -> Iterator[Problem]:
    """Yield every broken rule of a serial robot; nothing if it is sound."""
    structure = [*_names(robot), *_chain(robot), *_count(robot)]
    yield from structure
    for index, joint in enumerate(robot.joints):
        where = f"joints[{index}] ({joint.name})"
        yield from _placement(f"{where}.origin", joint.origin)
        if isinstance(joint, Joint):
            yield from _motion(where, joint)
    yield from _placement("base_frame", robot.base_frame)
    yield from _frames(robot)
    yield from _dependence(robot)
    coupling = list(_coupling(robot))
    yield from coupling
    if not structure and not coupling:
        yield from _home(robot)
        yield from _positions(robot)
    yield from _dh(robot)
    yield from _vrm(robot)
    yield from _links(robot)


def parallel_problems(robot: ParallelFacts) -> Iterator[Problem]:
    """Yield every broken rule of a parallel robot; nothing if it is sound."""
    legs = robot.joint_names
    if len(legs) != robot.dof:
        yield "joint_names", f"names {len(legs)} legs; accepted: dof = {robot.dof}"
    yield from _unique("joint_names", "leg", legs)
    for field, anchors in (
        ("base_anchors", robot.base_anchors),
        ("platform_anchors", robot.platform_anchors),
    ):
        if tuple(anchor.leg for anchor in anchors) != legs:
            yield field, "accepted: one anchor per leg, in the order of joint_names"
    leg = robot.leg
    if not leg.min_length < leg.home_length < leg.max_length:
        yield "leg", "accepted: min_length below home_length below max_length"
    for name, base, platform in zip(legs, robot.base_anchors, robot.platform_anchors, strict=False):
        x, y, z = platform.xyz
        length = math.dist((x, y, z + robot.home_height), base.xyz)
        if abs(length - leg.home_length) > _LEG_TOLERANCE:
            yield (
                "leg.home_length",
                f"is {leg.home_length} m, but {name} measures {length:.9f} m at home",
            )
    if len(robot.home) != robot.dof or any(robot.home):
        yield "home", f"accepted: {robot.dof} zeros, the pose variables being about home"


def _names(robot: SerialFacts) -> Iterator[Problem]:
    yield from _unique("joints", "joint", (joint.name for joint in robot.joints))
    yield from _unique("joints", "link", robot.links)


def _unique(field: str, what: str, names: Iterable[str]) -> Iterator[Problem]:
    for name, count in Counter(names).items():
        if count > 1:
            yield field, f"has {count} {what}s called {name!r}; accepted: each name once"


def _chain(robot: SerialFacts) -> Iterator[Problem]:
    if not robot.joints:
        yield "joints", "is empty; accepted: the joints from root_link to tool_link"
        return
    tip = robot.root_link
    for index, joint in enumerate(robot.joints):
        if joint.parent != tip:
            yield (
                f"joints[{index}] ({joint.name}).parent",
                f"is {joint.parent!r}, which does not continue the chain; accepted: {tip!r}",
            )
        tip = joint.child
    if robot.tool_link != tip:
        yield "tool_link", f"is {robot.tool_link!r}; accepted: the last joint's child {tip!r}"
    if robot.flange_link is not None and robot.flange_link not in robot.links:
        yield "flange_link", f"is {robot.flange_link!r}; accepted: a link of the chain"


def _count(robot: SerialFacts) -> Iterator[Problem]:
    driven = len(robot.driven)
    if robot.dof != driven:
        yield "dof", f"is {robot.dof}, but {driven} joints are driven; accepted: {driven}"
    if not 1 <= driven <= MAX_DOF:
        yield "joints", f"has {driven} driven joints; accepted: 1 to {MAX_DOF}"
    if len(robot.home) != driven:
        yield "home", f"has {len(robot.home)} values; accepted: {driven}, one per driven joint"


def _motion(where: str, joint: Joint) -> Iterator[Problem]:
    shortest, longest = _AXIS_LENGTHS
    if not shortest <= math.hypot(*joint.axis) <= longest:
        yield f"{where}.axis", f"is {list(joint.axis)}; accepted: a direction, not zero"
    unit = "m" if joint.prismatic else "rad"
    if not joint.lower < joint.upper:
        accepted = f"less than upper = {joint.upper} {unit}"
        yield f"{where}.lower", f"is {joint.lower} {unit}; accepted: {accepted}"
    farthest = MAX_LENGTH if joint.prismatic else MAX_ANGLE
    for field, value in (("lower", joint.lower), ("upper", joint.upper)):
        if abs(value) > farthest:
            yield f"{where}.{field}", _unit_doubt(value, farthest, unit)
    fastest = MAX_LINEAR_SPEED if joint.prismatic else MAX_ANGULAR_SPEED
    if joint.velocity > fastest:
        yield f"{where}.velocity", _unit_doubt(joint.velocity, fastest, f"{unit}/s")


def _unit_doubt(value: float, limit: float, unit: str) -> str:
    wrong = "millimetres" if unit.startswith("m") else "degrees"
    return f"is {value} {unit}; accepted: at most {limit:.4g} {unit} (is this in {wrong}?)"


def _placement(where: str, placement: Placement) -> Iterator[Problem]:
    for value in placement.xyz:
        if abs(value) > MAX_LENGTH:
            yield f"{where}.xyz", _unit_doubt(value, MAX_LENGTH, "m")
    for value in placement.rpy:
        if abs(value) > MAX_FIXED_ANGLE:
            yield f"{where}.rpy", _unit_doubt(value, MAX_FIXED_ANGLE, "rad")


def _frames(robot: SerialFacts) -> Iterator[Problem]:
    still = [robot.root_link]
    for joint in robot.joints:
        if not isinstance(joint, FixedJoint):
            break
        still.append(joint.child)
    if robot.base_frame.parent not in still:
        yield (
            "base_frame.parent",
            f"is {robot.base_frame.parent!r}; accepted: a link that never moves ({_list(still)})",
        )


def _dependence(robot: SerialFacts) -> Iterator[Problem]:
    driven: list[str] = []
    for index, joint in enumerate(robot.joints):
        if not isinstance(joint, Joint):
            continue
        if joint.dependent is None:
            driven.append(joint.name)
            continue
        where = f"joints[{index}] ({joint.name}).dependent"
        farthest = MAX_LENGTH if joint.prismatic else MAX_ANGLE
        if abs(joint.dependent.offset) > farthest:
            yield (
                f"{where}.offset",
                f"is {joint.dependent.offset}; accepted: at most {farthest:.4g}",
            )
        for term in joint.dependent.terms:
            if abs(term.gain) > MAX_GAIN:
                yield f"{where}.terms", f"has a gain of {term.gain}; accepted: at most {MAX_GAIN:g}"
        terms = [term.joint for term in joint.dependent.terms]
        yield from _unique(f"{where}.terms", "term", terms)
        for name in terms:
            if name not in driven:
                yield (
                    f"{where}.terms",
                    f"names {name!r}; accepted: an earlier driven joint ({_list(driven)})",
                )


def _coupling(robot: SerialFacts) -> Iterator[Problem]:
    factor = robot.coupling.state_factor
    if robot.coupling.type is CouplingType.NONE:
        if factor != 0:
            yield "coupling.state_factor", f"is {factor}; accepted with type none: 0"
        return
    if factor == 0:
        yield "coupling.state_factor", "is 0; accepted with type j2_j3: -1 or 1"
    if len(robot.driven) < 3 or any(joint.prismatic for joint in robot.driven[1:3]):
        yield "coupling.type", "is j2_j3; accepted only where driven joints 2 and 3 are revolute"


def _home(robot: SerialFacts) -> Iterator[Problem]:
    yield from _inside("home", robot, robot.home_position)


def _inside(where: str, robot: SerialFacts, position: Sequence[float]) -> Iterator[Problem]:
    """Yield each joint whose value at a (n,) controller-side position leaves its range."""
    for joint, value in zip(robot.driven, position, strict=True):
        if not joint.lower <= value <= joint.upper:
            unit = "m" if joint.prismatic else "rad"
            yield (
                where,
                f"puts {joint.name} at {value} {unit} on the controller's side;"
                f" accepted: {joint.lower} to {joint.upper} {unit}",
            )


def _positions(robot: SerialFacts) -> Iterator[Problem]:
    for name, values in robot.positions.items():
        if name in OWN_NAMES:
            yield "positions", f"names {name!r}; accepted: other names than {_list(OWN_NAMES)}"
        where = f"positions.{name}"
        if len(values) != len(robot.driven):
            accepted = f"{len(robot.driven)}, one per driven joint"
            yield where, f"has {len(values)} values; accepted: {accepted}"
            continue
        yield from _inside(where, robot, robot.to_controller(values))


def _dh(robot: SerialFacts) -> Iterator[Problem]:
    if robot.dh is None:
        return
    moving = robot.moving
    names = [joint.name for joint in moving]
    if [row.joint for row in robot.dh.rows] != names:
        yield "dh.rows", f"accepted: one row per joint that is not fixed, in order ({_list(names)})"
        return
    for index, (row, joint) in enumerate(zip(robot.dh.rows, moving, strict=True)):
        fitting = Variable.D if joint.prismatic else Variable.THETA
        if row.variable is not fitting:
            yield (
                f"dh.rows[{index}] ({row.joint}).variable",
                f"is {row.variable}; accepted for a {joint.type} joint: {fitting}",
            )
        for field, value, most, unit in (
            ("theta_offset", row.theta_offset, MAX_FIXED_ANGLE, "rad"),
            ("alpha", row.alpha, MAX_FIXED_ANGLE, "rad"),
            ("d", row.d, MAX_LENGTH, "m"),
            ("a", row.a, MAX_LENGTH, "m"),
        ):
            if abs(value) > most:
                yield f"dh.rows[{index}] ({row.joint}).{field}", _unit_doubt(value, most, unit)
    yield from _placement("dh.base", robot.dh.base)
    yield from _placement("dh.tool", robot.dh.tool)


def _vrm(robot: SerialFacts) -> Iterator[Problem]:
    if robot.vrm is None:
        return
    count = len(robot.moving)
    for field, values in (
        ("rows", robot.vrm.rows),
        ("map.sign", robot.vrm.map.sign),
        ("map.offset", robot.vrm.map.offset),
        ("home_joints", robot.vrm.home_joints),
    ):
        if len(values) != count:
            yield f"vrm.{field}", f"has {len(values)} entries; accepted: {count}"


def _links(robot: SerialFacts) -> Iterator[Problem]:
    known = frozenset(robot.links)
    for field, names in (
        ("link_mass_kg", robot.link_mass_kg),
        ("collision", robot.collision),
        ("meshes", [mesh.link for mesh in robot.meshes]),
        ("allowed_collisions", [link for pair in robot.allowed_collisions for link in pair[:2]]),
    ):
        for name in sorted(set(names) - known):
            yield field, f"names {name!r}; accepted: a link of the chain"


def _list(names: Iterable[str]) -> str:
    return ", ".join(names) or "none"
