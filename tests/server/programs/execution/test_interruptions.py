from __future__ import annotations

import dataclasses
from collections.abc import Callable

import pytest
from rigs.cells.controller_interruptions import fall_silent, lose, press_emergency_stop, report
from rigs.cells.program_cell import BODY_LINE, ProgramCell

from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import Status, TriState
from openpendant.simplemsg.pendant import (
    Activity,
    MotionControlAction,
    OperatorAction,
    Outcome,
    ProgramState,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME, STOP = MotionControlAction


WAITS = {"a wait": "wait 2 s\nmove PTP b\n", "a dwell": "move PTP a dwell 2 s\nmove PTP b\n"}


def waiting(statements: str) -> ProgramCell:
    cell = ProgramCell(main=statements)
    assert cell.run() is V.ACCEPTED
    for _ in range(1_000):
        cell.pass_time(10)
        if cell.core.cell.driving.activity is Activity.IDLE:
            break
    cell.pass_time(300)
    assert cell.core.cell.driving.activity is Activity.IDLE
    assert cell.reports()[-1].state == ProgramState.RUNNING
    return cell


def stop_from_ros(cell: ProgramCell) -> None:
    assert cell.ros().stop() is not None


INTERRUPTIONS: dict[str, tuple[Callable[[ProgramCell], None], V, str]] = {
    "emergency stop": (press_emergency_stop, V.CONTROLLER_STOPPED, "emergency stop"),
    "an emergency stop between two ticks": (
        lambda cell: report(cell, e_stopped=TriState.TRUE),
        V.CONTROLLER_STOPPED,
        "emergency stop",
    ),
    "no drive power between two ticks": (
        lambda cell: report(cell, drives_powered=TriState.FALSE),
        V.CONTROLLER_STOPPED,
        "drives lost their power",
    ),
    "an error between two ticks": (
        lambda cell: report(cell, in_error=TriState.TRUE, error_code=103),
        V.CONTROLLER_STOPPED,
        "error 103",
    ),
    "another mode of the controller": (
        lambda cell: report(cell, mode=1),
        V.CONTROLLER_STOPPED,
        "mode changed",
    ),
    "motion link": (lose(ControllerPath.MOTION), V.CONTROLLER_LOST, "motion link"),
    "state link": (lose(ControllerPath.STATE), V.CONTROLLER_LOST, "state link"),
    "reports": (fall_silent, V.FEEDBACK_STALE, "ms ago"),
    "ROS-I STOP": (stop_from_ros, V.STOPPED, "ROS-I client"),
}


@pytest.mark.parametrize("what", INTERRUPTIONS)
@pytest.mark.parametrize("where", WAITS)
def test_what_ends_a_motion_ends_a_program_that_waits_for_good(what: str, where: str) -> None:
    cell = waiting(WAITS[where])
    interrupt, code, words = INTERRUPTIONS[what]
    interrupt(cell)
    assert cell.until_outcomes(most=500) == [code]
    assert words in cell.user.all(Outcome)[-1].text
    assert (cell.reports()[-1].state, cell.core.cell.program) == (ProgramState.NONE, None)
    stood, motions = cell.position, len(cell.motions)
    cell.pass_time(3_000)
    assert (cell.position, len(cell.motions)) == (stood, motions)
    assert len(cell.user.outcomes()) == 1
    assert cell.run() is V.ACCEPTED


@pytest.mark.parametrize("what", ["emergency stop", "motion link", "reports", "ROS-I STOP"])
def test_a_program_that_is_paused_in_a_wait_stays_paused_and_moves_when_it_is_resumed(
    what: str,
) -> None:
    cell = waiting(WAITS["a wait"])
    assert cell.control(PAUSE) is V.ACCEPTED
    INTERRUPTIONS[what][0](cell)
    cell.pass_time(3_000)
    assert (cell.reports()[-1].state, cell.motions) == (ProgramState.PAUSED, [])
    assert cell.control(RESUME) is V.ACCEPTED
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert len(cell.motions) == 1


def test_a_program_that_is_paused_in_a_wait_is_not_resumed_under_an_emergency_stop() -> None:
    cell = waiting(WAITS["a wait"])
    cell.control(PAUSE)
    cell.controller.operate(OperatorAction.EMERGENCY_STOP, cell.now)
    cell.pass_time(300)
    assert cell.control(RESUME) is V.CONTROLLER_NOT_READY


def test_an_emergency_stop_between_two_ticks_ends_a_motion_that_is_planned() -> None:
    cell = ProgramCell(main="move PTP a\nmove PTP b\n")
    cell.run()
    cell.pass_time(200)
    report(cell, e_stopped=TriState.TRUE)
    assert cell.until_outcomes() == [V.CONTROLLER_STOPPED]


def test_a_status_that_says_nothing_new_ends_nothing() -> None:
    """An error that is shown all the time is old, and one that goes is none."""
    cell = ProgramCell(main="wait 1 s\nmove PTP b\n")
    own = cell.controller.status(cell.now)
    shown = dataclasses.replace(own, in_error=TriState.TRUE, error_code=103)
    assert isinstance(shown, Status)
    cell._hear(ControllerPath.STATE, shown)
    assert cell.run() is V.ACCEPTED
    cell._hear(ControllerPath.STATE, shown)
    cell._hear(ControllerPath.STATE, own)
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert cell.reports()[0].line == BODY_LINE
