import dataclasses
from collections.abc import Callable
from typing import Any

import pytest
from rigs.cells.controller_interruptions import fall_silent, lose, press_emergency_stop, reporting
from rigs.cells.expectations import expect
from rigs.cells.program_cell import BODY_LINE, ProgramCell
from rigs.data.large_programs import WorkingCell, large_text
from rigs.peers.server_clients import Pendant

from openpendant.server.events.events import ShutDown
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg import ReplyCode, Status, TriState
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.pendant import Activity, OperatingMode, ProgramState
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME, STOP = messages.MotionControlAction


WAITS = {"a wait": "wait 2 s\nmove PTP b\n", "a dwell": "move PTP a dwell 2 s\nmove PTP b\n"}


def waiting(statements: str) -> ProgramCell:
    cell = ProgramCell(main=statements)
    assert cell.run() is V.ACCEPTED
    while cell.core.cell.driving.activity is not Activity.IDLE:
        cell.pass_time(10)
    cell.pass_time(300)
    assert cell.core.cell.driving.activity is Activity.IDLE
    assert cell.reports()[-1].state == ProgramState.RUNNING
    return cell


TRUE, FALSE = TriState.TRUE, TriState.FALSE
HALTED = V.CONTROLLER_STOPPED
INTERRUPTIONS: dict[str, tuple[Callable[[ProgramCell], object], V, str]] = {
    "emergency stop": (press_emergency_stop, HALTED, "emergency stop"),
    "one between two ticks": (reporting(e_stopped=TRUE), HALTED, "emergency stop"),
    "no drive power": (reporting(drives_powered=FALSE), HALTED, "drives lost their power"),
    "an error": (reporting(in_error=TRUE, error_code=103), HALTED, "error 103"),
    "another mode of the controller": (reporting(mode=1), HALTED, "mode changed"),
    "motion link": (lose(ControllerPath.MOTION), V.CONTROLLER_LOST, "motion link"),
    "state link": (lose(ControllerPath.STATE), V.CONTROLLER_LOST, "state link"),
    "reports": (fall_silent, V.FEEDBACK_STALE, "ms ago"),
    "ROS-I STOP": (lambda cell: cell.ros().stop(), V.STOPPED, "ROS-I client"),
}


@pytest.mark.parametrize("what", INTERRUPTIONS)
@pytest.mark.parametrize("where", WAITS)
def test_what_ends_a_motion_ends_a_program_that_waits_for_good(what: str, where: str) -> None:
    cell = waiting(WAITS[where])
    interrupt, code, words = INTERRUPTIONS[what]
    interrupt(cell)
    assert cell.until_outcomes(most=500) == [code]
    assert words in cell.user.all(messages.Outcome)[-1].text
    assert (cell.reports()[-1].state, cell.core.cell.program) == (ProgramState.NONE, None)
    stood, motions = cell.position, len(cell.motions)
    cell.pass_time(3_000)
    assert (cell.position, len(cell.motions)) == (stood, motions)
    assert len(cell.user.outcomes()) == 1
    assert cell.run() is V.ACCEPTED


@pytest.mark.parametrize("what", ["emergency stop", "motion link", "reports", "ROS-I STOP"])
def test_a_program_paused_in_a_wait_stays_paused_and_moves_when_it_is_resumed(what: str) -> None:
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
    cell.controller.operate(messages.OperatorAction.EMERGENCY_STOP, cell.now)
    cell.pass_time(300)
    assert cell.control(RESUME) is V.CONTROLLER_NOT_READY


def test_an_emergency_stop_between_two_ticks_ends_a_motion_that_is_planned() -> None:
    cell = ProgramCell(main="move PTP a\nmove PTP b\n")
    cell.run()
    cell.pass_time(200)
    reporting(e_stopped=TRUE)(cell)
    assert cell.until_outcomes() == [V.CONTROLLER_STOPPED]


def test_a_status_that_says_nothing_new_ends_nothing() -> None:
    """An error that is shown all the time is old, and one that goes is none."""
    cell = ProgramCell(main="wait 1 s\nmove PTP b\n")
    own = cell.controller.status(cell.now)
    shown = expect(Status, dataclasses.replace(own, in_error=TRUE, error_code=103))
    cell._hear(ControllerPath.STATE, shown)
    assert cell.run() is V.ACCEPTED
    cell._hear(ControllerPath.STATE, shown)
    cell._hear(ControllerPath.STATE, own)
    assert (cell.until_outcomes(), cell.reports()[0].line) == ([V.ACCEPTED], BODY_LINE)


SHORT = program_to_json(parse(large_text(60, 60)))
GOAL = (0.1, -1.5, 1.5, -1.5, -1.5, 0.0)


@pytest.fixture
def cell() -> WorkingCell:
    cell = WorkingCell()
    cell.store.save(DocumentKind.PROGRAM, "main", SHORT, expected_revision=0, author="test")
    return cell


@pytest.fixture
def loading(cell: WorkingCell) -> WorkingCell:
    assert cell.run() is None
    assert len(cell.jobs) == 1
    return cell


