from collections.abc import Callable, Sequence

import pytest
from rigs.cells.program_cell import BODY_LINE, A, ProgramCell

from openpendant.server.events.effects import Effect
from openpendant.server.programs.execution.program_run import BareEnvironment
from openpendant.server.programs.interpreter.motion_blocks import MOST_INSTANT_AT_ONCE
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.pendant import ProgramState, RunKind
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME, STOP = messages.MotionControlAction
ALL, FORWARD, BACKWARD = RunKind
THERE_AND_BACK = "move PTP a\nmove PTP b\nmove PTP c\nmove PTP a\n"
B = (0.1, *A[1:])


def near(position: Sequence[float]) -> object:
    return pytest.approx(position, abs=1e-5)


def test_a_program_runs_to_its_end_with_one_verdict_and_one_outcome() -> None:
    cell = ProgramCell(main=THERE_AND_BACK)
    assert (cell.run(), cell.until_outcomes(), cell.position) == (V.ACCEPTED, [V.ACCEPTED], near(A))
    cell.pass_time(500)
    assert len(cell.user.verdicts()) == 2, "of the authority and of the run"
    assert len(cell.user.outcomes()) == 1
    assert not any(cell.controller.referee.counts.values())


JOINED_LINES = "move PTP a\nmove LIN b zone 5 mm\nmove LIN c zone 5 mm\nmove LIN a\n"


@pytest.mark.parametrize("statements", [THERE_AND_BACK, JOINED_LINES])
def test_the_slow_way_to_the_first_point_is_announced_and_every_line_told(statements: str) -> None:
    """Moves joined by zones are one motion, whose lines are told on the way."""
    cell = ProgramCell(main=statements)
    watcher = cell.pendant("watcher")
    cell.run()
    assert "slow way" in cell.reports()[0].text
    cell.until_outcomes()
    assert not any(cell.controller.referee.counts.values())
    lines = [report.line for report in cell.reports() if report.state == ProgramState.RUNNING]
    assert list(dict.fromkeys(lines)) == [BODY_LINE + number for number in range(4)]
    assert (cell.reports()[-1].state, cell.reports()[-1].text) == (ProgramState.NONE, "finished")
    assert len(watcher.all(type(cell.reports()[0]))) == len(cell.reports())


def test_a_run_may_begin_at_a_line_and_repeat() -> None:
    cell = ProgramCell(main=THERE_AND_BACK)
    assert cell.run(line=BODY_LINE + 2, loops=2) is V.ACCEPTED
    assert (cell.until_outcomes(), cell.reports()[0].line) == ([V.ACCEPTED], BODY_LINE + 2)
    assert max(report.loop for report in cell.reports()) == 2


def test_a_line_without_a_statement_is_refused_with_those_that_have_one() -> None:
    cell = ProgramCell(main=THERE_AND_BACK)
    assert cell.run(line=2) is V.BAD_ARGUMENT
    assert cell.run() is V.ACCEPTED


@pytest.mark.parametrize(
    ("name", "statements", "code"),
    [
        ("missing", "", V.NOT_FOUND),
        ("main", "move PTP a\ncall nobody\n", V.PROGRAM_UNKNOWN),
        ("main", "call main\n", V.CALL_TOO_DEEP),
    ],
)
def test_a_program_that_cannot_be_linked_is_refused(name: str, statements: str, code: V) -> None:
    cell = ProgramCell(main=statements or "move PTP a\n")
    assert cell.run(name) is code
    assert cell.user.outcomes() == []


def test_steps_go_forward_and_back_to_the_same_places() -> None:
    cell = ProgramCell(main=THERE_AND_BACK)
    places = []
    for number in range(1, 4):
        assert cell.run(kind=FORWARD) is V.ACCEPTED
        assert cell.until_outcomes(number)[-1] is V.ACCEPTED
        assert cell.reports()[-1].state == ProgramState.STEPPED
        assert cell.core.cell.activity is messages.Activity.PAUSED
        places.append(cell.position)
    for number in (4, 5):
        assert cell.run(kind=BACKWARD) is V.ACCEPTED
        assert cell.until_outcomes(number)[-1] is V.ACCEPTED
        assert cell.position == near(places[5 - number])
    assert cell.run(kind=BACKWARD) is V.STEP_BACK_REFUSED
    assert cell.run(kind=ALL) is V.ACCEPTED
    assert cell.until_outcomes(6)[-1] is V.ACCEPTED


