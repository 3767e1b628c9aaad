"""The stops told apart, their reset, and the authority by force (promises 18, 19, 26)."""

from collections.abc import Callable
from typing import Any

import pytest
from rigs.cells.expectations import expect, known
from rigs.cells.robot_cell_situations import at_a_pad, enabled
from rigs.cells.server_rig import MS, ServerRig, ready
from rigs.motion.jog_pad import JogPad

from openpendant.server.events.effects import SendStop, SendToController
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import JointTrajPtFull, TriState, accepted
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityAction,
    AuthorityChanged,
    AuthorityReason,
    AuthorityWanted,
    MotionControl,
    MotionControlAction,
    StopChanged,
    StopKind,
    Verdict,
)
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.simplemsg.verdicts import VerdictCode as V


def moving(**settings: Any) -> tuple[ServerRig, JogPad]:
    rig, pad = at_a_pad(**settings)
    assert pad.pendant.move(1.0, 0.5, speed=0.5) is V.ACCEPTED
    pad.hold(300)
    return rig, pad


def force(pad: JogPad) -> V | None:
    pad.pendant.last_request += 1
    return pad.pendant.code(Authority(pad.pendant.last_request, AuthorityAction.FORCE))


# Software stop and protective stop.


def test_a_software_stop_is_latched_once_and_says_who_and_why_to_everybody() -> None:
    rig, pad = moving()
    observer = rig.pendant("observer")
    observer.stop("hand in the way")
    pad.pendant.stop("too late")
    assert known(rig.core.cell.stop).reason == "hand in the way"
    (told,) = pad.pendant.all(StopChanged)
    assert (told.stop, told.reason) == (StopKind.SOFTWARE, "hand in the way")
    assert (told.session, told.client) == (observer.session, "observer")
    rig.wait(20)
    assert pad.newest_state.stop == StopKind.SOFTWARE


def test_a_protective_stop_is_the_servers_own_and_another_kind() -> None:
    rig, pad = moving()
    rig.perform(rig.core.cell.protective_stop(Refusal(V.CERTIFICATE_REFUSED, "why"), rig.now))
    (told,) = pad.pendant.all(StopChanged)
    assert (told.stop, told.session, told.reason) == (StopKind.PROTECTIVE, 0, "why")
    pad.hold(200)
    assert pad.pendant.move(0.0, 0.0) is V.PROTECTIVE_STOP


def test_a_software_stop_takes_the_place_of_a_protective_one_and_not_the_other_way() -> None:
    rig, pad = moving()
    refusal = Refusal(V.CERTIFICATE_REFUSED, "why")
    rig.perform(rig.core.cell.protective_stop(refusal, rig.now))
    pad.pendant.stop()
    pad.hold(20)
    assert pad.newest_state.stop == StopKind.SOFTWARE
    rig.perform(rig.core.cell.protective_stop(refusal, rig.now))
    pad.hold(20)
    assert pad.newest_state.stop == StopKind.SOFTWARE


# Reset.


def test_only_the_authority_resets_and_not_before_the_robot_stands() -> None:
    rig, pad = moving()
    observer = rig.pendant("observer")
    rig.controller.coasts = True
    observer.stop()
    assert observer.reset() is V.HELD_BY_OTHER
    assert pad.pendant.reset() is V.MOVING
    rig.controller.coasts = False
    pad.hold(500)
    assert pad.pendant.reset() is V.ACCEPTED


def test_a_reset_from_before_the_stop_does_not_count() -> None:
    rig, pad = moving()
    assert pad.pendant.reset() is V.MOVING
    pad.pendant.stop()
    pad.hold(500)
    assert rig.core.cell.stop is not None


@pytest.mark.parametrize("mode", ["automatic", "manual_reduced", "manual_high", "recovery"])
def test_promise_19_a_reset_moves_nothing_and_sends_nothing(mode: str) -> None:
    rig, pad = enabled(mode)
    if mode == "automatic":
        pad.pendant.move(1.0, 0.5)
    else:
        pad.press(1.0, 0.5)
    pad.hold(300)
    pad.pendant.stop()
    pad.hold(300)
    before, stood = len(rig.log), rig.controller.position
    assert pad.pendant.reset() is V.ACCEPTED
    pad.hold(1_000)
    assert rig.controller.position == stood
    assert not [
        item for _, item in rig.log[before:] if isinstance(item, SendToController | SendStop)
    ]


# Take-over.


def test_promise_18_a_take_over_waits_for_standstill_and_is_told_to_both() -> None:
    """Always with a stop between: whoever takes over from somebody who moves stops him first."""
    rig, pad = moving()
    other = JogPad(rig, "teacher", takes=False)
    assert force(other) is V.MOVING
    assert pad.pendant.outcomes() == []
    other.pendant.stop("let me")
    assert force(other) is V.MOVING
    other.hold(1_000)
    assert force(other) is V.ACCEPTED
    assert pad.pendant.all(AuthorityChanged)[-1].reason == AuthorityReason.TAKEN_OVER
    assert pad.pendant.move(0.0, 0.0) is V.HELD_BY_OTHER
    assert other.pendant.reset() is V.ACCEPTED
    assert other.pendant.move(0.0, 0.0) is V.ACCEPTED


@pytest.mark.parametrize("mode", ["manual_reduced", "manual_high", "recovery"])
def test_promise_18_in_manual_nobody_takes_over_but_everybody_stops(mode: str) -> None:
    rig = ready(modes={"initial": mode})
    JogPad(rig)
    other = JogPad(rig, "teacher", takes=False)
    assert force(other) is V.NO_TAKE_OVER
    assert other.pendant.stop() is V.ACCEPTED


