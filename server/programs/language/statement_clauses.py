"""Statement clauses of a program's text, read and written, one statement a line.

Owns the grammar of each statement. That points exist and blocks close is checked by the program.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from .clauses import Clauses
from .quantities import Dimension, from_si
from .statements import (
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
from .words import named

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


def _attach(clauses: Clauses, comment: str) -> Attach:
    return Attach(clauses.name("the object's name", "the object"), comment=comment)


def _detach(clauses: Clauses, comment: str) -> Detach:
    return Detach(clauses.name("the object's name", "the object"), comment=comment)


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


def _else(clauses: Clauses, comment: str) -> Else:
    return Else(comment=comment)


def _end(clauses: Clauses, comment: str) -> End:
    return End(comment=comment)


def _call(clauses: Clauses, comment: str) -> Call:
    return Call(clauses.name("the program's name", "the program"), comment=comment)


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
    "attach": _attach,
    "detach": _detach,
    "loop": _loop,
    "if": _if,
    "else": _else,
    "end": _end,
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
