"""`openpendant pendant`: arguments, places where it cannot run, exit codes."""

import importlib
import io
import sys

import pytest

from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.cli import main as openpendant
from openpendant.tools.console import ExitCode
from openpendant.tools.pendants.client import PendantClient, PendantError, Refused, WrongArgument
from openpendant.tools.pendants.connection_errors import server_address
from openpendant.tools.pendants.panel.keyboard import STOP_KEY
from openpendant.tools.pendants.panel.panel import Panel
from openpendant.tools.pendants.panel.stop_key import REMEDY
from openpendant.tools.pendants.terminal import cli
from openpendant.tools.pendants.terminal.cli import main


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("robot", ("robot", 11010)),
        ("robot:12", ("robot", 12)),
        ("[::1]:12", ("::1", 12)),
        ("[::1]", ("::1", 11010)),
        ("::1", ("::1", 11010)),
    ],
)
def test_the_server_is_a_host_and_maybe_a_port(text: str, address: tuple[str, int]) -> None:
    assert server_address(text) == address


@pytest.mark.parametrize("text", ["", ":12", "robot:", "robot:0", "robot:65536", "robot:x", "[]:1"])
def test_what_is_no_server_is_refused(text: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([text]) == ExitCode.USAGE
    error = capsys.readouterr().err
    assert "accepted: HOST or HOST:PORT" in error
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ([], "this is no terminal; --plain"),
        (["--speed", "7"], "--speed"),
        (["--plain", "--ca", "/nowhere/none.pem"], "none.pem"),
    ],
)
def test_what_it_cannot_run_with_is_wrong_usage_and_named(
    arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == ExitCode.USAGE
    assert said in capsys.readouterr().err


def test_a_server_that_is_not_there_is_one_line_and_no_traceback(
    capsys: pytest.CaptureFixture[str], unused_tcp_port: int
) -> None:
    assert main([f"127.0.0.1:{unused_tcp_port}", "--plain"]) == ExitCode.FAILED
    assert capsys.readouterr().err.count("\n") == 1


@pytest.mark.parametrize(
    ("failure", "code", "text"),
    [
        (
            Refused(VerdictCode.UNKNOWN_CELL, "name a cell; here: left, right", -1, 0.0, 0.0),
            ExitCode.USAGE,
            "name a cell; here: left, right; choose one: --cell NAME",
        ),
        (
            Refused(VerdictCode.LOGIN_FAILED, "wrong name or password", -1, 0.0, 0.0),
            ExitCode.FAILED,
            "LOGIN_FAILED: wrong name or password -> ",
        ),
        (WrongArgument("the name is too long"), ExitCode.USAGE, "the name is too long"),
    ],
)
def test_a_server_that_does_not_want_us_is_one_line_with_what_to_change(
    failure: PendantError,
    code: int,
    text: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async def connect(*_: object, **__: object) -> PendantClient:
        raise failure

    monkeypatch.setattr(PendantClient, "connect", connect)
    assert main(["--plain"]) == code
    error = capsys.readouterr().err
    assert error.startswith(f"openpendant pendant: {text}")
    assert error.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "typed", "name"),
    [
        ([], "kim\n", "kim"),
        ([], "\n", "terminal"),
        (["--name", "bench-2"], None, "bench-2"),
        (["--user", "lee"], None, "lee"),
    ],
)
def test_a_guest_is_asked_for_a_name_that_no_option_says(
    arguments: list[str],
    typed: str | None,
    name: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return typed is not None

    shown: list[tuple[str, object]] = []

    class Guest(PendantClient):
        async def login(
            self, user: str, *, password: str | None = None, pairing: str | None = None
        ) -> None:
            assert password is None
            shown.append((user, pairing))
            raise WrongArgument("seen enough")

    async def connect(*_: object, **given: object) -> PendantClient:
        assert not {"user", "password", "pairing"} & given.keys()
        guest = Guest()
        guest.abort()
        return guest

    monkeypatch.setattr(PendantClient, "connect", connect)
    monkeypatch.setattr("getpass.getpass", lambda _: "ABC234")
    monkeypatch.setattr(sys, "stdin", Terminal(typed or ""))
    main(["--plain", "--pairing", *arguments])
    assert shown == [(name, "ABC234")]
    assert ("Your name" in capsys.readouterr().err) == (typed is not None)


def test_a_pairing_code_that_nobody_types_is_in_no_variable(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def nobody(_: str) -> str:
        raise EOFError

    monkeypatch.setattr("getpass.getpass", nobody)
    assert main(["--plain", "--pairing"]) == ExitCode.USAGE
    error = capfd.readouterr().err
    assert "nobody typed a pairing code" in error
    assert "OPENPENDANT_PASSWORD" not in error
    assert error.count("\n") == 1


def test_without_textual_it_says_what_to_install(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    def absent(name: str, package: str | None = None) -> object:
        if name == "textual":
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)
        return real(name, package)

    real = importlib.import_module
    errors = Terminal()
    monkeypatch.setattr(importlib, "import_module", absent)
    for stream in ("stdin", "stdout"):
        monkeypatch.setattr(sys, stream, Terminal())
    monkeypatch.setattr(sys, "stderr", errors)
    assert openpendant(["pendant"]) == ExitCode.UNAVAILABLE
    assert "-m pip install -e '" in errors.getvalue()
    assert "[terminal]'" in errors.getvalue()
    assert errors.getvalue().count("\n") == 1


@pytest.mark.parametrize(
    ("gave_up", "text"),
    [
        (None, f"it was left before its stop was confirmed: {REMEDY}"),
        (WrongArgument("no"), f"it ended before its stop was confirmed: {REMEDY} (no)"),
    ],
)
def test_a_stop_that_is_owed_at_the_end_is_told_before_why_it_ended(
    gave_up: PendantError | None,
    text: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Left:
        def __init__(self, *_: object) -> None:
            self.panel = Panel()

        def run(self, *, mouse: bool) -> PendantError | None:
            self.panel.key(STOP_KEY, 0)
            return gave_up

    for number, stream in enumerate((sys.stdin, sys.stdout, sys.stderr)):
        monkeypatch.setattr(stream, "isatty", lambda: True)
        monkeypatch.setattr(stream, "fileno", lambda number=number: number)
    monkeypatch.setattr("openpendant.tools.pendants.terminal.app.PendantApp", Left)
    monkeypatch.setattr(cli, "end_with_terminal", lambda _: None)
    assert main([]) == ExitCode.FAILED
    assert capsys.readouterr().err == f"openpendant pendant: {text}\n"
