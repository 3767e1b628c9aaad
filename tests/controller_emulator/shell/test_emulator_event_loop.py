"""Which event loop the emulator runs on: Python's own unless uvloop is asked for."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from openpendant.controller_emulator.shell.cli import USAGE, loop_factory, main
from openpendant.controller_emulator.shell.settings import load_settings


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
    asked: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "uvloop", None)
    file = tmp_path / "cell.toml"
    file.write_text('[emulator]\nevent_loop = "uvloop"\n')
    ways = {"argument": ["--event-loop", "uvloop"], "file": ["--config", str(file)]}
    assert main(ways[asked]) == USAGE
    said = "uvloop is not installed; the extra 'fast' of openpendant adds it"
    assert capsys.readouterr().err == f"openpendant emulate: {said}\n"


def test_a_loop_of_another_name_is_refused_with_those_there_are(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--event-loop", "libev"]) == USAGE
    said = "arguments: emulator.event_loop = 'libev': expected 'asyncio' or 'uvloop'"
    assert capsys.readouterr().err == f"openpendant emulate: {said}\n"


def test_a_cells_event_loop_is_the_servers_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "cell.toml"
    file.write_text('event_loop = "uvloop"\n')
    assert main(["--config", str(file), "--print-config"]) == 0
    assert 'event_loop = "asyncio"' in capsys.readouterr().out
