"""Robot in a jog: what the jog mathematics asks of a mechanism, of a serial arm, and of a platform.

Positions are (n,) controller-side [rad or m] as lists; poses are of the tool centre point in the
base frame; a rate is a derivative by the path parameter σ, which has the unit of a second.

`SerialTool` owns the Newton step from a place beside a pose onto it, and what an arm does that has
not exactly six axes:

- six: J Δq = Δx.
- seven and more: the least Δq that does it, weighted by the joints' speeds (Whitney 1969),
  Δq = W Jᵀ (J W Jᵀ)⁻¹ Δx, and with what the task leaves free away from joint limits (gradient
  projection, Liégeois 1977).
- four, with a direction that the tool always keeps (SCARA, palletiser): x, y, z and the rotation
  about that direction. Any other rotation is refused instead of being done in part.
- fewer without such a direction: least squares, refused where an error remains. Which twists these
  are depends on the place.

The condition number is of the Jacobian without units: lengths in halves of the arm's size, which is
near the characteristic length that makes it least (Angeles 1992).

`PlatformTool` owns the reading of a Stewart platform's own limits as shares (workspace sum, cones
of the anchors), and the search for the pose of given legs, started where the last one ended. Legs
follow a pose by formula, so following needs no search. Its condition number is of the leg Jacobian
with rotations measured at the platform's anchor circle, as in its workspace.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple, Protocol

import numpy as np

from ..description.limits import JointLimits
from ..kinematics.closed_form import closed_form
from ..kinematics.ik.ik_context import kept_direction
from ..kinematics.ik.singularity import SingularityKind, dexterity
from ..kinematics.serial import Kinematics
from ..kinematics.stewart.platform import StewartKinematics, assemble
from ..pose import Array, Pose
from ..trajectory.point_speed import elbow_link
from .jog_commands import JogCause, JogEscape, JogSlowdown
from .line_speed_bounds import lever_arms


class Posture(NamedTuple):
    """Use of a limit that belongs to no single joint: 0 to 1, more is beyond the limit."""

    use: float
    cause: JogCause


class Footing(NamedTuple):
    """A joint position that puts the tool at a pose, with the rates that lead on from there.

    Attributes:
        condition: condition number of the Jacobian with lengths in units of `JogArm.length`.
    """

    position: list[float]
    rate: list[float]
    condition: float


class JogArm(Protocol):
    """The mechanism of one robot with one tool, for one thread."""

    @property
    def limits(self) -> JointLimits:
        """Limits of the joint vector."""

    @property
    def length(self) -> float:
        """Length that makes the Jacobian free of units [m]."""

    @property
    def rigid(self) -> bool:
        """True if each joint alone moves everything beyond it as one body, about one axis."""

    def place(self, position: Sequence[float]) -> tuple[Array, Array]:
        """Return the (3, 3) rotation and (3,) position [m] of the tool centre point."""

    def follow(
        self, seed: Sequence[float], rotation: Array, point: Array, twist: Array
    ) -> Footing | None:
        """Return the joint position near a seed that puts the tool at a pose, or None.

        Args:
            seed: (n,) within a few hundredths of a radian.
            rotation: (3, 3) of the tool.
            point: (3,) of the tool centre point [m].
            twist: (6,) [v; ω] of the tool by the path parameter.
        """

    def forbids(self, position: Sequence[float], twist: Array) -> JogCause | None:
        """Return why the arm has too few axes for a (6,) twist [v; ω] of its tool, or None."""

    def point_speeds(
        self, position: Sequence[float], velocity: Sequence[float] | Array
    ) -> tuple[float, float]:
        """Return the speeds of tool centre point and elbow [m/s] at joint position and velocity.

        An arm without an elbow has it at rest.
        """

    def elbow_speed(
        self, position: Sequence[float], velocity: Sequence[float], enough: float = 0.0
    ) -> float:
        """Return the speed of the elbow alone [m/s]; its limit is the tool's.

        Args:
            enough: a speed that counts as slow [m/s]. If the elbow is proven not to exceed it, the
                bound may be returned instead of the speed.
        """

    def posture(self, position: Sequence[float]) -> Posture | None:
        """Return the most used of the limits besides those of the joints; None if there is none."""

    def gains(self, position: Sequence[float]) -> list[float]:
        """Return the singular values of the Jacobian at a joint position, the greatest first."""

    def condition(self, position: Sequence[float]) -> float:
        """Return the condition number at a joint position."""

    def way_out(self, position: Sequence[float]) -> JogEscape:
        """Return the joint direction that leads away from singularity and workspace border."""


_ITERATIONS = 8
_SETTLED = 1e-4  # rad, or share of the length: the square of a lesser step is negligible
_EXACT = 1e-7  # rad: greatest error that is left
_FARTHEST = 0.25  # rad, or share of the length: farther is another branch
_MISFIT = 1e-4  # share of a twist that an arm of few axes may miss
_LOST = 1e8  # condition number from which rounding decides which twists are missed
_BESIDE = 0.01  # rad, or share of the length: distance from such a place for the test
_NULL_ZONE = 0.25  # share of the range at either end where spare axes avoid the limit
_END = 0.1  # rad or m: a joint this near its limit takes no part in a way out
_TASK_AXES = 6


class SerialTool:
    """Serial arm with a tool.

    Attributes:
        length: half the arm's size [m].
        rigid: True if no joint depends on another.
    """

    def __init__(self, kinematics: Kinematics, tcp: Pose | None = None) -> None:
        """Mount a tool by its centre point in the tool link's frame; the link's origin if None."""
        self._kinematics = kinematics
        self.limits = kinematics.limits
        self.length = kinematics.size / 2.0
        link = elbow_link(kinematics)
        self._elbow = [] if link is None else [kinematics.link_point(link)]
        by_joint = [] if link is None else lever_arms(kinematics, link)
        self._elbow_levers = [(joint, lever) for joint, lever in enumerate(by_joint) if lever]
        self.rigid = kinematics.is_direct
        self._offset = None if tcp is None or not tcp.position.any() else tcp.position
        self._turn = None if tcp is None else tcp.rotation
        tool = kinematics.link_point(
            offset=(0.0, 0.0, 0.0) if tcp is None else tcp.position.tolist()
        )
        self._points = [tool, *self._elbow]
        self._kept = kept_direction(kinematics)
        self._task = None if self._kept is None else _kept_task(self._kept.in_base)
        rows = _TASK_AXES if self._task is None else len(self._task)
        units = np.where(self.limits.prismatic, self.length, 1.0)
        self._units: list[float] = units.tolist()
        self._row_scale = np.ones((rows, 1))
        self._row_scale[:3] /= self.length
        self._scale = self._row_scale * units
        self._spare = kinematics.dof > rows
        self._square = kinematics.dof == rows
        self._few = kinematics.dof < rows
        speeds = np.array(self.limits.velocity)
        # By the squares of the speeds, the fast joints take most of the motion and slow it least.
        self._weights: Array = (speeds / speeds.max()) ** 2
        self._middle: list[float] = ((kinematics.lower + kinematics.upper) / 2.0).tolist()
        self._half: list[float] = ((kinematics.upper - kinematics.lower) / 2.0).tolist()
        # Names of singularities need the closed form; built here, as `way_out` is asked while
        # moving.
        closed_form(kinematics)

    def place(self, position: Sequence[float]) -> tuple[Array, Array]:
        """Return the rotation and position of the tool centre point."""
        rotation, point = self._kinematics.place(np.array(position))
        if self._offset is not None:
            point = point + rotation @ self._offset
        return rotation if self._turn is None else rotation @ self._turn, point

    def follow(
        self, seed: Sequence[float], rotation: Array, point: Array, twist: Array
    ) -> Footing | None:
        """Return the joint position near a seed that puts the tool at a pose."""
        position = list(seed)
        right = np.empty((6, 2))
        right[:, 1] = twist
        for _ in range(_ITERATIONS):
            found, here, jacobian = self._linearise(position)
            right[:3, 0] = point - here
            right[3:, 0] = _small_turn(rotation, found)
            task = right if self._task is None else self._task @ right
            try:
                steps = self._solved(jacobian, task, position)
            except np.linalg.LinAlgError:
                return None
            position = [value + step for value, step in zip(position, steps[0], strict=True)]
            error = max([abs(s) / u for s, u in zip(steps[0], self._units, strict=True)])
            # Written with `not`, so that a NaN fails. A long Newton step leads to another branch,
            # and a set-point there would be a jump.
            if not error < _FARTHEST:
                return None
            if error < _SETTLED:
                condition = self._condition(jacobian)
                # Newton converges quadratically: the error left is about condition · error², so
                # that no further step is computed just to see it.
                if condition * error * error < _EXACT:
                    break
        else:
            return None
        # Short steps may add up to another branch too.
        far = zip(position, seed, self._units, strict=True)
        if max([abs(value - start) / unit for value, start, unit in far]) > _FARTHEST:
            return None
        return Footing(position, steps[1], condition)

    def forbids(self, position: Sequence[float], twist: Array) -> JogCause | None:
        """Return why the arm has too few axes to move its tool along a twist."""
        if self._kept is not None:
            turn = twist[3:]
            across = float(np.linalg.norm(turn - (turn @ self._kept.in_base) * self._kept.in_base))
            if across > _MISFIT * float(np.linalg.norm(twist)):
                return JogCause(JogSlowdown.DIRECTION, across, 0.0)
        if self._few and self._misses(list(position), twist):
            asked = twist[3:] if twist[3:].any() else twist[:3]
            return JogCause(JogSlowdown.DIRECTION, float(np.linalg.norm(asked)), 0.0)
        return None

    def point_speeds(
        self, position: Sequence[float], velocity: Sequence[float] | Array
    ) -> tuple[float, float]:
        """Return the speeds of tool centre point and elbow."""
        joints, rates = np.array(position), np.asarray(velocity)
        speeds = self._kinematics.point_speeds(joints, rates, self._points)
        return speeds[0], speeds[1] if self._elbow else 0.0

    def elbow_speed(
        self, position: Sequence[float], velocity: Sequence[float], enough: float = 0.0
    ) -> float:
        """Return the speed of the elbow or an upper bound of it; 0 for an arm without one."""
        most = sum([lever * abs(velocity[joint]) for joint, lever in self._elbow_levers])
        if most <= enough or not self._elbow:
            return most
        joints, rates = np.array(position), np.array(velocity)
        return self._kinematics.point_speeds(joints, rates, self._elbow)[0]

    def posture(self, position: Sequence[float]) -> Posture | None:
        """Return None: a serial arm has the limits of its joints only."""
        return None

    def gains(self, position: Sequence[float]) -> list[float]:
        """Return the singular values of the Jacobian at a joint position."""
        _, _, jacobian = self._linearise(list(position))
        return self._gains(jacobian)

    def condition(self, position: Sequence[float]) -> float:
        """Return the condition number at a joint position."""
        _, _, jacobian = self._linearise(list(position))
        return self._condition(jacobian)

    def way_out(self, position: Sequence[float]) -> JogEscape:
        """Return the joint direction along which the least singular value grows fastest."""
        found = dexterity(self._kinematics, position)
        name = "" if found.kind is SingularityKind.UNNAMED else found.kind.value
        way: list[float] = (found.way_out / np.array(self._units)).tolist()
        # A joint near the end of its range cannot take part in the way out.
        ends = zip(position, self.limits.lower, self.limits.upper, way, strict=True)
        free = [
            0.0 if (w > 0.0 and q > upper - _END) or (w < 0.0 and q < lower + _END) else w
            for q, lower, upper, w in ends
        ]
        greatest = max(map(abs, free))
        if greatest < 1e-6:
            return JogEscape(None, True, name)
        return JogEscape(tuple(value / greatest for value in free), True, name)

    def _linearise(self, position: list[float]) -> tuple[Array, Array, Array]:
        """Return the tool's rotation and position, and the Jacobian of the directions it has."""
        rotation, point, jacobian = self._kinematics.linearise(np.array(position))
        if self._offset is not None:
            arm = rotation @ self._offset
            point = point + arm
            jacobian = jacobian.copy()
            jacobian[:3] += _lever(arm) @ jacobian[3:]
        if self._turn is not None:
            rotation = rotation @ self._turn
        return rotation, point, jacobian if self._task is None else self._task @ jacobian

    def _solved(self, jacobian: Array, right: Array, position: list[float]) -> list[list[float]]:
        """Return the joint steps (n,) for both columns of the right side."""
        if self._square:
            steps: list[list[float]] = np.linalg.solve(jacobian, right).T.tolist()
            return steps
        if self._few:
            fitted = self._fitted(jacobian, right)
            if _is_missed(jacobian, fitted[:, 1], right[:, 1]):
                raise np.linalg.LinAlgError("the twist is none that the arm can do")
            found: list[list[float]] = fitted.T.tolist()
            return found
        weighted = jacobian * self._weights
        away = self._away_from_limits(position)
        every = np.empty((len(right), 3))
        every[:, :2], every[:, 2] = right, jacobian @ np.array(away)
        solved = weighted.T @ np.linalg.solve(weighted @ jacobian.T, every)
        step, rate, bound = solved.T.tolist()
        greatest = max(map(abs, rate))
        free = zip(rate, away, bound, strict=True)
        return [step, [each + greatest * (turn - part) for each, turn, part in free]]

    def _fitted(self, jacobian: Array, right: Array) -> Array:
        """Return the joint steps (n, k) that come nearest to k right sides."""
        steps, *_ = np.linalg.lstsq(jacobian * self._scale, right * self._row_scale, rcond=None)
        fitted: Array = steps * np.array(self._units)[:, np.newaxis]
        return fitted

    def _misses(self, position: list[float], twist: Array) -> bool:
        """Return True if an arm of few axes cannot do a part of a twist.

        At a singularity every arm misses the direction that is lost there. So the test is made
        beside it, on the way out; where the way out leads out of none, the twist is not at fault.
        """
        _, _, jacobian = self._linearise(position)
        if self._condition(jacobian) > _LOST:
            way = self.way_out(position).joints
            if way is None:
                return False
            steps = zip(position, way, self._units, strict=True)
            _, _, jacobian = self._linearise([q + _BESIDE * w * unit for q, w, unit in steps])
            if self._condition(jacobian) > _LOST:
                return False
        task = twist if self._task is None else self._task @ twist
        return _is_missed(jacobian, self._fitted(jacobian, task[:, np.newaxis])[:, 0], task)

    def _away_from_limits(self, position: list[float]) -> list[float]:
        away = []
        for place, middle, half in zip(position, self._middle, self._half, strict=True):
            share = (place - middle) / half
            excess = (abs(share) - (1.0 - 2.0 * _NULL_ZONE)) / (2.0 * _NULL_ZONE)
            excess = min(max(excess, 0.0), 1.0)
            away.append(-math.copysign(excess * excess, share))
        return away

    def _gains(self, jacobian: Array) -> list[float]:
        values: list[float] = np.linalg.svd(jacobian * self._scale, compute_uv=False).tolist()
        return values

    def _condition(self, jacobian: Array) -> float:
        values = self._gains(jacobian)
        return values[0] / values[-1] if values[-1] > 0.0 else math.inf


