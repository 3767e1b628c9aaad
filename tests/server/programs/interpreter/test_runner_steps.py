import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.expectations import expect
from rigs.cells.program_rig import ProgramRig, Scenario

from openpendant.server.programs.interpreter import run_events as run
from openpendant.simplemsg.verdicts import VerdictCode as V

MOVES = "move PTP a\nmove LIN b zone 5 mm\nmove CIRC c via a\nmove SPLINE a via b c speed 20 mm/s"


FOUR_MOVES = "move PTP a\nmove PTP b\nmove PTP c\nmove PTP a"
JOINED = "move PTP a\nmove PTP b zone 1 deg\nmove PTP c zone 1 deg\nmove PTP a\nmove PTP b"
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
    "a pause of a whole run that ends its move stays a pause": Scenario(
        FOUR_MOVES,
        "start -> approach a; pause -> pause motion; done; where -> paused request main:1",
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
