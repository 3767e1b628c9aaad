"""Configuration of an arm at a pose: shoulder, elbow, wrist, and the revolutions of its joints.

Owns the flags that a taught point stores beside its pose, and the rule when a joint position agrees
with them. A flag is the side of a singularity, so it can only change by passing through one; on the
singularity itself both values are right. Arms without a closed form have no flags.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from ...pose import Array
from ..closed_form import closed_form
from ..closed_form.geometry import ClosedForm, Measures
from ..revolutions import revolutions_of
from ..serial import Kinematics

_ON_THE_BORDER = 1e-6
"""Distance from a singularity within which either flag is right [m or rad]."""


class Shoulder(StrEnum):
    """Side of the wrist, seen from axis 1 in the arm's own forward direction."""

    FRONT = "front"
    BACK = "back"


class Elbow(StrEnum):
    """Side of the elbow, seen from the line between shoulder and wrist."""

    UP = "up"
    DOWN = "down"


class Wrist(StrEnum):
    """Sign of the wrist's middle joint, counted from where its outer axes are parallel."""

    NO_FLIP = "no-flip"
    FLIP = "flip"


@dataclass(frozen=True, slots=True)
class Configuration:
    """Flags of one of the joint positions that reach a pose.

    Attributes:
        turns: (n,) revolutions of each joint, 0 from -π up to π; None for any, in a query.
    """

    shoulder: Shoulder
    elbow: Elbow
    wrist: Wrist
    turns: tuple[int, ...] | None = None

    def agrees_with(self, measures: Measures) -> bool:
        """Return True if an arm on these sides of its singularities has these flags."""
        return (
            _on_side(measures.shoulder, self.shoulder is Shoulder.FRONT)
            and _on_side(_from_fold(measures.elbow), self.elbow is Elbow.UP)
            and _on_side(_from_fold(measures.wrist), self.wrist is Wrist.NO_FLIP)
        )


def configuration_of(
    kinematics: Kinematics, joint_position: Sequence[float] | Array
) -> Configuration | None:
    """Return the flags of a joint position; None if the robot's family has none.

    Raises:
        WrongJointCount, NotFinite: not one finite value per driven joint.
    """
    values = [float(value) for value in joint_position]
    kinematics.limits.check_finite(values, "the joint position")
    form = closed_form(kinematics)
    if form is None:
        return None
    return flags(form, kinematics, values)


def flags(
    form: ClosedForm, kinematics: Kinematics, joint_position: Sequence[float]
) -> Configuration:
    """Return the flags of a joint position, without checks."""
    measures = form.measures(kinematics.robot.to_model(joint_position))
    return Configuration(
        Shoulder.FRONT if measures.shoulder >= 0.0 else Shoulder.BACK,
        Elbow.UP if measures.elbow >= 0.0 else Elbow.DOWN,
        Wrist.NO_FLIP if measures.wrist >= 0.0 else Wrist.FLIP,
        tuple(
            [
                0 if prismatic else revolutions_of(value)
                for value, prismatic in zip(
                    joint_position, kinematics.limits.prismatic, strict=True
                )
            ]
        ),
    )


def _from_fold(angle: float) -> float:
    """Return an angle's distance from the singularities at 0 and ±π, with the angle's sign."""
    return math.copysign(min(abs(angle), math.pi - abs(angle)), angle)


def _on_side(distance: float, positive: bool) -> bool:
    return distance >= -_ON_THE_BORDER if positive else distance <= _ON_THE_BORDER
