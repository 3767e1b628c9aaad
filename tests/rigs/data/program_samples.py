"""Programs for tests: a short one, and random ones of everything that a program may hold."""

import math
from collections.abc import Mapping

from hypothesis import strategies as st

from openpendant.server.programs.language.linking import Linked, link
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program import Program
from openpendant.simplemsg.pendant.management.program_values import (
    ArmConfiguration,
    PointPose,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.statements import (
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

HEAD = """openpendant-program/1
program "main" robot ur5
point a joints 0 -90 90 -90 -90 0 deg
point b joints 10 -90 90 -90 -90 0 deg
point c joints 20 -90 90 -90 -90 0 deg
"""


def program(statements: str, name: str = "main") -> Program:
    """A program of points a, b and c with these statements."""
    return parse(HEAD.replace("main", name) + statements)


def linked(statements: str, others: Mapping[str, str] | None = None) -> Linked:
    """Such a program with the programs that it calls, by name."""
    library = {name: program(text, name) for name, text in (others or {}).items()}
    return link(program(statements), library.get)


NAMES = st.one_of(
    st.from_regex(r"[A-Za-z_][A-Za-z0-9_.-]{0,12}", fullmatch=True),
    st.sampled_from(["above part", "Größe", "via", "speed", "3", "a#b", "100 %", "点", "-"]),
)
_COMMENTS = st.one_of(
    st.just(""), st.sampled_from(["x", "# twice", 'say "hello"', "größer als 5 °", "point a"])
)
_LINES = st.lists(_COMMENTS, max_size=3).map("\n".join)
_TIMES = st.floats(0.0, 86_400.0)
_SIGNALS = st.integers(0, 65_535)
_FRACTIONS = st.builds(Speed, st.just(SpeedKind.FRACTION), st.floats(1e-4, 1.0))
_SPEEDS = st.one_of(_FRACTIONS, st.builds(Speed, st.just(SpeedKind.TOOL), st.floats(1e-4, 10.0)))
_ZONES = st.one_of(st.just(0.0), st.floats(1e-6, 10.0))


@st.composite
def _poses(draw: st.DrawFn) -> PointPose:
    raw = draw(st.tuples(*[st.floats(-1.0, 1.0)] * 4).filter(lambda q: math.hypot(*q) > 0.1))
    length = math.hypot(*raw)
    x, y, z, w = (value / length for value in raw)
    coordinates = st.floats(-1e6, 1e6)
    place = (draw(coordinates), draw(coordinates), draw(coordinates))
    return PointPose(place, (x, y, z, w), draw(NAMES), draw(NAMES))


@st.composite
def points(draw: st.DrawFn, name: str, joints: int) -> TeachPoint:
    values = draw(st.lists(st.floats(-1e6, 1e6), min_size=joints, max_size=joints))
    turns = st.lists(st.integers(-100, 100), min_size=joints, max_size=joints).map(tuple)
    arms = st.builds(
        ArmConfiguration,
        st.sampled_from(["front", "back"]),
        st.sampled_from(["up", "down"]),
        st.sampled_from(["no-flip", "flip"]),
        st.one_of(st.none(), turns),
    )
    pose, arm = draw(st.one_of(st.none(), _poses())), draw(st.one_of(st.none(), arms))
    return TeachPoint(name, tuple(values), pose, arm, draw(_LINES))


@st.composite
def _moves(draw: st.DrawFn, names: list[str]) -> Move:
    way = draw(st.sampled_from(Way))
    vias = {Way.CIRC: (1, 1), Way.SPLINE: (0, 3)}.get(way, (0, 0))
    via = draw(st.lists(st.sampled_from(names), min_size=vias[0], max_size=vias[1]))
    zone = 0.0 if way is Way.SPLINE else draw(_ZONES)
    return Move(
        way,
        draw(st.sampled_from(names)),
        tuple(via),
        draw(_FRACTIONS if way is Way.PTP else _SPEEDS),
        zone,
        0.0 if zone else draw(_TIMES),
        comment=draw(_COMMENTS),
    )


def _simple(names: list[str]) -> st.SearchStrategy[Statement]:
    kinds: list[st.SearchStrategy[Statement]] = [
        st.builds(Wait, _TIMES, comment=_COMMENTS),
        st.builds(
            WaitInput, _SIGNALS, st.booleans(), st.one_of(st.none(), _TIMES), comment=_COMMENTS
        ),
        st.builds(SetOutput, _SIGNALS, st.booleans(), comment=_COMMENTS),
        st.builds(ReadInput, _SIGNALS, NAMES, comment=_COMMENTS),
        st.builds(Attach, NAMES, comment=_COMMENTS),
        st.builds(Detach, NAMES, comment=_COMMENTS),
        st.builds(Call, NAMES, comment=_COMMENTS),
        st.builds(Comment, comment=_COMMENTS),
    ]
    if names:
        kinds.append(_moves(names))
    return st.one_of(kinds)


@st.composite
def _bodies(draw: st.DrawFn, names: list[str], depth: int = 0) -> list[Statement]:
    found: list[Statement] = []
    for _ in range(draw(st.integers(0, 4))):
        kind = draw(st.integers(0, 5)) if depth < 3 else 5
        if kind == 0:
            passes = draw(st.one_of(st.none(), st.integers(1, 1_000_000)))
            found += [Loop(passes), *draw(_bodies(names, depth + 1)), End()]
        elif kind == 1:
            opened: Statement = draw(
                st.one_of(
                    st.builds(IfInput, _SIGNALS, st.booleans()),
                    st.builds(IfFlag, NAMES, st.booleans(), comment=_COMMENTS),
                )
            )
            found += [opened, *draw(_bodies(names, depth + 1))]
            if draw(st.booleans()):
                found += [Else(comment=draw(_COMMENTS)), *draw(_bodies(names, depth + 1))]
            found.append(End(comment=draw(_COMMENTS)))
        else:
            found.append(draw(_simple(names)))
    return found


@st.composite
def programs(draw: st.DrawFn) -> Program:
    """A program of anything that a program may hold."""
    names = draw(st.lists(NAMES, max_size=4, unique=True))
    joints = draw(st.integers(1, 8))
    axes = draw(st.lists(st.integers(0, joints - 1), unique=True, max_size=2))
    return Program(
        name=draw(NAMES),
        robot=draw(NAMES),
        linear_axes=tuple(sorted(axes)),
        tool=draw(NAMES),
        frame=draw(NAMES),
        points=tuple(draw(points(name, joints)) for name in names),
        statements=tuple(draw(_bodies(names))),
        comment=draw(_LINES),
    )
