"""Path accuracy of each robot as the emulated controller runs it, measured as ISO 9283 does.

Owns the command paths and the measure. ISO 9283:1998, clause 8.2: a path is run n times; at each of
m calculation points of the command path the attained positions in the plane at right angles to it
are averaged, and the path accuracy is the greatest distance of such a mean from the command path.

    ATp = max over i of √(x̄ᵢ² + ȳᵢ² + z̄ᵢ²), with x̄ᵢ = 1/n Σⱼ (xᵢⱼ - xᶜᵢ)

Orientation likewise; where the standard takes each of its three angles by itself, the angle of the
whole rotation is taken here, which is at least as great as each. Runs are at full speed, where a
robot strays most, each looked at with another phase to the points.

Each sample of a trajectory is sent as a point of type 14 through the codec, so that the controller
sees 4-byte reals, a fixed time ahead as the server does, on a clock that nobody waits for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from enum import Enum
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from openpendant.controller_emulator.core.controller import EmulatedController
from openpendant.controller_emulator.shell.build import build_controller
from openpendant.controller_emulator.shell.settings import EmulatorSettings
from openpendant.motion.description.robot import SerialRobot, load_robot, robot_names, serial_robot
from openpendant.motion.errors import BranchChange, OutOfRange, PoseUnreachable
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.path_chains import ToolChain
from openpendant.motion.paths.tool_curves import (
    ToolArc,
    ToolCurve,
    ToolLine,
    ToolSpline,
    ToolTurn,
    arc_about,
    circle_about,
    turned_by,
)
from openpendant.motion.paths.tool_paths import follow_tool_curve
from openpendant.motion.pose import Array, Pose
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.server.uplinks import dialect_of
from openpendant.simplemsg import Message, ReplyCode, codec_for

from .table import Benchmark, Bound, Judged, Sides

GREATEST_DISTANCE = 0.1
"""Accepted path accuracy of the position [mm]."""

GREATEST_ANGLE = 0.05
"""Accepted path accuracy of the orientation [°]."""

ISO_RUNS = 10
"""Number of runs of a path in the standard."""

ROBOTS = [name for name in robot_names() if isinstance(load_robot(name), SerialRobot)]

_SEED = 9283
_ATTEMPTS = 40
_PROJECTIONS = 4
_FINE = 2001  # places of a curve at which its length is summed up


class CommandPath(Enum):
    """Kinds of path that are run."""

    LINE = "line"
    MINOR_ARC = "a third of a turn"
    MAJOR_ARC = "two thirds of a turn"
    CIRCLE = "full circle"
    ZONE = "two lines with a zone"
    SPLINE = "spline"


class PathAccuracy(NamedTuple):
    """Distance of the mean of the attained paths from the command path."""

    distance: float
    angle: float


def benchmarks() -> list[Benchmark]:
    """Return the worst of all kinds of path for each robot, in position and in orientation."""
    figures: list[tuple[str, str, float, Callable[[PathAccuracy], float]]] = [
        ("position", "mm", GREATEST_DISTANCE, lambda worst: worst.distance),
        ("orientation", "deg", GREATEST_ANGLE, lambda worst: worst.angle),
    ]
    return [
        Benchmark(
            f"path accuracy {name}, {what}",
            unit,
            partial(_sides, name, figure),
            Bound(most, judged=Judged.VALUE),
            1,
        )
        for name in ROBOTS
        for what, unit, most, figure in figures
    ]


@contextmanager
def _sides(name: str, figure: Callable[[PathAccuracy], float]) -> Iterator[Sides]:
    yield Sides(lambda: figure(worst_of(robot_accuracy(name).values())))


def worst_of(accuracies: Iterable[PathAccuracy]) -> PathAccuracy:
    """Return the greatest distance and the greatest angle."""
    return PathAccuracy(*(max(column) for column in zip(*accuracies, strict=True)))


@cache
def robot_accuracy(
    name: str, *, size: float = math.inf, places: int = 1, runs: int = ISO_RUNS, seed: int = _SEED
) -> dict[CommandPath, PathAccuracy]:
    """Measure a robot on every kind of path, the worst of several places each.

    Raises:
        RuntimeError: a kind of path was reached too seldom, or the controller refused a point.
    """
    kinematics = Kinematics(serial_robot(name))
    found: dict[CommandPath, list[PathAccuracy]] = {kind: [] for kind in CommandPath}
    random = np.random.default_rng(seed)
    for _ in range(_ATTEMPTS * places):
        start, curves = _command_paths(kinematics, min(size, kinematics.size / 10.0), random)
        for kind, curve in curves.items():
            if len(found[kind]) < places:
                try:
                    found[kind].append(path_accuracy(kinematics, start, curve, runs))
                except (PoseUnreachable, OutOfRange, BranchChange):
                    continue
        if all(len(values) == places for values in found.values()):
            return {kind: worst_of(values) for kind, values in found.items()}
    raise RuntimeError(f"{name} reached too few paths: {found}")


def _command_paths(
    kinematics: Kinematics, size: float, random: np.random.Generator
) -> tuple[Array, dict[CommandPath, ToolCurve]]:
    """Return a random joint position (n,), and one path of each kind from there."""
    middle = (kinematics.lower + kinematics.upper) / 2.0
    half = (kinematics.upper - kinematics.lower) / 2.0
    start = middle + random.uniform(-0.5, 0.5, kinematics.dof) * half
    here = kinematics.forward(start)
    ahead, aside = (way / np.linalg.norm(way) * size for way in random.normal(size=(2, 3)))
    # Arms of fewer axes than six turn their tool about the vertical only.
    axes = [1.0, 1.0, 1.0] if kinematics.dof >= 6 else [0.0, 0.0, 1.0]
    turned = Pose(np.zeros(3), here.quaternion)
    turned = Pose.from_rpy([0.0] * 3, random.uniform(-0.3, 0.3, 3) * axes).compose(turned)

    def at(position: Array) -> Pose:
        return Pose(position, turned.quaternion)

    normal = np.cross(ahead, aside)
    normal /= np.linalg.norm(normal)
    radius = ahead / 2.0
    centre = here.position + radius
    third = at(centre - turned_by(normal[np.newaxis] * math.radians(120.0))[0] @ radius)
    arcs = [
        arc_about(here.position, centre, third.position, more_than_half=longer)
        for longer in (False, True)
    ]
    there, last = at(here.position + ahead), at(here.position + aside)
    legs = [ToolLine(here, there), ToolLine(there, last)]
    zone = min(leg.length for leg in legs) / 3.0
    return start, {
        CommandPath.LINE: legs[0],
        CommandPath.MINOR_ARC: ToolArc(arcs[0], here, third),
        CommandPath.MAJOR_ARC: ToolArc(arcs[1], here, third),
        CommandPath.CIRCLE: ToolArc(
            circle_about(here.position, centre, normal), here, here, ToolTurn.CONSTANT
        ),
        CommandPath.ZONE: ToolChain(legs, [zone]),
        CommandPath.SPLINE: ToolSpline([here, there, last]),
    }


def path_accuracy(
    kinematics: Kinematics, start: Array, curve: ToolCurve, runs: int
) -> PathAccuracy:
    """Plan, run and measure one path.

    Raises:
        MotionError: the robot cannot follow the curve.
        RuntimeError: the controller refused a point.
    """
    path = follow_tool_curve(kinematics, start, curve)
    trajectory = time_path(path, kinematics.limits)
    calculated = np.linspace(0.0, curve.length, round(trajectory.duration * 1e9) // SAMPLE)
    attained = [
        emulated_run(kinematics.robot.name, trajectory, phase=run * SAMPLE // runs)
        for run in range(runs)
    ]
    mean = np.mean([deviations(kinematics, curve, run, calculated) for run in attained], axis=0)
    distances, angles = (np.linalg.norm(part, axis=1) for part in (mean[:, :3], mean[:, 3:]))
    return PathAccuracy(1e3 * float(distances.max()), math.degrees(float(angles.max())))


def deviations(kinematics: Kinematics, curve: ToolCurve, run: Array, calculated: Array) -> Array:
    """Return how far one attained path is off at the calculation points of the command path.

    Args:
        kinematics: the robot.
        curve: the command path, with length; s counts along it.
        run: (k, n) joint positions in order of time, from the curve's start to its end.
        calculated: (m,) the calculation points, increasing s.

    Returns:
        (m, 6) displacement [m] at right angles to the path, and rotation vector [rad].
    """
    rotations, positions = (
        np.array(part) for part in zip(*map(kinematics.place, run), strict=True)
    )
    s = _nearest(curve, positions)
    wanted = curve.place(s)
    turns = _rotation_vectors(rotations @ wanted.rotation.transpose(0, 2, 1))
    off = np.hstack((positions - wanted.position, turns))
    order = np.argsort(s, kind="stable")
    return np.stack([np.interp(calculated, s[order], column[order]) for column in off.T], axis=1)


def _nearest(curve: ToolCurve, positions: Array) -> Array:
    """Return the (k,) s of the planes at right angles to the curve that hold the (k, 3) positions.

    A closed curve comes near itself, so the search begins where the way travelled says.
    """
    s = np.linspace(0.0, curve.length, _FINE)
    s = np.interp(_travelled(positions), _travelled(curve.place(s).position), s)
    for _ in range(_PROJECTIONS):
        tangent = curve.motion(s)[:, :3]
        error = positions - curve.place(s).position
        along = np.einsum("ij,ij->i", error, tangent) / np.einsum("ij,ij->i", tangent, tangent)
        s = np.clip(s + along, 0.0, curve.length)
    return s


def _travelled(positions: Array) -> Array:
    """Return the (k,) length of the way to each position, as a fraction of the whole."""
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    ways = np.concatenate(([0.0], np.cumsum(steps)))
    fractions: Array = ways / ways[-1]
    return fractions


def _rotation_vectors(rotations: Array) -> Array:
    """Return the (k, 3) rotation vectors [rad] of (k, 3, 3) rotations by less than half a turn."""
    skew = rotations - rotations.transpose(0, 2, 1)
    doubled = np.stack((skew[:, 2, 1], skew[:, 0, 2], skew[:, 1, 0]), axis=1)
    sine = np.linalg.norm(doubled, axis=1) / 2.0
    cosine = (np.trace(rotations, axis1=1, axis2=2) - 1.0) / 2.0
    factor = np.where(sine > 0.0, np.arctan2(sine, cosine) / np.where(sine > 0.0, sine, 1.0), 1.0)
    vectors: Array = doubled / 2.0 * factor[:, np.newaxis]
    return vectors


SAMPLE = 1_000_000
"""Time between two looks at the joints [ns]."""

_LINK = 1
_LATENCY = 200_000_000  # ns; longer than the controller takes to begin and to come to rest


def emulated_run(robot: str, trajectory: Trajectory, phase: int = 0) -> Array:
    """Return where the joints are every millisecond, (m, n), from before the start until rest.

    Args:
        robot: name of the robot.
        trajectory: what is sent; its first and last samples are at rest.
        phase: how long after each tick of the sender the joints are looked at [ns].

    Raises:
        RuntimeError: the controller refused a point or broke the motion off.
    """
    start = tuple(trajectory.position[0].tolist())
    settings = EmulatorSettings.model_validate({"robot": robot, "start": start})
    controller = build_controller(settings, 0)
    points = _points(trajectory)
    lead = round(ControllerLink().lead * 1e9)
    due = [round(time * 1e9) - lead for time in trajectory.times.tolist()]
    sent, run = 0, []
    for tick in range(0, round(trajectory.duration * 1e9) + _LATENCY, SAMPLE):
        while sent < len(points) and due[sent] <= tick:
            _send(controller, points[sent], tick)
            sent += 1
        controller.advance(tick + phase)
        run.append(controller.motion(tick + phase)[0])
    if controller.referee.total or controller.status(tick + phase).in_error:
        raise RuntimeError(str(controller.referee))
    return np.array(run)


def _points(trajectory: Trajectory) -> list[Message]:
    """Return the set-points as they arrive."""
    link = ControllerLink()
    uplink = dialect_of(link).uplink(link, np.abs(trajectory.velocity).max(axis=0).tolist())
    codec = codec_for()
    points = []
    for index in range(len(trajectory)):
        point = uplink.point(index, trajectory.row(index), 0.0, 0)
        points.append(codec.decode(codec.encode(point)))
    return points


def _send(controller: EmulatedController, point: Message, now: int) -> None:
    replies = [reply for _, reply in controller.handle(_LINK, point, now)]
    if [reply.reply_code for reply in replies] != [ReplyCode.SUCCESS]:
        raise RuntimeError(f"a point was refused: {controller.referee}")
