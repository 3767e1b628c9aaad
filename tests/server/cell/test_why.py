"""Whoever mends what `why` names first, again and again, is ready soon and mends nothing twice.

Conditions are broken at random over a real core, and mended as the catalogue says: a stop by its
reset, a joint outside its limits in the recovery mode.
"""

from collections.abc import Callable

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
    turn_to_manual,
    turn_to_recovery,
)
from rigs.cells.guarded_rig import GuardedRig, log_in
from rigs.cells.robot_cell_situations import at_a_pad, enabled
from rigs.cells.server_rig import ServerRig, ready
from rigs.data.example_counts import examples
from rigs.motion.jog_pad import JogPad

from openpendant.server.cell.interlocks import InterlockKind
from openpendant.server.cell.why import why
from openpendant.server.events.cell_events import RunningProgram
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import TriState
from openpendant.simplemsg.pendant import (
    Activity,
    MotionControlAction,
    OperatingMode,
    ProgramState,
)
from openpendant.simplemsg.pendant.management.cell import WhyRequest
from openpendant.simplemsg.verdicts import CATALOGUE, in_version_2
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.mark.parametrize(
    ("user", "link", "broken", "role"),
    [
        (None, True, "role", V.LOGIN_NEEDED),
        ("vera", True, "role", V.ROLE_TOO_LOW),
        ("otto", True, "authority", V.ACCEPTED),
        ("vera", False, "link", V.ROLE_TOO_LOW),
    ],
    ids=["nobody logged in", "a role too low", "the right role", "the link before the role"],
)
def test_a_role_that_may_not_move_the_robot_is_a_condition_of_its_own(
    user: str | None, link: bool, broken: str, role: V
) -> None:
    rig = GuardedRig()
    rig.path(ControllerPath.MOTION, link)
    pendant = rig.visitor("127.0.0.1") if user is None else rig.user(user)
    answer = pendant.ask("why")
    (told,) = [each for each in answer["conditions"] if each["condition"] == "role"]
    assert (answer["broken"], told["code"]) == (broken, role)


@pytest.mark.parametrize("request_", [{"kind": "fly"}, {"whose": "theirs"}, {"more": "1"}])
def test_a_question_that_is_none_is_refused(request_: dict[str, str]) -> None:
    _, pad = at_a_pad()
    assert pad.pendant.ask("why", **request_)["code"] == V.BAD_ARGUMENT


def moving(rig: ServerRig, pad: JogPad) -> None:
    pad.pendant.move(1.0, 0.5)
    pad.hold(100)


def stopped_controller_in_manual(rig: ServerRig, pad: JogPad) -> None:
    stop_the_controller(rig, pad)
    turn_to_manual(rig, pad)


def lowered_to_0(rig: ServerRig, pad: JogPad) -> None:
    moving(rig, pad)
    lower_the_override(rig, pad)
    pad.hold(500)


def dead_and_free(rig: ServerRig, pad: JogPad) -> None:
    for path in ControllerPath:
        rig.path(path, False)
    give_the_authority_back(rig, pad)


CASES: list[tuple[Callable[[ServerRig, JogPad], None], str, V]] = [
    (give_the_authority_back, "authority", V.NOT_IN_CONTROL),
    (stop, "stop", V.STOP_LATCHED),
    (lose_the_link, "link", V.CONTROLLER_DOWN),
    (lose_the_reports, "feedback", V.FEEDBACK_STALE),
    (moving, "standing", V.MOVING),
    (stop_the_controller, "controller", V.CONTROLLER_NOT_READY),
    (turn_to_manual, "enabling", V.NOT_ENABLED),
    (turn_to_recovery, "mode", V.MODE_FORBIDS),
    (stand_outside, "limits", V.OUTSIDE_LIMITS),
    (lower_the_override, "override", V.OVERRIDE_ZERO),
    (lowered_to_0, "override", V.OVERRIDE_ZERO),
    (dead_and_free, "link", V.CONTROLLER_DOWN),
    (stopped_controller_in_manual, "enabling", V.NOT_ENABLED),
]


