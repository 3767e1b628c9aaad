"""From the controller's joints to the joints of a serial robot's kinematic model.

Owns the one affine map from a controller-side joint vector (n driven joints) to the model's vector
(every moving joint, base to tip): coupling, dependent joints and file order are all in it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .pose import Array
from .robot import SerialRobot


def model_map(robot: SerialRobot) -> tuple[Array, Array]:
    """Return gain (m, n) and offset (m,) with model vector = gain · controller vector + offset.

    The model vector has one value per moving joint (m), driven or dependent, base to tip.
    """
    chain_side = np.eye(robot.dof)
    if robot.coupling.state_factor:
        chain_side[2, 1] = robot.coupling.state_factor
    row_of = {joint.name: chain_side[index] for index, joint in enumerate(robot.driven)}
    gain = np.zeros((len(robot.moving), robot.dof))
    offset = np.zeros(len(robot.moving))
    for index, joint in enumerate(robot.moving):
        if joint.dependent is None:
            gain[index] = row_of[joint.name]
            continue
        offset[index] = joint.dependent.offset
        for term in joint.dependent.terms:
            gain[index] += term.gain * row_of[term.joint]
    return gain, offset


def greatest_travel(robot: SerialRobot) -> list[float]:
    """Return the greatest distance of each moving joint from its zero, (m,) [rad or m].

    While the driven joints are in their ranges: a dependent one goes where they take it, whatever
    its own range in the robot file.
    """
    gain, offset = model_map(robot)
    ends = np.stack((gain * robot.limits.lower, gain * robot.limits.upper))
    least, most = (offset + side.sum(axis=1) for side in (ends.min(axis=0), ends.max(axis=0)))
    travel: list[float] = np.maximum(np.abs(least), np.abs(most)).tolist()
    return travel


def turning_joints(robot: SerialRobot, gain: Array) -> NDArray[np.bool_]:
    """Return (n,) whether a full turn of the joint leaves the tool where it was, read-only.

    Args:
        robot: the robot's facts.
        gain: (m, n) as of `model_map`.
    """
    # A coupled or dependent joint follows by its gain, so the gain must be a whole number.
    prismatic = np.array([joint.prismatic for joint in robot.moving])
    whole = (gain == np.round(gain)) & ~prismatic[:, None]
    turning: NDArray[np.bool_] = (whole | (gain == 0.0)).all(axis=0)
    turning.flags.writeable = False
    return turning
