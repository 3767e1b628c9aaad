"""The robots of the project, each read once a process.

A robot never changes, and to read one from its file takes longer than most tests of it.
"""

from collections.abc import Sequence
from functools import cache

from openpendant.motion.description import robot as motion_robot
from openpendant.motion.description.robot import Robot, SerialRobot, robot_names
from openpendant.motion.kinematics.serial import Kinematics

SERIAL = tuple(name for name in robot_names() if name != "stewart_classroom")
"""Every arm of the project."""


@cache
def load_robot(name: str) -> Robot:
    """As that of `motion.robot`, but for names of the project alone."""
    assert name in robot_names(), name
    return motion_robot.load_robot(name)


def serial_robot(name: str) -> SerialRobot:
    """As that of `motion.robot`, but for names of the project alone."""
    found = load_robot(name)
    assert isinstance(found, SerialRobot), name
    return found


@cache
def arm(name: str) -> Kinematics:
    """Return the kinematics of an arm, which a test must not change."""
    return Kinematics(serial_robot(name))


def chain_values(robot: SerialRobot, controller: Sequence[float]) -> list[float]:
    """Return the chain's own value of each moving joint, joint by joint from the file."""
    driven = [float(value) for value in controller]
    if robot.coupling.state_factor:
        driven[2] += robot.coupling.state_factor * driven[1]
    known = {joint.name: value for joint, value in zip(robot.driven, driven, strict=True)}
    for joint in robot.moving:
        if joint.dependent is not None:
            terms = (term.gain * known[term.joint] for term in joint.dependent.terms)
            known[joint.name] = joint.dependent.offset + sum(terms)
    return [known[joint.name] for joint in robot.moving]