@pytest.mark.parametrize(
    ("happens", "condition", "code"), CASES, ids=[case[0].__name__ for case in CASES]
)
def test_the_first_broken_condition_is_named_with_cause_and_remedy(
    happens: Callable[[ServerRig, JogPad], None], condition: str, code: V
) -> None:
    rig, pad = at_a_pad()
    happens(rig, pad)
    answer = pad.pendant.ask("why")
    assert (answer["ready"], answer["broken"]) == (False, condition)
    report = next(each for each in answer["conditions"] if each["condition"] == condition)
    assert (report["holds"], report["code"], report["name"]) == (False, code, code.name)
    assert (report["cause"], report["remedy"]) == (CATALOGUE[code].cause, CATALOGUE[code].remedy)
    assert report["text"]
    # What it says is what a motion would be refused for.
    assert pad.pendant.move(0.1, 0.1) is code


def test_where_all_is_well_the_conditions_come_in_the_order_in_which_a_user_mends_them() -> None:
    _, pad = at_a_pad()
    answer = pad.pendant.ask("why", kind="move", whose="mine")
    assert (answer["ready"], answer["broken"], answer["cell"]) == (True, "", "cell")
    named = [each["condition"] for each in answer["conditions"]]
    assert named == [
        *("server", "link", "feedback", "role", "authority", "limits", "mode", "stop"),
        *("enabling", "controller", "override", "scene", "program", "standing"),
    ]
    assert named == [condition.name.lower() for condition in InterlockKind]


@pytest.mark.parametrize("kind", ["jog", "program"])
def test_an_override_of_0_is_told_of_every_kind_of_motion(kind: str) -> None:
    rig, pad = enabled()
    assert pad.pendant.ask("why", kind=kind)["ready"]
    lower_the_override(rig, pad)
    answer = pad.pendant.ask("why", kind=kind)
    assert (answer["ready"], answer["broken"]) == (False, "override")


@pytest.mark.parametrize("happens", [dead_and_free, lose_the_reports])
def test_without_reports_nobody_says_whether_the_robot_moves_or_stands(
    happens: Callable[[ServerRig, JogPad], None],
) -> None:
    rig, pad = at_a_pad()
    happens(rig, pad)
    conditions = {each["condition"]: each for each in pad.pendant.ask("why")["conditions"]}
    assert conditions["standing"]["code"] == V.FEEDBACK_STALE
    assert "nobody knows" in conditions["standing"]["text"]


def test_a_controller_that_calls_itself_unable_while_it_moves_is_said_to_move() -> None:
    rig, pad = at_a_pad()
    moving(rig, pad)
    status = rig.controller.status(rig.now)
    status.motion_possible = TriState.FALSE
    rig.hear(ControllerPath.STATE, status)
    assert pad.pendant.ask("why")["broken"] == "standing"


def test_an_onlooker_asks_for_whoever_is_in_control_or_for_itself() -> None:
    rig = ready()
    JogPad(rig)
    onlooker = JogPad(rig, "onlooker", takes=False)
    assert onlooker.pendant.ask("why")["ready"]
    assert onlooker.pendant.ask("why", whose="mine")["broken"] == "authority"


def test_why_the_last_motion_ended_has_a_code_that_whoever_asks_knows() -> None:
    rig, pad = at_a_pad()
    older = rig.stranger()
    older.hello(version=2)
    rig.core.cell.ended = Refusal(V.NOTHING_GRIPPED, "far")
    for pendant, code in ((pad.pendant, V.NOTHING_GRIPPED), (older, V.UNKNOWN_OBJECT)):
        ended = pendant.ask("why")["ended"]
        assert (ended["code"], ended["name"], ended["text"]) == (code, code.name, "far")


