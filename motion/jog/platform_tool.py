"""Platform tool: the tool of a Stewart platform in a jog.

Owns the reading of the platform's own limits as shares (workspace sum, cones of the anchors), and
the search for the pose of given legs, started where the last one ended. Legs follow a pose by
formula, so following needs no search. The condition number is of the leg Jacobian with rotations
measured at the platform's anchor circle, as in `workspace`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..kinematics.stewart.platform import StewartKinematics, assemble
from ..pose import Array, Pose
from .jog_commands import JogCause, JogEscape, JogSlowdown
from .jog_robot import Footing, Posture

_REMEMBERED = 4  # poses: of a tick, of the stop after it, and of the ones before


class PlatformTool:
    """A platform with a tool.

    Attributes:
        limits: limits of the legs.
        length: radius of the platform's anchor circle [m].
        rigid: False: a leg by itself moves the platform about no axis.
    """

    def __init__(self, kinematics: StewartKinematics, tcp: Pose | None = None) -> None:
        """Mount a tool.

        Args:
            kinematics: the platform.
            tcp: the tool centre point in the platform's frame; its origin if None.
        """
        self._kinematics = kinematics
        self._legs, self._workspace = kinematics.legs, kinematics.workspace
        self.limits = kinematics.limits
        self.length = kinematics.size
        self.rigid = False
        self._tcp = Pose.identity() if tcp is None else tcp
        self._found: list[tuple[list[float], Pose, Array]] = []

    def place(self, position: Sequence[float]) -> tuple[Array, Array]:
        """Return the rotation and position of the tool centre point."""
        pose, _ = self._assembly(position)
        tool = pose.compose(self._tcp)
        return tool.rotation, tool.position

    def follow(
        self, seed: Sequence[float], rotation: Array, point: Array, twist: Array
    ) -> Footing | None:
        """Return the leg lengths that put the tool at a pose, whatever the seed."""
        platform = rotation @ self._tcp.rotation.T
        arm = platform @ self._tcp.position
        lengths, jacobian = self._legs.linearise(platform, point - arm)
        moved = twist.copy()
        # The legs are driven by the platform's origin; the twist is given at the tool centre point.
        moved[:3] -= np.cross(twist[3:], arm)
        rate: list[float] = (jacobian @ moved).tolist()
        return Footing(lengths.tolist(), rate, self._condition(jacobian))

    def forbids(self, position: Sequence[float], twist: Array) -> JogCause | None:
        """Return None: a platform moves its tool in all six directions."""
        return None

    def point_speeds(
        self, position: Sequence[float], velocity: Sequence[float] | Array
    ) -> tuple[float, float]:
        """Return the speed of the tool centre point, and 0 for the elbow that a platform lacks."""
        pose, jacobian = self._assembly(position)
        twist = np.linalg.solve(jacobian, np.asarray(velocity))
        arm = pose.rotation @ self._tcp.position
        return math.hypot(*(twist[:3] + np.cross(twist[3:], arm)).tolist()), 0.0

    def elbow_speed(
        self, position: Sequence[float], velocity: Sequence[float], enough: float = 0.0
    ) -> float:
        """Return 0: a platform has no elbow."""
        return 0.0

    def posture(self, position: Sequence[float]) -> Posture | None:
        """Return the use of the workspace, or of an anchor's cone if that is greater."""
        pose, _ = self._assembly(position)
        workspace = self._workspace
        use = workspace.usage(pose)
        found = Posture(use, JogCause(JogSlowdown.WORKSPACE, use, 1.0))
        for swings in workspace.swings(pose):
            leg = int(np.argmax(swings))
            swing = float(swings[leg])
            if swing / workspace.cone > found.use:
                cause = JogCause(JogSlowdown.WORKSPACE, swing, workspace.cone, leg)
                found = Posture(swing / workspace.cone, cause)
        return found

    def gains(self, position: Sequence[float]) -> list[float]:
        """Return the singular values of the Jacobian at leg lengths."""
        return self._gains(self._assembly(position)[1])

    def condition(self, position: Sequence[float]) -> float:
        """Return the condition number at leg lengths."""
        return self._condition(self._assembly(position)[1])

    def way_out(self, position: Sequence[float]) -> JogEscape:
        """Return the leg rates that lead home, the place farthest from all borders.

        By x, y, z, roll, pitch and yaw in proportion, so that the workspace sum falls from the
        start.
        """
        pose, _ = self._assembly(position)
        home = -self._workspace.coordinates(pose)
        way: list[float] = (self._legs.rpy_jacobian(pose) @ home).tolist()
        greatest = max(map(abs, way))
        if greatest < 1e-6:
            return JogEscape(None, True)
        return JogEscape(tuple(value / greatest for value in way), True)

    def _assembly(self, position: Sequence[float]) -> tuple[Pose, Array]:
        """Return the platform's pose and leg Jacobian at leg lengths.

        Raises:
            NoAssembly: no pose near the last one has these leg lengths.
        """
        lengths = list(position)
        for known, pose, jacobian in self._found:
            if known == lengths:
                return pose, jacobian
        # A platform cannot change its assembly while it moves, so the nearest answer is the right
        # one.
        start = self._found[-1][1] if self._found else self._kinematics.forward(lengths)
        found = assemble(self._legs, np.array(lengths), start)
        pose = Pose.from_matrix(found.rotation, found.position)
        self._found = [*self._found[1 - _REMEMBERED :], (lengths, pose, found.jacobian)]
        return pose, found.jacobian

    def _gains(self, jacobian: Array) -> list[float]:
        scaled = jacobian.copy()
        scaled[:, 3:] /= self.length
        values: list[float] = np.linalg.svd(scaled, compute_uv=False).tolist()
        return values

    def _condition(self, jacobian: Array) -> float:
        values = self._gains(jacobian)
        return values[0] / values[-1] if values[-1] > 0.0 else math.inf
