"""Context of inverse kinematics: data of a robot that are computed once.

Owns closed form and choice among its branches, ranges and revolutions, the direction that a tool
keeps, and the bound of its reach. Knows no search.

The kept direction: an arm of fewer than six axes may hold one direction of its tool along one
direction of its base, as a SCARA and a palletiser do. Such an arm reaches x, y, z and yaw only. The
test for it is here, and the tilt of a pose from it.

The reach bound: a ball, or a ball along a track, that holds every place that the tool can have. A
target far outside is refused without a search. From the first revolute joint on, the arm up to the
tool is a chain of rigid links; in every joint position it is no longer than their lengths together
and the strokes of prismatic joints between them (the triangle inequality). A rail in front of it
moves the ball. The bound knows no orientation: a place inside may be out of reach all the same.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from weakref import WeakKeyDictionary

import numpy as np

from ...pose import Array
from ..closed_form import closed_form
from ..closed_form.geometry import ClosedForm, arm_geometry, rotation_about
from ..revolutions import JointRanges
from ..serial import Kinematics
from .branches import BranchChoice

_SAMPLES = 6
_KEPT = 1e-9  # rad


@dataclass(frozen=True, slots=True, eq=False)
class KeptDirection:
    """Direction that stays the same in the tool and in the base.

    Attributes:
        in_base: (3,) unit vector.
        in_tool: (3,) unit vector, the same direction.
    """

    in_base: Array
    in_tool: Array

    def tilt(self, rotation: Array) -> float:
        """Return the angle by which a (3, 3) tool rotation tilts the direction [rad]."""
        x, y, z = rotation.dot(self.in_tool).tolist()
        u, v, w = self.in_base.tolist()
        across = math.hypot(y * w - z * v, z * u - x * w, x * v - y * u)
        return math.atan2(across, x * u + y * v + z * w)

    def levelled(self, rotation: Array) -> Array:
        """Return the (3, 3) rotation nearest to one that keeps the direction."""
        wanted = rotation @ self.in_tool
        axis = np.cross(wanted, self.in_base)
        length = float(np.linalg.norm(axis))
        if length < _KEPT:
            # Upright already, or upside down, where any axis at a right angle is right.
            axis = np.cross(wanted, np.eye(3)[int(np.argmin(np.abs(wanted)))])
            length = float(np.linalg.norm(axis))
        level: Array = rotation_about(axis / length, self.tilt(rotation)) @ rotation
        return level


def kept_direction(kinematics: Kinematics) -> KeptDirection | None:
    """Return the direction of its first revolute axis if an arm's tool keeps it, else None.

    Found by trying a few joint positions, whether parallel axes or levelling rods keep it.
    """
    if kinematics.dof >= 6:
        return None
    geometry = arm_geometry(kinematics.robot)
    turning = [index for index, slides in enumerate(geometry.prismatic) if not slides]
    if not turning:
        return None
    in_base = geometry.axes[turning[0]]
    random = np.random.default_rng(0)
    samples = random.uniform(kinematics.lower, kinematics.upper, (_SAMPLES, kinematics.dof))
    seen = [kinematics.place(sample)[0].T @ in_base for sample in samples]
    if max(float(np.linalg.norm(direction - seen[0])) for direction in seen) > _KEPT:
        return None
    return KeptDirection(in_base, seen[0])


@dataclass(frozen=True, slots=True, eq=False)
class ReachBound:
    """Ball whose centre slides along a track.

    Attributes:
        foot: (3,) the centre with the rail at its least position, in the base frame [m].
        track: (3,) from there to where the rail ends [m]; zero without a rail.
        radius: of the ball [m], infinite where no bound is known.
    """

    foot: Array
    track: Array
    radius: float

    def beyond(self, position: Sequence[float] | Array) -> float:
        """Return how far a (3,) place in the base frame is outside [m]; inside, 0 or less."""
        away = np.asarray(position) - self.foot
        if squared := float(self.track.dot(self.track)):
            away -= min(max(float(away.dot(self.track)) / squared, 0.0), 1.0) * self.track
        return math.hypot(*away.tolist()) - self.radius


def reach_bound(kinematics: Kinematics) -> ReachBound:
    """Return the bound of a robot."""
    chain = kinematics.robot.moving
    least, most = np.zeros((2, kinematics.dof))
    if chain[0].name == kinematics.robot.driven[0].name and chain[0].prismatic:
        least[0], most[0] = kinematics.lower[0], kinematics.upper[0]
        chain = chain[1:]
    if (
        not chain
        or chain[0].prismatic
        or any(joint.prismatic and joint.dependent for joint in chain)
    ):
        return ReachBound(np.zeros(3), np.zeros(3), math.inf)
    foot, end = (kinematics.forward(at, link=chain[0].child).position for at in (least, most))
    places = [kinematics.forward(least, link=joint.child).position for joint in chain]
    places.append(kinematics.forward(least).position)
    radius = sum(math.dist(*pair) for pair in pairwise(places))
    radius += sum(max(-joint.lower, joint.upper) for joint in chain if joint.prismatic)
    return ReachBound(foot, end - foot, radius)


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """Robot with all that inverse kinematics computes once.

    Attributes:
        form: its closed form, None without one.
        choice: the choice among the form's branches, None without one.
        ranges: limits and revolutions of the joints.
        kept: the direction that the tool keeps, None for an arm that can rotate it freely.
        reach: bound of every place of the tool.
    """

    form: ClosedForm | None
    choice: BranchChoice | None
    ranges: JointRanges
    kept: KeptDirection | None
    reach: ReachBound


_arms: WeakKeyDictionary[Kinematics, Arm] = WeakKeyDictionary()


def arm_of(kinematics: Kinematics) -> Arm:
    """Return the context of a robot; computed at the first query."""
    arm = _arms.get(kinematics)
    if arm is None:
        form, ranges = closed_form(kinematics), JointRanges(kinematics)
        choice = None if form is None else BranchChoice(kinematics, form, ranges)
        arm = Arm(form, choice, ranges, kept_direction(kinematics), reach_bound(kinematics))
        _arms[kinematics] = arm
    return arm
