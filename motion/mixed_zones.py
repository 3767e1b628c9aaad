"""How large a zone may be where a line in joint space meets a curve of the tool.

Owns the rule: such a zone takes the same distance r in joint space of both paths, no more than the
whole of a leg that begins or ends at rest and no more than half of one whose other end is rounded
too. At the end of a PTP r is what was asked for; at the end of a LIN or CIRC it is where the tool
is as far from the target as was asked for. Knows no segment and no time.
"""

from __future__ import annotations

import numpy as np

from .errors import ZoneTooLarge
from .joint_curves import Path
from .tool_kinematics import ToolKinematics
from .zones import LEAST_ZONE

_SAMPLES = 512
_ROUNDING = 1e-9  # of a zone that is exactly as large as it may be


def largest_joint_zone(before: Path, after: Path, *, rounded: tuple[bool, bool]) -> float:
    """Return the largest zone between two paths, in joint space.

    Args:
        before: the path that ends at the corner.
        after: the one that begins there.
        rounded: whether the last leg of the first begins in a zone, and the first leg of the other
            ends in one.
    """
    passed, next_passed = (path.knots[path.waypoint_knots] for path in (before, after))
    legs = (passed[-1] - passed[-2], next_passed[1] - next_passed[0])
    return min(
        float(leg) / (2.0 if other else 1.0) for leg, other in zip(legs, rounded, strict=True)
    )


def tool_zone(
    kinematics: ToolKinematics, before: Path, zone: float, largest: float, waypoint: int
) -> float:
    """Return the zone in joint space in which the tool runs as far as asked to the end of a path.

    Args:
        kinematics: the robot.
        before: the path that ends at the corner, a curve of the tool.
        zone: the way of the tool to the corner [m].
        largest: the largest zone that fits, in joint space.
        waypoint: number of the corner, for the refusal.

    Raises:
        ZoneTooLarge: the tool runs less far in the largest zone, or only turns.
    """
    left = np.linspace(0.0, largest, _SAMPLES)
    positions = kinematics.places(before.evaluate(before.length - left)).position
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1)
    way = np.concatenate(([0.0], np.cumsum(steps)))
    if way[-1] < LEAST_ZONE:
        raise ZoneTooLarge(waypoint, zone, 0.0, "m", "the tool only turns on a leg there")
    if zone > way[-1] * (1.0 + _ROUNDING):
        reason = "it does not fit on the legs there"
        raise ZoneTooLarge(waypoint, zone, float(way[-1]), "m", reason)
    return float(np.interp(zone, way, left))
