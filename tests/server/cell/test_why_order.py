"""Whoever mends what `why` names first, again and again, is ready soon and mends nothing twice.

Conditions are broken at random over a real core, and mended as the catalogue says: a stop by its
reset, a joint outside its limits in the recovery mode.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rigs.cells.broken_conditions import (
    give_the_authority_back,
    lose_the_link,
    lose_the_reports,
    lower_the_override,
    stand_outside,
    stop,
    stop_the_controller,
    turn_to_automatic,
    turn_to_recovery,
)
from rigs.cells.guarded_rig import GuardedRig, log_in
from rigs.cells.server_rig import ServerRig, ready
from rigs.data.example_counts import examples
from rigs.motion.jog_pad import JogPad

from openpendant.server.cell.interlocks import InterlockKind
from openpendant.server.events.cell_events import RunningProgram
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg.pendant import (
    Activity,
    Management,
    MotionControlAction,
    OperatingMode,
    ProgramState,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

KINDS = ("move", "jog", "program")
PROGRAM_STOP = MotionControlAction.PROGRAM_STOP


def ask(pad: JogPad, kind: str) -> Any:
    request = json.dumps({"op": "why", "kind": kind, "whose": "mine"}).encode()
    (reply,) = [each for each in pad.pendant.send(Management(7, request)) if _is_answer(each)]
    return json.loads(reply.body)  # type: ignore[attr-defined]  # of a management request


def _is_answer(message: object) -> bool:
    return isinstance(message, Management)


# How each condition is broken.


def let_go(rig: ServerRig, pad: JogPad) -> None:
    pad.let_go()


def press_through(rig: ServerRig, pad: JogPad) -> None:
    pad.squeeze(2)


def pause_a_motion(rig: ServerRig, pad: JogPad) -> None:
    pad.pendant.move(1.0, 0.5)
    pad.hold(100)
    pad.control(MotionControlAction.PAUSE)
    pad.hold(500)


def leave_a_program_paused(rig: ServerRig, pad: JogPad) -> None:
    rig.core.cell.program = RunningProgram("main", ProgramState.PAUSED, 3, 1)


BREAKS: tuple[Callable[[ServerRig, JogPad], None], ...] = (
    pause_a_motion,
    leave_a_program_paused,
    turn_to_automatic,
    turn_to_recovery,
    stand_outside,
    stop,
    let_go,
    press_through,
    stop_the_controller,
    lower_the_override,
    give_the_authority_back,
    lose_the_reports,
    lose_the_link,
)
"""In an order in which the later ones keep the earlier from nothing."""


# How a user mends it.


def connect_again(rig: ServerRig, pad: JogPad, kind: str) -> None:
    rig.path(ControllerPath.MOTION, True)
    pad.hold(20)


def report_again(rig: ServerRig, pad: JogPad, kind: str) -> None:
    rig.controller.reports = True
    pad.hold(20)


def take(rig: ServerRig, pad: JogPad, kind: str) -> None:
    assert pad.pendant.take() is V.ACCEPTED


def come_back_inside(rig: ServerRig, pad: JogPad, kind: str) -> None:
    is_ours = rig.core.cell.modes.is_ours
    assert pad.mode(OperatingMode.RECOVERY) is (V.ACCEPTED if is_ours else V.MODE_NOT_OURS)
    mend_all(rig, pad, "jog")
    assert pad.press(-1.0, 0.0) is V.ACCEPTED
    pad.hold(3_000)
    pad.release()
    settle(rig, pad)


def set_a_mode(rig: ServerRig, pad: JogPad, kind: str) -> None:
    assert pad.mode(OperatingMode.MANUAL_REDUCED) is V.ACCEPTED


def reset(rig: ServerRig, pad: JogPad, kind: str) -> None:
    settle(rig, pad)
    assert pad.pendant.reset() is V.ACCEPTED


def hold_anew(rig: ServerRig, pad: JogPad, kind: str) -> None:
    pad.let_go()
    pad.squeeze()


def reset_the_controller(rig: ServerRig, pad: JogPad, kind: str) -> None:
    rig.controller.e_stopped = False
    pad.hold(20)


def raise_the_override(rig: ServerRig, pad: JogPad, kind: str) -> None:
    assert pad.speed(1.0) is V.ACCEPTED


def end_the_program(rig: ServerRig, pad: JogPad, kind: str) -> None:
    rig.core.cell.program = None


def end_the_motion(rig: ServerRig, pad: JogPad, kind: str) -> None:
    if rig.activity() is not Activity.STOPPING:
        assert pad.control(PROGRAM_STOP) is V.ACCEPTED
    settle(rig, pad)


MENDS: dict[str, Callable[[ServerRig, JogPad, str], None]] = {
    "link": connect_again,
    "feedback": report_again,
    "authority": take,
    "limits": come_back_inside,
    "mode": set_a_mode,
    "stop": reset,
    "enabling": hold_anew,
    "controller": reset_the_controller,
    "override": raise_the_override,
    "program": end_the_program,
    "standing": end_the_motion,
}


def settle(rig: ServerRig, pad: JogPad) -> None:
    for _ in range(50):
        if not rig.core.cell.is_busy:
            return
        pad.hold(20)


def mend_all(rig: ServerRig, pad: JogPad, kind: str) -> list[str]:
    mended: list[str] = []
    while (broken := ask(pad, kind)["broken"]) and broken not in mended:
        mended.append(broken)
        MENDS[broken](rig, pad, kind)
    assert not broken, f"{broken} is to be mended again after {', '.join(mended)}"
    return mended


@settings(max_examples=examples(30, in_soak=3_000))
@given(
    kind=st.sampled_from(KINDS),
    selector=st.sampled_from(["server", "controller"]),
    broken=st.sets(st.sampled_from(range(len(BREAKS)))),
)
@example(kind="jog", selector="server", broken={BREAKS.index(stop)})
@example(kind="move", selector="server", broken={*map(BREAKS.index, (stand_outside, let_go))})
@example(
    kind="move", selector="server", broken={*map(BREAKS.index, (stand_outside, turn_to_recovery))}
)
@example(kind="program", selector="server", broken=set(range(len(BREAKS))))
def test_who_mends_the_first_broken_condition_each_time_mends_none_twice(
    kind: str, selector: str, broken: set[int]
) -> None:
    rig = ready(modes={"initial": "manual_reduced", "selector": selector})
    pad = JogPad(rig)
    pad.squeeze()
    for number in sorted(broken):
        BREAKS[number](rig, pad)
    names = [condition.name.lower() for condition in InterlockKind]
    order = [names.index(each) for each in mend_all(rig, pad, kind)]
    assert order == sorted(order), "what was mended first stands first"
    if kind == "move":
        assert pad.pendant.move(0.1, 0.1) is V.ACCEPTED
    elif kind == "jog":
        assert pad.press(-1.0, 0.0) is V.ACCEPTED


@pytest.mark.parametrize(
    ("kind", "breaks", "mended"),
    [
        ("jog", stop, ["stop", "enabling"]),
        ("move", stand_outside, ["limits", "mode", "enabling"]),
        ("jog", stand_outside, ["limits"]),
        ("jog", turn_to_automatic, ["mode", "enabling"]),
        ("move", give_the_authority_back, ["authority"]),
    ],
)
def test_what_a_user_is_told_one_after_the_other(
    kind: str, breaks: Callable[[ServerRig, JogPad], None], mended: list[str]
) -> None:
    rig = ready(modes={"initial": "manual_reduced"})
    pad = JogPad(rig)
    pad.squeeze()
    breaks(rig, pad)
    assert mend_all(rig, pad, kind) == mended


def test_the_order_of_the_conditions_is_the_order_of_the_chain() -> None:
    named = [each["condition"] for each in ask(JogPad(ready()), "move")["conditions"]]
    assert named == [condition.name.lower() for condition in InterlockKind]


def test_a_login_comes_before_the_authority_which_it_ends() -> None:
    rig = GuardedRig()
    pad = JogPad(rig, takes=False)
    told = [ask(pad, "move")["broken"]]
    assert log_in(pad.pendant, "otto") is V.ACCEPTED
    told.append(ask(pad, "move")["broken"])
    assert pad.pendant.take() is V.ACCEPTED
    told.append(ask(pad, "move")["broken"])
    assert told == ["role", "authority", ""]