def test_a_step_that_is_paused_stays_a_step() -> None:
    cell = ProgramCell(main=THERE_AND_BACK)
    cell.run(kind=FORWARD, speed=0.1)
    cell.pass_time(200)
    cell.control(PAUSE)
    cell.pass_time(300)
    assert cell.user.outcomes() == []
    cell.control(RESUME)
    assert cell.until_outcomes() == [V.ACCEPTED]
    cell.pass_time(1_000)
    assert cell.reports()[-1].state == ProgramState.STEPPED


ENDINGS: list[tuple[Callable[[ProgramCell], object], set[V]]] = [
    (lambda cell: cell.pendant("passer-by").stop(), {V.STOPPED, V.STOP_LATCHED}),
    (lambda cell: cell.user.release(), {V.AUTHORITY_LOST}),
    (lambda cell: cell.user.close(), {V.AUTHORITY_LOST}),
    (lambda cell: cell.user.mode(messages.OperatingMode.MANUAL_REDUCED), {V.MODE_CHANGED}),
    (lambda cell: cell.control(STOP), {V.PROGRAM_STOPPED}),
]


@pytest.mark.parametrize(("end", "codes"), ENDINGS)
@pytest.mark.parametrize("statements", [THERE_AND_BACK, "wait 2 s\nmove PTP a\n"])
def test_what_ends_a_run_ends_it_for_good(
    end: Callable[[ProgramCell], object], codes: set[V], statements: str
) -> None:
    """Mid-way in a motion and in a wait: nothing moves afterwards, nothing resumes by itself."""
    cell = ProgramCell(main=statements)
    cell.run()
    cell.pass_time(500)
    end(cell)
    (code,) = cell.until_outcomes()
    assert code in codes
    cell.pass_time(1_000)
    rest = cell.position
    cell.pass_time(5_000)
    assert cell.position == rest
    assert len(cell.user.outcomes()) == 1
    assert cell.core.cell.program is None
    assert not any(cell.controller.referee.counts.values())


def test_jogging_and_single_motions_are_refused_while_a_program_is_under_way() -> None:
    cell = ProgramCell(main="wait 20 s\nmove PTP a\n")
    cell.user.mode(messages.OperatingMode.MANUAL_REDUCED)
    cell.user.enable(0, 1)
    cell.run()
    cell.pass_time(100)
    assert cell.user.move(*A) is V.PROGRAM_RUNNING
    step = messages.JogStep(cell.user._next(), 0.5, 1, "", 6, (0.01,) + (0.0,) * 9)
    assert cell.user.code(step) is V.PROGRAM_RUNNING
    assert cell.run() is V.PROGRAM_RUNNING
    assert cell.control(STOP) is V.ACCEPTED
    assert cell.user.move(*A) is V.ACCEPTED


@pytest.mark.parametrize(
    ("statements", "kind", "action", "doing"),
    [
        ("wait 20 s\n", ALL, None, "runs"),
        ("wait 20 s\n", ALL, PAUSE, "is paused"),
        ("set output 1 on\nmove PTP a\n", FORWARD, None, "is paused after a step"),
    ],
)
def test_a_motion_beside_a_program_is_refused_with_what_the_program_does_and_what_helps(
    statements: str, kind: RunKind, action: messages.MotionControlAction | None, doing: str
) -> None:
    """That a pause would help is not said of one that is paused."""
    cell = ProgramCell(main="wait 0.1 s\n" + statements)
    assert cell.run(kind=kind) is V.ACCEPTED
    cell.pass_time(500)
    if action is not None:
        cell.control(action)
    assert cell.user.move(*A) is V.PROGRAM_RUNNING
    text = cell.user.all(messages.Verdict)[-1].text
    assert f"{doing} at line" in text
    assert "program stop" in text
    assert "rogram stop" in CATALOGUE[V.PROGRAM_RUNNING].remedy
    assert cell.control(STOP) is V.ACCEPTED
    assert cell.user.move(*B) is V.ACCEPTED


