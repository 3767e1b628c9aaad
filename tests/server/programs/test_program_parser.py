"""From text to program: what is taken, and what an error says and where."""

from __future__ import annotations

import math
from contextlib import suppress

import pytest
from program_samples import HEAD, program

from openpendant.server.programs.errors import ProgramError, ProgramSyntaxError, ProgramTooLarge
from openpendant.server.programs.parser import parse, parse_bytes, parse_source
from openpendant.server.programs.program import MOST_POINTS, MOST_STATEMENTS
from openpendant.server.programs.statements import (
    Comment,
    IfInput,
    Loop,
    Move,
    Speed,
    SpeedKind,
    WaitInput,
    Way,
)
from openpendant.server.programs.tokens import MOST_BYTES
from openpendant.simplemsg.verdicts import VerdictCode


def error_of(text: str) -> ProgramSyntaxError:
    with pytest.raises(ProgramSyntaxError) as caught:
        parse(text, "pick.program")
    return caught.value


def test_points_hold_joints_pose_frame_tool_and_configuration() -> None:
    point = parse(
        """openpendant-program/1
program "p" robot ur5 tool gripper frame table
point home
  joints 0 -90 90 -90 -90 0 deg   # taught by Anna
  pose 400 0 300 mm quat 0 0 0 1 frame base
  config front up no-flip turns 0 0 0 0 0 -1
"""
    ).points[0]
    assert point.joints[1] == -math.pi / 2
    assert point.pose is not None
    assert point.pose.position == (0.4, 0.0, 0.3)
    assert (point.pose.frame, point.pose.tool) == ("base", "gripper")
    assert point.configuration is not None
    assert point.configuration.turns == (0, 0, 0, 0, 0, -1)
    assert point.comment == "taught by Anna"


def test_roll_pitch_and_yaw_are_taken_for_a_quaternion() -> None:
    text = HEAD + "point d joints 0 0 0 0 0 0 deg pose 0 0 0 m rpy 0 0 180 deg"
    pose = parse(text).points[-1].pose
    assert pose is not None
    assert pose.quaternion == pytest.approx((0, 0, 1, 0))


def test_a_linear_axis_is_in_millimetres() -> None:
    text = 'openpendant-program/1\nprogram "p" robot rail linear 1\n'
    assert parse(text + "point a joints 500 mm 90 0 deg").points[0].joints[0] == 0.5
    error = error_of(text + "point a joints 5 90 0 deg")
    assert str(error) == (
        "pick.program:3:1: joint 1 is an angle; accepted: a length, as the program's header says"
        " which axes are linear"
    )


def test_a_move_has_way_speed_zone_and_dwell() -> None:
    moves = program(
        "move PTP a speed 50 % zone 5 deg\n"
        "move LIN b speed 250 mm/s zone 10 mm\n"
        "move CIRC c via a\n"
        "move SPLINE c via a b dwell 0.5 s\n"
    ).statements
    assert moves == (
        Move(Way.PTP, "a", speed=Speed(SpeedKind.FRACTION, 0.5), zone=math.radians(5)),
        Move(Way.LIN, "b", speed=Speed(SpeedKind.TOOL, 0.25), zone=0.01),
        Move(Way.CIRC, "c", ("a",)),
        Move(Way.SPLINE, "c", ("a", "b"), dwell=0.5),
    )


def test_other_statements() -> None:
    statements = program("loop 3\nif input 7 off\nwait input 2 on timeout 5 s\nend\nend").statements
    assert statements[:3] == (Loop(3), IfInput(7, False), WaitInput(2, True, 5.0))


def test_comments_go_to_what_they_stand_at() -> None:
    found = parse(
        """# first
openpendant-program/1
program "p" robot ur5  # head
# above a
point a joints 0 deg  # beside a
# a line of its own
loop  # beside loop
  # inside
end
# last
"""
    )
    assert found.comment == "first\nhead"
    assert found.points[0].comment == "above a\nbeside a"
    assert [statement.comment for statement in found.statements] == [
        *("a line of its own", "beside loop", "inside", "", "last")
    ]
    assert isinstance(found.statements[0], Comment)


