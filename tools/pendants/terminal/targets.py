"""Typed absolute targets: axes and their values, in the units of the screen.

Owns the parsing of such a text and the goal that follows from it and the present position. The
angles of the tool are those of the pose page: rotations about x, y, z of base, A first. Values are
separated by `;` because the space bar is the stop. The decimal separator is a dot in every locale;
a comma is refused, not guessed.
"""

from __future__ import annotations

import math

from openpendant.simplemsg.pendant import State

from ..motions import quaternion_of, roll_pitch_yaw
from .cell_view import CellView
from .commands import MoveJoints, MoveToPose

_LENGTHS, _ANGLES = "xyz", "abc"
_TOOL_AXES = _LENGTHS + _ANGLES

_STEEPEST = math.radians(89.5)
"""From this |B| on, A and C turn about nearly the same axis, and neither alone says anything."""


class NotATarget(ValueError):
    """A text that names no target; the message says what is accepted."""


def read_target(text: str, cell: CellView) -> MoveJoints | MoveToPose:
    """Read a target: joints such as `3=-45` (degrees or mm), or the tool in base, `z=400;a=180`.

    Args:
        text: as typed.
        cell: the present position; axes that are not typed keep it.

    Returns:
        The move, in rad and m.

    Raises:
        NotATarget: the text names no target, or the robot's position is not known.
    """
    accepted = (
        f"1 to {cell.dof}, or x, y, z in mm and a, b, c in degrees, then = and a number,"
        " more after ; as in 3=-45, z=400, x=300;a=180"
    )
    if "," in text:
        raise NotATarget(f"{text!r} is no target; accepted: a dot for decimals, as in 3=-45.5")
    values: dict[str, float] = {}
    for part in text.split(";"):
        name, _, number = part.partition("=")
        value = _number(number)
        if value is None:
            raise NotATarget(f"{part or 'nothing'!r} is no target; accepted: {accepted}")
        if not _is_tool_axis(name) and not _is_joint(name, cell.dof):
            raise NotATarget(f"no axis {name!r}; accepted: {accepted}")
        if name in values:
            raise NotATarget(f"{name} is named twice; accepted: each axis once")
        values[name] = value
    if all(map(_is_tool_axis, values)):
        return _tool_goal(values, cell)
    if any(map(_is_tool_axis, values)):
        raise NotATarget(f"{text!r} mixes joints and tool; accepted: either of them")
    return _joint_goal(values, cell)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _is_tool_axis(name: str) -> bool:
    return len(name) == 1 and name in _TOOL_AXES


def _is_joint(name: str, dof: int) -> bool:
    # No more digits than a number of joints has, or `01` would be another name of joint 1.
    return name.isascii() and name.isdigit() and name == str(int(name)) and 1 <= int(name) <= dof


def _joint_goal(values: dict[str, float], cell: CellView) -> MoveJoints:
    if cell.positions is None:
        raise NotATarget("no target: the joint values are not known")
    goal, told = list(cell.positions), []
    for name, value in values.items():
        joint = int(name) - 1
        linear = cell.joints[joint]["unit"] == "m"
        goal[joint] = value / 1000 if linear else math.radians(value)
        told.append(f"{name} to {value:g}{' mm' if linear else '°'}")
    return MoveJoints(tuple(goal), f"joint {', '.join(told)}")


def _tool_goal(values: dict[str, float], cell: CellView) -> MoveToPose:
    state = cell.state
    if state is None or not cell.knows_tool:
        raise NotATarget("no target: the tool's pose is not known")
    x, y, z = (
        values[axis] / 1000 if axis in values else here
        for axis, here in zip(_LENGTHS, state.tool_position, strict=True)
    )
    told = ", ".join(
        f"{axis} to {value:g}{' mm' if axis in _LENGTHS else '°'}" for axis, value in values.items()
    )
    return MoveToPose((x, y, z), _orientation(values, state), f"tool, {told}")


def _orientation(values: dict[str, float], state: State) -> tuple[float, float, float, float]:
    """Return the orientation with the typed angles, and the other angles as shown."""
    typed = [axis for axis in _ANGLES if axis in values]
    if not typed:
        x, y, z, w = state.tool_orientation
        return x, y, z, w
    shown = roll_pitch_yaw(state.tool_orientation)
    if len(typed) < len(_ANGLES) and abs(shown[1]) > _STEEPEST:
        raise NotATarget(
            f"at B = {math.degrees(shown[1]):.1f}° A and C are not told apart;"
            " accepted: all of a, b, c"
        )
    a, b, c = (
        math.radians(values[axis]) if axis in values else here
        for axis, here in zip(_ANGLES, shown, strict=True)
    )
    return quaternion_of(a, b, c)
