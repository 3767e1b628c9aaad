from __future__ import annotations

import pytest
from rigs.cells.program_rig import ProgramRig

from openpendant.server.programs.interpreter.run_events import (
    EventRefused,
    Passed,
    Pause,
    PauseReason,
    QueryInput,
    Resume,
    RunState,
    StepBack,
    StepForward,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

MOVES = "move PTP a\nmove PTP b\nmove PTP c\nmove PTP a"
JOINED = "move PTP a\nmove PTP b zone 1 deg\nmove PTP c zone 1 deg\nmove PTP a\nmove PTP b"


def answer(rig: ProgramRig) -> list[str]:
    return rig.value(True) if isinstance(rig.actions[-1], QueryInput) else rig.done()


@pytest.mark.parametrize(
    "statement",
    [
        "move PTP b",
        "set output 1 on",
        "attach part",
        "read input 1 into ok",
        "if input 1 on\nend",
        "wait input 1 on",
    ],
)
def test_a_step_that_ends_in_a_pause_is_a_step_that_is_done(statement: str) -> None:
    rig = ProgramRig(f"wait 0 s\n{statement}\nset output 9 on")
    rig.start(step=True)
    rig.after(0.0)
    rig.do(StepForward())
    rig.do(Pause())
    assert answer(rig) == []
    assert rig.runner.status.state is RunState.PAUSED
    assert rig.runner.status.pause is PauseReason.STEP
    assert not rig.runner.is_stepping


def test_a_step_back_that_ends_in_a_pause_is_a_step_that_is_done() -> None:
    rig = ProgramRig(MOVES)
    rig.start(step=True)
    rig.done()
    rig.do(StepForward())
    rig.done()
    rig.do(StepBack())
    rig.do(Pause())
    assert rig.done() == []
    assert rig.runner.status.pause is PauseReason.STEP
    assert not rig.runner.is_stepping
    assert rig.here == [("main", 1)]


def test_a_pause_of_a_whole_run_that_ends_its_move_stays_a_pause() -> None:
    rig = ProgramRig(MOVES)
    rig.start()
    rig.do(Pause())
    rig.done()
    assert rig.runner.status.pause is PauseReason.REQUEST


def test_a_step_to_the_end_that_was_paused_ends_the_run_when_it_goes_on() -> None:
    rig = ProgramRig("set output 1 on")
    rig.start(step=True)
    rig.do(Pause())
    assert rig.done() == []
    assert rig.runner.is_stepping
    assert rig.do(StepForward()) == ["finished"]


@pytest.mark.parametrize("event", [Resume(), StepForward(), StepBack()])
def test_a_run_steps_from_the_request_to_the_end_of_the_step(
    event: Resume | StepForward | StepBack,
) -> None:
    rig = ProgramRig(MOVES)
    seen = [rig.runner.is_stepping]
    rig.start(step=True)
    rig.done()
    for each in (StepForward(), event):
        rig.do(each)
        seen.append(rig.runner.is_stepping)
        if each is not event:
            rig.done()
            seen.append(rig.runner.is_stepping)
    assert seen == [False, True, False, not isinstance(event, Resume)]


def test_a_step_that_a_breakpoint_ends_is_over() -> None:
    rig = ProgramRig("# nothing\n# here\nset output 1 on")
    rig.break_at(("main", 1))
    rig.start(step=True)
    assert rig.runner.status.pause is PauseReason.BREAKPOINT
    assert not rig.runner.is_stepping


@pytest.mark.parametrize(("passed", "left"), [(0, 3), (1, 2)])
def test_a_step_out_of_the_middle_of_joined_moves_is_refused_and_changes_nothing(
    passed: int, left: int
) -> None:
    rig = ProgramRig(JOINED)
    rig.start()
    assert rig.done() == ["move b~ c~ a"]
    for place in range(passed):
        rig.do(Passed(rig.request, place))
    rig.do(Pause())
    before = rig.runner.status
    assert rig.do(StepForward()) == ["refused STEP_FORWARD_REFUSED"]
    refused = rig.actions[-1]
    assert isinstance(refused, EventRefused)
    assert (refused.refusal.value, refused.refusal.limit) == (left, 1)
    assert "accepted: resume, or a program stop" in refused.refusal.text
    assert rig.runner.status == before
    assert not rig.runner.is_stepping
    assert rig.do(Resume()) == ["resume motion"]
    assert rig.done() == ["move b"]


def test_a_step_out_of_the_last_of_joined_moves_ends_that_one() -> None:
    rig = ProgramRig(JOINED)
    rig.start()
    rig.done()
    for place in (0, 1):
        rig.do(Passed(rig.request, place))
    rig.do(Pause())
    assert rig.do(StepForward()) == ["resume motion"]
    assert rig.done() == []
    assert rig.runner.status.pause is PauseReason.STEP


@pytest.mark.parametrize(
    ("passed", "accepted"), [((), "accepted: resume, or"), ((0, 1), "accepted: step forward")]
)
def test_a_step_back_inside_of_joined_moves_is_refused_with_what_is_accepted_there(
    passed: tuple[int, ...], accepted: str
) -> None:
    rig = ProgramRig(JOINED)
    rig.start()
    rig.done()
    for place in passed:
        rig.do(Passed(rig.request, place))
    rig.do(Pause())
    rig.do(StepBack())
    refused = rig.actions[-1]
    assert isinstance(refused, EventRefused)
    assert refused.refusal.code is V.STEP_BACK_REFUSED
    assert accepted in refused.refusal.text
