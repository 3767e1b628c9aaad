"""What a robot is and where it stands, in RoboAnalyzer's units: degrees and millimetres."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from .attitude import roll_pitch_yaw
from .motions import Pose
from .snapshot import Snapshot


@dataclass(frozen=True, slots=True)
class JointDisplay:
    """One joint.

    Attributes:
        name: its name.
        unit: ° or mm.
        lower: its lower limit, in that unit.
        upper: its upper limit.
    """

    name: str
    unit: str
    lower: float
    upper: float


@dataclass(frozen=True, slots=True)
class RobotDisplay:
    """What a robot is.

    Attributes:
        name: its name.
        cell: name of its cell.
        joints: base to tip.
    """

    name: str
    cell: str
    joints: tuple[JointDisplay, ...]


@dataclass(frozen=True, slots=True)
class RobotPosture:
    """Where a robot is.

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
        tool: pose of the tool in base.
    """
    positions = tuple(value / unit for value, unit in zip(joints, units, strict=True))
    x, y, z = (1000.0 * value for value in tool.position)
    a, b, c = (math.degrees(angle) for angle in roll_pitch_yaw(tool.orientation))
    return RobotPosture(positions, x, y, z, a, b, c)
