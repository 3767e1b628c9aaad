"""Hold-to-run as pure rules: presses, beats, deadlines (promise 1)."""

from __future__ import annotations

import math
import random

import pytest

from openpendant.server.cell.execution.setpoint_sources import (
    LONGEST_DEADLINE,
    SHORTEST_DEADLINE,
    Press,
    PressCounter,
)
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant import JogEnd
from openpendant.simplemsg.verdicts import VerdictCode as V

MS = 1_000_000
SEQUENCES = 10_000


def begun(session: int = 1, number: int = 1, deadline: float = 0.15, now: int = 0) -> Press:
    press = PressCounter().begin(session, number, deadline, now)
    assert isinstance(press, Press)
    return press


@pytest.mark.parametrize("deadline", [0.049, 0.2501, 0.0, -1.0, math.nan, math.inf])
def test_a_deadline_outside_50_to_250_ms_is_refused(deadline: float) -> None:
    refusal = PressCounter().begin(1, 1, deadline, 0)
    assert isinstance(refusal, Refusal)
    assert refusal.code is V.BAD_ARGUMENT


@pytest.mark.parametrize("deadline", [SHORTEST_DEADLINE, LONGEST_DEADLINE])
def test_the_bounds_themselves_are_accepted(deadline: float) -> None:
    assert begun(deadline=deadline).deadline_ns == round(deadline * 1e9)


@pytest.mark.parametrize("number", [7, 6, 1, 0, -3])
def test_a_number_that_is_not_higher_than_all_before_is_dead(number: int) -> None:
    counter = PressCounter()
    assert isinstance(counter.begin(1, 7, 0.15, 0), Press)
    refusal = counter.begin(1, number, 0.15, 0)
    assert isinstance(refusal, Refusal)
    assert refusal.code is V.PRESS_DEAD


def test_each_connection_counts_for_itself() -> None:
    counter = PressCounter()
    counter.begin(1, 7, 0.15, 0)
    assert isinstance(counter.begin(2, 1, 0.15, 0), Press)


@pytest.mark.parametrize(
    ("session", "number", "beat"),
    [(2, 1, 2), (1, 2, 2), (1, 0, 2), (1, 1, 1), (1, 1, 0), (1, 1, -5)],
    ids=[
        "another connection",
        "another press",
        "an old press",
        "replayed",
        "reordered",
        "negative",
    ],
)
def test_a_beat_that_is_not_the_next_one_of_this_press_prolongs_nothing(
    session: int, number: int, beat: int
) -> None:
    press = begun()
    press.take_beat(1, 1, 1, 100 * MS)
    press.take_beat(session, number, beat, 150 * MS)
    assert press.heard == 100 * MS


def test_a_beat_may_be_lost_without_harm() -> None:
    press = begun()
    press.take_beat(1, 1, 5, 100 * MS)
    assert press.heard == 100 * MS


def test_a_beat_at_the_deadline_comes_too_late() -> None:
    press = begun()
    press.take_beat(1, 1, 1, 150 * MS)
    assert press.heard == 0
    assert press.is_overdue(150 * MS)
    assert not press.is_overdue(150 * MS - 1)


def test_a_dead_press_takes_no_beats_and_keeps_its_first_reason() -> None:
    press = begun()
    press.end(JogEnd.RELEASED, 20 * MS)
    press.end(JogEnd.SILENT, 30 * MS)
    press.take_beat(1, 1, 1, 40 * MS)
    assert (press.ended, press.ended_at, press.heard) == (JogEnd.RELEASED, 20 * MS, 0)


def test_promise_1_no_press_outlives_its_deadline_whatever_comes_in_between() -> None:
    chance = random.Random(1)
    for _ in range(SEQUENCES):
        deadline_ns = chance.randrange(50, 251) * MS
        press = begun(deadline=deadline_ns / 1e9)
        valid, number, now = 0, 0, 0
        for _ in range(12):
            now += chance.randrange(1, 2 * deadline_ns // 3 if chance.random() < 0.8 else 300 * MS)
            alive = now - valid < deadline_ns
            session = chance.choice((1, 1, 1, 2))
            pressed = chance.choice((1, 1, 1, 0, 2))
            beat = number + chance.choice((1, 1, 1, 2, 0, -1))
            press.take_beat(session, pressed, beat, now)
            if alive and (session, pressed) == (1, 1) and beat > number:
                valid, number = now, beat
            assert press.is_overdue(now) == (now - valid >= deadline_ns)
            if press.is_overdue(now):
                break
