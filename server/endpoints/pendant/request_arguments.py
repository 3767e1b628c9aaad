"""The arguments of pendant requests, checked before anything is planned.

Pure functions: a value to the refusal that it deserves, None where it is in order. Joint positions
are `joint_slots`' business.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from openpendant.simplemsg.pendant import Motion
from openpendant.simplemsg.verdicts import VerdictCode

from ...planning.jobs import PoseGoal
from ...refusal import Refusal

LARGEST_COORDINATE = 1e3
"""No tool is asked to go farther from its frame [m]; keeps overflow out of the planner."""

_LEAST_RATE, _GREATEST_RATE = 1.0, 125.0
_NORM_TOLERANCE = 0.01


def rate_fault(rate: float) -> Refusal | None:
    """Judge a wanted state rate [Hz]; 0 means none."""
    if rate == 0 or _LEAST_RATE <= rate <= _GREATEST_RATE:
        return None
    text = f"a state rate of {rate:g} Hz; accepted: 0, or {_LEAST_RATE:g} to {_GREATEST_RATE:g}"
    return Refusal(VerdictCode.BAD_ARGUMENT, text, value=rate, limit=_GREATEST_RATE)


def motion_fault(motion: int) -> Refusal | None:
    """Judge how the tool is to get to a pose."""
    if motion in (Motion.PTP, Motion.LIN):
        return None
    return Refusal(VerdictCode.BAD_ARGUMENT, f"motion {motion}; accepted: 1 PTP, 2 LIN")


def pose_fault(goals: Sequence[PoseGoal]) -> Refusal | None:
    """Judge tool poses: finite, not absurdly far, quaternions of length 1."""
    for number, goal in enumerate(goals, start=1):
        if not all(map(math.isfinite, (*goal.position, *goal.orientation))):
            return Refusal(VerdictCode.NOT_FINITE, f"pose {number} holds no finite numbers")
        farthest = max(goal.position, key=abs)
        if abs(farthest) > LARGEST_COORDINATE:
            text = f"pose {number} lies at {farthest:g} m; accepted: up to {LARGEST_COORDINATE:g}"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=farthest, limit=LARGEST_COORDINATE)
        norm = math.sqrt(sum(part * part for part in goal.orientation))
        if abs(norm - 1.0) > _NORM_TOLERANCE:
            text = f"the quaternion of pose {number} has length {norm:g}; accepted: 1"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=norm, limit=1.0)
    return None
