"""Typed absolute targets: one axis and its value, in the units of the screen.

Owns the reading of such a text. Decimals have a dot, whatever the country; a comma is refused and
not guessed at.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from ..snapshot import JointFacts
from .commands import MoveJoint, MoveTool

_TOOL_AXES = "xyz"


class NotATarget(ValueError):
    """A text that names no target; it says what would be accepted."""


def read_target(text: str, joints: Sequence[JointFacts]) -> MoveJoint | MoveTool:
    """Read a target such as `3=-45` (joint 3, degrees or mm) or `z=400` (the tool in base, mm).

    Args:
        text: as typed.
        joints: of the robot.

    Returns:
        The move, in rad and m.

    Raises:
        NotATarget: it is none.
    """
    accepted = f"1 to {len(joints)} or x, y, z, then = and a number: 3=-45, z=400"
    name, _, number = text.partition("=")
    try:
        value = float(number)
    except ValueError:
        value = math.nan
    if "," in number:
        raise NotATarget(f"{text!r} is no target; accepted: a dot for decimals, as in 3=-45.5")
    if not math.isfinite(value):
        raise NotATarget(f"{text or 'nothing'!r} is no target; accepted: {accepted}")
    if len(name) == 1 and name in _TOOL_AXES:
        return MoveTool(_TOOL_AXES.index(name), value / 1000)
    if name.isascii() and name.isdigit() and 1 <= int(name) <= len(joints):
        joint = int(name) - 1
        linear = joints[joint]["unit"] == "m"
        return MoveJoint(joint, value / 1000 if linear else math.radians(value))
    raise NotATarget(f"no axis {name!r}; accepted: {accepted}")
