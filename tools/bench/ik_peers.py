"""Other solvers of inverse kinematics, asked the same questions as ours.

EAIK gives all branches by formulas, without limits or choice; what its user adds is done here:
turns inside the limits, the nearest to the seed by our own measure of distance, and a check by
forward kinematics. roboticstoolbox searches from the seed by Levenberg and Marquardt, in C++. Each
has the geometry of the robot file.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from openpendant.motion.kinematics.closed_form.geometry import arm_geometry
from openpendant.motion.kinematics.ik.levenberg_marquardt import rotation_angle
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Array, Pose

from .table import MissingRequirement

_FULL_TURN = 2.0 * np.pi
_EXACT = 1e-6  # m and rad


class IkQuestion(NamedTuple):
    """A tool pose, the same as a (4, 4) matrix, and the (n,) joint position to be near to."""

    pose: Pose
    matrix: Array
    seed: Array


Solver: TypeAlias = Callable[[IkQuestion], Array | None]
"""Answers with a (n,) joint position inside the limits, None where there is none."""


class Eaik:
    """EAIK for a robot of six revolute joints without coupling."""

    def __init__(self, kinematics: Kinematics) -> None:
        geometry = arm_geometry(kinematics.robot)
        points = np.vstack((np.zeros(3), geometry.points, geometry.tool[:3, 3]))
        library = _installed("eaik.IK_HP", "EAIK")
        self._robot = library.HPRobot(geometry.axes, np.diff(points, axis=0))
        self._to_zero = geometry.tool[:3, :3].T
        self._kinematics = kinematics
        self._weight = 1.0 / np.array(kinematics.limits.velocity) ** 2

    def aligned(self, target: Array) -> Array:
        """Return a (4, 4) target for EAIK's tool, which is aligned with the base at zero."""
        wanted = target.copy()
        wanted[:3, :3] = target[:3, :3].dot(self._to_zero)
        return wanted

    def branches(self, wanted: Array) -> Any:
        """Return all answers to an aligned target, without limits."""
        return self._robot.IK(wanted).Q

    def answer(self, question: IkQuestion) -> Array | None:
        """Return the answer nearest to the seed inside the limits, checked."""
        target = question.pose.to_matrix()
        solution = self._robot.IK(self.aligned(target))
        # It marks answers that only come near to the pose.
        found = np.array(solution.Q)[~np.array(solution.is_LS)]
        kinematics, seed = self._kinematics, question.seed
        lower, upper = kinematics.lower, kinematics.upper
        found += _FULL_TURN * np.round((seed - found) / _FULL_TURN)
        found -= _FULL_TURN * np.ceil(np.maximum(found - upper, 0.0) / _FULL_TURN)
        found += _FULL_TURN * np.ceil(np.maximum(lower - found, 0.0) / _FULL_TURN)
        found = found[((found >= lower) & (found <= upper)).all(axis=1)]
        if len(found) == 0:
            return None
        chosen: Array = found[np.argmin(((found - seed) ** 2).dot(self._weight))]
        rotation, position = kinematics.place(chosen)
        miss = math.dist(position, target[:3, 3]) + rotation_angle(rotation, target[:3, :3])
        return chosen if miss <= _EXACT else None


class Toolbox:
    """roboticstoolbox's `ik_LM` on the DH table of the robot file."""

    def __init__(self, kinematics: Kinematics) -> None:
        library = _installed("roboticstoolbox", "roboticstoolbox")
        table = kinematics.robot.dh
        if table is None:
            raise MissingRequirement(f"{kinematics.robot.name} has no DH table")
        links = [
            library.RevoluteDH(
                d=row.d, a=row.a, alpha=row.alpha, offset=row.theta_offset, qlim=limits
            )
            for row, *limits in zip(table.rows, kinematics.lower, kinematics.upper, strict=True)
        ]
        base = Pose.from_rpy(kinematics.robot.base_frame.xyz, kinematics.robot.base_frame.rpy)
        before = Pose.from_rpy(table.base.xyz, table.base.rpy).inverse().compose(base)
        after = Pose.from_rpy(table.tool.xyz, table.tool.rpy).inverse()
        self._before, self._after = before.to_matrix(), after.to_matrix()
        self._chain = library.DHRobot(links).ets()

    def answer(self, question: IkQuestion) -> Array | None:
        """Search from the seed; the library judges limits and residual itself."""
        target = self._before.dot(question.pose.to_matrix()).dot(self._after)
        found = self._chain.ik_LM(target, q0=question.seed, tol=1e-12, slimit=100)
        return found.q if found.success else None


def _installed(module: str, name: str) -> Any:
    try:
        return import_module(module)
    except ImportError as absent:
        raise MissingRequirement(f"{name} is not installed") from absent
