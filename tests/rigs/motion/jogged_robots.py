"""Robots to jog, each built once, and random places and presses for them."""

from functools import cache

import numpy as np
from rigs.motion.loaded_robots import load_robot

from openpendant.motion import jog
from openpendant.motion.paths.mechanism import Mechanism, PlatformMechanism, mechanism

FAST = jog.JogCaps(joint_fraction=1.0, tool_speed=1.0, rotation_speed=1.0, reduced=False)
"""As fast as the joints allow."""

REDUCED = jog.JogCaps(joint_fraction=1.0)
"""Fast joints under 250 mm/s."""

UR5_BENT = [0.3, -1.2, 1.4, -1.0, -1.2, 0.4]
"""A place of the UR5 far from limits and singularities."""


@cache
def robot(name: str) -> Mechanism:
    return mechanism(load_robot(name))


@cache
def model(name: str) -> jog.JogModel:
    return jog.jog_model(robot(name))


def random_place(name: str, random: np.random.Generator) -> list[float]:
    """Return any joint position; of a platform one inside its workspace."""
    found = robot(name)
    if isinstance(found, PlatformMechanism):
        workspace = found.kinematics.workspace
        shares = random.dirichlet(np.full(6, 0.5)) * random.choice((-1.0, 1.0), 6)
        pose = workspace.pose(0.9 * random.uniform() * shares * workspace.bounds)
        lengths: list[float] = found.kinematics.inverse(pose).tolist()
        return lengths
    place: list[float] = random.uniform(found.limits.lower, found.limits.upper).tolist()
    return place


def random_press(dof: int, random: np.random.Generator, *, single: bool = False) -> jog.JogTarget:
    """Return a press of one key or of several, of joints or of the tool."""
    count = dof if random.random() < 0.4 else 6
    rates = random.uniform(-1.0, 1.0, count) * (random.random(count) < 0.6)
    if single:
        rates = np.zeros(count)
        rates[random.integers(count)] = random.choice((-1.0, 1.0))
    if count == dof and random.random() < 0.5:
        return jog.JointJog(tuple(rates))
    if count != 6:
        return jog.JointJog(tuple(rates))
    axes = None if random.random() < 0.3 else jog.BASE_AXES
    return jog.ToolJog(tuple(rates[:3]), tuple(rates[3:]), axes)


def opposite(target: jog.JogTarget) -> jog.JogTarget:
    if isinstance(target, jog.JointJog):
        return jog.JointJog(tuple(-rate for rate in target.rates))
    linear, angular = (tuple(-rate for rate in rates) for rates in (target.linear, target.angular))
    return jog.ToolJog(linear, angular, target.axes)
