"""A jogger simple enough to check by eye, in the place of `motion.jog`: joints only.

Joints tend to their asked speeds under the acceleration limits and brake in time before the ends of
their ranges. The tool is that of a flat arm of two links of half a metre; a longer arm has none.
"""

import math
from collections.abc import Sequence

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.jog import JogCaps, JogCause, JogSetpoint, JogSlowdown, JogTarget, JointJog
from openpendant.motion.jog.jogger import UndoPath

LINK = 0.5
"""Length of each link [m]."""

_SLACK = 0.999


def point_speed(velocity: Sequence[float]) -> float:
    """Return a bound of the speed of tool and elbow, whatever the position [m/s]."""
    if len(velocity) != 2:
        return 0.0
    return 2 * LINK * abs(velocity[0]) + LINK * abs(velocity[1])


class SimpleJogger:
    """Aim, step, limit and way as `motion.jog.Jogger` has them."""

    def __init__(self, limits: JointLimits, start: Sequence[float], caps: JogCaps) -> None:
        self._limits = limits
        self._caps = caps
        self._target: JogTarget | None = None
        self._position = list(start)
        self._velocity = [0.0] * len(self._position)
        self.way = UndoPath(start, [1.0] * len(self._position))

    def aim(self, target: JogTarget | None) -> None:
        self._target = target

    def limit(self, caps: JogCaps) -> None:
        self._caps = caps

    def step(self, dt: float) -> JogSetpoint:
        asked = self._asked()
        cause = None
        before = self._velocity
        velocity = []
        for joint, (now, wanted) in enumerate(zip(before, asked, strict=True)):
            gain = self._limits.acceleration[joint] * _SLACK * dt
            after = min(max(wanted, now - gain), now + gain)
            room = self._room(joint, after, now, dt)
            if abs(after) > room:
                after = math.copysign(max(room, 0.0), after)
                after = min(max(after, now - gain), now + gain)
                cause = JogCause(JogSlowdown.JOINT_LIMIT, self._position[joint], 0.0, joint)
            velocity.append(after)
        self._position = [
            at + 0.5 * (old + new) * dt
            for at, old, new in zip(self._position, before, velocity, strict=True)
        ]
        self._velocity = velocity
        self.way.add(self._position)
        gains = [(new - old) / dt for old, new in zip(before, velocity, strict=True)]
        at_rest = not any(velocity)
        scale = 1.0 if cause is None else 0.0
        return JogSetpoint(list(self._position), velocity, gains, scale, cause, at_rest)

    def _asked(self) -> list[float]:
        if not isinstance(self._target, JointJog):
            return [0.0] * len(self._velocity)
        share = self._caps.override * self._caps.joint_fraction
        limits = self._limits.velocity
        speeds = [share * rate * top for rate, top in zip(self._target.rates, limits, strict=True)]
        fastest = point_speed(speeds)
        scale = min(1.0, self._caps.point_speed / fastest) if fastest else 1.0
        return [scale * speed for speed in speeds]

    def _room(self, joint: int, velocity: float, before: float, dt: float) -> float:
        """Return the greatest speed from which the joint still stops inside its range."""
        limits, at = self._limits, self._position[joint]
        end = limits.upper[joint] if velocity > 0 else limits.lower[joint]
        ahead = abs(end - at) - abs(before) * dt - 1e-3
        if velocity * (end - at) < 0:
            return 0.0
        brake = limits.acceleration[joint] * _SLACK
        step = brake * dt
        return math.sqrt(max(2 * brake * ahead + step * step / 4, 0.0)) - 1.5 * step
