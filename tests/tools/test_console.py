"""The console: from errors to one line and an exit code, and text of others on a terminal."""

import argparse
import sys

import pytest
import typer

from openpendant.tools.console import (
    ExitCode,
    Faults,
    cells,
    command,
    emit_json,
    fail,
    one_line,
    run,
    run_alone,
    run_parsed,
    table,
    terminal,
)


class _Wrong(Exception):
    """What the user got wrong."""


class _WrongInDetail(_Wrong):
    """A special case of it."""


FAULTS: Faults = {_WrongInDetail: 7, _Wrong: 8, OSError: ExitCode.OUTPUT_FAILED}


def raising(error: BaseException | None, code: int = 0) -> typer.Typer:
    """Return a command that raises an error, or returns a code."""
    app = command("Do it.", "0 done, 8 wrong")

    @app.command()
    def act(number: int = 0) -> int:
        if error is not None:
            raise error
        return number or code

    return app


@pytest.mark.parametrize(
    ("error", "code", "told"),
    [
        (_Wrong("two\n  lines"), 8, "error: two lines\n"),
        (_WrongInDetail("less"), 7, "error: less\n"),
        (_Wrong("\x1b[2J"), 8, "error: \\x1b[2J\n"),
        (OSError(28, "No space left on device"), 74, "error: output: No space left on device\n"),
        (FileNotFoundError(2, "absent", "a.csv"), 74, "error: a.csv: absent\n"),
        (OSError("odd"), 74, "error: output: odd\n"),
        (typer.Abort(), 130, "error: interrupted\n"),
    ],
)
def test_a_fault_is_one_line_and_its_code(
    error: BaseException, code: int, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(raising(error), "act", [], FAULTS) == code
    assert capsys.readouterr() == ("", told)


def test_an_interruption_is_130() -> None:
    assert run(raising(KeyboardInterrupt()), "act", [], FAULTS) == ExitCode.INTERRUPTED


def test_wrong_usage_is_told_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(raising(None), "act", ["--number", "x"], {}) == ExitCode.USAGE
    told = capsys.readouterr().err
    assert "--number" in told
    assert told.startswith("error: ")
    assert told.count("\n") == 1


def test_a_command_may_tell_its_faults_itself(capsys: pytest.CaptureFixture[str]) -> None:
    told: list[str] = []
    assert run(raising(_Wrong("so")), "act", [], FAULTS, told.append) == 8
    assert (told, capsys.readouterr().err) == (["so"], "")


def test_what_a_command_returns_is_its_code() -> None:
    assert run(raising(None, 3), "act", [], FAULTS) == 3
    assert run(raising(None), "act", [], FAULTS) == 0


def test_an_unforeseen_fault_and_a_closed_pipe_are_left_to_the_caller() -> None:
    with pytest.raises(ZeroDivisionError):
        run(raising(ZeroDivisionError()), "act", [], FAULTS)
    with pytest.raises(BrokenPipeError):
        run(raising(BrokenPipeError()), "act", [], FAULTS)


def test_a_command_that_runs_alone_tells_its_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_alone(raising(None), "act", ["--wrong"]) == ExitCode.USAGE
    assert capsys.readouterr().err.startswith("Usage: openpendant act")
    assert run_alone(raising(typer.Exit(5)), "act", []) == 5
    assert run_alone(raising(None), "act", []) == ExitCode.OK


def test_the_help_names_the_exit_codes(capsys: pytest.CaptureFixture[str]) -> None:
    app = raising(None)
    app.command("other")(lambda: None)
    assert run(app, "act", ["--help"], {}) == ExitCode.OK
    told = capsys.readouterr().out
    assert "Do it." in told
    assert "Exit codes: 0 done, 8 wrong." in told


# Commands with the standard library's parser.


def parsed(error: BaseException | None, argv: list[str] | None = None) -> int:
    """Run a command of argparse that raises an error, or returns 4."""

    def act(_: argparse.Namespace) -> int:
        if error is not None:
            raise error
        return 4

    return run_parsed(argparse.ArgumentParser(prog="act"), act, argv or [], FAULTS)


@pytest.mark.parametrize(
    ("error", "code", "told"),
    [
        (None, 4, ""),
        (_Wrong("so"), 8, "so\n"),
        (FileNotFoundError(2, "absent", "a.pcap"), 74, "a.pcap: absent\n"),
        (OSError(5, "broken"), 74, "input or output: broken\n"),
        (KeyboardInterrupt(), 130, ""),
    ],
)
def test_a_parsed_command_ends_likewise(
    error: BaseException | None, code: int, told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert parsed(error) == code
    assert capsys.readouterr() == ("", told)


def test_a_parsed_command_tells_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    assert parsed(None, ["--wrong"]) == ExitCode.USAGE
    assert "--wrong" in capsys.readouterr().err
    assert parsed(None, ["--help"]) == ExitCode.OK


def test_a_parsed_command_whose_findings_nobody_sees_has_failed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdout", None)
    assert parsed(None) == ExitCode.FAILED
    assert capsys.readouterr().err == "standard output is closed\n"


# Output.


@pytest.mark.parametrize(
    ("text", "mark", "shown"),
    [
        ("plain °, µm", None, "plain °, µm"),
        ("\x1b[2J\r\n", None, "\\x1b[2J\\r\\n"),
        ("turned\u202eround", None, "turned\\u202eround"),
        ("\x1b[2J\n", " ", " [2J "),
        ("\x1b[2J\n", "?", "?[2J?"),
    ],
)
def test_text_of_others_commands_no_terminal(text: str, mark: str | None, shown: str) -> None:
    assert one_line(text, mark) == shown


def test_a_process_without_standard_error_writes_no_fault_elsewhere(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stderr", None)
    assert fail("wrong", 3) == 3
    assert capsys.readouterr().out == ""


def test_json_is_one_line_with_finite_numbers(capsys: pytest.CaptureFixture[str]) -> None:
    emit_json({"a": [1, 2.5]})
    emit_json({"a": [1, 2.5]}, compact=True)
    assert capsys.readouterr().out == '{"a": [1, 2.5]}\n{"a":[1,2.5]}\n'
    with pytest.raises(ValueError, match="JSON"):
        emit_json(float("nan"))


def test_a_name_in_a_table_is_no_markup(capsys: pytest.CaptureFixture[str]) -> None:
    made = table("name", "mm")
    made.add_row(*cells("[red]x[/red]\n", "1"))
    terminal().print(made)
    assert "[red]x[/red] " in capsys.readouterr().out
