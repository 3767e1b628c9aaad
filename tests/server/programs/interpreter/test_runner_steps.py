from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
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
    Stop,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

MOVES = "move PTP a\nmove LIN b zone 5 mm\nmove CIRC c via a\nmove SPLINE a via b c speed 20 mm/s"


def paused_at(rig: ProgramRig) -> tuple[PauseReason, int]:
    assert rig.runner.status.state is RunState.PAUSED
    return rig.runner.status.pause, rig.here[0][1]


def test_a_motion_pauses_on_its_path_and_goes_on_there() -> None:
    rig = ProgramRig(MOVES)
    rig.start()
    assert rig.do(Pause()) == ["pause motion"]
    assert paused_at(rig) == (PauseReason.REQUEST, 0)
    assert rig.do(Resume()) == ["resume motion"]
    assert rig.done() == ["move b:LIN~ c:CIRC<a"]


def test_a_motion_that_ends_all_the_same_leaves_the_run_paused() -> None:
    rig = ProgramRig(MOVES)
    rig.start()
    rig.do(Pause())
    assert rig.done() == []
    assert paused_at(rig) == (PauseReason.REQUEST, 1)
    assert rig.do(Resume()) == ["move b:LIN~ c:CIRC<a"]


def test_a_pause_holds_a_wait() -> None:
    rig = ProgramRig("wait 2 s\nset output 1 on")
    rig.start()
    rig.after(1.5)
    rig.do(Pause())
    assert rig.after(100.0) == []
    rig.do(Resume())
    assert rig.after(0.4) == []
    assert rig.after(0.1) == ["output 1 on"]


def test_a_pause_holds_a_dwell_that_begins_in_it() -> None:
    rig = ProgramRig("move PTP a dwell 1 s\nset output 1 on")
    rig.start()
    rig.do(Pause())
    rig.done()
    assert rig.after(100.0) == []
    assert rig.do(Resume()) == []
    assert rig.after(1.0) == ["output 1 on"]


def test_a_pause_holds_the_time_limit_of_an_input() -> None:
    rig = ProgramRig("wait input 1 on timeout 1 s")
    rig.start()
    rig.value(False)
    rig.do(Pause())
    assert rig.after(100.0) == []
    rig.do(Resume())
    assert rig.after(0.99) == ["ask 1"]
    rig.value(False)
    assert rig.after(0.01) == ["failed INPUT_TIMEOUT"]


def test_an_input_that_comes_during_a_pause_is_taken() -> None:
    rig = ProgramRig("wait input 1 on\nset output 1 on")
    rig.start()
    rig.do(Pause())
    assert rig.value(True) == []
    assert rig.do(Resume()) == ["output 1 on"]


def test_a_stop_during_a_pause_ends_the_run() -> None:
    rig = ProgramRig(MOVES)
    rig.start()
    rig.do(Pause())
    assert rig.do(Stop()) == ["stop motion"]
    assert rig.do(Resume()) == ["refused PROGRAM_NOT_RUNNING"]


@pytest.mark.parametrize("event", [Resume(), StepForward(), StepBack()])
def test_only_what_is_paused_goes_on(event: Resume | StepForward | StepBack) -> None:
    rig = ProgramRig(MOVES)
    assert rig.do(event) == ["refused PROGRAM_NOT_RUNNING"]
    rig.start()
    assert rig.do(event) == ["refused PROGRAM_NOT_RUNNING"]


@pytest.mark.parametrize("pauses", [0, 1])
def test_only_what_runs_is_paused(pauses: int) -> None:
    rig = ProgramRig(MOVES)
    if pauses:
        rig.start()
        rig.do(Pause())
    assert rig.do(Pause()) == ["refused PROGRAM_NOT_RUNNING"]


def test_steps_run_one_statement_each_and_stop_at_every_point() -> None:
    rig = ProgramRig(MOVES)
    assert rig.start(step=True) == ["approach a"]
    seen = []
    for _ in range(3):
        assert rig.done() == []
        assert paused_at(rig)[0] is PauseReason.STEP
        seen += rig.do(StepForward())
    assert seen == ["move b:LIN", "move c:CIRC<a", "move a:SPLINE<b<c"]
    assert rig.done() == ["finished"]


def test_a_step_passes_what_takes_no_time() -> None:
    rig = ProgramRig("loop 2\n# first\nset output 1 on\nend\nset output 2 on")
    assert rig.start(step=True) == ["output 1 on"]
    rig.done()
    assert rig.do(StepForward()) == ["output 1 on"]
    rig.done()
    assert rig.do(StepForward()) == ["output 2 on"]


