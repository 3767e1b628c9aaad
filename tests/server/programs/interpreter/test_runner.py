"""Which moves are handed over together, so that zones join them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.expectations import known, only
from rigs.cells.program_rig import ProgramRig, Scenario
from rigs.data.program_samples import linked

from openpendant.server.programs.interpreter import run_events as run
from openpendant.server.programs.interpreter.motion_blocks import MOST_MOVES_IN_BLOCK
from openpendant.server.programs.interpreter.runner import Runner
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.pendant.management.statements import MOST_PASSES, SpeedKind
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


START = "move PTP a\n"
B, C = "move LIN b zone 5 mm\n", "move LIN c zone 5 mm\n"
RUNS: dict[str, Scenario] = {
    "a call runs the other program and comes back": Scenario(
        "loop 2\ncall x\nend\nset output 9 on",
        "start -> output 1 on; done -> output 1 on; done -> output 9 on; done -> finished",
        {"x": "set output 1 on\ncall y", "y": ""},
    ),
    "a start inside of a loop is its first pass": Scenario(
        "loop 2\nset output 1 on\nset output 2 on\nend\nset output 3 on",
        "start at 2 -> output 2 on; done -> output 1 on; done -> output 2 on; "
        "done -> output 3 on; done -> finished",
    ),
    "a start inside of a branch runs that branch": Scenario(
        "if input 1 on\nset output 1 on\nelse\nset output 2 on\nend\nset output 3 on",
        "start at 3 -> output 2 on; done -> output 3 on",
    ),
    "a start beside the program is refused": Scenario(
        "wait 1 s", "start at -1 -> refused BAD_ARGUMENT; start at 1 -> refused BAD_ARGUMENT"
    ),
    "events before the start change nothing": Scenario(
        "wait 1 s", "stop; answer 0; answer 7; passed 0; where -> idle"
    ),
    "a wait takes its time": Scenario(
        "wait 1.5 s\nset output 1 on", "start; 1.499 s; 0.001 s -> output 1 on"
    ),
    "a dwell begins when the robot stands": Scenario(
        "move PTP a dwell 1 s\nset output 1 on",
        "start -> approach a; 5 s; done; 0.9 s; 0.1 s -> output 1 on",
    ),
    "an input is asked again until it has the value": Scenario(
        "wait input 3 on\nset output 1 on",
        "start -> ask 3; off; 0.01 s; 0.04 s -> ask 3; 0.05 s; on -> output 1 on",
    ),
    "a timeout passes also while nobody answers": Scenario(
        "wait input 3 on timeout 2 s", "start -> ask 3; 2 s -> failed INPUT_TIMEOUT"
    ),
    "a flag that was never read fails the run": Scenario(
        "if flag ok on\nend", "start -> failed FLAG_NOT_READ"
    ),
    "comments without an end of passes fail as well": Scenario(
        "# nothing", "start for ever; ticks -> failed PROGRAM_STUCK"
    ),
    "a robot that stands at the point already is no failure": Scenario(
        "move PTP a\nmove PTP b", "start -> approach a; abort NO_MOTION -> move b"
    ),
    "a second start during a run is refused": Scenario(
        "move PTP a",
        "start -> approach a; start -> refused PROGRAM_RUNNING; pause -> pause motion; "
        "start -> refused PROGRAM_RUNNING",
    ),
    "a stop ends the motion and nothing goes on by itself": Scenario(
        "move PTP a\nmove PTP b",
        "start -> approach a; done -> move b; stop -> stop motion; where -> stopped main:1; "
        "answer 2; 60 s; resume -> refused PROGRAM_NOT_RUNNING; "
        "forward -> refused PROGRAM_NOT_RUNNING",
    ),
    "a late answer of a stopped run does not touch the next one": Scenario(
        "set output 1 on\nset output 2 on",
        "start -> output 1 on; stop; start -> output 1 on; answer 1; done -> output 2 on",
    ),
    "the call stack is reported": Scenario(
        "wait 0 s\ncall x", "start; 0 s; where -> running main:1 x:1", {"x": "# first\nwait 1 s"}
    ),
    "a block goes into a called program and out of it": Scenario(
        "move PTP a\ncall x\nmove LIN a",
        "start -> approach a; done -> move b:LIN~ c:LIN~ a:LIN",
        {"x": "move LIN b zone 5 mm\nmove LIN c zone 5 mm"},
    ),
    "a block ends before a breakpoint": Scenario(
        f"{START}{B}{C}move LIN a", "break main:3; start -> approach a; done -> move b:LIN~ c:LIN"
    ),
    "a block may end before a breakpoint at something that takes no time": Scenario(
        f"{START}{B}# here\nmove LIN c",
        "break main:2; start -> approach a; done -> move b:LIN",
    ),
    "the current line goes on within a block": Scenario(
        f"{START}{B}{C}move LIN a",
        "start -> approach a; done -> move b:LIN~ c:LIN~ a:LIN; where -> running main:1; "
        "passed 0; where -> running main:2; passed 1; where -> running main:3; passed 0; "
        "where -> running main:3; passed 2; where -> running main:3",
    ),
}


@pytest.mark.parametrize("scenario", RUNS.values(), ids=RUNS)
def test_a_run_goes_as_its_scenario_says(scenario: Scenario) -> None:
    assert scenario.as_it_happens() == scenario.events


def test_a_program_is_run_as_often_as_asked() -> None:
    rig = ProgramRig("set output 1 on")
    assert rig.start(passes=3) == ["output 1 on"]
    assert (rig.done(), rig.runner.status.passes) == (["output 1 on"], 2)
    assert (rig.done(), rig.done(), rig.runner.status.passes) == (["output 1 on"], ["finished"], 3)


def test_a_program_is_run_for_ever() -> None:
    rig = ProgramRig("set output 1 on")
    rig.start(passes=None)
    for _ in range(1_000):
        assert rig.done() == ["output 1 on"]


@pytest.mark.parametrize("passes", [0, -1, MOST_PASSES + 1])
def test_a_number_of_passes_that_cannot_be_is_refused(passes: int) -> None:
    rig = ProgramRig("wait 1 s")
    assert rig.start(passes=passes) == ["refused BAD_ARGUMENT"]
    assert rig.runner.status.state is run.RunState.IDLE


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


def test_an_input_that_comes_too_late_fails_the_run_with_both_times() -> None:
    rig = ProgramRig("wait input 3 on timeout 2 s")
    rig.start()
    rig.value(False)
    rig.after(1.99)
    rig.value(False)
    assert rig.after(0.01) == ["failed INPUT_TIMEOUT"]
    failure = known(rig.runner.status.failure)
    assert (failure.value, failure.limit) == (2.0, 2.0)
    assert failure.text == "input 3 was not on after 2.000 s"


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


@pytest.mark.parametrize(
    "statements",
    ["move PTP a", "set output 1 on", "wait input 1 on", "if input 1 on\nend", "attach part"],
)
def test_a_request_that_is_aborted_fails_the_run_with_its_reason(statements: str) -> None:
    rig = ProgramRig(statements)
    rig.start()
    assert rig.abort(FAULT) == ["failed CONTROLLER_LOST"]
    assert (rig.runner.status.failure, rig.here) == (FAULT, [("main", 0)])


def test_every_change_is_reported_once_with_its_line() -> None:
    rig = ProgramRig("wait 1 s\nwait 1 s")
    report = only(run.RunReport, rig.runner.handle(run.Start(), 0))
    (place,) = report.status.stack
    assert (place.program, place.index, place.line) == ("main", 0, 11)
    assert rig.runner.handle(run.Pause(), 0)
    assert rig.runner.handle(run.Resume(), 0)
    assert rig.after(0.5) == []
    actions = rig.runner.handle(run.Stop(), rig.now)
    assert [type(action) for action in actions] == [run.RunReport]


def test_the_end_is_an_action_and_a_report() -> None:
    finished, report = ProgramRig("").runner.handle(run.Start(), 0)
    assert isinstance(finished, run.Finished)
    assert isinstance(report, run.RunReport)
    assert report.status.state is run.RunState.FINISHED


@pytest.mark.parametrize(
    ("statements", "expected"),
    [
        (B + "move LIN c", "move b:LIN~ c:LIN"),
        (B + "move CIRC c via a zone 5 mm\nmove LIN a", "move b:LIN~ c:CIRC<a~ a:LIN"),
        ("move PTP b zone 5 deg\nmove PTP c zone 5 deg\nmove PTP a", "move b~ c~ a"),
        ("move LIN b\nmove LIN c", "move b:LIN"),
        (B + "# to c\nmove LIN c", "move b:LIN~ c:LIN"),
        (B + "set output 1 on\nmove LIN c", "move b:LIN"),
        (B + "wait 0 s\nmove LIN c", "move b:LIN"),
        (B + "if input 1 on\nmove LIN c\nend", "move b:LIN"),
        (B + "move PTP c", "move b:LIN"),
        ("move PTP b zone 5 deg\nmove LIN c", "move b"),
        (B + "move SPLINE c", "move b:LIN"),
        (B, "move b:LIN"),
        ("move LIN b dwell 1 s\nmove LIN c", "move b:LIN"),
        (B + "move LIN c dwell 1 s\nmove LIN a", "move b:LIN~ c:LIN"),
        (f"loop 2\n{B}{C}end\nmove LIN a", "move b:LIN~ c:LIN~ b:LIN~ c:LIN~ a:LIN"),
    ],
)
def test_zones_join_moves_of_one_space(statements: str, expected: str) -> None:
    rig = ProgramRig(START + statements)
    rig.start()
    assert rig.done() == [expected]


def test_an_endless_loop_is_handed_over_in_blocks() -> None:
    rig = ProgramRig(f"{START}loop\n{B}{C}end")
    rig.start()
    for _ in range(3):
        rig.done()
        assert len(rig.block.moves) == MOST_MOVES_IN_BLOCK
        assert rig.block.moves[-1].move.zone == 0.0


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
EVENTS: st.SearchStrategy[run.Event] = st.one_of(
    st.builds(run.Start, st.integers(0, 13), st.none() | st.integers(1, 2), st.booleans()),
    st.sampled_from([run.Pause(), run.Resume(), run.StepForward(), run.StepBack(), run.Stop()]),
    st.just(run.TimePassed()),
    st.builds(run.RequestDone, REQUESTS),
    st.builds(run.RequestDone, REQUESTS),
    st.builds(run.InputValue, REQUESTS, st.booleans()),
    st.builds(run.Passed, REQUESTS, st.integers(-1, 3)),
    st.builds(run.RequestAborted, REQUESTS, st.just(FAULT)),
    st.just(run.ReplaceBreakpoints(frozenset({("main", 5), ("x", 0)}))),
)
UNDER_WAY = (run.RunState.RUNNING, run.RunState.PAUSED)
WORK = (run.RequestMotion, run.ResumeMotion, run.WriteOutput, run.QueryInput)


def requests_of(actions: list[run.Action]) -> list[int]:
    kinds = (run.RequestMotion, run.WriteOutput, run.QueryInput)
    return [action.request for action in actions if isinstance(action, kinds)]


@given(st.lists(st.one_of(EVENTS, st.none()), max_size=60))
def test_nothing_moves_but_by_a_start_or_the_answer_to_an_open_request(
    events: list[run.Event | None],
) -> None:
    runner, now, open_request, highest = Runner(LINKED), 0, 0, 0
    for event in events:
        now += 50_000_000
        # None stands for what a good robot answers.
        event = event or run.RequestDone(open_request)
        before = runner.status
        actions = runner.handle(event, now)
        fresh = requests_of(actions)
        assert len(fresh) <= 1
        for request in fresh:
            assert request == highest + 1
            open_request = highest = request
        if any(isinstance(action, WORK) for action in actions):
            assert isinstance(event, run.Start) or before.state in UNDER_WAY
            assert runner.status.state is run.RunState.RUNNING
        if before.state is run.RunState.PAUSED and fresh:
            assert isinstance(event, run.Resume | run.StepForward | run.StepBack)
        if isinstance(event, run.Stop):
            assert runner.status.state not in UNDER_WAY
            assert all(isinstance(action, run.StopMotion | run.RunReport) for action in actions)
        if any(isinstance(action, run.Finished | run.Failed) for action in actions):
            assert runner.status.state in (run.RunState.FINISHED, run.RunState.FAILED)
        if any(isinstance(action, run.EventRefused) for action in actions):
            assert runner.status == before
        is_told = bool(actions) and isinstance(actions[-1], run.RunReport)
        assert is_told == (runner.status != before)
