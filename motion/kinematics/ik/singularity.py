"""Singularity of an arm: its distance, its name, and the direction that leads out of it.

Owns the measures of dexterity and the names of singularities. The Jacobian is made free of units
first: lengths are divided by the arm's size, and a prismatic joint counts in arm's sizes. Twists
are [v; ω] as everywhere here: linear velocity of the tool's origin first. The RoboAnalyzer paper,
as many books do, stacks [ω; v]; `angular_first` converts one into the other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from ...pose import Array
from ..closed_form import closed_form
from ..serial import Kinematics

_INVOLVED = 0.1  # share of a unit joint direction that makes a joint part of a singularity
_STEP = 1e-6  # rad, or arm's sizes: of the finite differences
_FLAT = 1e-9  # a lesser gradient gives no direction


class SingularityKind(StrEnum):
    """Name of the nearest singularity."""

    WRIST = "wrist"
    """The wrist's outer axes are parallel."""
    ELBOW = "elbow"
    """Upper arm and forearm are straight or folded."""
    SHOULDER = "shoulder"
    """The wrist stands above or below axis 1."""
    UNNAMED = "unnamed"
    """The arm has no names for its singularities; see the joints involved."""


@dataclass(frozen=True, slots=True, eq=False)
class Dexterity:
    """Freedom of the tool to move at a joint position.

    Attributes:
        manipulability: √det(J Jᵀ) of the scaled Jacobian (Yoshikawa 1985), no unit; for arms of
            fewer than six axes √det(Jᵀ J).
        condition: greatest over least singular value of it, 1 at best, infinite at a singularity.
        least_gain: the least singular value of it: speed of the tool in the worst direction per
            unit of joint speed.
        kind: the nearest singularity.
        distance: distance of the arm from it, in `unit`.
        unit: `rad` or `m`; empty for an unnamed one, whose distance is `least_gain`.
        joints: names of the joints that, moved together at the singularity, leave the tool still.
        lost_twist: (6,) unit [v/size; ω] direction that is lost there, base frame.
        way_out: (n,) controller-side joint direction that leads out fastest, its greatest element
            ±1 [rad or m]; zero where no single step does.
        way_out_twist: (6,) [v; ω] of the tool moving in that direction [m/s, rad/s], base frame.
    """

    manipulability: float
    condition: float
    least_gain: float
    kind: SingularityKind
    distance: float
    unit: str
    joints: tuple[str, ...]
    lost_twist: Array
    way_out: Array
    way_out_twist: Array


def dexterity(kinematics: Kinematics, joint_position: Sequence[float] | Array) -> Dexterity:
    """Return the dexterity at a joint position.

    Raises:
        WrongJointCount, NotFinite: not one finite value per driven joint.
    """
    position = np.asarray(joint_position, dtype=np.float64)
    kinematics.limits.check_finite(position.tolist(), "the joint position")
    jacobian = _scaled(kinematics, position)
    left, gains, right = np.linalg.svd(jacobian)
    least = min(jacobian.shape) - 1
    lost, hidden = left[:, least], right[least]
    # The sign of a singular vector is free; below, the largest element of `lost` becomes positive.
    kind, distance, unit = _nearest(kinematics, position, float(gains[least]))
    way = _way_out(kinematics, position, lost, hidden)
    _, _, plain = kinematics.linearise(position)
    involved = np.abs(hidden) >= _INVOLVED
    return Dexterity(
        manipulability=float(np.prod(gains)),
        condition=float(gains[0] / gains[least]) if gains[least] > 0.0 else math.inf,
        least_gain=float(gains[least]),
        kind=kind,
        distance=distance,
        unit=unit,
        joints=tuple(
            name for name, is_in in zip(kinematics.limits.names, involved, strict=True) if is_in
        ),
        lost_twist=_read_only(lost * math.copysign(1.0, lost[int(np.argmax(np.abs(lost)))])),
        way_out=_read_only(way),
        way_out_twist=_read_only(plain @ way),
    )


SINGULAR = 1e9
"""A greater condition number is taken for infinite: the rest is rounding."""


def condition(kinematics: Kinematics, joint_position: Sequence[float] | Array) -> float:
    """Return the condition number of the scaled Jacobian, infinite at a singularity.

    As that of `dexterity`, at a tenth of its cost.
    """
    position = np.asarray(joint_position, dtype=np.float64)
    gains = np.linalg.svd(_scaled(kinematics, position), compute_uv=False)
    return float(gains[0] / gains[-1]) if gains[-1] * SINGULAR > gains[0] else math.inf


def angular_first(jacobian: Array) -> Array:
    """Reorder a (6, n) Jacobian or a (6,) twist from [v; ω] to [ω; v]."""
    return np.concatenate((jacobian[3:], jacobian[:3]))


def _scaled(kinematics: Kinematics, position: Array) -> Array:
    """Return the (6, n) Jacobian without units: lengths in arm's sizes."""
    _, _, jacobian = kinematics.linearise(position)
    scaled = jacobian * _joint_units(kinematics)
    scaled[:3] /= kinematics.size
    return scaled


def _joint_units(kinematics: Kinematics) -> Array:
    return np.where(kinematics.limits.prismatic, kinematics.size, 1.0)


def _nearest(
    kinematics: Kinematics, position: Array, least_gain: float
) -> tuple[SingularityKind, float, str]:
    form = closed_form(kinematics)
    if form is None:
        return SingularityKind.UNNAMED, least_gain, ""
    measures = form.measures(kinematics.robot.to_model(position.tolist()))
    # All three as angles, the shoulder's by the arm's size, so that they can be compared.
    elbow, wrist = (
        min(abs(angle), math.pi - abs(angle)) for angle in (measures.elbow, measures.wrist)
    )
    shoulder = abs(measures.shoulder)
    return min(
        (SingularityKind.WRIST, wrist, "rad"),
        (SingularityKind.ELBOW, elbow, "rad"),
        (SingularityKind.SHOULDER, shoulder, "m"),
        key=lambda found: found[1] / (kinematics.size if found[2] == "m" else 1.0),
    )


def _way_out(kinematics: Kinematics, position: Array, lost: Array, hidden: Array) -> Array:
    """Return the joint direction along which the least singular value grows fastest.

    A singular value σ = uᵀ J w changes by ∂σ/∂qᵢ = uᵀ (∂J/∂qᵢ) w, also through zero, where its
    sign changes and either direction leads out.
    """
    units = _joint_units(kinematics)
    gradient = np.zeros(len(position))
    for joint, unit in enumerate(units.tolist()):
        step = np.zeros(len(position))
        step[joint] = _STEP * unit
        change = _scaled(kinematics, position + step) - _scaled(kinematics, position - step)
        gradient[joint] = lost @ change @ hidden / (2.0 * _STEP)
    greatest = float(np.abs(gradient).max())
    if greatest < _FLAT:
        return np.zeros(len(position))
    way: Array = gradient * units / greatest
    return way


def _read_only(array: Array) -> Array:
    array.flags.writeable = False
    return array