def test_a_broken_condition_has_a_code_that_whoever_asks_knows() -> None:
    rig, _ = at_a_pad()

    def frozen(_: int) -> Refusal:
        return Refusal(V.NOT_PREPARED, "not prepared")

    told = why(rig.core.cell, "cell", WhyRequest(), 1, rig.now, role=frozen, known=as_in_version_2)
    (broken,) = [each for each in told.conditions if each.text == "not prepared"]
    assert (broken.code, broken.name) == (V.CONTROLLER_NOT_READY, "CONTROLLER_NOT_READY")


def as_in_version_2(code: V) -> V:
    return V(in_version_2(code))


def test_asking_changes_nothing() -> None:
    rig, pad = at_a_pad()
    moving(rig, pad)
    pad.pendant.ask("why")
    assert (rig.stops, rig.activity()) == ([], Activity.MOVING)


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


def connect_again(rig: ServerRig, pad: JogPad) -> None:
    rig.path(ControllerPath.MOTION, True)
    pad.hold(20)


def report_again(rig: ServerRig, pad: JogPad) -> None:
    rig.controller.reports = True
    pad.hold(20)


def come_back_inside(rig: ServerRig, pad: JogPad) -> None:
    is_ours = rig.core.cell.modes.is_ours
    assert pad.mode(OperatingMode.RECOVERY) is (V.ACCEPTED if is_ours else V.MODE_NOT_OURS)
    mend_all(rig, pad, "jog")
    assert pad.press(-1.0, 0.0) is V.ACCEPTED
    pad.hold(3_000)
    pad.release()
    settle(rig, pad)


def reset(rig: ServerRig, pad: JogPad) -> None:
    settle(rig, pad)
    assert pad.pendant.reset() is V.ACCEPTED


def hold_anew(rig: ServerRig, pad: JogPad) -> None:
    pad.let_go()
    pad.squeeze()


def reset_the_controller(rig: ServerRig, pad: JogPad) -> None:
    rig.controller.e_stopped = False
    pad.hold(20)


def end_the_program(rig: ServerRig, pad: JogPad) -> None:
    rig.core.cell.program = None


def end_the_motion(rig: ServerRig, pad: JogPad) -> None:
    if rig.activity() is not Activity.STOPPING:
        assert pad.control(MotionControlAction.PROGRAM_STOP) is V.ACCEPTED
    settle(rig, pad)


MENDS: dict[str, Callable[[ServerRig, JogPad], V | None]] = {
    "link": connect_again,
    "feedback": report_again,
    "authority": lambda _, pad: pad.pendant.take(),
    "limits": come_back_inside,
    "mode": lambda _, pad: pad.mode(OperatingMode.MANUAL_REDUCED),
    "stop": reset,
    "enabling": hold_anew,
    "controller": reset_the_controller,
    "override": lambda _, pad: pad.speed(1.0),
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
    while (
        broken := pad.pendant.ask("why", kind=kind, whose="mine")["broken"]
    ) and broken not in mended:
        mended.append(broken)
        assert MENDS[broken](rig, pad) in (None, V.ACCEPTED)
    assert not broken, f"{broken} is to be mended again after {', '.join(mended)}"
    return mended


@settings(max_examples=examples(30, in_soak=3_000))
@given(
    kind=st.sampled_from(["move", "jog", "program"]),
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
    rig, pad = at_a_pad(modes={"initial": "manual_reduced", "selector": selector})
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
    rig, pad = enabled()
    breaks(rig, pad)
    assert mend_all(rig, pad, kind) == mended


def test_a_login_comes_before_the_authority_which_it_ends() -> None:
    rig = GuardedRig()
    pad = JogPad(rig, takes=False)
    assert pad.pendant.ask("why", whose="mine")["broken"] == "role"
    assert log_in(pad.pendant, "otto") is V.ACCEPTED
    assert pad.pendant.ask("why", whose="mine")["broken"] == "authority"
    assert pad.pendant.take() is V.ACCEPTED
    assert pad.pendant.ask("why", whose="mine")["broken"] == ""
