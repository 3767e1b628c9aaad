"""Robot check: problems of a robot file in words, found before anyone moves the robot.

Owns the comparisons of a file beyond its own rules: the chain's forward kinematics with its
Denavit–Hartenberg table and that of RoboAnalyzer, the reach with the data sheet's, the dependent
joints with their ranges, self-collision at home and at random positions, and the margins at home.
For a platform: the uniqueness of its pose for given leg lengths. Findings are data; it prints
nothing.

Owns also the measure of reach: the greatest distance of a point from where the axis of the first
revolute joint stands when a rail under it is at its least position. Makers state it for the wrist's
centre or for the tool, so both are measured. The search is a random one with a fixed seed: a lower
bound, right to a few parts in a thousand.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..description.robot import ParallelRobot, Robot, SerialRobot, load_robot
from ..description.schema import Joint
from ..errors import RobotFileError
from ..kinematics.dh import SAMPLES, dh_difference, vrm_difference
from ..kinematics.pinocchio_model import model_map
from ..kinematics.serial import Kinematics
from ..kinematics.stewart.platform import StewartKinematics, uniqueness
from ..pose import Array, Pose
from ..scene.collision import CollisionModel

DH_TOLERANCE = 1e-9  # m and rad
REACH_TOLERANCE = 0.2  # of the stated reach, which makers measure to different points
VRM_TOLERANCE = 1e-6  # m and rad, beyond what the file says of the difference
_COLLISION_SAMPLES = 200
_ROUNDING = 1e-9  # rad or m, or either per second


class _Finding(NamedTuple):
    text: str
    bad: bool


@dataclass(frozen=True, slots=True)
class CheckReport:
    """Result of a check: `problems` make a robot unusable, `remarks` do not."""

    name: str
    problems: tuple[str, ...]
    remarks: tuple[str, ...] = ()

    @property
    def sound(self) -> bool:
        """True if the robot can be used."""
        return not self.problems


def check_robot(name_or_path: str | Path) -> CheckReport:
    """Check a robot of the project, or any robot file; `UnknownRobot` if it is neither."""
    try:
        robot = load_robot(name_or_path)
    except RobotFileError as error:
        found = (f"{field}: {problem}" if field else problem for field, problem in error.problems)
        return CheckReport(str(name_or_path), tuple(found))
    findings = [*_platform(robot)] if isinstance(robot, ParallelRobot) else [*_arm(robot)]
    problems = tuple(finding.text for finding in findings if finding.bad)
    remarks = [*_name_remarks(robot, Path(name_or_path))]
    remarks += [finding.text for finding in findings if not finding.bad]
    return CheckReport(robot.name, problems, tuple(remarks))


def _arm(robot: SerialRobot) -> Iterator[_Finding]:
    kinematics = Kinematics(robot)
    yield from _dh(robot)
    yield from _vrm(robot)
    yield from _limits(kinematics)
    yield from _reach(kinematics)
    yield from _self_collision(kinematics)
    yield _Finding(_room_at_home(robot), bad=False)


def _platform(robot: ParallelRobot) -> Iterator[_Finding]:
    kinematics = StewartKinematics(robot)
    legs, workspace = kinematics.legs, kinematics.workspace
    measure = uniqueness(legs, workspace.bounds)
    text = f"legs: the Jacobian changes by {measure:.2f} of that at home within the workspace"
    if measure < 1.0:
        yield _Finding(f"{text}, so their lengths tell the pose", bad=False)
    else:
        accepted = "accepted: less than 1, by a smaller workspace, so that they tell the pose"
        yield _Finding(f"{text}; {accepted}", bad=True)
    corners = np.concatenate((np.eye(6), -np.eye(6))) * workspace.bounds
    worst = max(workspace.holding(workspace.pose(corner)).condition for corner in corners)
    at_home = workspace.holding(legs.home).condition
    yield _Finding(
        f"singularity: condition {at_home:.2f} at home, {worst:.2f} at the worst corner of the"
        " workspace",
        bad=False,
    )


def _name_remarks(robot: Robot, path: Path) -> list[str]:
    if path.stem == robot.name:
        return []
    return [f"name: is {robot.name!r}, the file is called {path.name!r}"]


def _dh(robot: SerialRobot) -> Iterator[_Finding]:
    residual = dh_difference(robot)
    if residual is None:
        yield _Finding("dh: no table, so the chain has nothing to be compared with", bad=False)
        return
    verdict = f"{residual.position:.1e} m and {residual.rotation:.1e} rad over {SAMPLES} positions"
    if max(residual) > DH_TOLERANCE:
        text = f"dh: the table and the joints differ by {verdict}; accepted: {DH_TOLERANCE:.0e}"
        yield _Finding(text, bad=True)
    else:
        yield _Finding(f"dh: the table and the joints agree to {verdict}", bad=False)


def _vrm(robot: SerialRobot) -> Iterator[_Finding]:
    if robot.vrm is None:
        return
    found, stated = vrm_difference(robot), robot.vrm.fk_difference
    more = (
        found.position > stated.position_m + VRM_TOLERANCE
        or found.rotation > stated.rotation_rad + VRM_TOLERANCE
    )
    yield _Finding(
        f"vrm: the table of {robot.vrm.name} differs from the joints by {found.position:.1e} m and"
        f" {found.rotation:.1e} rad; the file says {stated.position_m:g} m and"
        f" {stated.rotation_rad:g} rad",
        bad=more,
    )


def _limits(kinematics: Kinematics) -> Iterator[_Finding]:
    robot = kinematics.robot
    assumed = [joint.name for joint in robot.driven if joint.acceleration is None]
    if assumed:
        yield _Finding(
            f"limits: accelerations of {len(assumed)} of {robot.dof} joints are not stated; speed"
            f" over {robot.acceleration_ramp_s:g} s is used",
            bad=False,
        )
    # A sum of terms has its extremes at the bounds of its joints, so no sampling is needed.
    gain, offset = model_map(robot)
    low, high = (
        np.minimum(gain * kinematics.lower, gain * kinematics.upper),
        np.maximum(gain * kinematics.lower, gain * kinematics.upper),
    )
    fastest = np.abs(gain) @ np.array(robot.limits.velocity)
    for joint, least, greatest, speed in zip(
        robot.moving, low.sum(axis=1) + offset, high.sum(axis=1) + offset, fastest, strict=True
    ):
        if joint.dependent is None:
            continue
        inside = joint.lower - _ROUNDING <= least and greatest <= joint.upper + _ROUNDING
        kept = inside and speed <= joint.velocity + _ROUNDING
        unit = "m" if joint.prismatic else "rad"
        yield _Finding(
            f"limits: {joint.name} follows from {least:.6g} to {greatest:.6g} {unit} at up to"
            f" {speed:.6g} {unit}/s; its own limits are {joint.lower:.6g} to {joint.upper:.6g}"
            f" {unit} and {joint.velocity:.6g} {unit}/s" + ("" if kept else ", not watched"),
            bad=False,
        )


def _reach(kinematics: Kinematics) -> Iterator[_Finding]:
    measured = reach(kinematics)
    wrist = "" if measured.wrist is None else f"{measured.wrist:.3f} m to the wrist, "
    text = f"reach: {wrist}{measured.tool:.3f} m to the tool"
    stated = kinematics.robot.specs.reach_m
    if stated is None:
        yield _Finding(f"{text}; the specification does not say", bad=False)
        return
    off = abs(measured.nearest_to(stated) - stated)
    accepted = "" if off <= REACH_TOLERANCE * stated else f"; accepted: {REACH_TOLERANCE:.0%} off"
    yield _Finding(f"{text}; the specification says {stated:g} m{accepted}", bad=bool(accepted))


def _self_collision(kinematics: Kinematics) -> Iterator[_Finding]:
    model = CollisionModel(kinematics)
    if not model.pairs:
        yield _Finding("self-collision: no shapes that could touch, so none is found", bad=False)
        return

    def touching(position: Array) -> set[tuple[str, str]]:
        clearances = model.clearances(position).tolist()
        return {pair for pair, free in zip(model.pairs, clearances, strict=True) if free <= 0.0}

    at_home = touching(np.array(kinematics.robot.home_position))
    for first, second in sorted(at_home):
        text = f"self-collision: {first} and {second} touch at home; accepted: a home where nothing"
        yield _Finding(f"{text} touches, or the pair in allowed_collisions", bad=True)
    random = np.random.default_rng(0)
    trials = random.uniform(
        kinematics.lower, kinematics.upper, (_COLLISION_SAMPLES, kinematics.dof)
    )
    found = [touching(position) for position in trials]
    counts = Counter(pair for pairs in found for pair in pairs)
    worst = "".join(f", above all {a} and {b}" for (a, b), _ in counts.most_common(1))
    share = sum(map(bool, found)) / len(found)
    yield _Finding(
        f"self-collision: {'none' if not at_home else 'some'} at home; in {share:.1%} of"
        f" {len(found)} random positions{worst}",
        bad=False,
    )


def _room_at_home(robot: SerialRobot) -> str:
    limits = robot.limits
    fractions = [
        min(value - lower, upper - value) / (upper - lower)
        for value, lower, upper in zip(robot.home_position, limits.lower, limits.upper, strict=True)
    ]
    index = fractions.index(min(fractions))
    return (
        f"home: inside all limits; {limits.names[index]} is nearest to a bound,"
        f" {fractions[index]:.0%} of its range away"
    )


_SAMPLES = 300
_STEPS = 500
_FIRST_STEP = 0.3  # of each joint's range
_SHRINK = 0.985

_WRIST_AXES = 6  # arms of fewer revolute joints have no separate wrist


@dataclass(frozen=True, slots=True)
class Reach:
    """Greatest distances from the first turning axis [m]; `wrist` is None for arms without one."""

    tool: float
    wrist: float | None

    def nearest_to(self, stated: float) -> float:
        """Return the measure that differs least from a stated one [m]."""
        measures = [self.tool] if self.wrist is None else [self.tool, self.wrist]
        return min(measures, key=lambda each: abs(each - stated))


def reach(kinematics: Kinematics) -> Reach:
    """Return a robot's reach inside its limits, by random search."""
    turning = [joint for joint in kinematics.robot.driven if not joint.prismatic]
    axis = _axis(kinematics, turning[0] if turning else kinematics.robot.moving[0])
    # The last two axes meet in the wrist's centre, which the last joint does not move.
    wrist = turning[-2].child if len(turning) >= _WRIST_AXES else None
    return Reach(
        tool=_farthest(kinematics, axis, kinematics.robot.tool_link),
        wrist=None if wrist is None else _farthest(kinematics, axis, wrist),
    )


