import math
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.expectations import known
from rigs.data.program_samples import HEAD, program

from openpendant.server.programs.language import lexer
from openpendant.server.programs.language.parser import parse, parse_bytes, parse_source
from openpendant.server.programs.language.program import MOST_POINTS
from openpendant.server.programs.language.program_errors import ProgramSyntaxError, ProgramTooLarge
from openpendant.simplemsg.pendant.management import statements
from openpendant.simplemsg.pendant.management.program_values import ProgramError
from openpendant.simplemsg.pendant.management.programs import MOST_STATEMENTS
from openpendant.simplemsg.pendant.management.statements import Move, Speed, SpeedKind, Way
from openpendant.simplemsg.verdicts import VerdictCode as V


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
    assert (point.configuration.turns, point.comment) == ((0, 0, 0, 0, 0, -1), "taught by Anna")


def test_roll_pitch_and_yaw_are_taken_for_a_quaternion() -> None:
    text = HEAD + "point d joints 0 0 0 0 0 0 deg pose 0 0 0 m rpy 0 0 180 deg"
    pose = known(parse(text).points[-1].pose)
    assert pose.quaternion == pytest.approx((0, 0, 1, 0))


def test_a_linear_axis_is_in_millimetres() -> None:
    text = 'openpendant-program/1\nprogram "p" robot rail linear 1\n'
    assert parse(text + "point a joints 500 mm 90 0 deg").points[0].joints[0] == 0.5
    error = error_of(text + "point a joints 5 90 0 deg")
    assert str(error) == (
        "pick.program:3:16: joint 1 is an angle; accepted: a length, as the program's header says"
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
    found = program("loop 3\nif input 7 off\nwait input 2 on timeout 5 s\nend\nend").statements
    expected = (statements.Loop(3), statements.IfInput(7, False))
    assert found[:3] == (*expected, statements.WaitInput(2, True, 5.0))


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
    assert (found.comment, found.points[0].comment) == ("first\nhead", "above a\nbeside a")
    comments = [statement.comment for statement in found.statements]
    assert comments == ["a line of its own", "beside loop", "inside", "", "last"]
    assert isinstance(found.statements[0], statements.Comment)


def test_line_ends_and_byte_order_marks_of_other_systems_are_taken() -> None:
    text = HEAD + "move PTP a\n"
    raw = b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode()
    assert parse_bytes(raw).program == parse(text) == parse("\ufeff" + text)


def test_every_statement_knows_its_line() -> None:
    source = parse_source(HEAD + "\nmove PTP a\n\n# here\n# and here")
    assert (source.statement_lines, source.point_lines) == ((7, 9, 10), (3, 4, 5))


@pytest.mark.parametrize(
    ("line", "column", "message"),
    [
        ("move PTP a spede 5 %", 12, "found 'spede'; accepted: speed, zone, dwell, the end"),
        ("move PTP", 9, "the line ends here; accepted: the point's name"),
        ("move FLY a", 6, "found 'FLY'; accepted: PTP, LIN, CIRC, SPLINE"),
        ("move PTP a speed 5 mm/s", 20, "found 'mm/s'; accepted: %"),
        ("move LIN a speed 1,5 %", 18, "found '1,5'; accepted: a number with a decimal dot"),
        ("move PTP a zone 5 mm", 19, "found 'mm'; accepted: deg or rad"),
        ("move PTP a speed 0 %", 18, "the speed is 0; accepted: 0.0001 to 1"),
        ("move PTP a speed 5 % speed 6 %", 22, "found 'speed'; accepted: zone, dwell, the end"),
        ("move LIN a zone 5 mm dwell 1 s", 28, "the dwell stands beside a zone"),
        ("move SPLINE a zone 5 mm", 15, "found 'zone'; accepted: via, speed, dwell"),
        ("wait 1e400 s", 6, "the number is too large"),
        ("wait -1 s", 6, "the wait is -1 s; accepted: 0 to 86400 s"),
        ("wait input 99999 on", 12, "the input is 99999; accepted: 0 to 65535"),
        ("wait input 1 maybe", 14, "found 'maybe'; accepted: on, off"),
        ("loop 0", 6, "the number of passes is 0; accepted: 1 to 1e+06"),
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
        ("move PTP nowhere", 10, "no point is named 'nowhere'; points: 'a', 'b', 'c'"),
        ('call "../etc/passwd"', 6, "the name of the program has '/'; accepted: a name without /"),
        ("call a\0b", 6, "holds U+0000 as character 2"),
        ("point a joints 0 0 0 0 0 0 deg", 7, "point 'a' stands in line 3 already"),
        ("point d joints 0 0 deg", 18, "point 'd' has 2 joints; accepted: 6, as point 'a'"),
        ("point d", 1, "point d has no joints"),
        (
            "point d joints 1 2 3",
            21,
            "the line ends here; accepted: a number with a decimal dot, or deg or rad or mm or m",
        ),
        ("point d joints 0 0 0 0 0 0 deg joints", 32, "found 'joints'; accepted: pose, config"),
        ("config front up flat", 17, "found 'flat'; accepted: no-flip, flip"),
        ("pose 1 2 mm quat 0 0 0 1", 8, "the position has 2 numbers; accepted: x, y and z"),
        ("pose 1 2 3 mm quat 0 0 0 2", 26, "an element of the quaternion is 2"),
        ("pose 1 2 3 mm quat 0 0 0 1.1", 20, "the quaternion has length 1.1; accepted: 1"),
        ("# a\x07bell", 1, "the comment holds U+0007"),
        (f"# {'x' * 201}", 1, "the comment has 201 characters; accepted: up to 200"),
        (f"# {'x' * 8192}", 8193, "the line has 8194 characters; accepted: up to 8192"),
    ],
)
def test_an_error_says_where_what_was_found_and_what_is_accepted(
    line: str, column: int, message: str
) -> None:
    error = error_of(HEAD + line)
    assert str(error).startswith(f"pick.program:6:{column}: ")
    assert message in str(error)


@pytest.mark.parametrize(
    ("line", "column", "message"),
    [
        ("  end", 3, "end closes nothing"),
        ("  loop 3", 3, "the block is not closed"),
        ("move PTP   nowhere", 12, "no point is named 'nowhere'"),
        ("move CIRC b via nowhere", 17, "no point is named 'nowhere'"),
        ("move SPLINE b via a nowhere c", 21, "no point is named 'nowhere'"),
        ('move PTP "a/b"', 10, "the name of the point has '/'"),
        ("move SPLINE b via a c/d", 21, "the name of the point has '/'"),
        ("move CIRC a", 12, "via names 0 points; accepted: one for CIRC"),
        ("move CIRC a via b c", 19, "via names 2 points; accepted: one for CIRC"),
        ("move PTP a speed 200 %", 18, "the speed is 2; accepted: 0.0001 to 1"),
        ("move LIN a speed 20 m/s", 18, "the speed is 20 m/s"),
        ("move LIN a speed 5 % zone 20 m", 27, "the zone is 20 m"),
        ("move LIN a dwell -1 s", 18, "the dwell is -1 s"),
        ("wait input 1 on timeout -1 s", 25, "the timeout is -1 s"),
        ("set output 70000 on", 12, "the output is 70000"),
        ("read input 70000 into x", 12, "the input is 70000"),
        ("read input 1 into x/y", 19, "the name of the flag has '/'"),
        ("if input 70000 on", 10, "the input is 70000"),
        ("if flag x/y on", 9, "the name of the flag has '/'"),
        ("attach x/y", 8, "the name of the object has '/'"),
        ("end  # a\x07", 6, "the comment holds U+0007"),
        ("  # a\x07", 3, "the comment holds U+0007"),
        ("point x/y joints 0 0 0 0 0 0 deg", 7, "the name of the point has '/'"),
        ("  point d", 3, "point d has no joints"),
        ("point d joints 0 0 0 0 0 0 0 deg", 28, "point 'd' has 7 joints; accepted: 6"),
        ("point d joints 0 0 0 9e9 0 0 deg", 22, "joint 4 of point d is 1.5708e+08"),
        ("point d joints 0 0 mm 0 0 0 0 deg", 16, "joint 1 is a length; accepted: an angle"),
        (f"point d joints {'0 ' * 17}deg", 48, "joints are 17; accepted: 1 to 16"),
        ("pose 1 2 3 4 mm quat 0 0 0 1", 12, "the position has 4 numbers"),
        ("pose 1 2e9 3 m quat 0 0 0 1", 8, "a coordinate is 2e+09 m"),
        ("pose 1 2e9 3 m rpy 0 0 0 deg", 8, "a coordinate is 2e+09 m"),
        ("pose 1 2 3 mm rpy 0 0 deg", 21, "the turns are 2 angles"),
        ("pose 1 2 3 mm quat 0 0 0 1 frame x/y", 34, "the name of the frame has '/'"),
        ("pose 1 2 3 mm quat 0 0 0 1 tool x/y", 33, "the name of the tool has '/'"),
        ("config front up flip turns 0 0.5", 30, "a number of turns is 0.5"),
        ("config front up flip turns 0 500", 30, "a number of turns is 500"),
    ],
)
def test_what_is_wrong_with_a_value_is_placed_at_the_value(
    line: str, column: int, message: str
) -> None:
    assert str(error_of(HEAD + line)).startswith(f"pick.program:6:{column}: {message}")


@pytest.mark.parametrize(
    ("line", "column"),
    [
        ("\t\tmove PTP nowhere", 12),
        ('move SPLINE a via "Größe" b', 19),
        ('move SPLINE "a\u0301🤖点" via nowhere', 13),
        ("move\tPTP\tnowhere", 10),
    ],
)
def test_a_column_counts_code_points_whatever_their_width(line: str, column: int) -> None:
    error = error_of(HEAD + line)
    assert (error.line, error.column) == (6, column)


def test_a_byte_order_mark_is_no_character_of_the_first_line() -> None:
    with pytest.raises(ProgramSyntaxError, match=r"^x:1:1: found 'hello'"):
        parse("\ufeffhello", "x")
    with pytest.raises(ProgramSyntaxError, match=r"^x:1:3: byte 0xFF is not UTF-8"):
        parse_bytes("\ufeffaü".encode() + b"\xff", "x")
    with pytest.raises(ProgramSyntaxError, match=r"^x:1:1: found '\\ufeff"):
        parse("\ufeff\ufeff" + HEAD, "x")


def of_program(words: str) -> str:
    return f"openpendant-program/1\nprogram {words}\n"


D = "point d joints 0 0 0 0 0 0 deg"
TURNS = "config front up flip turns 0 0 0 0 0 0 0"


@pytest.mark.parametrize(
    ("text", "place", "message"),
    [
        (of_program("a/b robot r"), "2:9", "the name of the program has '/'"),
        (of_program("p robot a/b"), "2:17", "the name of the robot has '/'"),
        (of_program("p robot r tool a/b"), "2:24", "the name of the tool has '/'"),
        (of_program("p robot r frame a/b"), "2:25", "the name of the frame has '/'"),
        (of_program("p robot r linear 1 3 2"), "2:30", "the linear axes are [0, 2, 1]"),
        (of_program("p robot r linear 0"), "2:26", "the linear axes are [-1]"),
        (of_program("p robot r  # a\x07"), "2:20", "the comment holds U+0007"),
        (HEAD + "point d\n  joints 0 0 deg", "7:12", "point 'd' has 2 joints"),
        (HEAD + "point d\n  joints 0 0 0 0 0 9e9 deg", "7:20", "joint 6 of point d"),
        (f"{HEAD}{D}\n{TURNS}", "7:40", "turns are 7; accepted: 6, as joints"),
        (f"{HEAD}{D}  # x\n  # y\x07\nwait 1 s", "7:3", "the comment holds"),
        (f"{HEAD}# x\n# y\x07\n{D}", "7:1", "the comment holds"),
        ("", "1:1", "the text ends here; accepted: openpendant-program/1"),
        ("hello", "1:1", "found 'hello'; accepted: openpendant-program/1, as the first word"),
        ("openpendant-program/2", "1:1", "found 'openpendant-program/2'"),
        ("openpendant-program/1\n\n", "3:1", 'the text ends here; accepted: program "NAME"'),
        ("openpendant-program/1\npoint a", "2:1", "found 'point'; accepted: program"),
        (of_program('"p"'), "2:12", "the line ends here; accepted: robot NAME"),
        (
            of_program('"p" robot r') + "joints 1 deg",
            "3:1",
            "found 'joints'; accepted: point NAME before its clauses",
        ),
        (HEAD + "move PTP a\npoint d joints 1 deg", "7:1", "a point stands behind a statement"),
    ],
)
def test_what_is_wrong_on_any_other_line_is_placed_there(
    text: str, place: str, message: str
) -> None:
    assert str(error_of(text)).startswith(f"pick.program:{place}: {message}")


def test_bytes_that_are_no_text_are_refused_with_their_place() -> None:
    with pytest.raises(ProgramSyntaxError, match=r"^x:2:3: byte 0xFF is not UTF-8") as caught:
        parse_bytes(b"a\nbc\xff", "x")
    assert caught.value.code is V.PROGRAM_SYNTAX


@pytest.mark.parametrize(
    ("statements", "code"),
    [
        ("move PTP x", V.POINT_UNKNOWN),
        ("call a/b", V.BAD_NAME),
        ("loop", V.PROGRAM_INVALID),
        ("move", V.PROGRAM_SYNTAX),
    ],
)
def test_a_refusal_has_the_code_of_the_rule(statements: str, code: V) -> None:
    assert error_of(HEAD + statements).code is code


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
        ("x" * (lexer.MOST_BYTES + 1), lexer.MOST_BYTES),
        (HEAD + "loop\n" * 100_000, MOST_STATEMENTS),
        (HEAD + "".join(f"point p{i} joints 0 0 0 0 0 0 deg\n" for i in range(2_000)), MOST_POINTS),
    ],
)
def test_a_program_that_is_too_large_is_refused_with_the_limit(text: str, limit: int) -> None:
    with pytest.raises(ProgramTooLarge) as caught:
        parse_bytes(text.encode())
    assert caught.value.limit == limit


