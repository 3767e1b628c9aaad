"""Which way leads out of what holds a jog.

Owns the choice for each cause; asked once, when a robot has come to rest, because it costs some
hundred microseconds. Knows no names of directions: whoever shows it has the joints'.
"""

from __future__ import annotations

from collections.abc import Sequence

from .model import JogModel
from .reasons import JogCause, JogReason, Retreat
from .singular_keys import keys_out


def retreat(
    model: JogModel, position: Sequence[float], cause: JogCause, *, reverse: bool
) -> Retreat | None:
    """Return the way out of a cause at a joint position; None where none is needed.

    Args:
        model: the robot.
        position: (n,) where it stands.
        cause: what holds it.
        reverse: whether the opposite of what was asked leads out.
    """
    match cause.reason:
        case JogReason.JOINT_LIMIT:
            inward = 1.0 if position[cause.joint] < _middle(model, cause.joint) else -1.0
            joints = [inward if joint == cause.joint else 0.0 for joint in range(model.dof)]
            return Retreat(tuple(joints), reverse)
        case JogReason.COLLISION if model.guard is not None:
            apart = model.guard.way_apart(position)
            return Retreat(None if apart is None else tuple(apart), reverse)
        case JogReason.SINGULARITY:
            found = model.arm.way_out(position)._replace(reverse=reverse)
            # At two singularities at once no small step leads out of either.
            return found._replace(joints=found.joints or keys_out(model, position))
        case JogReason.REACH | JogReason.WORKSPACE:
            return model.arm.way_out(position)._replace(reverse=reverse)
    return None


def _middle(model: JogModel, joint: int) -> float:
    return 0.5 * (model.limits.lower[joint] + model.limits.upper[joint])
