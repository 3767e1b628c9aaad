import pytest
from rigs.cells.program_rig import ProgramRig, Scenario

from openpendant.server.programs.interpreter import run_events as run
from openpendant.server.programs.interpreter.control_flow import ControlFlow, Flags, Position
from openpendant.server.programs.interpreter.motion_blocks import (
    MOST_INSTANT_AT_ONCE,
    MOST_INSTANT_STATEMENTS,
    MOST_MOVES_IN_BLOCK,
)

MOST_WORK = 2 * MOST_INSTANT_AT_ONCE + 2 * MOST_MOVES_IN_BLOCK
"""Statements looked behind in one event: passed, then looked ahead over with the moves."""

COUNTED = "loop 9990\nend\n"
FIRST = "move PTP a\n"
ZONE = "move PTP b zone 1 deg\n"


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
    passes = MOST_INSTANT_STATEMENTS - 1 + passed
    rig = ProgramRig(f"loop {passes}\nend\nset output 1 on")
    assert rig.start() == []
    assert rig.ticks() == (["failed PROGRAM_STUCK"] if stuck else ["output 1 on"])
    at_once = MOST_INSTANT_STATEMENTS / MOST_INSTANT_AT_ONCE
    assert rig.now / 10_000_000 == pytest.approx(at_once, abs=1)


LIMITED = "wait input 3 on timeout {limit} s\nset output 1 on"
IN_NO_TIME: dict[str, Scenario] = {
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


@pytest.mark.parametrize("scenario", IN_NO_TIME.values(), ids=IN_NO_TIME)
def test_statements_that_take_no_time_go_as_their_scenario_says(scenario: Scenario) -> None:
    assert scenario.as_it_happens() == scenario.events


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
