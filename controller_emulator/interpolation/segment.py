"""Motion between two points: functions of time for all joints, and whether they stay in bounds.

Owns the choice of interpolation. Joints are interpolated alike wherever their bounds allow: by one
rule that is linear in the states at both ends, with the same weights for all joints. Where the
sender's joints move along q(t) = q₀ + c s(t), such a rule gives q₀ + c S(t) with S in place of s:
another time, the same path. So the robot leaves the sender's path only by what the path bends
within the segment. Joints that each follow a rule of their own would leave it sideways.

The quintic of all joints is taken where it stays inside the bounds, else the motion with one step
in the accelerations stated, else the cubic, else constant accelerations with one switch, each at
the same time for all. Where none of these is in bounds each joint takes its motion of least peak
acceleration; so a pair of points is turned down only if *no* motion between them could keep the
bounds. Knows no buffers and no clock: times are seconds from the start
of the segment.
"""

from __future__ import annotations

from typing import NamedTuple

from ..error_codes import PointRefusal, violation
from .polynomials import Bounds, Pieces, SegmentEnd, cubics, quintics
from .stepping import Excess, gentlest, stepped, switched

State = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]
"""Position [rad or m], velocity […/s], acceleration […/s²] of all joints."""


class MotionSegment(NamedTuple):
    """The motion of all joints between two points.

    Attributes:
        duration: [s], more than 0.
        joints: the pieces of each joint, in order of time.
    """

    duration: float
    joints: tuple[Pieces, ...]

    def sample(self, time: float) -> State:
        """Return position, velocity and acceleration `time` seconds after the start."""
        position, velocity, acceleration = [], [], []
        for pieces in self.joints:
            index = len(pieces) - 1
            while index and time < pieces[index][0]:
                index -= 1
            start, (c0, c1, c2, c3, c4, c5) = pieces[index]
            t = time - start
            position.append(c0 + t * (c1 + t * (c2 + t * (c3 + t * (c4 + t * c5)))))
            velocity.append(c1 + t * (2 * c2 + t * (3 * c3 + t * (4 * c4 + t * 5 * c5))))
            acceleration.append(2 * c2 + t * (6 * c3 + t * (12 * c4 + t * 20 * c5)))
        return tuple(position), tuple(velocity), tuple(acceleration)


def connect(
    duration: float, starts: list[SegmentEnd], ends: list[SegmentEnd], bounds: tuple[Bounds, ...]
) -> MotionSegment | PointRefusal:
    """Return the motion from one state of all joints to another, within bounds.

    Args:
        duration: [s], more than 0.
        starts: state of each joint at the start.
        ends: state of each joint at the end.
        bounds: bounds of each joint.

    Returns:
        The segment, or the refusal with the first joint for which no motion keeps its bounds.
    """
    alike = (
        quintics(duration, starts, ends, bounds)
        or stepped(duration, starts, ends, bounds)
        or cubics(duration, starts, ends, bounds)
        or switched(duration, starts, ends, bounds)
    )
    if alike:
        return MotionSegment(duration, alike)
    joints = []
    for index, (start, end, bound) in enumerate(zip(starts, ends, bounds, strict=True)):
        pieces = gentlest(duration, start, end, bound)
        if isinstance(pieces, Excess):
            return violation(pieces.kind, index, pieces.value, pieces.limit)
        joints.append(pieces)
    return MotionSegment(duration, tuple(joints))
