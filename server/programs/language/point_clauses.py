"""Point clauses of a program's text: joints, pose and config, each once.

Owns their grammar, read and written. A clause may stand on the line of its point or on a line of
its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import groupby
from typing import TYPE_CHECKING, Literal, cast

from openpendant.motion.pose import Pose

from .clauses import Clauses, Places, TextPlace
from .points import MOST_TURNS, ArmConfiguration, PointPose, TeachPoint
from .program_errors import BadValue
from .quantities import Dimension, from_si, plain_number
from .words import named

if TYPE_CHECKING:
    from .program import Program

POINT_CLAUSES = ("joints", "pose", "config")
_SHOULDERS, _ELBOWS, _WRISTS = ("front", "back"), ("up", "down"), ("no-flip", "flip")


@dataclass(slots=True)
class PointClauses:
    """Point that is being read.

    Attributes:
        header: the program's names of tool and frame, and its linear axes.
        comments: the comments beside and between its clauses.
        places: where its values stand.
    """

    name: str
    begin: TextPlace
    header: Program
    comments: list[str] = field(default_factory=list)
    places: Places = field(default_factory=dict)
    _joints: tuple[float, ...] | None = None
    _pose: PointPose | None = None
    _configuration: ArmConfiguration | None = None

    def read(self, clauses: Clauses) -> None:
        """Read the clauses on the rest of a line.

        Raises:
            ProgramSyntaxError: a word that is not accepted.
            BadValue: a value that a point cannot have.
        """
        while clauses.next is not None:
            match clauses.keyword(self._missing or ["the end of the line"]):
                case "joints":
                    self._joints = self._read_joints(clauses)
                case "pose":
                    self._pose = self._read_pose(clauses)
                case "config":
                    self._configuration = _read_configuration(clauses)

    def point(self) -> TeachPoint:
        """Return the point.

        Raises:
            BadValue: it has no joints, or a value that a point cannot have.
        """
        if self._joints is None:
            raise BadValue(f"point {self.name}", "has no joints; accepted: joints NUMBERS deg")
        comment = "\n".join(self.comments)
        return TeachPoint(self.name, self._joints, self._pose, self._configuration, comment)

    @property
    def _missing(self) -> list[str]:
        given = (self._joints, self._pose, self._configuration)
        return [word for word, clause in zip(POINT_CLAUSES, given, strict=True) if clause is None]

    def _read_joints(self, clauses: Clauses) -> tuple[float, ...]:
        found = clauses.quantities("joints", Dimension.ANGLE, Dimension.LENGTH)
        for axis, (_, dimension) in enumerate(found):
            expected = _dimension(axis, self.header.linear_axes)
            if dimension is not expected:
                accepted = f"{expected.value}, as the program's header says which axes are linear"
                problem = f"is {dimension.value}; accepted: {accepted}"
                raise BadValue(f"joint {axis + 1}", problem, part="joints", place=axis)
        return tuple(value for value, _ in found)

    def _read_pose(self, clauses: Clauses) -> PointPose:
        part = "a coordinate"
        position = [value for value, _ in clauses.quantities(part, Dimension.LENGTH)]
        if len(position) != 3:
            problem = f"has {len(position)} numbers; accepted: x, y and z"
            raise BadValue("the position", problem, part=part, place=_off(len(position), 3))
        if clauses.keyword(["quat", "rpy"]) == "quat":
            element = "an element of the quaternion"
            quaternion = [clauses.at(element).number() for _ in range(4)]
        else:
            angles = [value for value, _ in clauses.quantities("the turns", Dimension.ANGLE)]
            if len(angles) != 3:
                problem = f"are {len(angles)} angles; accepted: roll, pitch and yaw"
                raise BadValue("the turns", problem, place=_off(len(angles), 3))
            # Of the turns alone: the point judges its coordinates, and names the one it refuses.
            quaternion = Pose.from_rpy((0.0, 0.0, 0.0), angles).quaternion.tolist()
        frame, tool = self.header.frame, self.header.tool
        if clauses.skip("frame"):
            frame = clauses.name("the frame's name", "the frame")
        if clauses.skip("tool"):
            tool = clauses.name("the tool's name", "the tool")
        (x, y, z), (qx, qy, qz, qw) = position, quaternion
        return PointPose((x, y, z), (qx, qy, qz, qw), frame, tool)


def point_lines(point: TeachPoint, linear_axes: tuple[int, ...]) -> Iterator[str]:
    """Yield the canonical lines of a point, its comment included."""
    comment = point.comment.split("\n") if point.comment else []
    if len(comment) > 1:
        yield from (f"# {line}".rstrip() for line in comment)
    beside = f"  # {comment[0]}" if len(comment) == 1 else ""
    yield f"point {named(point.name)}{beside}"
    yield f"  joints {_joints_text(point.joints, linear_axes)}"
    if point.pose is not None:
        pose = point.pose
        position = " ".join(from_si(value, "mm") for value in pose.position)
        quaternion = " ".join(plain_number(value) for value in pose.quaternion)
        where = f"frame {named(pose.frame)} tool {named(pose.tool)}"
        yield f"  pose {position} mm quat {quaternion} {where}"
    if point.configuration is not None:
        arm = point.configuration
        turns = "" if arm.turns is None else " turns " + " ".join(map(str, arm.turns))
        yield f"  config {arm.shoulder} {arm.elbow} {arm.wrist}{turns}"


def count_point_lines(point: TeachPoint) -> int:
    """Return the number of lines of `point_lines`, without writing the numbers."""
    comment = point.comment.count("\n") + 1 if "\n" in point.comment else 0
    return comment + 2 + (point.pose is not None) + (point.configuration is not None)


def _read_configuration(clauses: Clauses) -> ArmConfiguration:
    # The keywords accepted are exactly the words that the type allows.
    found = ArmConfiguration(
        cast('Literal["front", "back"]', clauses.keyword(_SHOULDERS)),
        cast('Literal["up", "down"]', clauses.keyword(_ELBOWS)),
        cast('Literal["no-flip", "flip"]', clauses.keyword(_WRISTS)),
    )
    if not clauses.skip("turns"):
        return found
    turns: list[int] = []
    while clauses.at_number() or not turns:
        value = clauses.at("a number of turns").number()
        if not (value.is_integer() and abs(value) <= MOST_TURNS):
            accepted = f"whole numbers of up to {MOST_TURNS} turns"
            problem = f"is {value:g}; accepted: {accepted}"
            raise BadValue("a number of turns", problem, place=len(turns))
        turns.append(int(value))
    return ArmConfiguration(found.shoulder, found.elbow, found.wrist, tuple(turns))


def _off(given: int, accepted: int) -> int:
    """Return the index of the first number too many; of too few, the last."""
    return min(given - 1, accepted)


def _joints_text(joints: tuple[float, ...], linear_axes: tuple[int, ...]) -> str:
    words = []
    for linear, group in groupby(enumerate(joints), key=lambda each: each[0] in linear_axes):
        unit = "mm" if linear else "deg"
        words += [*(from_si(value, unit) for _, value in group), unit]
    return " ".join(words)


def _dimension(axis: int, linear_axes: tuple[int, ...]) -> Dimension:
    return Dimension.LENGTH if axis in linear_axes else Dimension.ANGLE