MODES = (OperatingMode.MANUAL_REDUCED, OperatingMode.AUTOMATIC)
ENDS: dict[str, tuple[Callable[[WorkingCell], Any], V]] = {
    "stop and its reset": (lambda it: [it.pendant("other").stop(), it.user.reset()], V.STOPPED),
    "mode there and back": (lambda cell: map(cell.user.mode, MODES), V.MODE_CHANGED),
    "authority lost": (lambda cell: [cell.user.release(), cell.user.take()], V.AUTHORITY_LOST),
    "program stop": (lambda cell: [cell.control(STOP)], V.PROGRAM_STOPPED),
    "ROS-I STOP": (lambda cell: [cell.ros().stop()], V.STOPPED),
    "motion link": (lose(ControllerPath.MOTION), V.CONTROLLER_LOST),
    "emergency stop": (press_emergency_stop, HALTED),
    "one between two ticks": (reporting(e_stopped=TRUE), HALTED),
    "reports": (fall_silent, V.FEEDBACK_STALE),
    "an override of 0": (lambda cell: map(cell.user.speed, (0.0, 1.0)), V.OVERRIDE_ZERO),
}


@pytest.mark.parametrize("what", ENDS)
def test_a_start_from_before_never_moves_the_robot_and_is_refused_at_once(
    loading: WorkingCell, what: str
) -> None:
    request, stood = loading.user.last_request, loading.position
    end, code = ENDS[what]
    assert set(end(loading) or [V.ACCEPTED]) <= {V.ACCEPTED, ReplyCode.SUCCESS}
    told = [each for number, each in loading.user.verdicts() if number == request]
    assert told == [code], "before anything was loaded"
    loading.pass_time(200)
    loading.work()
    loading.pass_time(3_000)
    assert [each for number, each in loading.user.verdicts() if number == request] == [code]
    assert (loading.position, loading.motions, loading.reports()) == (stood, [], [])
    assert (loading.core.cell.program, loading.run()) == (None, None)
    loading.work()
    loading.pass_time(100)
    assert loading.user.verdicts()[-1][1] is V.ACCEPTED


def test_a_start_ends_with_the_connection_that_asked(loading: WorkingCell) -> None:
    loading.user.close()
    other = loading.pendant("other")
    other.take()
    loading.work()
    loading.wait(2_000)
    assert loading.motions == []
    assert other.move(*GOAL) is V.ACCEPTED


def test_a_start_ends_when_the_enabling_device_is_let_go(cell: WorkingCell) -> None:
    cell.user.mode(OperatingMode.MANUAL_REDUCED)
    cell.user.enable(0, 1)
    assert cell.run() is None
    cell.user.enable(0)
    cell.wait(10)
    assert cell.user.verdicts()[-1][1] is V.ENABLING_LOST
    cell.user.enable(1)
    cell.work()
    cell.pass_time(100)
    assert cell.motions == []


def step(user: Pendant) -> V | None:
    return user.code(messages.JogStep(user._next(), 0.5, 1, "", 6, (0.01,) + (0.0,) * 9))


OTHERS: dict[str, Callable[[Pendant], V | None]] = {
    "joint move": lambda user: user.move(*GOAL),
    "path": lambda user: user.path(GOAL),
    "home": lambda user: user.code(messages.Home(user._next(), 0.5, "zero")),
}


@pytest.mark.parametrize("kind", OTHERS)
def test_no_other_motion_begins_beside_a_program_loading(loading: WorkingCell, kind: str) -> None:
    assert OTHERS[kind](loading.user) is V.PROGRAM_RUNNING
    told = loading.user.all(messages.Verdict)[-1].text
    assert "program 'main' is being loaded; accepted: another motion after a program stop" in told
    assert loading.control(STOP) is V.ACCEPTED
    assert OTHERS[kind](loading.user) is V.ACCEPTED


def test_no_jog_begins_beside_a_program_being_loaded(cell: WorkingCell) -> None:
    cell.user.mode(OperatingMode.MANUAL_REDUCED)
    cell.user.enable(0, 1)
    cell.run()
    assert step(cell.user) is V.PROGRAM_RUNNING
    cell.control(STOP)
    assert step(cell.user) is V.ACCEPTED


@pytest.mark.parametrize("action", [PAUSE, RESUME])
def test_nothing_is_paused_or_resumed_while_a_program_is_loaded_and_what_helps_is_told(
    loading: WorkingCell, action: messages.MotionControlAction
) -> None:
    assert loading.control(action) is V.NOTHING_TO_CONTROL
    assert "accepted: program stop" in loading.user.all(messages.Verdict)[-1].text


def test_a_program_being_loaded_is_shown_as_planned_and_why_names_it(loading: WorkingCell) -> None:
    watcher = loading.pendant("watcher", state_rate=100.0)
    loading.wait(20)
    state = watcher.all(messages.State)[-1]
    assert (state.activity, state.program_state) == (Activity.PLANNING, ProgramState.NONE)
    (why,) = loading.send(loading.user, "why", kind="move")
    assert why["broken"] == "program"
    (shown,) = loading.send(loading.user, "snapshot")
    assert (shown["activity"], shown["program"]) == ("planning", None)
    loading.control(STOP)
    loading.wait(20)
    assert watcher.all(messages.State)[-1].activity == Activity.IDLE


def test_a_program_that_cannot_be_loaded_leaves_the_cell_free(loading: WorkingCell) -> None:
    loading.control(STOP)
    loading.work()
    assert loading.run("missing") is V.NOT_FOUND
    assert loading.core.cell.program is None
    assert loading.user.move(*GOAL) is V.ACCEPTED


def test_a_shut_down_refuses_what_is_loaded(loading: WorkingCell) -> None:
    request = loading.user.last_request
    loading.perform(loading.core.handle(ShutDown(), loading.now))
    assert loading.user.verdicts()[-1] == (request, V.SHUTTING_DOWN)