REALS = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize("unit", lexer.UNITS)
@given(value=REALS)
def test_every_real_reads_back_as_itself_in_every_unit(unit: str, value: float) -> None:
    text = lexer.from_si(value, unit)
    assert lexer.is_number(text)
    assert lexer.to_si(text, unit) == value


@given(REALS)
def test_every_real_without_a_unit_reads_back_as_itself(value: float) -> None:
    text = lexer.plain_number(value)
    assert lexer.is_number(text)
    assert lexer.read_number(text) == value


@pytest.mark.parametrize(
    ("number", "unit", "expected"),
    [
        ("180", "deg", math.pi),
        ("-90", "deg", -math.pi / 2),
        ("0.1", "mm", 0.0001),
        ("250", "mm/s", 0.25),
        ("50", "%", 0.5),
        ("20", "ms", 0.02),
        ("1e3", "m", 1000.0),
    ],
)
def test_a_number_with_a_unit_is_the_nearest_real(number: str, unit: str, expected: float) -> None:
    assert lexer.to_si(number, unit) == expected


@pytest.mark.parametrize("typed", ["30", "-12.5", "0.001", "359.999", "0", "100000"])
def test_what_was_typed_is_printed_as_it_was(typed: str) -> None:
    assert lexer.from_si(lexer.to_si(typed, "deg"), "deg") == typed
    assert lexer.from_si(lexer.to_si(typed, "mm"), "mm") == typed


def test_minus_zero_is_zero() -> None:
    assert math.copysign(1.0, lexer.to_si("-0", "deg")) == 1.0


@pytest.mark.parametrize(
    "word", ["", ".", "1,5", "1.5.", "0x10", "1_000", "nan", "inf", "١", "1e", "--1", "e5"]
)
def test_what_is_no_number_is_not_taken_for_one(word: str) -> None:
    assert not lexer.is_number(word)


def test_a_number_may_not_be_endless() -> None:
    assert lexer.is_number("1" * lexer.LONGEST_NUMBER)
    assert not lexer.is_number("1" * (lexer.LONGEST_NUMBER + 1))


def test_a_number_beyond_all_reals_is_infinite() -> None:
    assert lexer.to_si("1e999", "m") == math.inf
