from __future__ import annotations

import pytest
from rigs.cells.program_rig import ProgramRig

from openpendant.server.programs.interpreter.run_events import Pause, Resume

LIMITED = "wait input 3 on timeout {limit} s\nset output 1 on"


@pytest.mark.parametrize("limit", [0, 0.02])
def test_a_limit_waits_for_the_answer_to_a_question_that_was_just_asked(limit: float) -> None:
    rig = ProgramRig(LIMITED.format(limit=limit))
    assert rig.start() == ["ask 3"]
    assert rig.after(limit) == []
    assert rig.value(True) == ["output 1 on"]


def test_a_limit_of_nothing_fails_at_the_first_tick_behind_a_wrong_answer() -> None:
    rig = ProgramRig(LIMITED.format(limit=0))
    rig.start()
    assert rig.value(False) == []
    assert rig.after(0.0) == ["failed INPUT_TIMEOUT"]


def test_a_limit_waits_for_the_answer_to_every_question() -> None:
    rig = ProgramRig(LIMITED.format(limit=1))
    rig.start()
    rig.value(False)
    assert rig.after(0.99) == ["ask 3"]
    assert rig.after(0.01) == []
    assert rig.value(True) == ["output 1 on"]


def test_a_question_that_nobody_answers_does_not_hold_a_run_for_ever() -> None:
    rig = ProgramRig(LIMITED.format(limit=0))
    rig.start()
    assert rig.after(0.049) == []
    assert rig.after(0.001) == ["failed INPUT_TIMEOUT"]


def test_a_pause_holds_the_time_that_an_answer_may_take() -> None:
    rig = ProgramRig(LIMITED.format(limit=0))
    rig.start()
    rig.do(Pause())
    assert rig.after(10.0) == []
    rig.do(Resume())
    assert rig.after(0.01) == []
    assert rig.value(True) == ["output 1 on"]
