from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.program_rig import ProgramRig

from openpendant.server.programs.interpreter.run_events import (
    EventRefused,
    QueryInput,
    RunState,
    StepBack,
    StepForward,
)

REFUSED = ["refused STEP_BACK_REFUSED"]
EFFECTS = ("set output 2 on", "attach part", "detach part")
MOVES = ("move PTP a", "move PTP b", "move LIN c")


def stepped(statements: str) -> ProgramRig:
    rig = ProgramRig(statements + "\nwait 1 s\nwait 1 s")
    rig.start(step=True)
    for _ in statements.splitlines()[1:]:
        answer(rig)
        rig.do(StepForward())
    answer(rig)
    return rig


def answer(rig: ProgramRig) -> None:
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


@given(st.lists(st.sampled_from([*MOVES, *EFFECTS]), min_size=1, max_size=12), st.data())
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
            before_last = [each for each in behind[:-1] if each in MOVES]
            possible = behind[-1] in MOVES and bool(before_last)
            assert (rig.do(StepBack()) != REFUSED) == possible
            if possible:
                rig.done()
                behind.pop()
        assert rig.runner.status.state is RunState.PAUSED
