"""How fast each joint can move a point of the arm, wherever in their ranges the joints are.

Owns that bound. Links being rigid, a turning joint moves the origin of a link beyond it by at most
the lengths of what is between them, per radian; a slide by its own travel. So a look at a point's
speed can be spared where even the sum of these is slow.
"""

from __future__ import annotations

import math

import numpy as np

from ..kinematics import Kinematics
from ..model_map import greatest_travel, model_map
from ..robot_schema import Joint


def levers(kinematics: Kinematics, link: str, offset: float = 0.0) -> list[float]:
    """Return the greatest speed of a point of a link by the speed of each joint, (n,) [m/rad or 1].

    Wherever the driven joints are in their ranges.

    Args:
        kinematics: the arm.
        link: which the point is fixed to.
        offset: how far the point is from the link's origin [m].
    """
    robot = kinematics.robot
    gain, _ = model_map(robot)
    travel = greatest_travel(robot)
    rows = np.zeros(len(gain))
    chain = robot.joints[: robot.links.index(link)]
    index = sum(isinstance(joint, Joint) for joint in chain)
    reach = offset
    for joint in reversed(chain):
        if isinstance(joint, Joint):
            index -= 1
            rows[index] = 1.0 if joint.prismatic else reach
            if joint.prismatic:
                reach += travel[index]
        reach += math.hypot(*joint.origin.xyz)
    found: list[float] = (rows @ np.abs(gain)).tolist()
    return found
