"""Which moves are handed over together, so that zones join them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.program_rig import ProgramRig
from rigs.data.program_samples import linked

from openpendant.server.programs.interpreter.motion_blocks import MOST_MOVES_IN_BLOCK
from openpendant.server.programs.interpreter.run_events import (
    Action,
    Event,
    EventRefused,
    Failed,
    Finished,
    InputValue,
    Passed,
    Pause,
    QueryInput,
    ReplaceBreakpoints,
    RequestAborted,
    RequestDone,
    RequestMotion,
    Resume,
    ResumeMotion,
    RunReport,
    RunState,
    Start,
    StepBack,
    StepForward,
    Stop,
    StopMotion,
    TimePassed,
    WriteOutput,
)
from openpendant.server.programs.interpreter.runner import Runner
from openpendant.server.programs.language.statements import MOST_PASSES, SpeedKind
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode as V

FAULT = Refusal(V.CONTROLLER_LOST, "the link is gone")


@pytest.mark.parametrize(
    ("statements", "expected"),
    [
        ("", ["finished"]),
        ("# nothing", ["finished"]),
        ("move PTP a\nmove LIN b", ["approach a", "move b:LIN", "finished"]),
        (
            "move PTP a\nset output 1 on\nattach part\ndetach part",
            ["approach a", "output 1 on", "attach part", "detach part", "finished"],
        ),
        (
            "move PTP a\nloop 2\nmove PTP b\nloop 2\nmove PTP c\nend\nend",
            ["approach a", *(["move b", "move c", "move c"] * 2), "finished"],
        ),
        (
            "move PTP a\nif input 1 on\nmove PTP b\nelse\nmove PTP c\nend\nmove PTP a",
            ["approach a", "ask 1", "move b", "move a", "finished"],
        ),
        (
            "move PTP a\nif input 1 off\nmove PTP b\nelse\nmove PTP c\nend\nmove PTP a",
            ["approach a", "ask 1", "move c", "move a", "finished"],
        ),
        (
            "move PTP a\nif input 1 off\nmove PTP b\nend\nmove PTP a",
            ["approach a", "ask 1", "move a", "finished"],
        ),
        (
            "read input 4 into ok\nif flag ok on\nset output 1 on\nelse\nset output 2 on\nend",
            ["ask 4", "output 1 on", "finished"],
        ),
        ("wait input 3 on timeout 1 s\nset output 1 on", ["ask 3", "output 1 on", "finished"]),
    ],
)
def test_statements_run_in_order(statements: str, expected: list[str]) -> None:
    assert ProgramRig(statements).run_out() == expected


def test_a_call_runs_the_other_program_and_comes_back() -> None:
    rig = ProgramRig(
        "loop 2\ncall x\nend\nset output 9 on", {"x": "set output 1 on\ncall y", "y": ""}
    )
    assert rig.run_out() == ["output 1 on", "output 1 on", "output 9 on", "finished"]


def test_a_program_is_run_as_often_as_asked() -> None:
    rig = ProgramRig("set output 1 on")
    assert rig.start(passes=3) == ["output 1 on"]
    assert rig.done() == ["output 1 on"]
    assert rig.runner.status.passes == 2
    assert rig.done() == ["output 1 on"]
    assert rig.done() == ["finished"]
    assert rig.runner.status.passes == 3


def test_a_program_is_run_for_ever() -> None:
    rig = ProgramRig("set output 1 on")
    rig.start(passes=None)
    for _ in range(1_000):
        assert rig.done() == ["output 1 on"]


@pytest.mark.parametrize("passes", [0, -1, MOST_PASSES + 1])
def test_a_number_of_passes_that_cannot_be_is_refused(passes: int) -> None:
    rig = ProgramRig("wait 1 s")
    assert rig.start(passes=passes) == ["refused BAD_ARGUMENT"]
    assert rig.runner.status.state is RunState.IDLE


def test_the_first_motion_is_a_slow_joint_motion_and_announced() -> None:
    rig = ProgramRig("move CIRC b via a speed 500 mm/s dwell 1 s\nmove LIN c")
    assert rig.start() == ["approach b"]
    speed = rig.block.moves[0].move.speed
    assert (speed.kind, speed.value) == (SpeedKind.FRACTION, 0.1)
    announced = [rig.runner.status.approaching]
    rig.done()
    announced.append(rig.runner.status.approaching)
    assert announced == [True, False]
    assert rig.after(1.0) == ["move c:LIN"]


def test_a_first_motion_that_is_slower_still_keeps_its_speed() -> None:
    rig = ProgramRig("move PTP a speed 2 %")
    rig.start()
    assert rig.block.moves[0].move.speed.value == 0.02


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_run_starts_from_any_statement(index: int) -> None:
    rig = ProgramRig("set output 0 on\nset output 1 on\nset output 2 on")
    assert rig.start(index) == [f"output {index} on"]


def test_a_start_inside_of_a_loop_is_its_first_pass() -> None:
    rig = ProgramRig("loop 2\nset output 1 on\nset output 2 on\nend\nset output 3 on")
    assert rig.start(2) == ["output 2 on"]
    assert [rig.done() for _ in range(4)] == [
        *(["output 1 on"], ["output 2 on"], ["output 3 on"], ["finished"])
    ]


def test_a_start_inside_of_a_branch_runs_that_branch() -> None:
    rig = ProgramRig("if input 1 on\nset output 1 on\nelse\nset output 2 on\nend\nset output 3 on")
    assert rig.start(3) == ["output 2 on"]
    assert rig.done() == ["output 3 on"]


@pytest.mark.parametrize("index", [-1, 3])
def test_a_start_beside_the_program_is_refused(index: int) -> None:
    rig = ProgramRig("wait 1 s\nwait 1 s\nwait 1 s")
    assert rig.start(index) == ["refused BAD_ARGUMENT"]


def test_a_wait_takes_its_time() -> None:
    rig = ProgramRig("wait 1.5 s\nset output 1 on")
    assert rig.start() == []
    assert rig.after(1.499) == []
    assert rig.after(0.001) == ["output 1 on"]


def test_a_dwell_begins_when_the_robot_stands() -> None:
    rig = ProgramRig("move PTP a dwell 1 s\nset output 1 on")
    rig.start()
    assert rig.after(5.0) == []
    assert rig.done() == []
    assert rig.after(0.9) == []
    assert rig.after(0.1) == ["output 1 on"]


def test_an_input_is_asked_again_until_it_has_the_value() -> None:
    rig = ProgramRig("wait input 3 on\nset output 1 on")
    assert rig.start() == ["ask 3"]
    assert rig.value(False) == []
    assert rig.after(0.01) == []
    assert rig.after(0.04) == ["ask 3"]
    assert rig.after(0.05) == []  # the question is open
    assert rig.value(True) == ["output 1 on"]


def test_an_input_that_comes_too_late_fails_the_run_with_both_times() -> None:
    rig = ProgramRig("wait input 3 on timeout 2 s")
    rig.start()
    rig.value(False)
    rig.after(1.99)
    rig.value(False)
    assert rig.after(0.01) == ["failed INPUT_TIMEOUT"]
    failure = rig.runner.status.failure
    assert failure is not None
    assert (failure.value, failure.limit) == (2.0, 2.0)
    assert failure.text == "input 3 was not on after 2.000 s"


def test_a_timeout_passes_also_while_nobody_answers() -> None:
    rig = ProgramRig("wait input 3 on timeout 2 s")
    rig.start()
    assert rig.after(2.0) == ["failed INPUT_TIMEOUT"]


def test_a_flag_that_was_never_read_fails_the_run() -> None:
    rig = ProgramRig("if flag ok on\nend")
    assert rig.start() == ["failed FLAG_NOT_READ"]


def test_a_flag_is_known_in_every_program_of_the_run() -> None:
    rig = ProgramRig("call x\nif flag ok off\nset output 1 on\nend", {"x": "read input 1 into ok"})
    rig.start()
    assert rig.value(False) == ["output 1 on"]
    assert rig.runner.flags == {"ok": False}


@pytest.mark.parametrize("statements", ["loop\nend", "loop\ncall x\nend", "loop\nloop 9\nend\nend"])
def test_a_program_that_goes_round_without_doing_anything_fails(statements: str) -> None:
    rig = ProgramRig(statements, {"x": "# nothing"})
    assert rig.start() == []
    assert rig.ticks() == ["failed PROGRAM_STUCK"]


def test_comments_without_an_end_of_passes_fail_as_well() -> None:
    rig = ProgramRig("# nothing")
    assert rig.start(passes=None) == []
    assert rig.ticks() == ["failed PROGRAM_STUCK"]


@pytest.mark.parametrize(
    "statements",
    ["move PTP a", "set output 1 on", "wait input 1 on", "if input 1 on\nend", "attach part"],
)
def test_a_request_that_is_aborted_fails_the_run_with_its_reason(statements: str) -> None:
    rig = ProgramRig(statements)
    rig.start()
    assert rig.abort(FAULT) == ["failed CONTROLLER_LOST"]
    assert rig.runner.status.failure == FAULT
    assert rig.here == [("main", 0)]


def test_a_robot_that_stands_at_the_point_already_is_no_failure() -> None:
    rig = ProgramRig("move PTP a\nmove PTP b")
    rig.start()
    assert rig.abort(Refusal(V.NO_MOTION)) == ["move b"]


def test_a_second_start_during_a_run_is_refused() -> None:
    rig = ProgramRig("move PTP a")
    rig.start()
    assert rig.start() == ["refused PROGRAM_RUNNING"]
    rig.do(Pause())
    assert rig.start() == ["refused PROGRAM_RUNNING"]


def test_a_stop_ends_the_motion_and_nothing_goes_on_by_itself() -> None:
    rig = ProgramRig("move PTP a\nmove PTP b")
    rig.start()
    rig.done()
    late = rig.request
    assert rig.do(Stop()) == ["stop motion"]
    assert rig.runner.status.state is RunState.STOPPED
    assert rig.here == [("main", 1)]
    assert rig.do(RequestDone(late)) == []
    assert rig.after(60.0) == []
    assert rig.do(Resume()) == ["refused PROGRAM_NOT_RUNNING"]
    assert rig.do(StepForward()) == ["refused PROGRAM_NOT_RUNNING"]


def test_a_late_answer_of_a_stopped_run_does_not_touch_the_next_one() -> None:
    rig = ProgramRig("set output 1 on\nset output 2 on")
    rig.start()
    late = rig.request
    rig.do(Stop())
    rig.start()
    assert rig.do(RequestDone(late)) == []
    assert rig.done() == ["output 2 on"]


@pytest.mark.parametrize("event", [Stop(), RequestDone(7), Passed(7, 0)])
def test_events_before_the_start_change_nothing(event: Stop | RequestDone | Passed) -> None:
    rig = ProgramRig("wait 1 s")
    assert rig.do(event) == []
    assert rig.runner.status.state is RunState.IDLE


def test_every_change_is_reported_once_with_its_line() -> None:
    rig = ProgramRig("wait 1 s\nwait 1 s")
    (report,) = rig.runner.handle(Start(), 0)
    assert isinstance(report, RunReport)
    (place,) = report.status.stack
    assert (place.program, place.index, place.line) == ("main", 0, 11)
    assert rig.runner.handle(Pause(), 0)
    assert rig.runner.handle(Resume(), 0)
    assert rig.after(0.5) == []
    actions = rig.runner.handle(Stop(), rig.now)
    assert [type(action) for action in actions] == [RunReport]


def test_the_end_is_an_action_and_a_report() -> None:
    finished, report = ProgramRig("").runner.handle(Start(), 0)
    assert isinstance(finished, Finished)
    assert isinstance(report, RunReport)
    assert report.status.state is RunState.FINISHED


def test_the_call_stack_is_reported() -> None:
    rig = ProgramRig("wait 0 s\ncall x", {"x": "# first\nwait 1 s"})
    rig.start()
    rig.after(0.0)
    assert rig.here == [("main", 1), ("x", 1)]


START = "move PTP a\n"


def first_block(statements: str, others: dict[str, str] | None = None) -> str:
    rig = ProgramRig(START + statements, others)
    rig.start()
    return rig.done()[0]


@pytest.mark.parametrize(
    ("statements", "expected"),
    [
        ("move LIN b zone 5 mm\nmove LIN c", "move b:LIN~ c:LIN"),
        ("move LIN b zone 5 mm\nmove CIRC c via a zone 5 mm\nmove LIN a", None),
        ("move PTP b zone 5 deg\nmove PTP c zone 5 deg\nmove PTP a", "move b~ c~ a"),
        ("move LIN b\nmove LIN c", "move b:LIN"),
        ("move LIN b zone 5 mm\n# to c\nmove LIN c", "move b:LIN~ c:LIN"),
        ("move LIN b zone 5 mm\nset output 1 on\nmove LIN c", "move b:LIN"),
        ("move LIN b zone 5 mm\nwait 0 s\nmove LIN c", "move b:LIN"),
        ("move LIN b zone 5 mm\nif input 1 on\nmove LIN c\nend", "move b:LIN"),
        ("move LIN b zone 5 mm\nmove PTP c", "move b:LIN"),
        ("move PTP b zone 5 deg\nmove LIN c", "move b"),
        ("move LIN b zone 5 mm\nmove SPLINE c", "move b:LIN"),
        ("move LIN b zone 5 mm", "move b:LIN"),
        ("move LIN b dwell 1 s\nmove LIN c", "move b:LIN"),
        ("move LIN b zone 5 mm\nmove LIN c dwell 1 s\nmove LIN a", "move b:LIN~ c:LIN"),
        ("loop 2\nmove LIN b zone 5 mm\nmove LIN c zone 5 mm\nend\nmove LIN a", None),
    ],
)
def test_zones_join_moves_of_one_space(statements: str, expected: str | None) -> None:
    whole = {
        "CIRC": "move b:LIN~ c:CIRC<a~ a:LIN",
        "loop": "move b:LIN~ c:LIN~ b:LIN~ c:LIN~ a:LIN",
    }
    expected = expected or next(text for word, text in whole.items() if word in statements)
    assert first_block(statements) == expected


def test_a_block_goes_into_a_called_program_and_out_of_it() -> None:
    called = {"x": "move LIN b zone 5 mm\nmove LIN c zone 5 mm"}
    assert first_block("call x\nmove LIN a", called) == "move b:LIN~ c:LIN~ a:LIN"


def test_an_endless_loop_is_handed_over_in_blocks() -> None:
    rig = ProgramRig(START + "loop\nmove LIN b zone 5 mm\nmove LIN c zone 5 mm\nend")
    rig.start()
    for _ in range(3):
        rig.done()
        assert len(rig.block.moves) == MOST_MOVES_IN_BLOCK
        assert rig.block.moves[-1].move.zone == 0.0


def test_a_block_ends_before_a_breakpoint() -> None:
    rig = ProgramRig(START + "move LIN b zone 5 mm\nmove LIN c zone 5 mm\nmove LIN a")
    rig.break_at(("main", 3))
    rig.start()
    assert rig.done() == ["move b:LIN~ c:LIN"]


def test_a_block_may_end_before_a_breakpoint_at_something_that_takes_no_time() -> None:
    rig = ProgramRig(START + "move LIN b zone 5 mm\n# here\nmove LIN c")
    rig.break_at(("main", 2))
    rig.start()
    assert rig.done() == ["move b:LIN"]


def test_the_current_line_goes_on_within_a_block() -> None:
    rig = ProgramRig(START + "move LIN b zone 5 mm\nmove LIN c zone 5 mm\nmove LIN a")
    rig.start()
    rig.done()
    lines = [rig.here[0][1]]
    for place in (0, 1, 0, 2):
        rig.do(Passed(rig.request, place))
        lines.append(rig.here[0][1])
    assert lines == [1, 2, 3, 3, 3]


def test_the_points_of_a_block_are_in_it() -> None:
    rig = ProgramRig("move PTP a")
    rig.start()
    (move,) = rig.block.moves
    assert (move.program, move.index, move.target.name) == ("main", 0, "a")


PROGRAM = """move PTP a zone 5 deg
move PTP b
loop 2
  set output 1 on
  if input 2 on
    move LIN c zone 5 mm
    move LIN a dwell 0.1 s
  else
    wait 0.1 s
  end
  wait input 3 on timeout 0.2 s
  call x
