"""`openpendant stop`, `reset`, `home` and `run`: what they are told, and where nobody answers."""

import json
import socket
from collections.abc import Callable

import pytest

from openpendant.tools.pendants.commands import home, reset, run, stop

Main = Callable[[list[str]], int]

COMMANDS: dict[str, tuple[Main, list[str]]] = {
    "stop": (stop.main, []),
    "reset": (reset.main, ["--yes"]),
    "home": (home.main, []),
    "run": (run.main, ["cutting"]),
}


@pytest.fixture
def nobody() -> list[str]:
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    return ["--server", f"127.0.0.1:{port}"]


@pytest.mark.parametrize("name", COMMANDS)
def test_nobody_there_is_a_sentence_and_exit_code_69(
    name: str, nobody: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    main, more = COMMANDS[name]
    assert main([*more, *nobody]) == 69
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith(f"openpendant {name}: nobody listens at 127.0.0.1:")


def test_a_stop_that_reached_nobody_names_the_emergency_stop(
    nobody: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    stop.main(nobody)
    assert "use the controller's own emergency stop" in capsys.readouterr().err


@pytest.mark.parametrize("name", COMMANDS)
def test_json_tells_a_failure_as_one_object(
    name: str, nobody: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    main, more = COMMANDS[name]
    main([*more, *nobody, "--json"])
    assert json.loads(capsys.readouterr().out)["event"] == "unavailable"


NO_SERVERS = ("127.0.0.1:0", ":11010", "host:port", "host:65536")
NO_SPEEDS = ("0", "1.01", "-0.1", "nan", "fast")


@pytest.mark.parametrize(
    ("name", "option", "wrong"),
    [
        *((name, "--server", wrong) for name in COMMANDS for wrong in NO_SERVERS),
        *((name, "--speed", wrong) for name in ("home", "run") for wrong in NO_SPEEDS),
        ("stop", "--user", "otto"),
    ],
)
def test_what_is_no_server_no_speed_or_no_option_is_wrong_usage(
    name: str, option: str, wrong: str
) -> None:
    main, more = COMMANDS[name]
    with pytest.raises(SystemExit) as ended:
        main([*more, option, wrong])
    assert ended.value.code == 2
