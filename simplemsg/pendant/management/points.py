"""Teach points: the joint position, and the pose of a tool in a frame there.

Owns the fields of a point and their accepted values. Joints are controller-side [rad or m]. Knows
no mathematics of poses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias

from .words import BadValue, check_comment, check_name, check_number

JointVector: TypeAlias = tuple[float, ...]

MOST_JOINTS = 16
"""Joints of a point."""

MOST_TURNS = 100
"""Greatest number of revolutions of a joint, either way."""

_LARGEST_VALUE = 1e6
_UNIT_TOLERANCE = 1e-6


class Value:
    """A part of a program; its JSON has exactly its fields, of exactly their types."""

    __slots__ = ()
    __pydantic_config__: ClassVar[Mapping[str, Any]] = {"extra": "forbid", "strict": True}


@dataclass(frozen=True, slots=True)
class ArmConfiguration(Value):
    """Which of the ways to reach its pose a point takes; the words of `motion.configuration`.

    Attributes:
        shoulder: where the wrist is, seen from axis 1.
        elbow: where the elbow is, seen from the line between shoulder and wrist.
        wrist: the sign of the wrist's middle joint.
        turns: full turns of each joint; None where they are not said.
    """

    shoulder: Literal["front", "back"]
    elbow: Literal["up", "down"]
    wrist: Literal["no-flip", "flip"]
    turns: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        for place, turn in enumerate(self.turns or ()):
            check_number(turn, "a number of turns", -MOST_TURNS, MOST_TURNS, place=place)


@dataclass(frozen=True, slots=True)
class PointPose(Value):
    """Where the tool is.

    Attributes:
        position: (3,) of the tool's centre point in the frame [m].
        quaternion: (4,) x, y, z, w; its length is 1 to 1e-6.
        frame: the frame's name.
        tool: the tool's name.
    """

    position: tuple[float, float, float]
    quaternion: tuple[float, float, float, float]
    frame: str
    tool: str

    def __post_init__(self) -> None:
        for place, value in enumerate(self.position):
            what = "a coordinate"
            check_number(value, what, -_LARGEST_VALUE, _LARGEST_VALUE, "m", place=place)
        for place, value in enumerate(self.quaternion):
            check_number(value, "an element of the quaternion", -1.1, 1.1, place=place)
        length = math.hypot(*self.quaternion)
        if abs(length - 1.0) > _UNIT_TOLERANCE:
            accepted = f"1 to within {_UNIT_TOLERANCE:g}, in the order x, y, z, w"
            problem = f"has length {length:.9g}; accepted: {accepted}"
            raise BadValue("the quaternion", problem, part="an element of the quaternion")
        check_name(self.frame, "the frame")
        check_name(self.tool, "the tool")


@dataclass(frozen=True, slots=True)
class TeachPoint(Value):
    """One taught point.

    Attributes:
        name: unique in its program.
        joints: (n,) controller side [rad or m].
        pose: where that put the tool; None where nobody measured it.
        configuration: which of the ways to reach the pose; None where the robot has no such words.
        comment: lines of text; empty for none.
    """

    name: str
    joints: JointVector
    pose: PointPose | None = None
    configuration: ArmConfiguration | None = None
    comment: str = ""

    def __post_init__(self) -> None:
        check_name(self.name, "the point")
        if not 1 <= len(self.joints) <= MOST_JOINTS:
            problem = f"are {len(self.joints)}; accepted: 1 to {MOST_JOINTS}"
            raise BadValue("joints", problem, place=MOST_JOINTS)
        for number, value in enumerate(self.joints, start=1):
            what = f"joint {number} of point {self.name}"
            check_number(
                *(value, what, -_LARGEST_VALUE, _LARGEST_VALUE), part="joints", place=number - 1
            )
        turns = None if self.configuration is None else self.configuration.turns
        if turns is not None and len(turns) != len(self.joints):
            problem = f"are {len(turns)}; accepted: {len(self.joints)}, as joints"
            place = min(len(turns) - 1, len(self.joints))
            raise BadValue("turns", problem, part="a number of turns", place=place)
        check_comment(self.comment)