def test_a_run_goes_on_from_a_step() -> None:
    rig = ProgramRig(MOVES)
    rig.start(step=True)
    rig.done()
    assert rig.do(Resume()) == ["move b:LIN~ c:CIRC<a"]
    assert rig.done() == ["move a:SPLINE<b<c"]


def test_a_step_out_of_a_pause_ends_the_statement_under_way() -> None:
    rig = ProgramRig(MOVES)
    rig.start()
    rig.do(Pause())
    assert rig.do(StepForward()) == ["resume motion"]
    assert rig.done() == []
    assert paused_at(rig) == (PauseReason.STEP, 1)


def test_steps_back_go_the_same_way_in_reverse() -> None:
    rig = ProgramRig(MOVES + "\nmove PTP b")
    rig.start()
    for _ in range(2):
        rig.done()
    rig.do(Pause())
    rig.done()
    back = []
    while (found := rig.do(StepBack()))[0].startswith("move"):
        back += found
        assert rig.done() == []
    assert back == ["move c:SPLINE<c<b", "move b:CIRC<a", "move a:LIN"]
    assert found == ["refused STEP_BACK_REFUSED"]
    assert paused_at(rig) == (PauseReason.STEP, 1)


def test_a_step_forward_after_one_back_is_the_same_statement_again() -> None:
    rig = ProgramRig("loop 3\nmove PTP a\nmove LIN b\nend")
    rig.start(step=True)
    for _ in range(3):
        rig.done()
        rig.do(StepForward())
    rig.done()
    before = rig.runner.status.stack
    rig.do(StepBack())
    rig.done()
    assert rig.do(StepForward()) == ["move b:LIN"]
    rig.done()
    assert rig.runner.status.stack == before
    rig.do(Resume())
    assert [rig.done() for _ in range(2)] == [["move b:LIN"], ["finished"]]


def test_a_way_back_has_no_zone_no_dwell_and_the_speed_of_the_way() -> None:
    rig = ProgramRig("move PTP a\nmove LIN b speed 20 mm/s dwell 1 s\nwait 1 s")
    rig.start(step=True)
    rig.done()
    rig.do(StepForward())
    rig.done()
    rig.after(1.0)
    assert rig.do(StepBack()) == ["move a:LIN"]
    move = rig.block.moves[0].move
    assert (move.speed.value, move.zone, move.dwell) == (0.02, 0.0, 0.0)


@pytest.mark.parametrize(
    ("statements", "steps"),
    [
        ("move PTP a\nmove PTP b\nset output 1 on", 3),
        ("move PTP a\nmove PTP b\nattach part\nwait 1 s", 3),
        ("move PTP a", 0),
        ("move PTP a\nwait 1 s", 1),
    ],
)
def test_a_step_back_over_an_effect_or_the_start_is_refused(statements: str, steps: int) -> None:
    rig = ProgramRig(statements + "\nwait 1 s")
    rig.start(step=True)
    for _ in range(steps - 1):
        rig.done()
        rig.do(StepForward())
    rig.done()
    assert rig.do(StepBack()) == ["refused STEP_BACK_REFUSED"]


def test_a_step_back_out_of_the_middle_of_a_motion_is_refused() -> None:
    rig = ProgramRig(MOVES)
    rig.start()
    rig.done()
    rig.do(Pause())
    assert rig.do(StepBack()) == ["refused STEP_BACK_REFUSED"]


def test_a_run_pauses_before_a_breakpoint_and_goes_on_behind_it() -> None:
    rig = ProgramRig("loop 2\nset output 1 on\nset output 2 on\nend")
    rig.break_at(("main", 2))
    rig.start()
    for _ in range(2):
        assert rig.done() == []
        assert paused_at(rig) == (PauseReason.BREAKPOINT, 2)
        assert rig.do(Resume()) == ["output 2 on"]
        rest = rig.done()
    assert rest == ["finished"]


def test_a_breakpoint_in_a_called_program() -> None:
    rig = ProgramRig("call x\nwait 1 s", {"x": "# here\nset output 1 on"})
    rig.break_at(("x", 0))
    assert rig.start() == []
    assert rig.here == [("main", 0), ("x", 0)]
    assert rig.do(Resume()) == ["output 1 on"]


def test_a_breakpoint_at_the_start_pauses_a_run_but_not_a_step() -> None:
    rig = ProgramRig("set output 1 on")
    rig.break_at(("main", 0))
    assert rig.start() == []
    assert rig.do(StepForward()) == ["output 1 on"]
    rig.do(Stop())
    assert rig.start(step=True) == ["output 1 on"]


