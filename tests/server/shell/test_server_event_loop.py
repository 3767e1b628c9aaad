from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from openpendant.server.cli.serve import main
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.shell.server_process import loop_factory
from openpendant.tools.console import ExitCode


def test_nobody_who_does_not_ask_gets_another_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "uvloop", None)
    assert loop_factory(make_settings({}, "test").event_loop) is None


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
    asked: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "uvloop", None)
    file = tmp_path / "cell.toml"
    file.write_text('event_loop = "uvloop"\n')
    ways = {"argument": ["--event-loop", "uvloop"], "file": ["--config", str(file)]}
    assert main(ways[asked]) == ExitCode.USAGE
    said = "uvloop is not installed; the extra 'fast' of openpendant adds it"
    assert capsys.readouterr().err == f"openpendant serve: {said}\n"


def test_a_loop_of_another_name_is_refused_with_those_there_are(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--event-loop", "libev"]) == ExitCode.USAGE
    said = "arguments: event_loop: Input should be 'asyncio' or 'uvloop'; got 'libev'"
    assert capsys.readouterr().err == f"openpendant serve: {said}\n"


def test_the_argument_goes_before_the_file_and_is_one_of_all_cells(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "room.toml"
    file.write_text('event_loop = "uvloop"\n[[cells]]\nname = "a"\n')
    assert main(["--config", str(file), "--event-loop", "asyncio", "--print-config"]) == 0
    assert 'event_loop = "asyncio"\n' in capsys.readouterr().out
    file.write_text('[[cells]]\nname = "a"\nevent_loop = "uvloop"\n')
    assert main(["--config", str(file)]) == ExitCode.USAGE
    assert "event_loop of cell 'a': unknown key" in capsys.readouterr().err


def test_the_help_says_what_there_is_to_choose_from(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    told = capsys.readouterr().out
    assert "--event-loop" in told
    assert "asyncio or on uvloop" in " ".join(told.split())
