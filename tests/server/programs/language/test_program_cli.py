import json
import os
from pathlib import Path

import pytest
from rigs.data.program_samples import HEAD

from openpendant.server.programs.language.parser import parse
from openpendant.tools.cli import main

Capture = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def write(name: str, statements: str) -> None:
    Path(name).write_text(HEAD.replace("main", name) + statements, "utf-8")


def test_a_good_program_is_said_to_be_good(capsys: Capture) -> None:
    write("one", "move PTP a")
    assert main(["program", "check", "one"]) == 0
    out, err = capsys.readouterr()
    assert out == "one: program 'one' for ur5: 3 points, 1 statements, good\n"
    assert err == ""


def test_programs_of_one_check_may_call_each_other() -> None:
    write("one", "call two")
    write("two", "wait 1 s")
    assert main(["program", "check", "one", "two"]) == 0
    assert main(["program", "check", "one"]) == 1


def test_every_problem_is_said_with_its_place(capsys: Capture) -> None:
    write("one", "point far joints 0 0 400 0 0 0 deg\ncall three")
    write("two", "move PTP")
    assert main(["program", "check", "one", "two"]) == 1
    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines() == [
        "one:7: 'call three': there is no program 'three' to call",
        "one:6: elbow_joint at 6.981317007977318 rad is outside its range"
        " -3.141592654 to 3.141592654 rad",
        "two:6:9: the line ends here; accepted: the point's name",
    ]


@pytest.mark.parametrize(
    ("robot", "message"),
    [("puma560", "was taught on 'ur5'; accepted here: programs of 'puma560'"), ("ur6", "ur6")],
)
def test_a_program_of_another_robot_is_refused(robot: str, message: str, capsys: Capture) -> None:
    write("one", "")
    assert main(["program", "check", "one", "--robot", robot]) == 1
    assert message in capsys.readouterr().err


def test_a_check_as_json_has_codes_and_lines(capsys: Capture) -> None:
    write("one", "move PTP x")
    assert main(["program", "check", "one", "--json"]) == 1
    found = json.loads(capsys.readouterr().out)
    assert found["ok"] is False
    (problem,) = found["files"][0]["problems"]
    assert (problem["name"], problem["code"], problem["line"]) == ("POINT_UNKNOWN", 115, 6)


def test_a_program_is_printed_in_its_layout(capsys: Capture) -> None:
    write("one", "  move   PTP a")
    assert main(["program", "print", "one"]) == 0
    assert capsys.readouterr().out.endswith("\n\nmove PTP a\n")


def test_there_and_back_is_the_same_program() -> None:
    write("one", "move PTP a speed 12.5 %  # slow")
    assert main(["program", "convert", "one", "--output", "one.json"]) == 0
    assert main(["program", "convert", "one.json", "--output", "again"]) == 0
    assert json.loads(Path("one.json").read_text())["format"] == "openpendant-program/1"
    assert parse(Path("again").read_text()) == parse(Path("one").read_text())


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        (["print", "nowhere"], 2, "openpendant program: nowhere: No such file or directory"),
        (["print", "."], 2, "openpendant program: .: Is a directory"),
        (["check", "nowhere"], 2, "nowhere: No such file or directory"),
        (["print", "broken"], 1, "openpendant program: broken:1:1: found 'hello'"),
        (["print", "/dev/zero"], 2, "/dev/zero: is not a regular file; accepted: a file on a disk"),
        (["check", "pipe"], 2, "pipe: is not a regular file"),
        (["print", "large"], 1, "2097153 or more bytes in large; accepted: up to 1048576"),
        (["print", "large.json"], 1, "2097153 or more bytes in large.json"),
        (["convert", "one", "--output", "no/where"], 2, "no/where: No such file or directory"),
        (["convert", "one", "--to", "xml"], 2, "xml"),
    ],
)
def test_what_cannot_be_done_is_said_in_one_line(
    arguments: list[str], code: int, message: str, capsys: Capture
) -> None:
    write("one", "")
    Path("broken").write_text("hello")
    os.mkfifo("pipe")
    Path("large").write_bytes(bytes(3 << 20))
    Path("large.json").write_bytes(b"{" + bytes(3 << 20))
    assert main(["program", *arguments]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert message in err
    assert "Traceback" not in err


def test_a_name_that_no_server_takes_is_told(capsys: Capture) -> None:
    name = "ü" * 33
    Path("one").write_text(HEAD.replace("main", name) + "move PTP a", "utf-8")
    assert main(["program", "check", "one"]) == 1
    assert "has 66 bytes of UTF-8; accepted: up to 64" in capsys.readouterr().err
    assert main(["program", "print", "one"]) == 0
