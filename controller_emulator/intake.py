"""From the points of a message to the legs of a motion: all of them, or the first that is refused.

Owns the running state from point to point within a message. Nothing is buffered here, so a message
of many points is taken entirely or not at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from openpendant.simplemsg import JointTrajPt, JointTrajPtFull, TrajPoint

from .admission import Admission
from .faults import Refusal
from .legs import Knot, Leg
from .points import read_point


class Admitted(NamedTuple):
    """Points that may all be buffered.

    Attributes:
        legs: the way to each point.
        elapsed: time of the last point, from the start of the trajectory [ns].
        strays: points with values beyond the robot's joints.
    """

    legs: tuple[Leg, ...]
    elapsed: int
    strays: int


class Rejected(NamedTuple):
    """A point that may not be taken.

    Attributes:
        sequence: its number.
        refusal: why.
    """

    sequence: int
    refusal: Refusal


def admit(
    admission: Admission,
    points: Sequence[JointTrajPt | JointTrajPtFull | TrajPoint],
    tail: Knot,
    elapsed: int | None,
) -> Admitted | Rejected:
    """Check points one after the other.

    Args:
        admission: the checks.
        points: the points, in order.
        tail: state that the motion has before them.
        elapsed: time of the point before, from the start of the trajectory [ns]; None if these
            points start one.
    """
    legs: list[Leg] = []
    strays = 0
    for wire in points:
        point = read_point(wire, admission.limits.dof)
        if isinstance(point, Refusal):
            return Rejected(wire.sequence, point)
        if elapsed is None:
            leg = admission.first(point, tail)
        else:
            leg = admission.next(point, tail, elapsed)
        if isinstance(leg, Refusal):
            return Rejected(wire.sequence, leg)
        elapsed = (elapsed or 0) + point.duration if point.time is None else point.time
        tail = leg.end
        strays += point.has_stray_joints
        legs.append(leg)
    return Admitted(tuple(legs), elapsed or 0, strays)
