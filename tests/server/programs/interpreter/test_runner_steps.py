from __future__ import annotations

import pytest
from rigs.cells.program_rig import ProgramRig

from openpendant.server.programs.interpreter.run_events import (
    Pause,
    PauseReason,
    Resume,
    RunState,
    StepBack,
    StepForward,
    Stop,
)

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
