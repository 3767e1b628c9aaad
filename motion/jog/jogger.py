"""Jogger: presses from rest to rest, with a target at any time and a set-point a tick.

Owns the change of targets. A joint jog takes another velocity at once. A tool jog bends into
another direction where the speed allows it. Between joint and tool jog, on a reversal, and where a
bend is not possible, the robot comes to rest first. Reads no clock: the caller gives the length of
each tick. Every set-point obeys speed and acceleration limits relative to the one before, whatever
was asked and when.

Owns also the path of the last jog, kept so that it can be followed back: joint positions thinned so
that the straight pieces between them are nowhere farther from a set-point than a tolerance.
Set-points are collected and thinned by the block (the algorithm of Ramer, Douglas and Peucker), so
recording one costs next to nothing. When there are too many, the tolerance doubles and the rest is
thinned again, so memory is bounded and the error is stated.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np

from ..errors import BadArgument, WrongJointCount
from ..pose import Array
from .cartesian_jog import CartesianJogMotion
from .escape_directions import leads_along, retreat
from .jog_commands import (
    LONGEST_STEP,
    JogCaps,
    JogCause,
    JogEscape,
    JogSetpoint,
    JogSlowdown,
    JogTarget,
    JointJog,
    ToolJog,
)
from .jog_model import JogModel
from .joint_jog import JointJogMotion
from .tool_path import JogTwist

Position: TypeAlias = tuple[float, ...]

TOLERANCE = 1e-3
"""Greatest distance of a joint from what is kept [rad, or arm's lengths], until it must double."""

MOST_POINTS = 512

BLOCK = 64
"""Set-points that are thinned together; the last of each block is kept."""


class UndoPath:
    """Path of one jog."""

    def __init__(
        self, start: Sequence[float], units: Sequence[float], tolerance: float = TOLERANCE
    ) -> None:
        """Start a path; `units` are as `JogModel.unit`, and the tolerance in them is above 0."""
        if not tolerance > 0.0:
            raise BadArgument("tolerance", tolerance, "more than 0")
        self.tolerance = tolerance
        self._units = np.array(units)
        self._kept: list[Position] = [tuple(start)]
        self._pending: list[Position] = []

    def add(self, position: Sequence[float]) -> None:
        """Record a set-point."""
        place = tuple(position)
        if place == (self._pending[-1] if self._pending else self._kept[-1]):
            return
        self._pending.append(place)
        # Thinned by the block, so that most ticks only append: thinning takes time that grows with
        # it.
        if len(self._pending) >= BLOCK:
            self._kept = self.waypoints()
            self._pending = []
            if len(self._kept) > MOST_POINTS:
                self._coarsen()

    def waypoints(self) -> list[Position]:
        """Return the path from its start to its end; a single point where nothing moved."""
        return self._kept[:-1] + self._thinned([self._kept[-1], *self._pending], self.tolerance)

    def way_back(self) -> list[Position]:
        """Return the path from its end to its start."""
        return self.waypoints()[::-1]

    def _coarsen(self) -> None:
        # The second thinning is of points that deviate by the first already: errors add up.
        kept = self._thinned(self._kept, self.tolerance)
        self.tolerance *= 2.0
        self._kept = kept if len(kept) <= MOST_POINTS // 2 else self._every_second(kept)

    def _every_second(self, kept: list[Position]) -> list[Position]:
        """Drop every second point of a path that no tolerance shortens; note the deviation."""
        thinned = [*kept[:-1:2], kept[-1]]
        triples = zip(kept[::2], kept[1::2], kept[2::2], strict=False)
        self.tolerance += max(float(self._distances(np.array(each))[0]) for each in triples)
        return thinned

    def _thinned(self, way: list[Position], tolerance: float) -> list[Position]:
        """Return the first and last point, and the points needed between them.

        A stretch is one straight piece where all its points are within the tolerance of it;
        otherwise it is split at the point that is farthest.
        """
        points = np.array(way)
        kept = {0, len(way) - 1}
        stretches = [(0, len(way) - 1)]
        while stretches:
            first, last = stretches.pop()
            if last - first < 2:
                continue
            distances = self._distances(points[first : last + 1])
            farthest = int(distances.argmax())
            if distances[farthest] > tolerance:
                middle = first + 1 + farthest
                kept.add(middle)
                stretches += [(first, middle), (middle, last)]
        return [way[index] for index in sorted(kept)]

    def _distances(self, stretch: Array) -> Array:
        """Return how far each inner point of an (m, n) stretch is from its straight piece, (m-2,).

        It is the greatest distance of a joint from the nearest place of the piece.
        """
        ways = (stretch[1:] - stretch[0]) / self._units
        line = ways[-1]
        square = float(line @ line)
        if square:
            shares = np.minimum(np.maximum(ways[:-1] @ line / square, 0.0), 1.0)
        else:
            shares = np.zeros(len(ways) - 1)
        distances: Array = np.abs(ways[:-1] - shares[:, np.newaxis] * line).max(axis=1)
        return distances


_BEND_RETRY = 4  # ticks between trials to bend


class Jogger:
    """A jog of one robot; `way` is the path so far, for the undo."""

    def __init__(self, model: JogModel, start: Sequence[float], caps: JogCaps) -> None:
        """Start at rest where the robot stands, also beyond a limit, to be led back inside.

        Raises:
            WrongJointCount, NotFinite: the start is not one finite value per joint.
            NoAssembly: a platform has no pose with the legs of the start.
        """
        model.limits.check_finite(start, "the joint position")
        position = [float(value) for value in start]
        model.arm.place(position)
        self.caps = caps
        self.way = UndoPath(position, model.unit)
        self._model = model
        self._motion: JointJogMotion | CartesianJogMotion = JointJogMotion(model, position)
        self._target: JogTarget | None = None
        self._twist: JogTwist | None = None
        self._tick = 0
        self._began = position
        self._retreat: tuple[JogCause, JogEscape | None] | None = None

    @property
    def at_rest(self) -> bool:
        """True while the robot stands still."""
        return self._motion.at_rest

    @property
    def position(self) -> list[float]:
        """The last set-point (n,) [rad or m]."""
        return list(self._motion.position)

    def aim(self, target: JogTarget | None) -> None:
        """Set the target; None releases; `WrongJointCount` for other than one rate per joint."""
        if isinstance(target, JointJog) and len(target.rates) != self._model.dof:
            raise WrongJointCount(len(target.rates), self._model.dof)
        if target != self._target:
            self._target = target
            self._twist = self._retreat = None
            self._tick = 0
            self._began = self.position

    def limit(self, caps: JogCaps) -> None:
        """Change the caps; a motion that is faster brakes, or comes to rest and continues.

        Another override holds at once. Other speeds of tool, elbow or rotation are another
        direction to a tool jog: it bends into it, or starts again from rest.
        """
        self.caps = caps
        self._twist = None

    def step(self, dt: float) -> JogSetpoint:
        """Return the next set-point.

        Args:
            dt: time since the last one [s], above 0 and at most `LONGEST_STEP`.

        Raises:
            BadArgument: dt is outside.
        """
        # Every bound of braking assumes ticks of at most `LONGEST_STEP`: a longer one could pass
        # the end of a range before the next tick.
        if not 0.0 < dt <= LONGEST_STEP * (1.0 + 1e-9):
            raise BadArgument("dt", dt, f"more than 0 and at most {LONGEST_STEP} s")
        before = self._motion.velocity
        match self._target:
            case JointJog(rates) if any(rates):
                self._step_joints(dt, rates)
            case ToolJog() as target if target.magnitude > 0.0:
                self._step_tool(dt, target)
            case _:
                self._release(dt)
        self.way.add(self._motion.position)
        return self._told(before, dt)

    def _step_joints(self, dt: float, rates: tuple[float, ...]) -> None:
        if isinstance(self._motion, CartesianJogMotion):
            if not self._motion.at_rest:
                self._release(dt)
                return
            self._motion = JointJogMotion(self._model, self._motion.position)
        self._motion.step(dt, rates, self.caps)

    def _step_tool(self, dt: float, target: ToolJog) -> None:
        caps, twist = self.caps, self._twist
        if twist is None:
            linear, angular = target.direction()
            of_tool = target.axes is None
            twist = JogTwist(linear * caps.tool_speed, angular * caps.rotation_speed, of_tool)
            twist = self._twist = self._same_as_now(twist)
        motion = self._motion
        if isinstance(motion, JointJogMotion) or motion.twist is not twist:
            if motion.at_rest:
                motion = CartesianJogMotion.begin(
                    self._model, twist, motion.position, caps.point_speed
                )
            else:
                bent = self._bent(twist)
                if bent is None:
                    self._release(dt)
                    return
                motion = bent
            self._motion = motion
        magnitude = target.magnitude
        motion.step(dt, min(magnitude, 1.0) * caps.override)
        if motion.lost:
            self._leave_line(dt)
        elif magnitude > 1.0:
            motion.scale /= magnitude
            if motion.cause is None:
                speed = magnitude * caps.override * caps.tool_speed
                motion.cause = JogCause(JogSlowdown.TOOL_SPEED, speed, speed / magnitude)

    def _same_as_now(self, twist: JogTwist) -> JogTwist:
        """Return the tool's present direction if it equals the asked one, else the asked one."""
        motion = self._motion
        if (
            not isinstance(motion, CartesianJogMotion)
            or motion.point_speed != self.caps.point_speed
        ):
            return twist
        return motion.twist if motion.twist.is_like(twist) else twist

    def _bent(self, twist: JogTwist) -> CartesianJogMotion | None:
        """Return the tool's motion bent into another direction; None while it has to slow down."""
        self._tick += 1
        # A trial looks ahead over many cells, too much for every tick; in between the tool brakes,
        # which makes the next trial likelier to succeed.
        if isinstance(self._motion, JointJogMotion) or self._tick % _BEND_RETRY != 1:
            return None
        return self._motion.bent(twist, self.caps.point_speed)

    def _release(self, dt: float) -> None:
        if isinstance(self._motion, JointJogMotion):
            self._motion.release(dt)
        elif not self._motion.at_rest:
            self._motion.step(dt, 0.0)
            if self._motion.lost:
                self._leave_line(dt)
        else:
            self._motion = JointJogMotion(self._model, self._motion.position)

    def _leave_line(self, dt: float) -> None:
        """Come to rest joint by joint, where no speed on the line obeys the accelerations."""
        lost = self._motion
        # Limits of the joints outrank the line: the stop begins with the velocity of the last
        # set-point, so no joint exceeds its acceleration, and the tool leaves the line instead.
        motion = JointJogMotion(self._model, lost.position, lost.velocity)
        motion.release(dt)
        motion.scale, motion.cause = 0.0, lost.cause or JogCause(JogSlowdown.REACH, 1.0, 0.0)
        self._motion = motion

    def _told(self, before: Sequence[float], dt: float) -> JogSetpoint:
        motion = self._motion
        velocity = list(motion.velocity)
        gains = [(now - then) / dt for now, then in zip(velocity, before, strict=True)]
        cause, at_rest = motion.cause, motion.at_rest
        way_out = None
        if cause is not None and at_rest:
            if self._retreat is None or self._retreat[0].reason is not cause.reason:
                back = self._leads_back()
                found = retreat(self._model, motion.position, cause, reverse=back)
                self._retreat = cause, found
            way_out = self._retreat[1]
        return JogSetpoint(
            list(motion.position), velocity, gains, motion.scale, cause, at_rest, way_out
        )

    def _leads_back(self) -> bool:
        """Return True if the opposite of what was asked leads away from what holds the robot."""
        motion = self._motion
        if isinstance(motion, CartesianJogMotion):
            # The opposite may lead back to the limit that the robot was led away from, so it is
            # tried.
            return leads_along(self._model, motion.position, motion.twist.reversed())
        return motion.position != self._began
