"""Which late ticks are logged, and what is said of what held the loop (promise 26)."""

from __future__ import annotations

import pytest
from promises.promise_table import figure

from openpendant.server.shell.loop_timing import LoopLog, event_text
from openpendant.simplemsg import PENDANT, ByteOrder, codec_for
from openpendant.simplemsg.journal import Gap, Journal
from openpendant.simplemsg.pendant import JogBeat

MS = 1_000_000
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


def test_the_journal_knows_what_the_longest_time_began_with() -> None:
    clock = iter([5, 6, 16, 19, 20, 100])
    journal = Journal(lambda: next(clock))
    journal.begin("tick")
    journal.begin("in", 4, b"first")
    journal.begin("in", 5, b"second")
    journal.begin("tick")
    assert journal.longest_gap() == Gap(10, "in", 4, b"first")
    journal.begin("planned", "9")
    assert journal.longest_gap() == Gap(1, "tick")
    journal.begin("tick")
    assert journal.longest_gap() == Gap(80, "planned", "9")
