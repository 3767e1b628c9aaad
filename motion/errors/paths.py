"""The geometry of a path is at fault: a circle, a zone, or one segment of several."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import ClassVar

from .motion_error import MotionError
from .wording import for_a_screen


class CircleFault(Enum):
    """Why points determine no circle."""

    COINCIDENT = "coincident"
    COLLINEAR = "collinear"
    NOT_EQUIDISTANT = "not-equidistant"
    TOO_SMALL = "too-small"
    TOO_LARGE = "too-large"
    NO_NORMAL = "no-normal"


_CIRCLE_FAULTS = {
    CircleFault.COINCIDENT: (
        "two points of the circle are {value} apart; accepted: at least {limit}"
    ),
    CircleFault.COLLINEAR: (
        "the points of the circle lie on one line: one is {value} off the line through the others;"
        " accepted: at least {limit}"
    ),
    CircleFault.NOT_EQUIDISTANT: (
        "the centre is {limit} from the start and {value} from the end; accepted: equal radii"
    ),
    CircleFault.TOO_SMALL: "the radius is {value}; accepted: at least {limit}",
    CircleFault.TOO_LARGE: "the radius is {value}; accepted: at most {limit}",
    CircleFault.NO_NORMAL: (
        "start, centre and end lie within {value} of one line, so the plane of the circle is not"
        " known; accepted: at least {limit}, or a normal of the plane"
    ),
}


@dataclass(eq=False)
class BadCircle(MotionError):
    """Points do not determine a circle that can be run along.

    `fault` names the rule; `value` and `limit` are its numbers, [m] each. For a centre that is not
    equally far from both ends they are the radius at the end and that at the start.
    """

    code: ClassVar[str] = "bad-circle"
    fault: CircleFault
    value: float
    limit: float

    def __str__(self) -> str:
        value, limit = for_a_screen(self.value, "m"), for_a_screen(self.limit, "m")
        return _CIRCLE_FAULTS[self.fault].format(value=value, limit=limit)


@dataclass(eq=False)
class ZoneTooLarge(MotionError):
    """A corner cannot be rounded as widely as asked.

    `waypoint` is the corner's place among those asked for, from 0; `largest` is the largest zone
    that works there with the other zones as they are, `unit` that of both; `reason` is what
    bounds it.
    """

    code: ClassVar[str] = "zone-too-large"
    waypoint: int
    zone: float
    largest: float
    unit: str
    reason: str

    def __str__(self) -> str:
        return (
            f"the zone of {self.zone:.6g} {self.unit} at waypoint {self.waypoint} is too large:"
            f" {self.reason}; the largest that works is {self.largest:.6g} {self.unit}"
        )


@dataclass(eq=False)
class SegmentRefused(MotionError):
    """One segment of several is refused; `reason` says why, a fraction in it is the segment's.

    `segment` is its place in the list, from 0.
    """

    code: ClassVar[str] = "segment-refused"
    segment: int
    reason: MotionError

    def __str__(self) -> str:
        return f"segment {self.segment}: {self.reason}"
