"""Scenes for tests of collisions and planning: one with a pillar, and random ones."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from rigs.motion.loaded_robots import arm

from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Array
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Box, Capsule, Cylinder, Scene, SceneObject, Shape, Sphere


class Task(NamedTuple):
    collision: CollisionModel
    start: Array
    goal: Array


def pillar_scene() -> Scene:
    """A pillar in front of the UR5 and the table it stands on."""
    pillar = SceneObject("pillar", Box((0.12, 0.12, 1.0)), (-0.45, 0.0, 0.5))
    return Scene((pillar, SceneObject("table", Box((2.0, 2.0, 0.1)), (0.0, 0.0, -0.1))))


def pillar_task() -> Task:
    """The UR5 is to swing 1.8 rad with the pillar in the middle."""
    kinematics = arm("ur5")
    start, goal = np.array(kinematics.robot.home_position), np.array(kinematics.robot.home_position)
    start[0], goal[0] = -0.22 - 0.9, -0.22 + 0.9
    return Task(CollisionModel(kinematics, pillar_scene()), start, goal)


def random_tasks(robot: str, seeds: range) -> Iterator[Task]:
    """Up to five random bodies within reach, and two random positions that touch nothing."""
    kinematics = arm(robot)
    for seed in seeds:
        random = np.random.default_rng(seed)
        bodies = (_body(f"body {i}", kinematics.size, random) for i in range(5))
        # One that touches the robot at home could leave it no free position at all.
        objects = tuple(body for body in bodies if not _touches_at_home(kinematics, body))
        collision = CollisionModel(kinematics, Scene(objects))
        start, goal = free_position(collision, random), free_position(collision, random)
        yield Task(collision, start, goal)


def free_position(collision: CollisionModel, random: np.random.Generator) -> Array:
    kinematics = collision.kinematics
    lower = np.maximum(kinematics.lower, -math.pi)
    upper = np.minimum(kinematics.upper, math.pi)
    for _ in range(10_000):
        position: Array = random.uniform(lower, upper)
        if not collision.collides(position):
            return position
    raise AssertionError("the scene leaves no room")


def _touches_at_home(kinematics: Kinematics, body: SceneObject) -> bool:
    return CollisionModel(kinematics, Scene((body,))).collides(kinematics.robot.home_position)


def _body(name: str, reach: float, random: np.random.Generator) -> SceneObject:
    direction = random.normal(size=3)
    direction /= np.linalg.norm(direction)
    x, y, z = (direction * random.uniform(0.4, 1.0) * reach).tolist()
    turn = random.normal(size=4)
    a, b, c, d = (turn / np.linalg.norm(turn)).tolist()
    size = random.uniform(0.05, 0.25, 3) * reach
    shapes: tuple[Shape, ...] = (
        Box((float(size[0]), float(size[1]), float(size[2]))),
        Sphere(float(size[0]) / 2.0),
        Cylinder(float(size[0]) / 2.0, float(size[1])),
        Capsule(float(size[0]) / 2.0, float(size[1])),
    )
    return SceneObject(name, shapes[random.integers(4)], (x, y, z), (a, b, c, d))
