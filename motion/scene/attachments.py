"""Attaching and detaching of scene objects: taken by a link of the robot, or left where they are.

Owns the change that a program's `attach` and `detach` make to a scene, for a run and for the dry
run alike. Knows neither documents nor the permission to move.
"""

from __future__ import annotations

from collections.abc import Callable

from ..pose import Pose
from .scene import Scene


def taken(scene: Scene, name: str, link: str, link_pose: Pose) -> Scene:
    """Return the scene after a link has taken an object, both being where they are.

    Args:
        scene: the scene before.
        name: of the object.
        link: the link that carries it from now on, and may touch what it carries.
        link_pose: pose of the link in the base frame.

    Raises:
        MotionError: there is no such object, or it is carried already.
    """
    return scene.attach(name, link, link_pose, touching=(link,))


def left(scene: Scene, name: str, flange: str, link_pose: Callable[[str], Pose]) -> Scene:
    """Return the scene after an object is left where it is.

    Args:
        scene: the scene before.
        name: of the object.
        flange: the link that tools are bolted to, for an object that no link carries.
        link_pose: returns the pose of a link in the base frame.

    Raises:
        MotionError: there is no such object, or nobody carries it.
    """
    return scene.detach(name, link_pose(scene.get(name).link or flange))
