"""Values of RoboAnalyzer's calls: arguments as scripts and MATLAB give them, robots, postures.

Owns what is taken for a number, a joint or a name, and the wording of the `WrongArgument` that each
function raises where a value is none: a language that knows no integers counts joints in floats,
1.0 is a joint, 1.5 is none. Owns RoboAnalyzer's units, degrees and millimetres, and the choice of a
cell by its name or by its robot's, with the wording where there is none or more than one. Connects
to nothing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import SupportsFloat

from openpendant.simplemsg.pendant.management.cell import ServedCell, Snapshot
from openpendant.simplemsg.verdicts import VerdictCode

from ..connection_errors import Refused, WrongArgument
from ..motions import Pose, roll_pitch_yaw


def number(value: object, what: str) -> float:
    """Return a finite number.

    Args:
        value: of any type that has one number: of Python, of NumPy, from MATLAB.
    """
    found = math.nan
    if isinstance(value, SupportsFloat) and not isinstance(value, bool):
        try:
            found = float(value)
        except (TypeError, ValueError, OverflowError):
            found = math.nan
    if not math.isfinite(found):
        raise WrongArgument(f"{what} is {_shown(value)}; accepted: a finite number")
    return found


def whole(value: object, what: str) -> int:
    """Return a whole number; 1.0 is one; arguments and errors as above."""
    found = number(value, what)
    if not found.is_integer():
        raise WrongArgument(f"{what} is {_shown(value)}; accepted: a whole number, as 1 or 1.0")
    return int(found)


def numbers(values: object, what: str, count: int) -> list[float]:
    """Return one finite number for each joint.

    Args:
        values: a list, or whatever yields numbers.

    Raises:
        WrongArgument: they are not so many numbers.
    """
    if isinstance(values, str | bytes) or not isinstance(values, Iterable):
        raise WrongArgument(f"{what}: {_shown(values)}; accepted: a list of {count} numbers")
    given = list(values)
    if len(given) != count:
        raise WrongArgument(f"{len(given)} {what}; the robot has {count} joints")
    return [number(value, f"of {count} {what} number {i}") for i, value in enumerate(given, 1)]


def joint_index(value: object, count: int) -> int:
    """Return the index, from 0, of a joint that is counted from 1.

    Raises:
        WrongArgument: it is no whole number, or the robot has no such joint.
    """
    joint = whole(value, "the joint")
    if not 1 <= joint <= count:
        raise WrongArgument(f"no joint {joint}; the robot has joints 1 to {count}")
    return joint - 1


def text(value: object, what: str) -> str:
    """Return a text."""
    if not isinstance(value, str):
        raise WrongArgument(f"{what} is {_shown(value)}; accepted: a text")
    return value


def fraction(value: object, what: str) -> float:
    """Return a number above 0, up to 1."""
    found = number(value, what)
    if not 0.0 < found <= 1.0:
        raise WrongArgument(f"{what} is {found:g}; accepted: above 0, up to 1")
    return found


def _shown(value: object) -> str:
    return repr(value)[:80]


@dataclass(frozen=True, slots=True)
class JointDisplay:
    """One joint.

    Attributes:
        unit: ° or mm.
        lower: its lower limit, in that unit.
    """

    name: str
    unit: str
    lower: float
    upper: float


@dataclass(frozen=True, slots=True)
class RobotDisplay:
    """A robot with its joints."""

    name: str
    cell: str
    joints: tuple[JointDisplay, ...]


@dataclass(frozen=True, slots=True)
class RobotPosture:
    """Posture of a robot.

    Attributes:
        joints: (n,) positions [°, mm for a linear axis].
        x: of the tool in base [mm].
        y: likewise.
        z: likewise.
        a: roll of the tool in base [°].
        b: pitch [°].
        c: yaw [°].
    """

    joints: tuple[float, ...]
    x: float
    y: float
    z: float
    a: float
    b: float
    c: float


def display_of(snapshot: Snapshot) -> RobotDisplay:
    """Return what the robot of a snapshot is."""
    joints = []
    for joint in snapshot["joints"]:
        is_angle = joint["unit"] == "rad"
        scale = math.degrees(1.0) if is_angle else 1000.0
        joints.append(
            JointDisplay(
                name=joint["name"],
                unit="°" if is_angle else "mm",
                lower=joint["lower"] * scale,
                upper=joint["upper"] * scale,
            )
        )
    return RobotDisplay(snapshot["robot"], snapshot["cell"], tuple(joints))


def posture_of(units: Sequence[float], joints: Sequence[float], tool: Pose) -> RobotPosture:
    """Return a posture in degrees and millimetres.

    Args:
        units: (n,) one degree or one millimetre of each joint, in rad or m.
        joints: (n,) positions [rad, m].
    """
    positions = tuple(value / unit for value, unit in zip(joints, units, strict=True))
    x, y, z = (1000.0 * value for value in tool.position)
    a, b, c = (math.degrees(angle) for angle in roll_pitch_yaw(tool.orientation))
    return RobotPosture(positions, x, y, z, a, b, c)


_LISTED_AFTER = "; here: "


def some_cell(refused: Refused) -> str:
    """Return a cell that a server of several named when it refused a hello; empty for none.

    Any of them tells all the others, by `PendantClient.cells`.
    """
    if refused.code != VerdictCode.UNKNOWN_CELL:
        return ""
    return refused.text.partition(_LISTED_AFTER)[2].partition(", ")[0]


def chosen_cell(name: str, cells: Sequence[ServedCell]) -> str:
    """Return the cell of a name, or the only one whose robot has it.

    Args:
        name: of a cell or a robot; empty for the only cell.

    Raises:
        WrongArgument: there is none, or more than one; the text has the cells.
    """
    if name in [each["cell"] for each in cells]:
        return name
    found = [each["cell"] for each in cells if name in ("", each["robot"])]
    if len(found) == 1:
        return found[0]
    if found and name:
        raise WrongArgument(f"{len(found)} cells have a robot {name!r}: name {' or '.join(found)}")
    known = ", ".join(f"{each['robot']} (cell {each['cell']})" for each in cells)
    if found:
        raise WrongArgument(f"the server has several robots: name one of {known}")
    raise WrongArgument(f"no robot {name!r}; the server has {known}")
