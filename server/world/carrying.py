"""How an object of the scene changes hands: taken by a link of the robot, or left where it is.

Owns what a program's `attach` and `detach` make of a scene, for those that run it and for the dry
run alike. Knows neither documents nor whether the robot may move.
"""

from __future__ import annotations

from collections.abc import Callable

from openpendant.motion.pose import Pose
from openpendant.motion.scene import Scene


def taken(scene: Scene, name: str, link: str, link_pose: Pose) -> Scene:
    """Return the scene once a link has taken an object where both are.

    Args:
        scene: the scene before.
        name: of the object.
        link: the link that carries from now on, and may touch what it carries.
        link_pose: where the link is, in the base frame.

    Raises:
        MotionError: there is no such object, or it is carried already.
    """
    return scene.attach(name, link, link_pose, touching=(link,))


def left(scene: Scene, name: str, flange: str, link_pose: Callable[[str], Pose]) -> Scene:
    """Return the scene once an object is left where it is.

    Args:
        scene: the scene before.
        name: of the object.
        flange: the link that tools are bolted to, for an object that no link carries.
        link_pose: tells where a link is, in the base frame.

    Raises:
        MotionError: there is no such object, or nobody carries it.
    """
    return scene.detach(name, link_pose(scene.get(name).link or flange))
