from __future__ import annotations

from collections.abc import Callable

import pytest
from rigs.cells.program_cell import ProgramCell, ask

from openpendant.server.events.effects import Ask, Effect
from openpendant.server.planning.jobs import BlockJob
from openpendant.simplemsg.pendant import (
    Activity,
    MotionControlAction,
    ProgramState,
    RunKind,
    SetSpeed,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME, STOP = MotionControlAction
ALL, FORWARD, BACKWARD = RunKind
THERE_AND_BACK = "move PTP a\nmove PTP b\nmove PTP c\nmove PTP a\n"


def activity(cell: ProgramCell) -> Activity:
    return cell.core.cell.activity


class SlowPlanning(ProgramCell):
    def __init__(self, **programs: str) -> None:
        self.held: list[Effect] = []
        super().__init__(**programs)

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        self.held = [each for each in outgoing if _plans_motion(each)] or self.held
        return super().perform([each for each in outgoing if not _plans_motion(each)])

    def plan(self) -> None:
        held, self.held = self.held, []
        super().perform(held)


def _plans_motion(item: Effect) -> bool:
    return isinstance(item, Ask) and isinstance(item.question, BlockJob)


def speed(cell: ProgramCell, override: float) -> V | None:
    return cell.user.code(SetSpeed(cell.user._next(), override, 0.0))


PAUSES: dict[str, tuple[str, Callable[[ProgramCell], object], ProgramState]] = {
    "in a wait": ("wait 20 s\n", lambda cell: cell.control(PAUSE), ProgramState.PAUSED),
    "at a breakpoint": ("wait 0.1 s\nwait 9 s\n", lambda _: None, ProgramState.AT_BREAKPOINT),
}


@pytest.mark.parametrize("where", PAUSES)
def test_a_program_that_is_paused_between_motions_shows_paused(where: str) -> None:
    statements, pause, state = PAUSES[where]
    cell = ProgramCell(main=statements)
    if state is ProgramState.AT_BREAKPOINT:
        ask(cell.user, "programs.breakpoints", name="main", statements=[1])
    cell.run()
    cell.pass_time(300)
    pause(cell)
    assert cell.reports()[-1].state == state
    assert activity(cell) is Activity.PAUSED
    assert ask(cell.user, "snapshot")["activity"] == "paused"
    assert cell.control(RESUME) is V.ACCEPTED
    assert activity(cell) is Activity.IDLE
    assert cell.control(STOP) is V.ACCEPTED
    assert activity(cell) is Activity.IDLE


def test_between_steps_the_cell_shows_paused_and_the_next_step_is_taken() -> None:
    cell = ProgramCell(main=THERE_AND_BACK)
    for number in (1, 2):
        assert cell.run(kind=FORWARD) is V.ACCEPTED
        assert cell.until_outcomes(number)[-1] is V.ACCEPTED
        assert activity(cell) is Activity.PAUSED


@pytest.mark.parametrize("statements", ["wait 2 s\n", THERE_AND_BACK])
def test_promise_32_an_override_of_0_pauses_a_program_which_then_waits_for_its_resume(
    statements: str,
) -> None:
    cell = ProgramCell(main=statements)
    cell.run()
    cell.pass_time(300)
    assert speed(cell, 0.0) is V.ACCEPTED
    cell.pass_time(1_000)
    assert activity(cell) is Activity.PAUSED
    assert cell.reports()[-1].state == ProgramState.PAUSED
    for kind in (ALL, FORWARD):
        assert cell.run(kind=kind) is V.OVERRIDE_ZERO
    assert cell.control(RESUME) is V.OVERRIDE_ZERO
    stood = cell.position
    assert speed(cell, 1.0) is V.ACCEPTED
    cell.pass_time(3_000)
    assert (activity(cell), cell.position) == (Activity.PAUSED, stood)
    assert cell.control(RESUME) is V.ACCEPTED
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert not any(cell.controller.referee.counts.values())


def test_a_program_whose_block_is_planned_while_the_override_falls_to_0_is_paused() -> None:
    cell = SlowPlanning(main=THERE_AND_BACK)
    cell.run()
    before = cell.position
    assert speed(cell, 0.0) is V.ACCEPTED
    cell.plan()
    cell.pass_time(1_000)
    assert activity(cell) is Activity.PAUSED
    assert cell.position == pytest.approx(before, abs=1e-5)
    assert cell.user.outcomes() == []
    speed(cell, 1.0)
    assert cell.control(RESUME) is V.ACCEPTED
    cell.pass_time(1_000)
    assert cell.position != before


def test_a_point_is_taught_while_a_motion_of_a_program_is_paused() -> None:
    cell = ProgramCell(main=THERE_AND_BACK)
    cell.run()
    cell.pass_time(500)
    cell.control(PAUSE)
    moving = ask(cell.user, "programs.record", name="main", expected_revision=1, point="here")
    assert moving["code"] == V.MOVING
    cell.pass_time(1_000)
    assert activity(cell) is Activity.PAUSED
    kept = ask(cell.user, "programs.record", name="main", expected_revision=1, point="here")
    assert kept["revision"] == 2
    assert cell.control(RESUME) is V.ACCEPTED


def test_a_step_back_inside_a_statement_says_what_is_accepted() -> None:
    cell = ProgramCell(main=THERE_AND_BACK)
    assert cell.run(kind=BACKWARD) is V.PROGRAM_NOT_RUNNING
    assert "paused between two statements" in cell.user.all(Verdict)[-1].text
    cell.run(kind=FORWARD)
    cell.until_outcomes(1)
    cell.run(kind=FORWARD, speed=0.05)
    cell.pass_time(200)
    cell.control(PAUSE)
    cell.pass_time(500)
    assert cell.run(kind=BACKWARD) is V.STEP_BACK_REFUSED
    assert "accepted: step forward, then back" in cell.user.all(Verdict)[-1].text
    assert cell.run(kind=FORWARD) is V.ACCEPTED
    cell.until_outcomes(2)
    assert cell.run(kind=BACKWARD) is V.ACCEPTED


def test_a_program_that_is_paused_while_its_block_is_planned_does_not_leave_the_start() -> None:
    cell = SlowPlanning(main=THERE_AND_BACK)
    cell.run()
    assert cell.held
    start = cell.position
    assert cell.control(PAUSE) is V.ACCEPTED
    cell.plan()
    cell.pass_time(1_000)
    assert cell.position == pytest.approx(start, abs=1e-6)
    assert activity(cell) is Activity.PAUSED


def test_a_request_for_another_program_does_not_go_on_with_the_one_that_is_paused() -> None:
    cell = ProgramCell(main=THERE_AND_BACK, other=THERE_AND_BACK)
    cell.run()
    cell.pass_time(300)
    assert cell.control(PAUSE) is V.ACCEPTED
    cell.pass_time(1_000)
    stood = cell.position
    for kind in (ALL, FORWARD, BACKWARD):
        assert cell.run("other", kind) is V.PROGRAM_RUNNING
    cell.pass_time(1_000)
    assert cell.position == stood
