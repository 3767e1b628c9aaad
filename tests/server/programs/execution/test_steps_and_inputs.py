from __future__ import annotations

import pytest
from rigs.cells.program_cell import BODY_LINE, ProgramCell

from openpendant.server.events.effects import Effect
from openpendant.server.programs.execution.program_run import BareEnvironment
from openpendant.server.programs.interpreter.motion_blocks import MOST_INSTANT_AT_ONCE
from openpendant.simplemsg.pendant import MotionControlAction, ProgramState, RunKind, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME, STOP = MotionControlAction
ALL, FORWARD, BACKWARD = RunKind
JOINED = "move PTP a\nmove PTP b zone 1 deg\nmove PTP c zone 1 deg\nmove PTP a\nwait 1 s\n"


class AllOff(BareEnvironment):
    def input(self, signal: int, now: int) -> bool:
        return False

    def set_output(self, signal: int, value: bool, now: int) -> list[Effect]:
        return []


def with_signals(statements: str) -> ProgramCell:
    cell = ProgramCell(main=statements)
    cell.core.pendants.programs.executor.environment = AllOff()
    return cell


def in_the_middle_of_joined_moves() -> ProgramCell:
    cell = ProgramCell(main=JOINED)
    cell.run(speed=0.1)
    while cell.reports()[-1].line == BODY_LINE:
        cell.pass_time(10)
    cell.pass_time(200)
    assert cell.control(PAUSE) is V.ACCEPTED
    cell.pass_time(500)
    return cell


def test_a_step_that_ends_in_its_pause_has_its_outcome_then() -> None:
    cell = with_signals("set output 1 on\nmove PTP a\nwait 9 s\n")
    cell.run(kind=FORWARD)
    cell.control(PAUSE)
    assert cell.until_outcomes(1, most=100) == [V.ACCEPTED]
    assert cell.reports()[-1].state == ProgramState.STEPPED
    assert cell.motions == []


def test_a_step_out_of_joined_moves_is_refused_and_the_pause_holds() -> None:
    cell = in_the_middle_of_joined_moves()
    stood, line = cell.position, cell.reports()[-1].line
    assert cell.run(kind=FORWARD) is V.STEP_FORWARD_REFUSED
    assert "accepted: resume" in cell.user.all(Verdict)[-1].text
    cell.pass_time(1_000)
    assert cell.position == stood
    assert (cell.reports()[-1].state, cell.reports()[-1].line) == (ProgramState.PAUSED, line)
    assert cell.control(RESUME) is V.ACCEPTED
    assert cell.until_outcomes() == [V.ACCEPTED]


def test_a_run_that_was_begun_by_a_step_and_goes_on_is_resumed_as_a_run() -> None:
    cell = ProgramCell(main=JOINED)
    cell.run(kind=FORWARD, speed=0.3)
    cell.pass_time(200)
    cell.control(PAUSE)
    cell.pass_time(500)
    assert cell.run(speed=0.3) is V.ACCEPTED
    while cell.reports()[-1].line == BODY_LINE:
        cell.pass_time(10)
    cell.control(PAUSE)
    cell.pass_time(500)
    assert cell.control(RESUME) is V.ACCEPTED
    assert cell.until_outcomes(2) == [V.ACCEPTED, V.ACCEPTED]
    assert cell.reports()[-1].state == ProgramState.NONE


@pytest.mark.parametrize("before", ["", "set output 1 on\n", "read input 2 into x\n", "wait 0 s\n"])
@pytest.mark.parametrize(("wanted", "code"), [("off", V.ACCEPTED), ("on", V.INPUT_TIMEOUT)])
def test_an_input_is_looked_at_before_a_limit_of_nothing(before: str, wanted: str, code: V) -> None:
    cell = with_signals(f"{before}wait input 1 {wanted} timeout 0 s\n")
    cell.run()
    assert cell.until_outcomes(1, most=1_000) == [code]


def test_a_program_that_passes_much_in_no_time_moves_on_all_the_same() -> None:
    cell = ProgramCell(main=f"loop {3 * MOST_INSTANT_AT_ONCE}\nend\nmove PTP b\n")
    cell.run()
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert cell.position[0] == pytest.approx(0.1, abs=1e-4)
