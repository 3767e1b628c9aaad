"""Points, vectors and twists from one frame to another.

Owns the three rules, which differ: a point shifts and turns, a free vector only turns, a twist
turns and changes with the place that its linear part is of. Poses go by `Pose.compose`. Knows no
tree: the transform is the source frame in the target frame, as of `FrameTree.transform`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .pose import Array, Pose, checked_vector


def transform_point(transform: Pose, point: Sequence[float] | Array) -> Array:
    """Return the (3,) place [m] in the target frame of a (3,) place in the source frame.

    Args:
        transform: the source frame in the target frame, as of `FrameTree.transform`.
        point: (3,) [m].

    Raises:
        BadArgument: there are not three values.
        NotFinite: a value is infinite or not a number.
    """
    moved: Array = transform.position + transform.rotation @ checked_vector(point, 3, "point")
    return moved


def transform_vector(transform: Pose, vector: Sequence[float] | Array) -> Array:
    """Return a (3,) free vector, such as a velocity or a force, along the target frame's axes.

    Raises:
        BadArgument: there are not three values.
        NotFinite: a value is infinite or not a number.
    """
    turned: Array = transform.rotation @ checked_vector(vector, 3, "vector")
    return turned


def transform_twist(transform: Pose, twist: Sequence[float] | Array) -> Array:
    """Return a rigid body's twist as seen in the target frame.

    The linear part of a twist is the velocity of the body's point at the *origin of the frame it
    is expressed in*, so it changes with the frame: v' = R v + p × R ω, ω' = R ω, the adjoint of
    Lynch and Park, Modern Robotics, section 3.3.2, in the order [v; ω]. The velocity of one and
    the same point is two free vectors instead: `transform_vector` each.

    Args:
        transform: the source frame in the target frame; the two do not move against each other.
        twist: (6,) [v; ω], m/s and rad/s.

    Raises:
        BadArgument: there are not six values.
        NotFinite: a value is infinite or not a number.
    """
    values = checked_vector(twist, 6, "twist")
    rotation = transform.rotation
    angular = rotation @ values[3:]
    return np.concatenate((rotation @ values[:3] + np.cross(transform.position, angular), angular))
