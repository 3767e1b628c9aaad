"""Which late ticks are logged, and what is said of what held the loop (promise 26)."""

import logging
import os
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from promises.promise_table import figure
from rigs.cells.expectations import known
from rigs.cells.server_rig import MS

from openpendant.server.cli.serve import main
from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.shell.loop_timing import Gap, LoopLog, event_text, next_deadline
from openpendant.server.shell.server_process import asked_niceness, loop_factory
from openpendant.simplemsg import PENDANT, ByteOrder, codec_for
from openpendant.simplemsg.pendant import JogBeat
from openpendant.tools.console import ExitCode


def test_nobody_who_does_not_ask_gets_another_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "uvloop", None)
    assert loop_factory(make_settings({}, "test").event_loop) is None


@pytest.mark.skipif(
    find_spec("uvloop") is None,
    reason="uvloop is not installed: the extra 'fast' of openpendant adds it",
)
def test_who_asks_for_uvloop_gets_a_loop_of_it() -> None:
    make_loop = known(loop_factory("uvloop"))
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


TICK = Gap(0, "tick")


def log() -> LoopLog:
    return LoopLog(10 * MS)


def test_promise_26_a_lag_above_30_ms_is_logged_and_a_smaller_one_is_not() -> None:
    lags = log()
    assert lags.tick(0, 0, TICK) == ""
    at = 10 * MS + figure(26, "logged").ns
    assert lags.tick(at, 0, TICK) == ""
    assert "31 ms" in lags.tick(2 * at + MS, 0, TICK)


def test_many_lags_are_one_line_a_second() -> None:
    lags = log()
    lines = [lags.tick(at * 50 * MS, 0, TICK) for at in range(100)]
    told = [line for line in lines if line]
    assert 4 <= len(told) <= 6
    assert "20 times" in told[1]


@pytest.mark.parametrize(
    ("computed", "words"),
    [(80, "the server computed (80 ms of processor time in 95 ms)"), (3, "the machine was busy")],
)
def test_a_server_that_computed_is_told_from_a_machine_that_was_busy(
    computed: int, words: str
) -> None:
    lags = log()
    lags.tick(0, 7 * MS, TICK)
    line = lags.tick(95 * MS, (7 + computed) * MS, Gap(88 * MS, "planned", "12"))
    assert "by 85 ms" in line
    assert "88 ms went by behind an answer of the planning process of 12" in line
    assert words in line


@pytest.mark.parametrize("order", ByteOrder)
def test_of_bytes_the_type_of_the_first_frame_is_named(order: ByteOrder) -> None:
    frame = codec_for(PENDANT, order).encode(JogBeat(1, 2))
    expected = f"bytes of 3, the first of type {JogBeat.PLACE.msg_type}"
    assert event_text(Gap(1, "in", 3, frame)) == expected
    assert event_text(Gap(1, "in", "state", frame[:6])) == "bytes of state"
    assert event_text(Gap(1, "in", "state", bytes(20))) == "bytes of state"


@pytest.mark.parametrize(("event", "words"), [("stored", "an answer of the store"), ("up", "'up'")])
def test_other_events_have_their_names(event: str, words: str) -> None:
    assert event_text(Gap(1, event)) == words


class Scheduler:
    def __init__(self, lowest: int) -> None:
        self.niceness, self._lowest = 3, lowest

    def get(self, which: int, process: int) -> int:
        assert (which, process) == (os.PRIO_PROCESS, 0)
        return self.niceness

    def set(self, which: int, process: int, niceness: int) -> None:
        assert (which, process) == (os.PRIO_PROCESS, 0)
        if niceness < min(self.niceness, self._lowest):
            raise PermissionError
        self.niceness = niceness


def scheduler(monkeypatch: pytest.MonkeyPatch, lowest: int) -> Scheduler:
    made = Scheduler(lowest)
    monkeypatch.setattr(os, "getpriority", made.get)
    monkeypatch.setattr(os, "setpriority", made.set)
    return made


def test_the_niceness_holds_while_the_server_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    system = scheduler(monkeypatch, lowest=-20)
    with asked_niceness(-10):
        assert system.niceness == -10
    assert system.niceness == 3


def test_a_denied_niceness_is_logged_with_what_stays(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    system = scheduler(monkeypatch, lowest=0)
    with caplog.at_level(logging.INFO), asked_niceness(-10):
        assert system.niceness == 3
    assert caplog.messages == ["the system does not allow niceness -10; it stays at 3"]


def test_a_server_that_is_to_run_last_stays_last(monkeypatch: pytest.MonkeyPatch) -> None:
    system = scheduler(monkeypatch, lowest=0)
    with asked_niceness(19):
        assert system.niceness == 19
    assert system.niceness == 19


PERIOD = 0.5


@pytest.mark.parametrize(
    ("took", "due", "left_out"),
    [
        pytest.param(-0.0625, 0.5, 0, id="a timer that rang early: no second tick for it"),
        pytest.param(0.0, 0.5, 0, id="a short tick"),
        pytest.param(0.4375, 0.5, 0, id="nearly a period"),
        pytest.param(0.5, 0.5, 0, id="a period"),
        pytest.param(0.625, 0.5, 0, id="a little more than a period: caught up at once"),
        pytest.param(0.9375, 0.5, 0, id="nearly two periods: caught up at once"),
        pytest.param(1.0, 1.0, 1, id="two periods: one is left out"),
        pytest.param(2.25, 2.0, 3, id="a freeze: of four the last is made"),
    ],
)
def test_the_next_tick_is_due(took: float, due: float, left_out: int) -> None:
    last = 64.0
    assert next_deadline(last, last + took, PERIOD) == (last + due, left_out)


def test_lateness_does_not_add_up() -> None:
    due = start = 64.0
    for _ in range(100):
        due, left_out = next_deadline(due, due + PERIOD / 8, PERIOD)
        assert left_out == 0
    assert due == start + 100 * PERIOD
