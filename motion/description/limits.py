"""Joint limits as plain data, their checks, and their values as 4-byte reals.

Owns the rule that a position exactly at a bound is legal, and the rule that a bound compared with
a 4-byte real is first rounded outward to the next representable one. All vectors are
controller-side driven joints in file order [rad or m, s]. Knows no robot file and no numpy.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from ..errors import BadArgument, NotFinite, OutOfRange, TooFast, TooSharp, WrongJointCount

_FLOAT32 = struct.Struct("<f")
_UINT32 = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class JointLimits:
    """Limits of the driven joints, controller side: positions [rad or m], speeds and accelerations.

    Attributes:
        names: joint names, wire order.
        prismatic: True if the joint is measured in metres.
        display_names: what people call the joints; the names themselves where left out.

    Raises:
        WrongJointCount, NotFinite: in every check, not one finite value per joint.
    """

    names: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    velocity: tuple[float, ...]
    acceleration: tuple[float, ...]
    prismatic: tuple[bool, ...]
    display_names: tuple[str, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        count = len(self.names)
        object.__setattr__(self, "display_names", self.display_names or self.names)
        for values in (
            *(self.lower, self.upper, self.velocity, self.acceleration, self.prismatic),
            self.display_names,
        ):
            if len(values) != count:
                raise WrongJointCount(len(values), count)
        for index, name in enumerate(self.names):
            if not self.lower[index] < self.upper[index]:
                value = (self.lower[index], self.upper[index])
                raise BadArgument(f"range of {name}", value, "lower below upper")
            if not self.velocity[index] > 0:
                raise BadArgument(f"velocity of {name}", self.velocity[index], "more than 0")
            if not self.acceleration[index] > 0:
                raise BadArgument(
                    f"acceleration of {name}", self.acceleration[index], "more than 0"
                )

    @property
    def dof(self) -> int:
        """Number of driven joints."""
        return len(self.names)

    def unit(self, index: int) -> str:
        """Return the unit of a joint's position, `rad` or `m`."""
        return "m" if self.prismatic[index] else "rad"

    def check_finite(self, values: Sequence[float], what: str) -> None:
        """Check that there is one finite value per joint, in any unit.

        Args:
            values: (n,) one per joint.

        Raises:
            WrongJointCount, NotFinite: not one finite value per joint.
        """
        if len(values) != len(self.names):
            raise WrongJointCount(len(values), len(self.names))
        if not all(map(math.isfinite, values)):
            raise NotFinite(what, [math.isfinite(value) for value in values].index(False))

    def check_position(self, position: Sequence[float]) -> None:
        """Check a joint position exactly; a value on a bound is legal.

        Args:
            position: (n,) controller-side joint position [rad or m].

        Raises:
            OutOfRange: the first joint that is outside its range.
        """
        self.check_finite(position, "the joint position")
        for index, value in enumerate(position):
            lower, upper = self.lower[index], self.upper[index]
            if not lower <= value <= upper:
                name, unit = self.names[index], self.unit(index)
                raise OutOfRange(name, float(value), lower, upper, unit, index)

    def check_velocity(self, velocity: Sequence[float]) -> None:
        """Check (n,) velocities [rad/s or m/s] exactly, either sign, or raise `TooFast`."""
        self.check_finite(velocity, "the joint velocity")
        for index, value in enumerate(velocity):
            limit = self.velocity[index]
            if abs(value) > limit:
                raise TooFast(self.names[index], float(value), limit, self.unit(index), index)

    def check_acceleration(self, acceleration: Sequence[float]) -> None:
        """Check (n,) accelerations [rad/s² or m/s²] likewise, or raise `TooSharp`."""
        self.check_finite(acceleration, "the joint acceleration")
        for index, value in enumerate(acceleration):
            limit = self.acceleration[index]
            if abs(value) > limit:
                raise TooSharp(self.names[index], float(value), limit, self.unit(index), index)

    def as_float32(self) -> JointLimits:
        """Return the limits for a peer that compares 4-byte reals, rounded outward."""
        return replace(
            self,
            lower=tuple(-float32_ceiling(-value) for value in self.lower),
            upper=tuple(float32_ceiling(value) for value in self.upper),
            velocity=tuple(float32_ceiling(value) for value in self.velocity),
            acceleration=tuple(float32_ceiling(value) for value in self.acceleration),
        )


def without_rounding(
    position: Sequence[float], limits: JointLimits, reported: JointLimits
) -> tuple[float, ...]:
    """Return joints of which those that a 4-byte real has carried over a bound are on the bound.

    A joint that stands on its limit is reported so, and whoever sends the report back means the
    limit.

    Args:
        position: (n,) controller-side joint position [rad or m].
        reported: the limits as 4-byte reals, `limits.as_float32()`.
    """
    bounds = zip(position, limits.lower, limits.upper, reported.lower, reported.upper, strict=True)
    return tuple(
        min(max(value, lower), upper) if least <= value <= greatest else value
        for value, lower, upper, least, greatest in bounds
    )


def float32_ceiling(value: float) -> float:
    """Return the least 4-byte real that is not below a value.

    Raises:
        NotFinite: the value is not a number.
    """
    if math.isnan(value):
        raise NotFinite("the limit", 0)
    try:
        (nearest,) = _FLOAT32.unpack(_FLOAT32.pack(value))
    except OverflowError:
        nearest = math.copysign(math.inf, value)
    return float(nearest) if nearest >= value else _float32_above(nearest)


def _float32_above(value: float) -> float:
    # Consecutive 4-byte reals of one sign have consecutive bit patterns.
    if value == 0.0:
        bits = 1
    else:
        (bits,) = _UINT32.unpack(_FLOAT32.pack(value))
        bits += 1 if value > 0.0 else -1
    (above,) = _FLOAT32.unpack(_UINT32.pack(bits))
    return float(above)
