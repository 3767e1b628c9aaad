"""One press, or a chain of presses, from rest to rest: a target at any time, a set-point a tick.

Owns the changes of aim: joints ask for another velocity at once; the tool bends into another
direction where the speed allows it; between joints and tool, on a turn-round, and where a bend does
not work, the robot comes to rest first. Without a clock: whoever ticks says how long a tick is.
Every set-point keeps to speed and acceleration limits from the one before, whatever was asked when.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..errors import BadArgument, WrongJointCount
from .joint_motion import JointMotion
from .model import JogModel
from .reasons import JogCause, JogReason, JogStep, Retreat
from .retreat import retreat
from .targets import LONGEST_STEP, JogCaps, JogTarget, JointJog, ToolJog
from .tool_motion import ToolMotion
from .tool_path import JogTwist
from .undo import JogWay
from .ways_out import leads_along

_BEND_RETRY = 4  # ticks between trials to bend


class Jogger:
    """A jog of one robot.

    Attributes:
        caps: greatest speeds.
        way: the way so far, for the undo.
    """

    def __init__(self, model: JogModel, start: Sequence[float], caps: JogCaps) -> None:
        """Begin at rest.

        Args:
            model: the robot.
            start: (n,) where it stands [rad or m]; beyond a limit too, to be led back inside.
            caps: greatest speeds.

        Raises:
            WrongJointCount: the start has not one value per joint.
            NotFinite: the start holds an infinity or a NaN.
            NoAssembly: a platform has no pose with the legs of the start.
        """
        model.limits.check_finite(start, "the joint position")
        position = [float(value) for value in start]
        model.arm.place(position)
        self.caps = caps
        self.way = JogWay(position, model.unit)
        self._model = model
        self._motion: JointMotion | ToolMotion = JointMotion(model, position)
        self._target: JogTarget | None = None
        self._twist: JogTwist | None = None
        self._tick = 0
        self._began = position
        self._retreat: tuple[JogCause, Retreat | None] | None = None

    @property
    def at_rest(self) -> bool:
        """Whether the robot stands."""
        return self._motion.at_rest

    @property
    def position(self) -> list[float]:
        """The last set-point (n,) [rad or m]."""
        return list(self._motion.position)

    def aim(self, target: JogTarget | None) -> None:
        """Ask for a motion; None releases.

        Raises:
            WrongJointCount: there is not one rate per joint.
        """
        if isinstance(target, JointJog) and len(target.rates) != self._model.dof:
            raise WrongJointCount(len(target.rates), self._model.dof)
        if target != self._target:
            self._target = target
            self._twist = self._retreat = None
            self._tick = 0
            self._began = self.position

    def limit(self, caps: JogCaps) -> None:
        """Change the caps; a motion that is faster brakes, or comes to rest and goes on.

        Another override is kept to at once. Other speeds of tool, elbow or rotation are other
        directions to a tool jog, which it bends into or begins anew, at rest.
        """
        self.caps = caps
        self._twist = None

    def step(self, dt: float) -> JogStep:
        """Return the next set-point.

        Args:
            dt: time since the last one [s], above 0 and at most `LONGEST_STEP`.

        Raises:
            BadArgument: dt is outside.
        """
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
        if isinstance(self._motion, ToolMotion):
            if not self._motion.at_rest:
                self._release(dt)
                return
            self._motion = JointMotion(self._model, self._motion.position)
        self._motion.step(dt, rates, self.caps)

    def _step_tool(self, dt: float, target: ToolJog) -> None:
        caps, twist = self.caps, self._twist
        if twist is None:
            linear, angular = target.direction()
            of_tool = target.axes is None
            twist = JogTwist(linear * caps.tool_speed, angular * caps.rotation_speed, of_tool)
            twist = self._twist = self._same_as_now(twist)
        motion = self._motion
        if isinstance(motion, JointMotion) or motion.twist is not twist:
            if motion.at_rest:
                motion = ToolMotion.begin(self._model, twist, motion.position, caps.point_speed)
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
                motion.cause = JogCause(JogReason.TOOL_SPEED, speed, speed / magnitude)

    def _same_as_now(self, twist: JogTwist) -> JogTwist:
        """Return the direction that the tool has already, if it is the same."""
        motion = self._motion
        if not isinstance(motion, ToolMotion) or motion.point_speed != self.caps.point_speed:
            return twist
        return motion.twist if motion.twist.is_like(twist) else twist

    def _bent(self, twist: JogTwist) -> ToolMotion | None:
        """Return the tool's motion bent into another direction; None while it has to slow."""
        self._tick += 1
        if isinstance(self._motion, JointMotion) or self._tick % _BEND_RETRY != 1:
            return None
        return self._motion.bent(twist, self.caps.point_speed)

    def _release(self, dt: float) -> None:
        if isinstance(self._motion, JointMotion):
            self._motion.release(dt)
        elif not self._motion.at_rest:
            self._motion.step(dt, 0.0)
            if self._motion.lost:
                self._leave_line(dt)
        else:
            self._motion = JointMotion(self._model, self._motion.position)

    def _leave_line(self, dt: float) -> None:
        """Come to rest by the joints, where no speed on the line keeps to the accelerations."""
        lost = self._motion
        motion = JointMotion(self._model, lost.position, lost.velocity)
        motion.release(dt)
        motion.scale, motion.cause = 0.0, lost.cause or JogCause(JogReason.REACH, 1.0, 0.0)
        self._motion = motion

    def _told(self, before: Sequence[float], dt: float) -> JogStep:
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
        return JogStep(
            list(motion.position), velocity, gains, motion.scale, cause, at_rest, way_out
        )

    def _leads_back(self) -> bool:
        """Return whether the opposite of what was asked leads out of where the robot is held."""
        motion = self._motion
        if isinstance(motion, ToolMotion):
            # It may come nearer to what the robot was led out of, so it is tried.
            return leads_along(self._model, motion.position, motion.twist.reversed())
        return motion.position != self._began
