"""Steps instead of holding: where the tool is to go by one press.

What pendants call A, B, C is two things, named apart here: `turned` turns the tool about axes of a
frame through the tool centre point, as a held key does; `with_rpy_changed` adds to the three values
roll, pitch and yaw, as a pendant that shows them and steps one of them does. `motion.orientation`
has the formulas. The targets are poses for point-to-point motions; nothing here moves, and which
sizes are offered is the pendant's business.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..errors import BadArgument, NotFinite
from ..orientation import quaternion_of_vector, rpy_increment
from ..pose import Pose, quaternion_product


def shifted(pose: Pose, shift: Sequence[float], frame: Pose | None = None) -> Pose:
    """Return a pose moved along the axes of a frame; it keeps its orientation.

    Args:
        pose: of the tool, in the base.
        shift: (3,) along x, y, z of the frame [m].
        frame: the frame in the base; None for the base itself, the pose for the tool's own axes.

    Raises:
        BadArgument: there are not three values.
        NotFinite: a value is infinite or not a number.
    """
    way = np.array(_three(shift, "the shift"))
    if frame is not None:
        way = frame.rotation @ way
    return Pose(pose.position + way, pose.quaternion)


def turned(pose: Pose, turn: Sequence[float], frame: Pose | None = None) -> Pose:
    """Return a pose turned about one axis through its own origin: A, B, C as held keys do.

    Args:
        pose: of the tool, in the base.
        turn: (3,) rotation vector along x (A), y (B), z (C) of the frame [rad], right-handed.
        frame: the frame in the base; None for the base itself, the pose for the tool's own axes.

    Raises:
        BadArgument: there are not three values.
        NotFinite: a value is infinite or not a number.
    """
    vector = np.array(_three(turn, "the turn"))
    if frame is not None:
        vector = frame.rotation @ vector
    turned_by = quaternion_of_vector(vector)
    return Pose(pose.position, quaternion_product(turned_by, pose.quaternion))


def with_rpy_changed(pose: Pose, change: Sequence[float], frame: Pose | None = None) -> Pose:
    """Return a pose whose roll, pitch and yaw, as read in a frame, are each changed by an amount.

    Args:
        pose: of the tool, in the base.
        change: (3,) added to roll, pitch and yaw [rad].
        frame: the frame in the base whose roll, pitch and yaw are meant; None for the base.

    Raises:
        BadArgument: there are not three values.
        NotFinite: a value is infinite or not a number.
    """
    values = _three(change, "the change")
    if frame is None:
        return rpy_increment(pose, values)
    # Only the frame's axes matter, so the pose is turned into them and back about its own origin.
    axes = Pose(np.zeros(3), frame.quaternion)
    return axes.compose(rpy_increment(axes.inverse().compose(pose), values))


def _three(values: Sequence[float], what: str) -> list[float]:
    if len(values) != 3:
        raise BadArgument(what, list(values), "3 numbers")
    for index, value in enumerate(values):
        if not math.isfinite(value):
            raise NotFinite(what, index)
    return [float(value) for value in values]