end
"""
LINKED = linked(PROGRAM, {"x": "move LIN b\nread input 4 into ok\nif flag ok on\nmove PTP c\nend"})
REQUESTS = st.integers(1, 12)
LOST = Refusal(V.CONTROLLER_LOST)
EVENTS: st.SearchStrategy[Event] = st.one_of(
    st.builds(Start, st.integers(0, 13), st.one_of(st.none(), st.integers(1, 2)), st.booleans()),
    st.sampled_from(
        [Pause(), Resume(), StepForward(), StepBack(), Stop(), TimePassed(), TimePassed()]
    ),
    st.builds(RequestDone, REQUESTS),
    st.builds(RequestDone, REQUESTS),
    st.builds(InputValue, REQUESTS, st.booleans()),
    st.builds(Passed, REQUESTS, st.integers(-1, 3)),
    st.builds(RequestAborted, REQUESTS, st.just(LOST)),
    st.just(ReplaceBreakpoints(frozenset({("main", 5), ("x", 0)}))),
)
UNDER_WAY = (RunState.RUNNING, RunState.PAUSED)
WORK = (RequestMotion, ResumeMotion, WriteOutput, QueryInput)


def requests_of(actions: list[Action]) -> list[int]:
    kinds = (RequestMotion, WriteOutput, QueryInput)
    return [action.request for action in actions if isinstance(action, kinds)]


@given(st.lists(st.one_of(EVENTS, st.none()), max_size=60))
def test_nothing_moves_but_by_a_start_or_the_answer_to_an_open_request(
    events: list[Event | None],
) -> None:
    runner, now, open_request, highest = Runner(LINKED), 0, 0, 0
    for event in events:
        now += 50_000_000
        # None stands for what a good robot answers.
        event = event or RequestDone(open_request)
        before = runner.status
        actions = runner.handle(event, now)
        fresh = requests_of(actions)
        assert len(fresh) <= 1
        for request in fresh:
            assert request == highest + 1
            open_request = highest = request
        if any(isinstance(action, WORK) for action in actions):
            assert isinstance(event, Start) or before.state in UNDER_WAY
            assert runner.status.state is RunState.RUNNING
        if before.state is RunState.PAUSED and fresh:
            assert isinstance(event, Resume | StepForward | StepBack)
        if isinstance(event, Stop):
            assert runner.status.state not in UNDER_WAY
            assert all(isinstance(action, StopMotion | RunReport) for action in actions)
        if any(isinstance(action, Finished | Failed) for action in actions):
            assert runner.status.state in (RunState.FINISHED, RunState.FAILED)
        if any(isinstance(action, EventRefused) for action in actions):
            assert runner.status == before
        assert (actions[-1:] != [] and isinstance(actions[-1], RunReport)) == (
            runner.status != before
        )