def test_no_take_over_where_a_mirrored_controller_hides_its_mode() -> None:
    rig = ready(modes={"selector": "controller"})
    rig.controller.mode = -1
    rig.wait(20)
    JogPad(rig)
    assert force(JogPad(rig, "teacher", takes=False)) is V.NO_TAKE_OVER


def test_the_remedy_of_a_refused_take_over_is_one_that_the_asker_has() -> None:
    rig = ready(modes={"initial": "manual_reduced"})
    holder = JogPad(rig, "ann")
    other = JogPad(rig, "bob", takes=False)
    assert force(other) is V.NO_TAKE_OVER
    assert "ann" in other.pendant.all(Verdict)[-1].text
    assert "Ask the holder" in CATALOGUE[V.NO_TAKE_OVER].remedy
    assert [wanted.client for wanted in holder.pendant.all(AuthorityWanted)] == ["bob"]
    assert holder.pendant.release() is V.ACCEPTED
    assert other.pendant.take() is V.ACCEPTED


def test_promise_18_a_second_one_is_refused_by_name_and_the_holder_is_told() -> None:
    rig, pad = moving()
    other = JogPad(rig, "pupil", takes=False)
    assert other.pendant.take() is V.HELD_BY_OTHER
    (wanted,) = pad.pendant.all(AuthorityWanted)
    assert wanted.client == "pupil"


# A server that stood still.


def freeze(rig: ServerRig, milliseconds: int) -> None:
    rig.now += milliseconds * MS


def test_promise_26_a_server_that_comes_back_latches_a_protective_stop() -> None:
    rig, pad = moving()
    freeze(rig, 100)
    rig.wait(10)
    assert known(rig.core.cell.stop).is_protective
    assert pad.pendant.outcomes()[-1][1] is V.SERVER_LATE
    assert rig.stops[0] == rig.now


def test_promise_26_a_short_delay_stops_nothing() -> None:
    rig, _ = moving()
    freeze(rig, 80)
    rig.wait(10)
    assert (rig.core.cell.stop, rig.activity()) == (None, Activity.MOVING)


def test_promise_26_no_set_point_leaves_for_the_time_that_was_lost() -> None:
    rig, _ = moving()
    before = len(rig.points)
    freeze(rig, 300)
    # What the loop finds first is an answer, or a message of a pendant.
    point = expect(JointTrajPtFull, rig.points[-1])
    rig.controller.awaited = 1
    rig.hear(ControllerPath.MOTION, accepted(point))
    rig.wait(500)
    assert len(rig.points) == before


def nobody_in_control(rig: ServerRig) -> None:
    rig.pendant("onlooker")
    rig.wait(10)


def one_who_took_it_after_the_last_tick(rig: ServerRig) -> None:
    rig.wait(10)
    rig.holder()


def a_robot_that_others_move(rig: ServerRig) -> None:
    status = rig.controller.status(rig.now)
    status.in_motion = TriState.TRUE
    rig.hear(ControllerPath.STATE, status)
    rig.tick()


def a_motion_that_is_planned(rig: ServerRig) -> None:
    rig.plans_at_once = False
    rig.holder().path((0.5, 0.5), (1.0, 0.0))


def a_motion_that_is_paused(rig: ServerRig) -> None:
    pendant = rig.holder()
    pendant.path((0.5, 0.5), (1.0, 0.0))
    rig.wait(200)
    pendant.code(MotionControl(99, MotionControlAction.PAUSE))
    rig.wait(1_000)
    assert rig.activity() is Activity.PAUSED


FROZEN: dict[str, tuple[Callable[[ServerRig], object], bool]] = {
    "nobody in control": (nobody_in_control, False),
    "one who rests": (JogPad, False),
    "taken after the last tick": (one_who_took_it_after_the_last_tick, False),
    "left after the last tick": (lambda rig: JogPad(rig).pendant.release(), False),
    "moved by others": (a_robot_that_others_move, True),
    "planned": (a_motion_that_is_planned, True),
    "paused": (a_motion_that_is_paused, True),
}


@pytest.mark.parametrize(("situation", "is_stopped"), FROZEN.values(), ids=FROZEN)
def test_promise_26_whom_the_watchdog_stopped_shows_the_stop_of_a_late_server(
    situation: Callable[[ServerRig], object], is_stopped: bool
) -> None:
    rig = ready()
    situation(rig)
    assert rig.core.may_move is is_stopped
    freeze(rig, 500)
    rig.wait(10)
    stop = rig.core.cell.stop
    assert (stop is not None) is is_stopped
    assert stop is None or (stop.is_protective and "510 ms" in stop.reason)


def test_after_a_freeze_at_rest_a_motion_needs_no_reset() -> None:
    rig, pad = at_a_pad()
    freeze(rig, 500)
    pad.hold(50)
    assert pad.pendant.move(1.0, 0.5) is V.ACCEPTED


def test_the_watchdog_is_told_that_the_robot_may_move_from_the_request_to_the_end() -> None:
    rig, pad = at_a_pad(plans_at_once=False)
    told = [rig.core.may_move]
    pad.pendant.path((0.1, 0.0), (0.2, 0.1))
    told.append(rig.core.may_move)
    rig.plan()
    for milliseconds in (50, 5_000):
        rig.wait(milliseconds)
        told.append(rig.core.may_move)
    assert told == [False, True, True, False]
