"""Frame teaching: a frame from points that the tool's tip was moved to.

Owns the meaning of three points (the origin, a point on +x, a point of the xy plane on the side of
+y) and of four (two on each axis), the rules when they are too close or too nearly in line, and the
quality of the frame. Knows no robot and no tree: points are (3,) [m] in one frame, and the frame
found is expressed in the same. Points come from one tool whose centre point was calibrated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..errors import PoorGeometry
from ..pose import Array, Pose, checked_vector

LEAST_DISTANCE = 0.01
"""Least distance of two taught points [m]: at 10 mm a touch 0.2 mm off tilts the frame by 1°."""

LEAST_ANGLE = math.radians(5.0)
"""Least angle between the directions that the points give to x and y [rad]."""

GREATEST_SKEW = math.radians(10.0)
"""Greatest deviation of two axes taught apart from a right angle [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class FrameFromPoints:
    """Frame from points, and how well they determine it.

    Attributes:
        pose: the frame, in the frame of the points.
        x_distance: distance of the points along x [m].
        y_distance: distance of the farther point along y from the x axis [m].
        angle: between the directions taught for x and y [rad]; π/2 determines best.
        tilt_per_error: tilt of the frame per error of a point [rad/m].
        skew: deviation of the axes, each taught by two points, from the right angle [rad]; 0 for
            three points, which have no redundancy.
        gap: least distance of the two axes as taught [m]; 0 for three points.
    """

    pose: Pose
    x_distance: float
    y_distance: float
    angle: float
    tilt_per_error: float
    skew: float = 0.0
    gap: float = 0.0


def frame_from_three_points(
    origin: Sequence[float] | Array,
    on_x: Sequence[float] | Array,
    on_y_side: Sequence[float] | Array,
) -> FrameFromPoints:
    """Return the frame whose origin, x axis and xy plane three points give.

    x points to `on_x`, z is at right angles to the plane of the points, y completes the frame and
    `on_y_side` has y > 0: Gram and Schmidt's construction.

    Args:
        on_x: (3,) any point on the positive x axis [m].
        on_y_side: (3,) any point of the xy plane with y > 0 [m].

    Raises:
        PoorGeometry: two points nearly coincide, or the three lie nearly in a line.
        BadArgument, NotFinite: a vector is not three finite values.
    """
    o = checked_vector(origin, 3, "origin")
    x = _separation(o, checked_vector(on_x, 3, "on_x"), "origin", "on_x")
    side = _separation(o, checked_vector(on_y_side, 3, "on_y_side"), "origin", "on_y_side")
    _separation(o + x, o + side, "on_x", "on_y_side")
    angle = _angle(x, side)
    _check_not_in_line(angle, "the angle at the origin")
    pose = _frame(o, x, side)
    y_distance = float(np.linalg.norm(side)) * math.sin(angle)
    x_distance = float(np.linalg.norm(x))
    return FrameFromPoints(pose, x_distance, y_distance, angle, 1.0 / min(x_distance, y_distance))


def frame_from_four_points(
    first_on_x: Sequence[float] | Array,
    second_on_x: Sequence[float] | Array,
    first_on_y: Sequence[float] | Array,
    second_on_y: Sequence[float] | Array,
) -> FrameFromPoints:
    """Return the frame whose axes four points give: for a corner whose tip cannot be touched.

    x is the line through its two points, exactly. z is at right angles to both lines; the origin is
    the point of x that is nearest to the other line. The residual is the deviation of the lines
    from a right angle and their distance.

    Args:
        first_on_x: (3,) a point on the x axis [m].
        second_on_x: (3,) another, farther along +x [m].
        first_on_y: (3,) a point on the y axis [m].
        second_on_y: (3,) another, farther along +y [m].

    Raises:
        PoorGeometry: two points of an axis nearly coincide, the axes miss the right angle by more
            than 10°, or pass each other by more than a tenth of the shorter taught length.
        BadArgument, NotFinite: a vector is not three finite values.
    """
    a, c = checked_vector(first_on_x, 3, "first_on_x"), checked_vector(first_on_y, 3, "first_on_y")
    x = _separation(a, checked_vector(second_on_x, 3, "second_on_x"), "first_on_x", "second_on_x")
    y = _separation(c, checked_vector(second_on_y, 3, "second_on_y"), "first_on_y", "second_on_y")
    angle = _angle(x, y)
    skew = abs(angle - math.pi / 2.0)
    if skew > GREATEST_SKEW:
        what = "what the two axes miss the right angle by"
        raise PoorGeometry(what, skew, GREATEST_SKEW, "rad", least=False)
    # The feet of the common normal: a + s x and c + t y with both at right angles to the gap.
    normal = np.array([[x @ x, -(x @ y)], [x @ y, -(y @ y)]])
    s, t = np.linalg.solve(normal, np.array([x @ (c - a), y @ (c - a)]))
    origin = a + s * x
    gap = float(np.linalg.norm(c + t * y - origin))
    lengths = float(np.linalg.norm(x)), float(np.linalg.norm(y))
    if gap > min(lengths) / 10.0:
        what = "the distance at which the two axes pass each other"
        raise PoorGeometry(what, gap, min(lengths) / 10.0, "m", least=False)
    pose = _frame(origin, x, y)
    return FrameFromPoints(pose, *lengths, angle, 1.0 / min(lengths), skew, gap)


def _frame(origin: Array, x: Array, side: Array) -> Pose:
    """Return the frame at an origin with x along one vector and y on the side of another."""
    x = x / np.linalg.norm(x)
    z = np.cross(x, side)
    z /= np.linalg.norm(z)
    return Pose.from_matrix(np.column_stack((x, np.cross(z, x), z)), origin)


def _separation(start: Array, end: Array, first: str, second: str) -> Array:
    distance = math.dist(start, end)
    if not distance >= LEAST_DISTANCE:
        what = f"the distance from {first} to {second}"
        raise PoorGeometry(what, distance, LEAST_DISTANCE, "m")
    return end - start


def _check_not_in_line(angle: float, what: str) -> None:
    if angle < LEAST_ANGLE:
        raise PoorGeometry(what, angle, LEAST_ANGLE, "rad")
    if math.pi - angle < LEAST_ANGLE:
        raise PoorGeometry(what, angle, math.pi - LEAST_ANGLE, "rad", least=False)


def _angle(first: Array, second: Array) -> float:
    return math.atan2(float(np.linalg.norm(np.cross(first, second))), float(first @ second))
