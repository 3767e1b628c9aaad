"""Whether the way of a motion touches anything, before it starts and while it runs.

Owns which refusal a contact is. Runs in the planning process, like all that takes milliseconds: a
motion of ten minutes is looked at in about a second, one of a few seconds in some ten milliseconds.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from openpendant.motion.collision import CollisionModel
from openpendant.motion.errors import PathInCollision, StartInCollision
from openpendant.motion.kinematics import Kinematics
from openpendant.motion.path_check import first_contact
from openpendant.motion.scene import Scene
from openpendant.motion.trajectory import Array

from ..refusal import Refusal, refusal_of
from .way_check_job import WayCheckJob, WayFree


def collision_on(kinematics: Kinematics, positions: Array, scene: Scene) -> Refusal | None:
    """Return why a motion may not be made; None where nothing touches on its way.

    Args:
        kinematics: the robot.
        positions: (m, n) its samples, controller side; straight lines join them [rad or m].
        scene: what stands around.

    Raises:
        MotionError: the scene does not fit the robot.
    """
    contact = first_contact(_model(kinematics, scene), positions)
    if contact is None:
        return None
    if contact.fraction == 0.0:
        return refusal_of(StartInCollision(contact.first, contact.second, contact.distance))
    return refusal_of(
        PathInCollision(contact.first, contact.second, contact.distance, contact.fraction)
    )


def check_running(kinematics: Kinematics, job: WayCheckJob) -> Refusal | WayFree:
    """Return whether the rest of a motion that runs is free in a scene that has changed."""
    positions = np.frombuffer(job.positions, dtype="<f8").reshape(-1, kinematics.dof)
    return collision_on(kinematics, positions, job.scene) or WayFree()


@lru_cache(maxsize=8)
def _model(kinematics: Kinematics, scene: Scene) -> CollisionModel:
    return CollisionModel(kinematics, scene)
