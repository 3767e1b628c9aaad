"""What a jog is asked for: joints or the tool, how fast, and under which caps.

Owns the checks of these numbers. Shares are -1 to 1 of a cap, so that a key and a joystick ask
alike. Knows no robot: how many joints there are is checked by `jogger`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np

from ..errors import BadArgument, NotFinite
from ..pose import Array, quaternion_to_matrix
from ..tool_speed import REDUCED_SPEED

Axes: TypeAlias = tuple[float, float, float, float]
"""Unit quaternion x, y, z, w of a frame in the base frame."""

BASE_AXES: Axes = (0.0, 0.0, 0.0, 1.0)

LONGEST_STEP = 0.02
"""Longest tick [s], of a server at 50 Hz."""

_NORM_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class JogCaps:
    """How fast a jog may be.

    Attributes:
        override: share of all speeds below, above 0 and at most 1; it only lowers.
        joint_fraction: greatest share of each joint's speed limit in a joint jog, 0 to 1.
        tool_speed: greatest speed of the tool centre point, and of the elbow [m/s].
        rotation_speed: greatest turning speed of the tool in a tool jog [rad/s].
        reduced: manual reduced speed: tool centre point and elbow at 0.25 m/s at most.

    Raises:
        BadArgument: a value is outside its range or not a number.
    """

    override: float = 1.0
    joint_fraction: float = 0.2
    tool_speed: float = REDUCED_SPEED
    rotation_speed: float = 0.5
    reduced: bool = True

    def __post_init__(self) -> None:
        for name in ("override", "joint_fraction"):
            value = getattr(self, name)
            if not 0.0 < value <= 1.0:
                raise BadArgument(name, value, "more than 0 and at most 1")
        for name in ("tool_speed", "rotation_speed"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise BadArgument(name, value, "a finite speed of more than 0")

    @property
    def point_speed(self) -> float:
        """Greatest speed of tool centre point and elbow, whatever the jog [m/s]."""
        return min(self.tool_speed, REDUCED_SPEED) if self.reduced else self.tool_speed


@dataclass(frozen=True, slots=True)
class JointJog:
    """Joints, one or several at once.

    Attributes:
        rates: (n,) share of each joint's jog speed, -1 to 1; 0 stands.

    Raises:
        BadArgument: a share is beyond ±1.
        NotFinite: a share is infinite or not a number.
    """

    rates: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "rates", _shares(self.rates, "the joint rates"))


@dataclass(frozen=True, slots=True)
class ToolJog:
    """The tool along and about axes that go through the tool centre point.

    Attributes:
        linear: (3,) share of the tool speed along x, y, z of the axes, -1 to 1 each.
        angular: (3,) share of the rotation speed about x, y, z of the axes (A, B, C).
        axes: the jog frame's axes; None for the tool's own, which move along with it.
        magnitude: the greater of the lengths of both vectors: 1 is full speed, √3 the most.

    Raises:
        BadArgument: a share is beyond ±1, a vector has not 3 values, or the axes are no rotation.
        NotFinite: a number is infinite or not a number.
    """

    linear: tuple[float, ...] = (0.0, 0.0, 0.0)
    angular: tuple[float, ...] = (0.0, 0.0, 0.0)
    axes: Axes | None = BASE_AXES
    magnitude: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("linear", "angular"):
            shares = _shares(getattr(self, name), f"the {name} rates")
            if len(shares) != 3:
                raise BadArgument(f"{name} rates", shares, "3 numbers")
            object.__setattr__(self, name, shares)
        if self.axes is not None:
            norm = math.hypot(*self.axes)
            if len(self.axes) != 4 or not abs(norm - 1.0) <= _NORM_TOLERANCE:
                raise BadArgument("axes", self.axes, "a quaternion x, y, z, w of norm 1")
            x, y, z, w = (float(value) / norm for value in self.axes)
            object.__setattr__(self, "axes", (x, y, z, w))
        magnitude = max(math.hypot(*self.linear), math.hypot(*self.angular))
        object.__setattr__(self, "magnitude", magnitude)

    def direction(self) -> tuple[Array, Array]:
        """Return the (3,) linear and angular shares at full speed, along the base frame's axes.

        For the tool's own axes they are along those.
        """
        magnitude = self.magnitude or 1.0
        linear = np.array(self.linear) / magnitude
        angular = np.array(self.angular) / magnitude
        if self.axes is None:
            return linear, angular
        rotation = quaternion_to_matrix(np.array(self.axes))
        return rotation @ linear, rotation @ angular


JogTarget: TypeAlias = JointJog | ToolJog


def _shares(values: Sequence[float], what: str) -> tuple[float, ...]:
    shares = tuple(float(value) for value in values)
    for index, share in enumerate(shares):
        if not math.isfinite(share):
            raise NotFinite(what, index)
        if not -1.0 <= share <= 1.0:
            raise BadArgument(what, share, "-1 to 1")
    return shares
