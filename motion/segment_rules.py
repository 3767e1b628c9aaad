"""What a user may ask of the way from one waypoint to the next: how long, and how fast at most.

Owns the rule, its accepted values, and its translation from waypoints to the knots of a path, where
waypoints that coincide share one. Knows neither limits nor how a path is timed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from .errors import BadArgument
from .joint_curves import Path
from .trajectory import MAX_DURATION


@dataclass(frozen=True, slots=True)
class SegmentRule:
    """What is asked of the way from one waypoint to the next.

    Attributes:
        min_duration: the motion spends at least this long there [s].
        speed_fraction: no joint exceeds this fraction of its velocity limit there, 0 to 1.
    """

    min_duration: float | None = None
    speed_fraction: float | None = None


@dataclass(frozen=True, slots=True)
class Stretch:
    """A rule on the way between two knots of a path.

    Attributes:
        first: place of the knot where it begins.
        last: place of the knot where it ends, greater than `first`.
        min_duration: the motion spends at least this long in between [s].
        speed_fraction: of the velocity limits, above 0 and at most 1.
    """

    first: int
    last: int
    min_duration: float
    speed_fraction: float


def folded(path: Path, segments: Sequence[SegmentRule] | None) -> list[Stretch]:
    """Return the rules by knots; those of ways without length fall to the next that has one.

    Args:
        path: whose waypoints the rules lie between.
        segments: one rule for the way to each waypoint after the first, or none at all.

    Raises:
        BadArgument: the number of rules, or a value in one.
    """
    if segments is None:
        return []
    places = path.waypoint_knots.tolist()
    if len(segments) != len(places) - 1:
        raise BadArgument("segments", len(segments), f"{len(places) - 1} rules, one for each way")
    stretches: list[Stretch] = []
    waiting = 0.0
    for rule, first, last in zip(segments, places, places[1:], strict=False):
        duration, fraction = _checked(rule)
        waiting += duration
        if first < last:
            stretches.append(Stretch(first, last, waiting, fraction))
            waiting = 0.0
    if waiting:
        end = stretches.pop()
        stretches.append(replace(end, min_duration=end.min_duration + waiting))
    return stretches


def _checked(rule: SegmentRule) -> tuple[float, float]:
    duration = 0.0 if rule.min_duration is None else rule.min_duration
    fraction = 1.0 if rule.speed_fraction is None else rule.speed_fraction
    if not 0.0 <= duration <= MAX_DURATION:
        raise BadArgument("min_duration", duration, f"0 to {MAX_DURATION:g} s")
    if not 0.0 < fraction <= 1.0:
        raise BadArgument("speed_fraction", fraction, "more than 0 and at most 1")
    return duration, fraction