def test_the_override_acts_on_the_running_program() -> None:
    durations = []
    for override in (1.0, 0.25):
        cell = ProgramCell(main="move PTP a\nmove PTP b\n" * 2)
        cell.run()
        cell.user.speed(override)
        began = cell.now
        cell.until_outcomes()
        durations.append(cell.now - began)
    assert durations[1] > 2.5 * durations[0]


def test_a_program_in_reduced_speed_needs_enabling_and_ends_without_it() -> None:
    cell = ProgramCell(main="move PTP a\nwait 20 s\nmove PTP b\n")
    cell.user.mode(messages.OperatingMode.MANUAL_REDUCED)
    assert cell.run() is V.NOT_ENABLED

    def hold(milliseconds: int) -> None:
        for _ in range(0, milliseconds, 50):
            cell.user.enable(1)
            cell.pass_time(50)

    cell.user.enable(0, 1)
    assert cell.run() is V.ACCEPTED
    while cell.reports()[-1].line == BODY_LINE:
        hold(100)
    assert (cell.user.outcomes(), cell.until_outcomes()) == ([], [V.ENABLING_LOST])


def test_an_input_that_is_not_there_ends_the_run_by_name() -> None:
    cell = ProgramCell(main="loop\nif input 3 on\nend\nend\n")
    assert (cell.run(), cell.until_outcomes()) == (V.ACCEPTED, [V.NO_SIGNAL])
    assert "input 3" in cell.reports()[-1].text


def test_an_unreachable_point_ends_the_run_with_program_line_and_point_named() -> None:
    cell = ProgramCell(main="move PTP a\n")
    text = (
        'openpendant-program/1\nprogram "far" robot ur5\n'
        "point a joints 0 -1.5 1.5 -1.5 -1.5 0 rad\n"
        "point z joints 0 -9 1.5 -1.5 -1.5 0 rad\nmove PTP a\nmove PTP z\n"
    )
    cell.user.ask("programs.save", name="far", body=text, expected_revision=0)
    cell.run("far")
    assert cell.until_outcomes() == [V.OUT_OF_RANGE]
    assert "far, line 10, point z" in cell.reports()[-1].text


JOINED = "move PTP a\nmove PTP b zone 1 deg\nmove PTP c zone 1 deg\nmove PTP a\nwait 1 s\n"


class AllOff(BareEnvironment):
    def __init__(self, cell: ProgramCell) -> None:
        cell.core.pendants.programs.executor.environment = self

    def input(self, signal: int, now: int) -> bool:
        return False

    def set_output(self, signal: int, value: bool, now: int) -> list[Effect]:
        return []


def test_a_step_that_ends_in_its_pause_has_its_outcome_then() -> None:
    cell = ProgramCell(main="set output 1 on\nmove PTP a\nwait 9 s\n")
    AllOff(cell)
    cell.run(kind=FORWARD)
    cell.control(PAUSE)
    assert cell.until_outcomes(1, most=100) == [V.ACCEPTED]
    assert (cell.reports()[-1].state, cell.motions) == (ProgramState.STEPPED, [])


def test_a_step_out_of_joined_moves_is_refused_and_the_pause_holds() -> None:
    cell = ProgramCell(main=JOINED)
    cell.run(speed=0.1)
    while cell.reports()[-1].line == BODY_LINE:
        cell.pass_time(10)
    cell.pass_time(200)
    assert cell.control(PAUSE) is V.ACCEPTED
    cell.pass_time(500)
    stood, line = cell.position, cell.reports()[-1].line
    assert cell.run(kind=FORWARD) is V.STEP_FORWARD_REFUSED
    assert "accepted: resume" in cell.user.all(messages.Verdict)[-1].text
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
    cell = ProgramCell(main=f"{before}wait input 1 {wanted} timeout 0 s\n")
    AllOff(cell)
    cell.run()
    assert cell.until_outcomes(1, most=1_000) == [code]


def test_a_program_that_passes_much_in_no_time_moves_on_all_the_same() -> None:
    cell = ProgramCell(main=f"loop {3 * MOST_INSTANT_AT_ONCE}\nend\nmove PTP b\n")
    cell.run()
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert cell.position[0] == pytest.approx(0.1, abs=1e-4)
