"""The command line: commands, errors in one line with an exit code, text of others."""

import argparse
import importlib
import json
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest
import typer

from openpendant.simplemsg import __version__
from openpendant.tools import cli
from openpendant.tools.cli import COMMANDS, Command, main
from openpendant.tools.console import (
    ExitCode,
    Faults,
    cells,
    clean_json,
    command,
    complain,
    emit_json,
    fail,
    json_text,
    one_line,
    run,
    run_alone,
    run_parsed,
    table,
    terminal,
)

FAKE = {"fake": Command("fake_command", "stand in for a sub-command")}

Install = Callable[[Callable[[list[str]], int]], None]


@pytest.fixture
def install(monkeypatch: pytest.MonkeyPatch) -> Install:
    """Make `openpendant fake` call the given function."""

    def put(function: Callable[[list[str]], int]) -> None:
        module = ModuleType("fake_command")
        module.__dict__["main"] = function
        monkeypatch.setitem(sys.modules, "fake_command", module)

    return put


def raiser(error: BaseException) -> Callable[[list[str]], int]:
    def run(argv: list[str]) -> int:
        raise error

    return run


def test_help_lists_every_command(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == ExitCode.OK
    shown = capsys.readouterr().out
    for name, each in COMMANDS.items():
        assert f"  {name} " in shown
        assert each.help in shown


def test_no_command_shows_the_help_on_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == ExitCode.USAGE
    assert "Commands:" in capsys.readouterr().err


def test_version_is_that_of_the_loaded_code(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == ExitCode.OK
    assert capsys.readouterr().out == f"openpendant {__version__}\n"


@pytest.mark.parametrize(
    ("argument", "hint"),
    [
        ("sevre", "unknown command 'sevre'; did you mean 'serve'?"),
        ("zzz", f"unknown command 'zzz'; known: {', '.join(COMMANDS)}"),
        ("--hlep", "unknown option '--hlep'; did you mean '--help'?"),
    ],
)
def test_an_unknown_word_is_refused_with_a_hint(
    argument: str, hint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([argument]) == ExitCode.USAGE
    assert capsys.readouterr().err == f"openpendant: {hint}\n"


def test_a_command_gets_the_rest_of_the_line_and_gives_the_exit_code(install: Install) -> None:
    got: list[list[str]] = []

    def run(argv: list[str]) -> int:
        got.append(argv)
        return 7

    install(run)
    assert main(["fake", "--robot", "ur5"], commands=FAKE) == 7
    assert got == [["--robot", "ur5"]]


@pytest.mark.parametrize(
    ("library", "extra"),
    [
        ("pinocchio", "[server]"),
        ("toppra.algorithm", "[server]"),
        ("matplotlib", "[plot]"),
        ("textual.app", "[terminal]"),
        ("uvloop", "[fast]"),
        ("pydantic", ""),
    ],
)
@pytest.mark.parametrize(
    ("checkout", "source"), [(Path("/a/b c"), "-e '/a/b c{}'"), (None, "'WHEEL{}', where WHEEL is")]
)
def test_a_missing_library_is_answered_with_what_to_install(
    library: str,
    extra: str,
    checkout: Path | None,
    source: str,
    monkeypatch: pytest.MonkeyPatch,
    install: Install,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr(cli, "CHECKOUT", checkout)
    install(raiser(ModuleNotFoundError(f"No module named {library!r}", name=library)))
    assert main(["fake"], commands=FAKE) == ExitCode.UNAVAILABLE
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert f"{sys.executable} -m pip install {source.format(extra)}" in error


def test_a_checkout_is_known_as_where_missing_libraries_come_from() -> None:
    assert cli.CHECKOUT == Path(__file__).parents[2]


def test_a_missing_library_is_found_on_import_too(capsys: pytest.CaptureFixture[str]) -> None:
    absent = {"fake": Command("no_such_library.cli", "is not there")}
    assert main(["fake"], commands=absent) == ExitCode.UNAVAILABLE
    assert "no_such_library" in capsys.readouterr().err


def test_a_missing_module_of_ours_is_a_fault_and_no_missing_extra(
    capsys: pytest.CaptureFixture[str],
) -> None:
    absent = {"fake": Command("openpendant.no_such_room", "is not there")}
    assert main(["fake"], commands=absent) == ExitCode.INTERNAL_ERROR
    assert "pip install" not in capsys.readouterr().err


def test_an_unforeseen_error_is_one_line(
    install: Install, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENPENDANT_TRACEBACK", raising=False)
    install(raiser(ZeroDivisionError("division by zero")))
    assert main(["fake"], commands=FAKE) == ExitCode.INTERNAL_ERROR
    error = capsys.readouterr().err
    assert error.startswith("openpendant: internal error: ZeroDivisionError: division by zero")
    assert error.count("\n") == 1


def test_an_unforeseen_error_shows_its_traceback_on_request(
    install: Install, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPENPENDANT_TRACEBACK", "1")
    install(raiser(ZeroDivisionError()))
    with pytest.raises(ZeroDivisionError):
        main(["fake"], commands=FAKE)


def test_an_interrupt_ends_with_the_exit_code_of_the_shells(install: Install) -> None:
    install(raiser(KeyboardInterrupt()))
    assert main(["fake"], commands=FAKE) == 128 + signal.SIGINT


@pytest.mark.parametrize("ending", ["return 0", "sys.exit(0)"])
def test_a_closed_pipe_ends_without_a_word(ending: str) -> None:
    script = (
        "import sys, types; from openpendant.tools import cli\n"
        "def talk(argv):\n"
        "    sys.stdin.read()  # until the reader of our output is gone\n"
        "    print('too late')\n"
        f"    {ending}\n"
        "sys.modules['talker'] = types.SimpleNamespace(main=talk)\n"
        "sys.exit(cli.main(['x'], commands={'x': cli.Command('talker', '')}))\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        process.stdin.close()
        assert process.stderr.read() == b""
    assert process.returncode == ExitCode.PIPE_CLOSED


def test_the_package_runs_as_the_command() -> None:
    ran = subprocess.run(
        [sys.executable, "-m", "openpendant.tools", "--version"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert ran.stdout == f"openpendant {__version__}\n"


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_of_the_table_has_a_main(name: str) -> None:
    assert callable(importlib.import_module(COMMANDS[name].module).main)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_an_output_that_cannot_be_written_is_one_line_and_an_exit_code() -> None:
    with Path("/dev/full").open("w") as full:
        command = [sys.executable, "-m", "openpendant.tools", "--version"]
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == ExitCode.OUTPUT_FAILED
    assert done.stderr == (
        "openpendant: cannot write to standard output: No space left on device\n"
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
        ("\x9b31m", None, "\\x9b31m"),
        ("\x7f", None, "\\x7f"),
        ("\u2028next", None, "\\u2028next"),
        ("half\udcff", None, "half\\udcff"),
        ("ann\u200b", None, "ann\\u200b"),
        ("ann\u3164", None, "ann\\u3164"),
        ("ann\ufe00", "?", "ann?"),
        ("a" + 6 * "\u0301", "?", "a" + 4 * "\u0301" + "??"),
        ("naïve, ñandú, 中文, Ω", None, "naïve, ñandú, 中文, Ω"),
    ],
)
def test_text_of_others_commands_no_terminal(text: str, mark: str | None, shown: str) -> None:
    assert one_line(text, mark) == shown
    assert one_line(shown, mark) == shown


def test_a_text_of_others_that_is_too_long_is_cut_and_says_so() -> None:
    assert one_line(4_000 * "x") == 4_000 * "x"
    assert one_line(4_001 * "x") == f"{4_000 * 'x'}… (1 signs more)"
    assert one_line("abcdef\x1b", longest=3) == "abc… (4 signs more)"


def test_no_complaint_commands_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    complain("a peer said: \x1b[2J\u202e\r\nall is well")
    assert capsys.readouterr().err == "a peer said: \\x1b[2J\\u202e\\r\\nall is well\n"


def test_json_for_people_says_the_same_and_commands_no_terminal() -> None:
    value = {"é\x9b": ["\u202e", "\x7f", "\u3164", "\U000e0041", "\x1b[2J\n", 1.5, None]}
    for shown in (json_text(value), json_text(value, indent=2)):
        assert json.loads(shown) == value
        assert all(line.isprintable() and "\u3164" not in line for line in shown.split("\n"))
        assert "é" in shown
    assert clean_json('{"a": "\x7f"}') == '{"a": "\\u007f"}'


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
