from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
from rigs.data.program_samples import linked

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
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode as V

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
FAULT = Refusal(V.CONTROLLER_LOST)
EVENTS: st.SearchStrategy[Event] = st.one_of(
    st.builds(Start, st.integers(0, 13), st.one_of(st.none(), st.integers(1, 2)), st.booleans()),
    st.sampled_from(
        [Pause(), Resume(), StepForward(), StepBack(), Stop(), TimePassed(), TimePassed()]
    ),
    st.builds(RequestDone, REQUESTS),
    st.builds(RequestDone, REQUESTS),
    st.builds(InputValue, REQUESTS, st.booleans()),
    st.builds(Passed, REQUESTS, st.integers(-1, 3)),
    st.builds(RequestAborted, REQUESTS, st.just(FAULT)),
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
