"""The stop ramp: from any state of motion to rest, as hard as the joints may decelerate.

Owns the rule that all joints slow down in proportion, so that the robot leaves its path along the
tangent; and the one exception to it, a joint that would run out of its range. Knows no reason for
stopping: STOP, emergency stop, under-run, lost link and refused points all end here.
"""

from __future__ import annotations

from collections.abc import Sequence

from openpendant.motion.description.limits import JointLimits

from .segment import State

REST_FRACTION = 1e-5
"""A speed below this part of its limit is rest."""


class AxisLimits:
    """Decelerations of the axes during a stop, and the velocity below which an axis is at rest.

    Attributes:
        joints: the robot's limits as its file states them.
        hardest: (n,) greatest deceleration the controller ever uses […/s²].
    """

    def __init__(self, joints: JointLimits, margin: float) -> None:
        """Widen the accelerations by a relative margin, 0 for none."""
        self.joints = joints
        self.hardest = tuple(a * (1 + margin) for a in joints.acceleration)

    def is_rest(self, velocity: tuple[float, ...]) -> bool:
        """Return True if a velocity is small enough to end a motion with."""
        return all(
            abs(v) <= REST_FRACTION * limit
            for v, limit in zip(velocity, self.joints.velocity, strict=True)
        )


class Ramp:
    """One stop.

    Attributes:
        duration: time to rest [s], 0 if nothing moved.
        final: (n,) position at rest [rad or m].
    """

    def __init__(
        self,
        position: Sequence[float],
        velocity: Sequence[float],
        limits: AxisLimits,
    ) -> None:
        """Plan the stop.

        Args:
            position: (n,) where it starts [rad or m].
            velocity: (n,) at the start [rad/s or m/s].
            limits: the accelerations of an ordinary stop, the ranges, and the decelerations that
                keep a joint inside its range if need be.
        """
        joints = limits.joints
        common = max(abs(v) / limit for v, limit in zip(velocity, joints.acceleration, strict=True))
        self._joints = [
            (p, v, _time_within(p, v, common, lower, upper, most))
            for p, v, lower, upper, most in zip(
                position, velocity, joints.lower, joints.upper, limits.hardest, strict=True
            )
        ]
        self.duration = max(time for _, _, time in self._joints)
        self.final = tuple(p + v * time / 2 for p, v, time in self._joints)

    def sample(self, time: float) -> State:
        """Return position, velocity and acceleration `time` seconds after the stop started."""
        position, velocity, acceleration = [], [], []
        for p, v, duration in self._joints:
            if time >= duration:
                position.append(p + v * duration / 2)
                velocity.append(0.0)
                acceleration.append(0.0)
            else:
                rate = -v / duration
                position.append(p + time * (v + rate * time / 2))
                velocity.append(v + rate * time)
                acceleration.append(rate)
        return tuple(position), tuple(velocity), tuple(acceleration)


def _time_within(
    position: float, velocity: float, common: float, lower: float, upper: float, most: float
) -> float:
    if velocity == 0.0:
        return 0.0
    room = upper - position if velocity > 0 else position - lower
    if abs(velocity) * common / 2 <= room:
        return common
    return max(2 * room / abs(velocity), abs(velocity) / most)
