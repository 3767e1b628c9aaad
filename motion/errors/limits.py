"""A limit of a joint would be broken; the unit of a value is that of the joint."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .motion_error import MotionError
from .wording import on_the_path


@dataclass(eq=False)
class OutOfRange(MotionError):
    """A joint position lies outside its range; `index` is the joint's place, -1 if not known.

    `fraction` is how far along a path it would be there, 0 to 1.
    """

    code: ClassVar[str] = "out-of-range"
    joint: str
    value: float
    lower: float
    upper: float
    unit: str = "rad"
    index: int = -1
    fraction: float | None = None

    def __str__(self) -> str:
        where = on_the_path(self.fraction)
        return (
            f"{self.joint} at {self.value!r} {self.unit} is outside its range"
            f" {self.lower!r} to {self.upper!r} {self.unit}{where}"
        )


@dataclass(eq=False)
class TooFast(MotionError):
    """A joint velocity exceeds its limit; `unit` is that of the position."""

    code: ClassVar[str] = "too-fast"
    joint: str
    value: float
    limit: float
    unit: str = "rad"
    index: int = -1

    def __str__(self) -> str:
        return (
            f"{self.joint} at {self.value!r} {self.unit}/s is faster than its limit"
            f" {self.limit!r} {self.unit}/s"
        )


@dataclass(eq=False)
class TooSharp(MotionError):
    """A joint acceleration exceeds its limit; `unit` is that of the position."""

    code: ClassVar[str] = "too-sharp"
    joint: str
    value: float
    limit: float
    unit: str = "rad"
    index: int = -1

    def __str__(self) -> str:
        return (
            f"{self.joint} accelerating at {self.value!r} {self.unit}/s² exceeds its limit"
            f" {self.limit!r} {self.unit}/s²"
        )


@dataclass(eq=False)
class CertificateRefused(MotionError):
    """The independent check found a sample that may not leave.

    `check` names the rule, such as `velocity`; `joint`, `value` and `limit` are the offender's;
    `unit` is that of `value`; `time` [s] is the sample's, from the start of the trajectory.
    """

    code: ClassVar[str] = "certificate-refused"
    check: str
    joint: str
    value: float
    limit: float
    time: float
    unit: str = "rad"

    def __str__(self) -> str:
        return (
            f"the trajectory fails the {self.check} check: {self.joint} has {self.value!r}"
            f" {self.unit} at {self.time:.6g} s, the limit is {self.limit!r} {self.unit}"
        )
