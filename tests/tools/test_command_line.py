import importlib
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import pytest

from openpendant.simplemsg import __version__
from openpendant.tools import cli
from openpendant.tools.cli import COMMANDS, Command, main
from openpendant.tools.console import ExitCode

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
    for name, command in COMMANDS.items():
        assert f"  {name} " in shown
        assert command.help in shown


def test_no_command_shows_the_help_on_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == ExitCode.USAGE
    assert "commands:" in capsys.readouterr().err


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
