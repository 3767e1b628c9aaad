"""Settings, event loops, scenarios, logs and reports: what the emulator reads and leaves behind."""

import csv
import json
import os
import stat
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from openpendant.controller_emulator.shell.cli import USAGE, loop_factory, main
from openpendant.controller_emulator.shell.recording import MotionLog, write_report
from openpendant.controller_emulator.shell.scenario import (
    ScenarioPlayer,
    load_scenario,
)
from openpendant.controller_emulator.shell.settings import (
    EmulatorSettings,
    EmulatorSettingsError,
    as_toml,
    load_settings,
)
from openpendant.simplemsg.pendant import OperatorAction

Capture = pytest.CaptureFixture[str]


def written(folder: Path, text: str) -> Path:
    file = folder / "cell.toml"
    file.write_text(text, encoding="utf-8")
    return file


def test_arguments_go_before_the_file_and_the_file_before_the_defaults(tmp_path: Path) -> None:
    file = written(tmp_path, "[server]\nother = 1\n[emulator]\nrate = 50\nbuffer = 20\n")
    settings = load_settings(file, {"buffer": 30})
    assert (settings.rate, settings.buffer, settings.motion_port) == (50, 30, 12000)


@pytest.mark.parametrize(
    ("text", "robot"),
    [
        ("robot = 'puma560'\n", "puma560"),
        ("robot = 'puma560'\n[emulator]\nrobot = 'epson_c3'\n", "epson_c3"),
    ],
)
def test_the_cells_robot_is_taken_if_none_is_named(tmp_path: Path, text: str, robot: str) -> None:
    assert load_settings(written(tmp_path, text)).robot == robot


@pytest.mark.parametrize(
    ("text", "key", "value", "expected"),
    [
        ("[emulator]\nrobbot = 'ur5'\n", "emulator.robbot", "ur5", "one of robot, profile"),
        ("[emulator]\nrate = 0\n", "emulator.rate", 0, "greater than or equal to 1"),
        ("[emulator]\nstart = 'here'\n", "emulator.start", "here", "'home' or 'zero'"),
        ("emulator = 3\n", "emulator", 3, "a table"),
        ("[emulator\n", "file", None, "TOML"),
    ],
)
def test_a_wrong_setting_is_refused_with_file_key_and_expected_value(
    tmp_path: Path, text: str, key: str, value: object, expected: str
) -> None:
    file = written(tmp_path, text)
    with pytest.raises(EmulatorSettingsError) as caught:
        load_settings(file)
    error = caught.value
    assert error.file == str(file)
    assert error.key.startswith(key)
    assert value is None or error.value == value
    assert expected in error.expected
    assert "\n" not in str(error)


def test_a_missing_file_is_a_configuration_error(tmp_path: Path) -> None:
    with pytest.raises(EmulatorSettingsError, match="No such file"):
        load_settings(tmp_path / "none.toml")


def test_the_printed_settings_are_settings_again(tmp_path: Path) -> None:
    settings = EmulatorSettings(start=(0.0, 0.5), host="127.0.0.2", strict_sequence=False)
    assert load_settings(written(tmp_path, as_toml(settings))) == settings


def test_scenario_events_become_due_at_their_times_in_order(tmp_path: Path) -> None:
    text = "[[event]]\nat = 2.5\naction = 'reset'\n[[event]]\nat = 1\naction = 'emergency_stop'\n"
    player = ScenarioPlayer(load_scenario(written(tmp_path, text)), now=10_000_000_000)
    assert player.due(10_999_999_999) == []
    assert player.due(11_000_000_000) == [OperatorAction.EMERGENCY_STOP]
    assert player.due(12_499_999_999) == []
    assert player.due(20_000_000_000) == [OperatorAction.RESET]
    assert player.due(99_000_000_000) == []


@pytest.mark.parametrize(
    "text",
    [
        "[[event]]\nat = -1\naction = 'reset'\n",
        "[[event]]\nat = 1\naction = 'dance'\n",
        "x = 1\n",
    ],
)
def test_a_scenario_that_is_not_understood_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(EmulatorSettingsError, match="scenario"):
        load_scenario(written(tmp_path, text))


def test_the_motion_log_reads_back_exactly(tmp_path: Path) -> None:
    log = MotionLog(tmp_path / "log.csv", ("a", "b"))
    log.write(0.01, ((0.1, 0.2), (0.3, 0.4), (1 / 3, -0.0)))
    log.close()
    (row,) = csv.DictReader((tmp_path / "log.csv").read_text().splitlines())
    assert row["time"] == "0.010000"
    assert float(row["a.acceleration"]) == 1 / 3
    assert float(row["b.velocity"]) == 0.4


def test_a_report_replaces_the_old_one_and_leaves_nothing_else(tmp_path: Path) -> None:
    file = tmp_path / "report.json"
    file.write_text("old")
    write_report(file, {"violations": 0})
    assert json.loads(file.read_text()) == {"violations": 0}
    assert list(tmp_path.iterdir()) == [file]


def test_a_report_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file"):
        write_report(tmp_path / "none" / "report.json", {})


def test_a_report_to_a_symbolic_link_goes_where_the_link_points(tmp_path: Path) -> None:
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_text("old")
    link.symlink_to(target)
    write_report(link, {"violations": 0})
    assert link.is_symlink()
    assert json.loads(target.read_text()) == {"violations": 0}


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="there are no named pipes")
def test_a_report_to_a_pipe_goes_through_it(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    write_report(pipe, {"violations": 0})
    assert json.loads(os.read(reader, 1024)) == {"violations": 0}
    os.close(reader)
    assert stat.S_ISFIFO(pipe.lstat().st_mode)


def test_nobody_who_does_not_ask_gets_another_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "uvloop", None)
    assert loop_factory(load_settings().event_loop) is None


@pytest.mark.skipif(
    find_spec("uvloop") is None,
    reason="uvloop is not installed: the extra 'fast' of openpendant adds it",
)
def test_who_asks_for_uvloop_gets_a_loop_of_it() -> None:
    make_loop = loop_factory("uvloop")
    assert make_loop is not None
    loop = make_loop()
    loop.close()
    assert type(loop).__module__ == "uvloop"


@pytest.mark.parametrize("asked", ["argument", "file"])
def test_without_uvloop_the_extra_that_brings_it_is_named(
    asked: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capture
) -> None:
    monkeypatch.setitem(sys.modules, "uvloop", None)
    file = written(tmp_path, '[emulator]\nevent_loop = "uvloop"\n')
    ways = {"argument": ["--event-loop", "uvloop"], "file": ["--config", str(file)]}
    assert main(ways[asked]) == USAGE
    said = "uvloop is not installed; the extra 'fast' of openpendant adds it"
    assert capsys.readouterr().err == f"openpendant emulate: {said}\n"


def test_a_loop_of_another_name_is_refused_with_those_there_are(capsys: Capture) -> None:
    assert main(["--event-loop", "libev"]) == USAGE
    said = "arguments: emulator.event_loop = 'libev': expected 'asyncio' or 'uvloop'"
    assert capsys.readouterr().err == f"openpendant emulate: {said}\n"


def test_a_cells_event_loop_is_the_servers_own(tmp_path: Path, capsys: Capture) -> None:
    file = written(tmp_path, 'event_loop = "uvloop"\n')
    assert main(["--config", str(file), "--print-config"]) == 0
    assert 'event_loop = "asyncio"' in capsys.readouterr().out
