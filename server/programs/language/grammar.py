"""Grammar of the points and statements of a program's text, read and written.

A point has the clauses joints, pose and config, each once, on its line or on lines of their own; a
statement stands on one line. That points exist and blocks close is checked by the program.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import groupby
from typing import TYPE_CHECKING, Literal, cast

from openpendant.motion.pose import Pose
from openpendant.simplemsg.pendant.management.program_values import (
    MOST_TURNS,
    ArmConfiguration,
    BadValue,
    PointPose,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.statements import (
    FULL_SPEED,
    Attach,
    Call,
    Comment,
    Detach,
    Else,
    End,
    IfFlag,
    IfInput,
    Loop,
    Move,
    ReadInput,
    SetOutput,
    Speed,
    SpeedKind,
    Statement,
    Wait,
    WaitInput,
    Way,
)

from .lexer import Clauses, Dimension, Places, TextPlace, from_si, named, plain_number

if TYPE_CHECKING:
    from .program import Program


_MOVE_CLAUSES = ("via", "speed", "zone", "dwell")


def read_statement(clauses: Clauses, comment: str) -> Statement:
    """Read the statement on a line.

    Args:
        clauses: the line, which begins with one of `STATEMENTS`.

    Raises:
        ProgramSyntaxError: a word that is not accepted.
        BadValue: a value that the statement cannot have.
    """
    statement = STATEMENTS[clauses.keyword(list(STATEMENTS))](clauses, comment)
    clauses.done()
    return statement


def _move(clauses: Clauses, comment: str) -> Move:
    way = Way(clauses.keyword([way.value for way in Way]))
    point = clauses.name("the point's name", "the point")
    left = [word for word in _MOVE_CLAUSES if not (word == "zone" and way is Way.SPLINE)]
    if way in (Way.PTP, Way.LIN):
        left.remove("via")
    via: list[str] = []
    speed, zone, dwell = FULL_SPEED, 0.0, 0.0
    while clauses.next is not None:
        keyword = clauses.keyword(left, "the end of the line")
        left.remove(keyword)
        match keyword:
            case "via":
                via.append(clauses.at("via").name("a point's name", "the point"))
                while clauses.next is not None and not clauses.at_keyword(*_MOVE_CLAUSES):
                    via.append(clauses.at("via").name("a point's name", "the point"))
            case "speed":
                speed = _speed(clauses, way)
            case "zone":
                size = Dimension.ANGLE if way is Way.PTP else Dimension.LENGTH
                zone, _ = clauses.at("the zone").quantity(size)
            case "dwell":
                dwell, _ = clauses.at("the dwell").quantity(Dimension.TIME)
    if not via:
        clauses.at("via")
    return Move(way, point, tuple(via), speed, zone, dwell, comment=comment)


def _speed(clauses: Clauses, way: Way) -> Speed:
    accepted = [Dimension.FRACTION]
    if way is not Way.PTP:
        accepted.append(Dimension.VELOCITY)
    value, dimension = clauses.at("the speed").quantity(*accepted)
    kind = SpeedKind.FRACTION if dimension is Dimension.FRACTION else SpeedKind.TOOL
    return Speed(kind, value)


def _wait(clauses: Clauses, comment: str) -> Wait | WaitInput:
    if clauses.at_number():
        return Wait(clauses.at("the wait").quantity(Dimension.TIME)[0], comment=comment)
    clauses.keyword(["input"], "a number of seconds")
    signal, value = _input(clauses), _on_or_off(clauses)
    timeout = None
    if clauses.skip("timeout"):
        timeout, _ = clauses.at("the timeout").quantity(Dimension.TIME)
    else:
        clauses.done(["timeout"])
    return WaitInput(signal, value, timeout, comment=comment)


def _set(clauses: Clauses, comment: str) -> SetOutput:
    clauses.keyword(["output"])
    signal = clauses.at("the output").integer("the output's number")
    return SetOutput(signal, _on_or_off(clauses), comment=comment)


def _read(clauses: Clauses, comment: str) -> ReadInput:
    clauses.keyword(["input"])
    signal = _input(clauses)
    clauses.keyword(["into"])
    return ReadInput(signal, _flag(clauses), comment=comment)


def _loop(clauses: Clauses, comment: str) -> Loop:
    if clauses.next is None:
        return Loop(comment=comment)
    passes = clauses.at("the number of passes").integer("the number of passes")
    return Loop(passes, comment=comment)


def _if(clauses: Clauses, comment: str) -> IfInput | IfFlag:
    if clauses.keyword(["input", "flag"]) == "input":
        signal = _input(clauses)
        return IfInput(signal, _on_or_off(clauses), comment=comment)
    flag = _flag(clauses)
    return IfFlag(flag, _on_or_off(clauses), comment=comment)


def _call(clauses: Clauses, comment: str) -> Call:
    return Call(clauses.name("the program's name", "the program"), comment=comment)


def _object(clauses: Clauses) -> str:
    return clauses.name("the object's name", "the object")


def _input(clauses: Clauses) -> int:
    return clauses.at("the input").integer("the input's number")


def _flag(clauses: Clauses) -> str:
    return clauses.name("the flag's name", "the flag")


def _on_or_off(clauses: Clauses) -> bool:
    return clauses.keyword(["on", "off"]) == "on"


STATEMENTS: Mapping[str, Callable[[Clauses, str], Statement]] = {
    "move": _move,
    "wait": _wait,
    "set": _set,
    "read": _read,
    "attach": lambda clauses, comment: Attach(_object(clauses), comment=comment),
    "detach": lambda clauses, comment: Detach(_object(clauses), comment=comment),
    "loop": _loop,
    "if": _if,
    "else": lambda _, comment: Else(comment=comment),
    "end": lambda _, comment: End(comment=comment),
    "call": _call,
}
"""First word of each statement, and the function that reads the rest of its line."""


def statement_text(statement: Statement) -> str:
    """Return the canonical line of a statement, without indentation."""
    if isinstance(statement, Comment):
        return f"# {statement.comment}".rstrip()
    beside = f"  # {statement.comment}" if statement.comment else ""
    return f"{_words(statement)}{beside}"


def _words(statement: Statement) -> str:
    match statement:
        case Move():
            return _move_text(statement)
        case Wait(duration):
            return f"wait {from_si(duration, 's')} s"
        case WaitInput(signal, value, timeout):
            ending = "" if timeout is None else f" timeout {from_si(timeout, 's')} s"
            return f"wait input {signal} {_state(value)}{ending}"
        case SetOutput(signal, value):
            return f"set output {signal} {_state(value)}"
        case ReadInput(signal, flag):
            return f"read input {signal} into {named(flag)}"
        case Attach(scene_object):
            return f"attach {named(scene_object)}"
        case Detach(scene_object):
            return f"detach {named(scene_object)}"
        case Loop(passes):
            return "loop" if passes is None else f"loop {passes}"
        case IfInput(signal, value):
            return f"if input {signal} {_state(value)}"
        case IfFlag(flag, value):
            return f"if flag {named(flag)} {_state(value)}"
        case Else():
            return "else"
        case End():
            return "end"
        case Call(program):
            return f"call {named(program)}"
        case Comment(comment=text):
            return f"# {text}".rstrip()


def _move_text(move: Move) -> str:
    words = [f"move {move.way} {named(move.point)}"]
    if move.via:
        words.append("via " + " ".join(named(name) for name in move.via))
    if move.speed != FULL_SPEED:
        unit = "%" if move.speed.kind is SpeedKind.FRACTION else "mm/s"
        words.append(f"speed {from_si(move.speed.value, unit)} {unit}")
    if move.zone:
        unit = "deg" if move.way is Way.PTP else "mm"
        words.append(f"zone {from_si(move.zone, unit)} {unit}")
    if move.dwell:
        words.append(f"dwell {from_si(move.dwell, 's')} s")
    return " ".join(words)


def _state(value: bool) -> str:
    return "on" if value else "off"


POINT_CLAUSES = ("joints", "pose", "config")
_SHOULDERS, _ELBOWS, _WRISTS = ("front", "back"), ("up", "down"), ("no-flip", "flip")


@dataclass(slots=True)
class PointClauses:
    """Point that is being read.

    Attributes:
        header: the program's names of tool and frame, and its linear axes.
        comments: the comments beside and between its clauses.
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
