import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.expectations import expect
from rigs.cells.program_rig import ProgramRig, Scenario

from openpendant.server.programs.interpreter import motion_blocks
from openpendant.server.programs.interpreter import run_events as run
from openpendant.server.programs.interpreter.control_flow import ControlFlow, Flags, Position
from openpendant.server.programs.interpreter.motion_blocks import (
    MOST_INSTANT_AT_ONCE,
    MOST_MOVES_IN_BLOCK,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

MOVES = "move PTP a\nmove LIN b zone 5 mm\nmove CIRC c via a\nmove SPLINE a via b c speed 20 mm/s"
FOUR_MOVES = "move PTP a\nmove PTP b\nmove PTP c\nmove PTP a"
JOINED = "move PTP a\nmove PTP b zone 1 deg\nmove PTP c zone 1 deg\nmove PTP a\nmove PTP b"
MOST_WORK = 2 * MOST_INSTANT_AT_ONCE + 2 * MOST_MOVES_IN_BLOCK
"""Statements looked behind in one event: passed, then looked ahead over with the moves."""

COUNTED = "loop 9990\nend\n"
FIRST = "move PTP a\n"
ZONE = "move PTP b zone 1 deg\n"
LIMITED = "wait input 3 on timeout {limit} s\nset output 1 on"
STEPS_AND_PAUSES: dict[str, Scenario] = {
    "a motion pauses on its path and goes on there": Scenario(
        MOVES,
        "start -> approach a; pause -> pause motion; where -> paused request main:0; "
        "resume -> resume motion; done -> move b:LIN~ c:CIRC<a",
    ),
    "a motion that ends all the same leaves the run paused": Scenario(
        MOVES,
        "start -> approach a; pause -> pause motion; done; where -> paused request main:1; "
        "resume -> move b:LIN~ c:CIRC<a",
    ),
    "a pause holds a wait": Scenario(
        "wait 2 s\nset output 1 on",
        "start; 1.5 s; pause; 100 s; resume; 0.4 s; 0.1 s -> output 1 on",
    ),
    "a pause holds a dwell that begins in it": Scenario(
        "move PTP a dwell 1 s\nset output 1 on",
        "start -> approach a; pause -> pause motion; done; 100 s; resume; 1 s -> output 1 on",
    ),
    "a pause holds the time limit of an input": Scenario(
        "wait input 1 on timeout 1 s",
        "start -> ask 1; off; pause; 100 s; resume; 0.99 s -> ask 1; off; "
        "0.01 s -> failed INPUT_TIMEOUT",
    ),
    "an input that comes during a pause is taken": Scenario(
        "wait input 1 on\nset output 1 on", "start -> ask 1; pause; on; resume -> output 1 on"
    ),
    "a stop during a pause ends the run": Scenario(
        MOVES,
        "start -> approach a; pause -> pause motion; stop -> stop motion; "
        "resume -> refused PROGRAM_NOT_RUNNING",
    ),
    "steps run one statement each and stop at every point": Scenario(
        MOVES,
        "step -> approach a; done; where -> paused step main:1; forward -> move b:LIN; done; "
        "where -> paused step main:2; forward -> move c:CIRC<a; done; "
        "where -> paused step main:3; forward -> move a:SPLINE<b<c; done -> finished",
    ),
    "a step passes what takes no time": Scenario(
        "loop 2\n# first\nset output 1 on\nend\nset output 2 on",
        "step -> output 1 on; done; forward -> output 1 on; done; forward -> output 2 on",
    ),
    "only what is paused goes on": Scenario(
        MOVES,
        "resume -> refused PROGRAM_NOT_RUNNING; forward -> refused PROGRAM_NOT_RUNNING; "
        "back -> refused PROGRAM_NOT_RUNNING; start -> approach a; "
        "resume -> refused PROGRAM_NOT_RUNNING; forward -> refused PROGRAM_NOT_RUNNING; "
        "back -> refused PROGRAM_NOT_RUNNING",
    ),
    "only what runs is paused": Scenario(
        MOVES,
        "pause -> refused PROGRAM_NOT_RUNNING; start -> approach a; pause -> pause motion; "
        "pause -> refused PROGRAM_NOT_RUNNING",
    ),
    "a run steps from the request to the end of the step": Scenario(
        FOUR_MOVES,
        "where -> idle; step -> approach a; done; forward -> move b; "
        "where -> running main:1 stepping; done; where -> paused step main:2; forward -> move c; "
        "where -> running main:2 stepping; done; back -> move b; "
        "where -> running main:2 stepping; done; resume -> move c; where -> running main:2",
    ),
    "a run goes on from a step": Scenario(
        MOVES, "step -> approach a; done; resume -> move b:LIN~ c:CIRC<a; done -> move a:SPLINE<b<c"
    ),
    "a step out of a pause ends the statement under way": Scenario(
        MOVES,
        "start -> approach a; pause -> pause motion; forward -> resume motion; done; "
        "where -> paused step main:1",
    ),
    "steps back go the same way in reverse": Scenario(
        MOVES + "\nmove PTP b",
        "start -> approach a; done -> move b:LIN~ c:CIRC<a; done -> move a:SPLINE<b<c; "
        "pause -> pause motion; done; back -> move c:SPLINE<c<b; done; back -> move b:CIRC<a; "
        "done; back -> move a:LIN; done; back -> refused STEP_BACK_REFUSED; "
        "where -> paused step main:1",
    ),
    "a step forward after one back is the same statement again": Scenario(
        "loop 3\nmove PTP a\nmove LIN b\nend",
        "step -> approach a; done; forward -> move b:LIN; done; forward -> move a; done; "
        "forward -> move b:LIN; done; where -> paused step main:3; back -> move a:LIN; done; "
        "forward -> move b:LIN; done; where -> paused step main:3; resume -> move a; "
        "done -> move b:LIN; done -> finished",
    ),
    "a step back out of the middle of a motion is refused": Scenario(
        MOVES,
        "start -> approach a; done -> move b:LIN~ c:CIRC<a; pause -> pause motion; "
        "back -> refused STEP_BACK_REFUSED",
    ),
    "a run pauses before a breakpoint and goes on behind it": Scenario(
        "loop 2\nset output 1 on\nset output 2 on\nend",
        "break main:2; start -> output 1 on; done; where -> paused breakpoint main:2; "
        "resume -> output 2 on; done -> output 1 on; done; where -> paused breakpoint main:2; "
        "resume -> output 2 on; done -> finished",
    ),
    "a breakpoint in a called program": Scenario(
        "call x\nwait 1 s",
        "break x:0; start; where -> paused breakpoint main:0 x:0; resume -> output 1 on",
        {"x": "# here\nset output 1 on"},
    ),
    "a breakpoint at the start pauses a run but not a step": Scenario(
        "set output 1 on", "break main:0; start; forward -> output 1 on; stop; step -> output 1 on"
    ),
    "a breakpoint holds also behind a pause": Scenario(
        "set output 1 on\nset output 2 on",
        "break main:1; start -> output 1 on; pause; done; resume; "
        "where -> paused breakpoint main:1",
    ),
    "a breakpoint that is taken away pauses nothing": Scenario(
        "set output 1 on\nset output 2 on",
        "break main:1; start -> output 1 on; break; done -> output 2 on",
    ),
    "a step back that ends in a pause is a step that is done": Scenario(
        FOUR_MOVES,
        "step -> approach a; done; forward -> move b; done; back -> move a; "
        "pause -> pause motion; done; where -> paused step main:1",
    ),
    "a step to the end that was paused ends the run when it goes on": Scenario(
        "set output 1 on",
        "step -> output 1 on; pause; done; where -> paused request stepping; forward -> finished",
    ),
    "a step that a breakpoint ends is over": Scenario(
        "# nothing\n# here\nset output 1 on",
        "break main:1; step; where -> paused breakpoint main:1",
    ),
    "a step out of the last of joined moves ends that one": Scenario(
        JOINED,
        "start -> approach a; done -> move b~ c~ a; passed 0; passed 1; pause -> pause motion; "
        "forward -> resume motion; done; where -> paused step main:4",
    ),
    "what was refused to go back over is not done again on the way forward": Scenario(
        "move PTP a\nmove PTP b\nset output 2 on\nmove PTP a\nwait 1 s\nwait 1 s",
        "step -> approach a; done; forward -> move b; done; forward -> output 2 on; done; "
        "forward -> move a; done; back -> move b; done; back -> refused STEP_BACK_REFUSED; "
        "done; forward -> move a; done; back -> move b; done; "
        "back -> refused STEP_BACK_REFUSED; done",
    ),
    "a limit of nothing fails at the first tick behind a wrong answer": Scenario(
        LIMITED.format(limit=0), "start -> ask 3; off; 0 s -> failed INPUT_TIMEOUT"
    ),
    "a limit waits for the answer to every question": Scenario(
        LIMITED.format(limit=1), "start -> ask 3; off; 0.99 s -> ask 3; 0.01 s; on -> output 1 on"
    ),
    "a question that nobody answers does not hold a run for ever": Scenario(
        LIMITED.format(limit=0), "start -> ask 3; 0.049 s; 0.001 s -> failed INPUT_TIMEOUT"
    ),
    "a pause holds the time that an answer may take": Scenario(
        LIMITED.format(limit=0), "start -> ask 3; pause; 10 s; resume; 0.01 s; on -> output 1 on"
    ),
    "the count of going round begins anew behind what takes time": Scenario(
        f"{COUNTED}set output 1 on\n{COUNTED}set output 2 on",
        "start; ticks -> output 1 on; done; ticks -> output 2 on",
    ),
    "a step back from between two such ticks goes along the last move": Scenario(
        FIRST + "move PTP b\n" + COUNTED + "move PTP c",
        "start -> approach a; done -> move b; done; 0.01 s; pause; back -> move a; done; "
        "where -> paused step main:1; resume -> move b",
    ),
}


@pytest.mark.parametrize("scenario", STEPS_AND_PAUSES.values(), ids=STEPS_AND_PAUSES)
def test_steps_and_pauses_go_as_their_scenario_says(scenario: Scenario) -> None:
    assert scenario.as_it_happens() == scenario.events


def test_a_way_back_has_no_zone_no_dwell_and_the_speed_of_the_way() -> None:
    rig = ProgramRig("move PTP a\nmove LIN b speed 20 mm/s dwell 1 s\nwait 1 s")
    rig.start(step=True)
    rig.done()
    rig.do(run.StepForward())
    rig.done()
    rig.after(1.0)
    assert rig.do(run.StepBack()) == ["move a:LIN"]
    move = rig.block.moves[0].move
    assert (move.speed.value, move.zone, move.dwell) == (0.02, 0.0, 0.0)


def answered(rig: ProgramRig) -> list[str]:
    return rig.value(True) if isinstance(rig.actions[-1], run.QueryInput) else rig.done()


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
    rig.do(run.StepForward())
    rig.do(run.Pause())
    assert answered(rig) == []
    state, pause = rig.runner.status.state, rig.runner.status.pause
    assert (state, pause) == (run.RunState.PAUSED, run.PauseReason.STEP)
    assert not rig.runner.is_stepping


@pytest.mark.parametrize(("passed", "left"), [(0, 3), (1, 2)])
def test_a_step_out_of_the_middle_of_joined_moves_is_refused_and_changes_nothing(
    passed: int, left: int
) -> None:
    rig = ProgramRig(JOINED)
    rig.start()
    assert rig.done() == ["move b~ c~ a"]
    for place in range(passed):
        rig.do(run.Passed(rig.request, place))
    rig.do(run.Pause())
    before = rig.runner.status
    assert rig.do(run.StepForward()) == ["refused STEP_FORWARD_REFUSED"]
    refused = expect(run.EventRefused, rig.actions[-1])
    assert (refused.refusal.value, refused.refusal.limit) == (left, 1)
    assert "accepted: resume, or a program stop" in refused.refusal.text
    assert (rig.runner.status, rig.runner.is_stepping) == (before, False)
    assert rig.do(run.Resume()) == ["resume motion"]
    assert rig.done() == ["move b"]


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
        rig.do(run.Passed(rig.request, place))
    rig.do(run.Pause())
    rig.do(run.StepBack())
    refused = expect(run.EventRefused, rig.actions[-1])
    assert refused.refusal.code is V.STEP_BACK_REFUSED
    assert accepted in refused.refusal.text


REFUSED = ["refused STEP_BACK_REFUSED"]
EFFECTS = ("set output 2 on", "attach part", "detach part")
KINDS_OF_MOVE = ("move PTP a", "move PTP b", "move LIN c")


def stepped(statements: str) -> ProgramRig:
    rig = ProgramRig(statements + "\nwait 1 s\nwait 1 s")
    rig.start(step=True)
    for _ in statements.splitlines()[1:]:
        answered(rig)
        rig.do(run.StepForward())
    answered(rig)
    return rig


def stepped_back(rig: ProgramRig) -> list[str]:
    log: list[str] = []
    while not log or log[-1] != REFUSED[0]:
        log += rig.do(run.StepBack())
        rig.done()
    return log


@pytest.mark.parametrize(
    ("statements", "log"),
    [
        ("move PTP a\nmove PTP b\nset output 2 on\nmove PTP a", ["move b"]),
        ("move PTP a\nmove PTP b\nattach part\nmove LIN c\nmove PTP a", ["move c", "move b:LIN"]),
        ("move PTP a\nset output 1 on\nset output 2 on\nmove PTP b", ["move a"]),
        ("move PTP a\nmove PTP b\nset output 2 on", []),
        ("move PTP a\nmove PTP b\nattach part", []),
        ("move PTP a", []),
        ("set output 1 on\nmove PTP a\nmove PTP b", ["move a"]),
        ("move PTP a\nread input 1 into x\nmove PTP b\nmove PTP c", ["move b", "move a"]),
    ],
)
def test_steps_back_lead_as_far_as_the_last_effect(statements: str, log: list[str]) -> None:
    assert stepped_back(stepped(statements)) == [*log, *REFUSED]


def test_the_refusal_names_what_is_not_undone() -> None:
    rig = stepped("move PTP a\nmove PTP b\nset output 2 on\nmove PTP a")
    stepped_back(rig)
    refused = expect(run.EventRefused, rig.actions[-1])
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
            rig.do(run.StepForward())
            rig.done()
            behind.append(statements[len(behind)])
        elif not forward:
            before_last = [each for each in behind[:-1] if each in KINDS_OF_MOVE]
            possible = behind[-1] in KINDS_OF_MOVE and bool(before_last)
            assert (rig.do(run.StepBack()) != REFUSED) == possible
            if possible:
                rig.done()
                behind.pop()
        assert rig.runner.status.state is run.RunState.PAUSED


@pytest.fixture
def looked_behind(monkeypatch: pytest.MonkeyPatch) -> list[Position]:
    places: list[Position] = []
    real = ControlFlow.after

    def noted(flow: ControlFlow, position: Position, flags: Flags) -> Position | None:
        places.append(position)
        return real(flow, position, flags)

    monkeypatch.setattr(ControlFlow, "after", noted)
    return places


@pytest.mark.parametrize(
    "statements",
    [
        (ZONE + COUNTED) * 99,
        COUNTED,
        COUNTED + ZONE * MOST_MOVES_IN_BLOCK,
        "loop\n" + COUNTED + "wait 0 s\nend\n",
        "call x\n" * 3,
        "loop\n" + "# nothing\n" * 900 + "end\n",
    ],
)
def test_no_event_looks_behind_more_than_a_few_hundred_statements(
    statements: str, looked_behind: list[Position]
) -> None:
    rig = ProgramRig(FIRST + statements, {"x": COUNTED})
    rig.start()
    most = 0
    for _ in range(100):
        for event in ("done", "0.01 s"):
            looked_behind.clear()
            rig.told(event)
            most = max(most, len(looked_behind))
    assert 0 < most <= MOST_WORK


def test_a_run_goes_on_where_it_was_at_the_next_tick() -> None:
    passes = MOST_INSTANT_AT_ONCE
    rig = ProgramRig(f"loop {passes}\n# nothing\nend\nset output 1 on")
    assert rig.start() == []
    assert rig.runner.status.state == run.RunState.RUNNING
    assert rig.here[0][1] in (1, 2)
    assert [rig.after(0.01), rig.after(0.01)] == [[], ["output 1 on"]]


@pytest.mark.parametrize("passes", [1, 50])
def test_all_that_takes_no_time_is_passed_at_once_where_it_is_little(passes: int) -> None:
    assert ProgramRig(f"loop {passes}\nend\nset output 1 on").start() == ["output 1 on"]


@pytest.mark.parametrize(("passed", "stuck"), [(-1, False), (0, True)])
def test_going_round_is_counted_over_all_ticks(passed: int, stuck: bool) -> None:
    """One statement enters the loop; each pass is its end."""
    passes = motion_blocks.MOST_INSTANT_STATEMENTS - 1 + passed
    rig = ProgramRig(f"loop {passes}\nend\nset output 1 on")
    assert rig.start() == []
    assert rig.ticks() == (["failed PROGRAM_STUCK"] if stuck else ["output 1 on"])
    at_once = motion_blocks.MOST_INSTANT_STATEMENTS / MOST_INSTANT_AT_ONCE
    assert rig.now / 10_000_000 == pytest.approx(at_once, abs=1)


def test_a_look_ahead_that_is_used_up_ends_the_block_at_a_stop_point() -> None:
    comments = "# nothing\n" * (MOST_INSTANT_AT_ONCE // 2)
    rig = ProgramRig(FIRST + (ZONE + comments) * 4)
    rig.start()
    assert (rig.done(), rig.done()) == (["move b~ b~ b"], ["move b"])


@pytest.mark.parametrize(("between", "moves"), [(0, "move b~ b"), (1, "move b")])
def test_the_look_ahead_passes_exactly_so_many_statements(between: int, moves: str) -> None:
    comments = "# nothing\n" * (MOST_INSTANT_AT_ONCE + between)
    rig = ProgramRig(FIRST + ZONE + comments + ZONE)
    rig.start()
    assert rig.done() == [moves]


def test_a_pause_between_two_such_ticks_holds_the_run_there() -> None:
    rig = ProgramRig(COUNTED + "set output 1 on")
    rig.start()
    rig.do(run.Pause())
    here = rig.here
    assert [rig.after(0.01) for _ in range(100)] == [[]] * 100
    assert (rig.runner.status.state, rig.here) == (run.RunState.PAUSED, here)
    assert rig.do(run.Resume()) == []
    assert rig.ticks() == ["output 1 on"]


def test_a_breakpoint_holds_wherever_the_ticks_fall() -> None:
    rig = ProgramRig("# nothing\n" * (2 * MOST_INSTANT_AT_ONCE) + "set output 1 on")
    index = 2 * MOST_INSTANT_AT_ONCE
    for breakpoint_at in (MOST_INSTANT_AT_ONCE, MOST_INSTANT_AT_ONCE + 7, index):
        rig.break_at(("main", breakpoint_at))
        rig.start()
        rig.after(0.01)
        rig.after(0.01)
        assert rig.runner.status.pause is run.PauseReason.BREAKPOINT
        assert rig.here == [("main", breakpoint_at)]
        rig.break_at()
        rig.do(run.Resume())
        while rig.runner.status.state is run.RunState.RUNNING:
            rig.after(0.01)
            rig.done()


def test_a_step_that_was_held_between_two_such_ticks_passes_no_breakpoint() -> None:
    rig = ProgramRig("# nothing\n" * 700 + "set output 1 on\nset output 2 on")
    rig.start(step=True)
    rig.do(run.Pause())
    rig.break_at(("main", rig.here[0][1]))
    assert rig.do(run.StepForward()) == []
    pauses = [rig.runner.status.pause]
    rig.do(run.StepForward())
    assert (rig.ticks(), rig.done()) == (["output 1 on"], [])
    pauses.append(rig.runner.status.pause)
    assert pauses == [run.PauseReason.BREAKPOINT, run.PauseReason.STEP]


@pytest.mark.parametrize("limit", [0, 0.02])
def test_a_limit_waits_for_the_answer_to_a_question_that_was_just_asked(limit: float) -> None:
    rig = ProgramRig(LIMITED.format(limit=limit))
    assert rig.start() == ["ask 3"]
    assert rig.after(limit) == []
    assert rig.value(True) == ["output 1 on"]