def test_line_ends_and_byte_order_marks_of_other_systems_are_taken() -> None:
    text = HEAD + "move PTP a\n"
    raw = b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode()
    assert parse_bytes(raw).program == parse(text)


def test_every_statement_knows_its_line() -> None:
    source = parse_source(HEAD + "\nmove PTP a\n\n# here\n# and here")
    assert source.statement_lines == (7, 9, 10)
    assert source.point_lines == (3, 4, 5)


@pytest.mark.parametrize(
    ("line", "column", "message"),
    [
        ("move PTP a spede 5 %", 12, "found 'spede'; accepted: speed, zone, dwell, the end"),
        ("move PTP", 9, "the line ends here; accepted: the point's name"),
        ("move FLY a", 6, "found 'FLY'; accepted: PTP, LIN, CIRC, SPLINE"),
        ("move PTP a speed 5 mm/s", 20, "found 'mm/s'; accepted: %"),
        ("move LIN a speed 1,5 %", 18, "found '1,5'; accepted: a number with a decimal dot"),
        ("move PTP a zone 5 mm", 19, "found 'mm'; accepted: deg or rad"),
        ("move PTP a speed 0 %", 1, "the speed is 0; accepted: 0.0001 to 1"),
        ("move PTP a speed 5 % speed 6 %", 22, "found 'speed'; accepted: zone, dwell, the end"),
        ("move LIN a zone 5 mm dwell 1 s", 1, "the dwell stands beside a zone"),
        ("move SPLINE a zone 5 mm", 15, "found 'zone'; accepted: via, speed, dwell"),
        ("wait 1e400 s", 6, "the number is too large"),
        ("wait -1 s", 1, "the wait is -1 s; accepted: 0 to 86400 s"),
        ("wait input 99999 on", 1, "the input is 99999; accepted: 0 to 65535"),
        ("wait input 1 maybe", 14, "found 'maybe'; accepted: on, off"),
        ("loop 0", 1, "the number of passes is 0; accepted: 1 to 1e+06"),
        ("loop -1", 6, "found '-1'; accepted: the number of passes, a whole number"),
        ("set input 1 on", 5, "found 'input'; accepted: output"),
        ("attach part now", 13, "found 'now'; accepted: the end of the line"),
        ("jump 5", 1, "found 'jump'; accepted: point, move, wait, set, read"),
        ('"move" PTP a', 1, "found 'move' in quotation marks; accepted: point, move"),
        ('call "other', 6, "the quotation mark is not closed"),
        ('call "a""b"', 9, "two words touch; accepted: a space between them"),
        ("end", 1, "end closes nothing"),
        ("else", 1, "else belongs to no if"),
        ("loop", 1, "the block is not closed"),
        ("move PTP nowhere", 1, "no point is named 'nowhere'; points: 'a', 'b', 'c'"),
        ('call "../etc/passwd"', 1, "the name of the program has '/'; accepted: a name without /"),
        ("call a\0b", 1, "character 2 (U+0000) is not printable"),
        ("point a joints 0 0 0 0 0 0 deg", 1, "point 'a' stands in line 3 already"),
        ("point d joints 0 0 deg", 1, "point 'd' has 2 joints; accepted: 6, as point 'a'"),
        ("point d", 1, "point d has no joints"),
        (
            "point d joints 1 2 3",
            21,
            "the line ends here; accepted: a number with a decimal dot, or deg or rad or mm or m",
        ),
        ("point d joints 0 0 0 0 0 0 deg joints", 32, "found 'joints'; accepted: pose, config"),
        ("config front up flat", 17, "found 'flat'; accepted: no-flip, flip"),
        ("pose 1 2 mm quat 0 0 0 1", 1, "the position has 2 numbers; accepted: x, y and z"),
        ("pose 1 2 3 mm quat 0 0 0 2", 1, "an element of the quaternion is 2"),
        ("pose 1 2 3 mm quat 0 0 0 1.1", 1, "the quaternion has length 1.1; accepted: 1"),
        ("# a\x07bell", 1, "the comment holds U+0007"),
        (f"# {'x' * 201}", 1, "the comment has 201 characters; accepted: up to 200"),
        (f"# {'x' * 4096}", 4097, "the line has 4098 characters; accepted: up to 4096"),
    ],
)
def test_an_error_says_where_what_was_found_and_what_is_accepted(
    line: str, column: int, message: str
) -> None:
    error = error_of(HEAD + line)
    assert str(error).startswith(f"pick.program:6:{column}: ")
    assert message in str(error)


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        ("", "1:1", "the text ends here; accepted: openpendant-program/1"),
        ("hello", "1:1", "found 'hello'; accepted: openpendant-program/1, as the first word"),
        ("openpendant-program/2", "1:1", "found 'openpendant-program/2'"),
        ("openpendant-program/1\n\n", "3:1", 'the text ends here; accepted: program "NAME"'),
        ("openpendant-program/1\npoint a", "2:1", "found 'point'; accepted: program"),
        ('openpendant-program/1\nprogram "p"', "2:12", "accepted: robot NAME"),
        (
            'openpendant-program/1\nprogram "p" robot r\njoints 1 deg',
            "3:1",
            "found 'joints'; accepted: point NAME before its clauses",
        ),
        (HEAD + "move PTP a\npoint d joints 1 deg", "7:1", "a point stands behind a statement"),
    ],
)
def test_a_text_that_is_no_program_is_refused(text: str, place: str, message: str) -> None:
    error = error_of(text)
    assert str(error).startswith(f"pick.program:{place}: ")
    assert message in str(error)


