"""Arguments and settings of the keypad's commands: what is taken, and the words for the rest."""

import os
from pathlib import Path

import pytest

from openpendant.tools.pendants.keypad import cli, emulator_cli
from openpendant.tools.pendants.keypad.keypad import EnablingSource
from openpendant.tools.pendants.keypad.settings import settings_of
from openpendant.tools.pendants.settings_file import SettingsRefused

EXAMPLE = """
[keypad]
port = "/dev/ttyACM0"
baud = 9600
server = "192.168.1.20"
deadline = 0.2
debounce_ms = 8
enabling = "button"
characters = true
"""


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "keypad.toml"


def test_a_file_sets_all_and_the_command_line_goes_before_it(file: Path) -> None:
    file.write_text(EXAMPLE)
    settings = settings_of(file, {"port": None, "baud": 115_200})
    assert settings.port == "/dev/ttyACM0"
    assert (settings.baud, settings.deadline, settings.debounce_ms) == (115_200, 0.2, 8)
    assert (settings.enabling, settings.characters) == (EnablingSource.BUTTON, True)


def test_without_a_file_the_usual_values_hold() -> None:
    settings = settings_of(None, {})
    assert (settings.baud, settings.deadline, settings.enabling) == (115_200, 0.15, "key")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[keypad]\nbaud = 300", "baud: Value error, accepted: 9600, 19200"),
        ("[keypad]\ndeadline = 0.3", "deadline: "),
        ("[keypad]\ndebounce_ms = 4", "debounce_ms: "),
        ('[keypad]\nenabling = "foot"', "enabling: "),
        ("[keypad]\nports = 1", "ports: Extra inputs"),
        ("[pendant]\n", "pendant; accepted: one table [keypad]"),
        ("[keypad", "keypad.toml: "),
    ],
)
def test_what_cannot_be_used_is_named_with_what_would_be(file: Path, text: str, told: str) -> None:
    file.write_text(text)
    with pytest.raises(SettingsRefused, match=r"keypad\.toml") as refused:
        settings_of(file, {})
    assert told in str(refused.value)


def test_a_pipe_in_the_place_of_the_file_is_refused_and_not_waited_for(tmp_path: Path) -> None:
    pipe = tmp_path / "keypad.toml"
    os.mkfifo(pipe)
    with pytest.raises(SettingsRefused, match="is not a regular file"):
        settings_of(pipe, {})


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ([], "which port? Name it with --port (seen: "),
        (["--port", "tcp://a"], "is no port; accepted: "),
        (["--port", "socket://a:1", "--take-control"], "--take-control goes with --characters"),
        (["--port", "socket://a:1", "--baud", "1"], "baud: "),
        (["--port", "socket://a:1", "--server", "a:b"], "server: "),
        (["--config", "absent.toml"], "absent.toml: cannot be read: No such file"),
    ],
)
def test_wrong_usage_of_the_bridge_is_one_line(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(arguments) == 2
    said = capsys.readouterr().err
    assert told in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--commands", "--baud", "1"], "1 baud; accepted: 9600"),
        (["--commands", "--link", "x", "--listen", "0"], "choose one"),
        ([], "this is no terminal; --commands takes keys from a program"),
    ],
)
def test_wrong_usage_of_the_emulator_is_one_line(
    arguments: list[str], told: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert emulator_cli.main(arguments) == 2
    said = capsys.readouterr().err
    assert told in said
    assert said.count("\n") == 1