def test_a_breakpoint_holds_also_behind_a_pause() -> None:
    rig = ProgramRig("set output 1 on\nset output 2 on")
    rig.break_at(("main", 1))
    rig.start()
    rig.do(Pause())
    rig.done()
    assert rig.do(Resume()) == []
    assert paused_at(rig) == (PauseReason.BREAKPOINT, 1)


def test_a_breakpoint_that_is_taken_away_pauses_nothing() -> None:
    rig = ProgramRig("set output 1 on\nset output 2 on")
    rig.break_at(("main", 1))
    rig.start()
    rig.break_at()
    assert rig.done() == ["output 2 on"]


FOUR_MOVES = "move PTP a\nmove PTP b\nmove PTP c\nmove PTP a"
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
    rig = ProgramRig(FOUR_MOVES)
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
    rig = ProgramRig(FOUR_MOVES)
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
    rig = ProgramRig(FOUR_MOVES)
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


REFUSED = ["refused STEP_BACK_REFUSED"]
EFFECTS = ("set output 2 on", "attach part", "detach part")
KINDS_OF_MOVE = ("move PTP a", "move PTP b", "move LIN c")


def stepped(statements: str) -> ProgramRig:
    rig = ProgramRig(statements + "\nwait 1 s\nwait 1 s")
    rig.start(step=True)
    for _ in statements.splitlines()[1:]:
        answer_it(rig)
        rig.do(StepForward())
    answer_it(rig)
    return rig


def answer_it(rig: ProgramRig) -> None:
    if isinstance(rig.actions[-1], QueryInput):
        rig.value(True)
    else:
        rig.done()


def stepped_back(rig: ProgramRig) -> list[str]:
    log: list[str] = []
    while not log or log[-1] != REFUSED[0]:
        log += rig.do(StepBack())
        rig.done()
    return log


@pytest.mark.parametrize(
    ("statements", "log"),
    [
        ("move PTP a\nmove PTP b\nset output 2 on\nmove PTP a", ["move b"]),
        ("move PTP a\nmove PTP b\nattach part\nmove LIN c\nmove PTP a", ["move c", "move b:LIN"]),
        ("move PTP a\nset output 1 on\nset output 2 on\nmove PTP b", ["move a"]),
        ("move PTP a\nmove PTP b\nset output 2 on", []),
        ("set output 1 on\nmove PTP a\nmove PTP b", ["move a"]),
        ("move PTP a\nread input 1 into x\nmove PTP b\nmove PTP c", ["move b", "move a"]),
    ],
)
def test_steps_back_lead_as_far_as_the_last_effect(statements: str, log: list[str]) -> None:
    assert stepped_back(stepped(statements)) == [*log, *REFUSED]


def test_what_was_refused_to_go_back_over_is_not_done_again_on_the_way_forward() -> None:
    rig = stepped("move PTP a\nmove PTP b\nset output 2 on\nmove PTP a")
    assert stepped_back(rig) == ["move b", *REFUSED]
    assert rig.do(StepForward()) == ["move a"]
    rig.done()
    assert stepped_back(rig) == ["move b", *REFUSED]


def test_the_refusal_names_what_is_not_undone() -> None:
    rig = stepped("move PTP a\nmove PTP b\nset output 2 on\nmove PTP a")
    stepped_back(rig)
    refused = rig.actions[-1]
    assert isinstance(refused, EventRefused)
    assert "'set output 2 on'" in refused.refusal.text


@given(st.lists(st.sampled_from([*KINDS_OF_MOVE, *EFFECTS]), min_size=1, max_size=12), st.data())
def test_a_step_back_is_refused_exactly_where_an_effect_lies_on_it(
    statements: list[str], data: st.DataObject
) -> None:
    rig = ProgramRig("\n".join(statements) + "\nwait 1 s\nwait 1 s")
    rig.start(step=True)
    rig.done()
    behind = [statements[0]]  # what lies between the start and the place where the robot stands
    for _ in range(data.draw(st.integers(0, 30))):
        forward = data.draw(st.booleans())
        if forward and len(behind) < len(statements):
            rig.do(StepForward())
            rig.done()
            behind.append(statements[len(behind)])
        elif not forward:
            before_last = [each for each in behind[:-1] if each in KINDS_OF_MOVE]
            possible = behind[-1] in KINDS_OF_MOVE and bool(before_last)
            assert (rig.do(StepBack()) != REFUSED) == possible
            if possible:
                rig.done()
                behind.pop()
        assert rig.runner.status.state is RunState.PAUSED
