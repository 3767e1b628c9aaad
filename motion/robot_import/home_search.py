"""Home search: a joint position of a new robot from which every first increment of the tool works.

Owns which positions are tried, and in which order. They lie on a coarse grid, so that a person can
read them: each joint at its default or some steps of 15° away from it, a linear one tenths of its
range. Those that move the joints least come first. Most are sorted out by their Jacobian and by
self-collision before the increments of `home_check` are tried. The same robot gets the same home.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ..description.robot import SerialRobot
from ..paths.mechanism import SerialMechanism
from ..pose import Array
from ..robot_report.home_check import HomeReport, check_position, condition_at, touching_at
from ..scene.collision import CollisionModel

WELL_AWAY = 20.0
"""Greatest condition number of a home that is chosen here."""

_STEPS = tuple(math.radians(angle) for angle in (0, 15, -15, 30, -30, 45, -45, 60, -60, 90, -90))
_TENTHS = tuple(tenth / 10 for tenth in (0, 1, -1, 2, -2, 3, -3, 4, -4))
_UNMOVED = 0.5  # share of the trials in which a joint keeps its default
_TRIALS = 4_000
_FULL_CHECKS = 40


def home_to_jog_from(robot: SerialRobot) -> tuple[Array | None, HomeReport]:
    """Find a home from which every first increment works, the robot's own if that is one.

    Returns:
        The (n,) controller-side position [rad or m], None where none was found; and the verdict on
        the robot's own home.
    """
    arm = SerialMechanism(robot)
    collision = CollisionModel(arm.kinematics)
    own = check_position(robot.name, arm, robot.home_position, collision)
    if own.is_good:
        return np.array(robot.home_position), own
    checks = 0
    for position in _candidates(robot):
        if condition_at(arm, position.tolist()) > WELL_AWAY:
            continue
        if touching_at(collision, position.tolist()) is not None:
            continue
        if check_position(robot.name, arm, position.tolist(), collision, most_refused=1).is_good:
            return position, own
        checks += 1
        if checks == _FULL_CHECKS:
            break
    return None, own


def _candidates(robot: SerialRobot) -> Iterator[Array]:
    """Yield (n,) positions inside the limits, those that move the joints least first."""
    limits = robot.limits
    lower, upper = np.array(limits.lower), np.array(limits.upper)
    home = np.array(robot.home_position)
    random = np.random.default_rng(0)
    columns = []
    for joint, in_metres in enumerate(limits.prismatic):
        scale = float(upper[joint] - lower[joint]) if in_metres else 1.0
        steps = np.array(_TENTHS if in_metres else _STEPS) * scale
        chosen = random.choice(steps, _TRIALS)
        columns.append(np.where(random.random(_TRIALS) < _UNMOVED, 0.0, chosen))
    trials = np.unique(home + np.column_stack(columns), axis=0)
    trials = trials[np.all((trials >= lower) & (trials <= upper), axis=1)]
    effort = np.abs((trials - home) / (upper - lower)).sum(axis=1)
    yield from trials[np.argsort(effort, kind="stable")]


def refused_in_words(report: HomeReport, most: int = 3) -> str:
    """Return why a position is no home to jog from, in a few words."""
    if report.outside is not None:
        return str(report.outside)
    if report.contact is not None:
        return f"{report.contact.first} and {report.contact.second} touch there"
    labels = [f"{each.increment.label} of {each.increment.frame}" for each in report.refused]
    rest = f" and {len(labels) - most} more" if len(labels) > most else ""
    return f"{len(labels)} of its first increments are refused: {', '.join(labels[:most])}{rest}"