def _is_missed(jacobian: Array, rate: Array, twist: Array) -> bool:
    """Return True if joint rates (n,) do not produce a part of a twist."""
    missed = float(np.abs(jacobian @ rate - twist).max())
    return missed > _MISFIT * float(np.abs(twist).max())


def _small_turn(target: Array, found: Array) -> Array:
    """Return the (3,) rotation vector from `found` to `target`, exact to the second order."""
    (_, b, c), (d, _, f), (g, h, _) = (target @ found.T).tolist()
    return np.array((0.5 * (h - f), 0.5 * (c - g), 0.5 * (d - b)))


def _lever(arm: Array) -> Array:
    """Return the (3, 3) matrix that takes ω to ω × arm."""
    x, y, z = arm.tolist()
    return np.array(((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0)))


def _kept_task(direction: Array) -> Array:
    """Return the (4, 6) matrix from a twist to [v; rotation about the kept direction]."""
    task = np.zeros((4, 6))
    task[:3, :3] = np.eye(3)
    task[3, 3:] = direction
    return task


_REMEMBERED = 4  # poses: of a tick, of the stop after it, and of the ones before


class PlatformTool:
    """A platform with a tool.

    Attributes:
        length: radius of the platform's anchor circle [m].
        rigid: False: a leg by itself moves the platform about no axis.
    """

    def __init__(self, kinematics: StewartKinematics, tcp: Pose | None = None) -> None:
        """Mount a tool by its centre point in the platform's frame; its origin if None."""
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
        """Return pose and leg Jacobian at leg lengths; `NoAssembly` if none is near the last."""
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