def _axis(kinematics: Kinematics, joint: Joint) -> tuple[Array, Array]:
    """Return a (3,) point on a joint's axis and its (3,) unit direction, in the base frame."""
    parent = kinematics.forward(kinematics.lower, "base", joint.parent)
    frame = parent.compose(Pose.from_rpy(joint.origin.xyz, joint.origin.rpy))
    direction = frame.rotation @ np.array(joint.axis)
    return frame.position, direction / np.linalg.norm(direction)


def _farthest(kinematics: Kinematics, axis: tuple[Array, Array], link: str) -> float:
    distance = _distance_from(kinematics, axis, link)
    random = np.random.default_rng(0)
    lower, upper = kinematics.lower, kinematics.upper
    best = max(random.uniform(lower, upper, (_SAMPLES, kinematics.dof)), key=distance)
    far, step = distance(best), _FIRST_STEP
    for _ in range(_STEPS):
        change = random.normal(0.0, step, kinematics.dof) * (upper - lower)
        trial = np.clip(best + change, lower, upper)
        if (length := distance(trial)) > far:
            best, far = trial, length
        else:
            step *= _SHRINK
    return far


def _distance_from(
    kinematics: Kinematics, axis: tuple[Array, Array], link: str
) -> Callable[[Array], float]:
    point, direction = axis
    points = (kinematics.link_point(link),)

    def distance(joint_position: Array) -> float:
        (place,) = kinematics.point_places(joint_position.tolist(), points)
        offset = np.array(place) - point
        return float(np.linalg.norm(offset - (offset @ direction) * direction))

    return distance