def test_bytes_that_are_no_text_are_refused_with_their_place() -> None:
    with pytest.raises(ProgramSyntaxError, match=r"^x:2:3: byte 0xFF is not UTF-8") as caught:
        parse_bytes(b"a\nbc\xff", "x")
    assert caught.value.refusal.code is VerdictCode.PROGRAM_SYNTAX


@pytest.mark.parametrize(
    ("statements", "code"),
    [
        ("move PTP x", VerdictCode.POINT_UNKNOWN),
        ("call a/b", VerdictCode.BAD_NAME),
        ("loop", VerdictCode.PROGRAM_INVALID),
        ("move", VerdictCode.PROGRAM_SYNTAX),
    ],
)
def test_a_refusal_has_the_code_of_the_rule(statements: str, code: VerdictCode) -> None:
    assert error_of(HEAD + statements).refusal.code is code


@pytest.mark.parametrize("cut", range(0, len(HEAD), 7))
def test_a_truncated_text_is_read_or_refused(cut: int) -> None:
    text = HEAD + "loop 3\n  move PTP a speed 50 %\nend\n"
    with suppress(ProgramError):
        parse(text[: cut + len(text) - len(HEAD)])


def test_a_program_nested_too_deep_is_refused() -> None:
    parse(HEAD + "loop\n" * 32 + "end\n" * 32)
    error = error_of(HEAD + "loop\n" * 3_900)
    assert "the block is number 33 inside of each other; accepted: up to 32" in str(error)
    assert error.line == 5 + 33


@pytest.mark.parametrize(
    ("text", "limit"),
    [
        ("x" * (MOST_BYTES + 1), MOST_BYTES),
        (HEAD + "loop\n" * 100_000, MOST_STATEMENTS),
        (HEAD + "".join(f"point p{i} joints 0 0 0 0 0 0 deg\n" for i in range(2_000)), MOST_POINTS),
    ],
)
def test_a_program_that_is_too_large_is_refused_with_the_limit(text: str, limit: int) -> None:
    with pytest.raises(ProgramTooLarge) as caught:
        parse_bytes(text.encode())
    assert caught.value.refusal.limit == limit
