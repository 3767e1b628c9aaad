"""The endpoint of the pendants: hello, silence, the authority, and the state that they are sent."""

import math
from types import SimpleNamespace
from typing import cast

import pytest
from promises.promise_table import figure
from rigs.cells.expectations import only
from rigs.cells.robot_cell_situations import in_control
from rigs.cells.server_rig import MS, ServerRig, ready
from rigs.peers.server_clients import hello, joints, pose

from openpendant.motion.jog import jog_commands as motion_jog
from openpendant.motion.jog.jog_commands import JogCause
from openpendant.server.cell import state_report
from openpendant.server.cell.execution.setpoint_sources import JogRows
from openpendant.server.events.effects import Broadcast
from openpendant.server.events.events import Skipped
from openpendant.simplemsg import CommType, Message, Ping, ReplyCode
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityBeat,
    AuthorityChanged,
    AuthorityReason,
    Hello,
    HelloReply,
    JogReason,
    LinkState,
    ResetStop,
    SoftwareStop,
    State,
    StopChanged,
    Subscribe,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

HELLO, SILENCE = round(figure(8, "hello").ms), round(figure(8, "silence").ms)


def test_hello_is_answered_with_who_and_what_is_here() -> None:
    pendant = ready().stranger()
    reply = only(HelloReply, pendant.hello())
    assert (reply.cell, reply.robot, reply.dof) == ("cell", "two-joints", 2)
    assert reply.session == pendant.session
    assert (reply.tick_rate, reply.max_state_rate, reply.authority_timeout) == (100.0, 100.0, 3.0)


@pytest.mark.parametrize(
    ("message", "code"),
    [
        (Hello(99, 0.0, "", "x"), V.VERSION),
        (hello(cell="elsewhere"), V.UNKNOWN_CELL),
        (hello(state_rate=math.nan), V.BAD_ARGUMENT),
        (hello(state_rate=-1.0), V.BAD_ARGUMENT),
        (hello(state_rate=0.5), V.BAD_ARGUMENT),
        (hello(state_rate=126.0), V.BAD_ARGUMENT),
    ],
)
def test_a_refused_hello_ends_the_conversation_for_good(message: Hello, code: V) -> None:
    pendant = ready().stranger()
    assert pendant.code(message) is code
    assert len(pendant.closed_for) == 1
    assert pendant.send(hello()) == []
    assert pendant.stop() is None


def test_ping_is_answered_before_hello() -> None:
    (reply,) = ready().stranger().send(Ping())
    assert (reply.comm_type, reply.reply_code) == (CommType.REPLY, ReplyCode.SUCCESS)


@pytest.mark.parametrize(
    "message",
    [
        joints(0.1, 0.1),
        pose(),
        Authority(9, 1),
        SoftwareStop(9, ""),
        ResetStop(9),
        Subscribe(9, 10.0),
    ],
)
def test_before_hello_every_other_request_is_refused(message: Message) -> None:
    rig = ready()
    assert rig.stranger().code(message) is V.HELLO_FIRST
    assert (rig.stops, rig.points) == ([], [])


def test_a_second_hello_is_refused_and_changes_nothing() -> None:
    rig = ready()
    pendant = rig.pendant("first")
    pendant.take()
    assert pendant.code(hello("second", 50.0)) is V.BAD_ARGUMENT
    assert pendant.closed_for == []
    rig.wait(100)
    assert pendant.all(State) == []


@pytest.mark.parametrize(("silence", "closed"), [(HELLO, 0), (HELLO + 10, 1)])
def test_promise_8_who_says_no_hello_in_2_s_is_closed(silence: int, closed: int) -> None:
    rig = ready()
    pendant = rig.stranger()
    rig.wait(silence)
    assert len(pendant.closed_for) == closed


def test_promise_8_who_is_silent_for_30_s_is_closed_and_a_ping_is_enough_to_stay() -> None:
    rig = ready()
    silent, alive = rig.pendant(), rig.pendant()
    for _ in range(SILENCE // 1_000):
        rig.wait(1_000)
        alive.send(Ping())
    assert silent.closed_for == []
    rig.wait(20)
    assert silent.closed_for
    assert alive.closed_for == []


def test_names_and_reasons_are_shown_without_control_characters_and_cut() -> None:
    rig = ready()
    observer, pendant = rig.pendant(), rig.pendant("a\nb\x1b" + "ü" * 40)
    pendant.take()
    pendant.stop("\x00line\r\nbreak" + "x" * 100)
    (owner,) = observer.all(AuthorityChanged)
    (stop,) = observer.all(StopChanged)
    assert owner.client == "a?b?" + "ü" * 14
    assert stop.reason == "?line??break" + "x" * 52
    assert rig.core.cell.stop is not None
    assert rig.core.cell.stop.reason.isprintable()


def test_two_pendants_one_authority() -> None:
    rig = ready()
    anna, bert = rig.pendant("anna"), rig.pendant("bert")
    assert anna.take() is V.ACCEPTED
    assert anna.take() is V.ACCEPTED
    assert bert.take() is V.HELD_BY_OTHER
    assert "anna" in bert.all(Verdict)[-1].text
    assert bert.release() is V.NOT_IN_CONTROL
    assert bert.move(0.1, 0.1) is V.HELD_BY_OTHER
    assert anna.release() is V.ACCEPTED
    assert bert.take() is V.ACCEPTED
    reasons = [change.reason for change in anna.all(AuthorityChanged)]
    assert reasons == [AuthorityReason.GRANTED, AuthorityReason.RELEASED, AuthorityReason.GRANTED]


def test_beats_keep_the_authority_and_their_absence_ends_it_after_3_s() -> None:
    rig, pendant = in_control()
    for _ in range(10):
        rig.wait(1_000)
        pendant.send(AuthorityBeat())
    last = rig.now
    rig.wait(2_990)
    assert rig.core.cell.authority.is_held_by(pendant.session)
    rig.wait(10)
    assert (rig.core.cell.authority.holder, rig.now) == (None, last + 3_000 * MS)
    assert pendant.all(AuthorityChanged)[-1].reason == AuthorityReason.EXPIRED


@pytest.mark.parametrize(("goal", "lives"), [(0.1, True), (9.0, False)])
def test_a_motion_request_is_a_sign_of_life_where_it_is_not_refused(
    goal: float, lives: bool
) -> None:
    rig, pendant = in_control()
    rig.wait(2_000)
    pendant.move(goal, goal)
    rig.wait(990)
    assert rig.core.cell.authority.holder is not None
    rig.wait(10)
    assert (rig.core.cell.authority.holder is not None) is lives
    rig.wait(1_990)
    assert (rig.core.cell.authority.holder is not None) is lives


def test_nobody_resets_without_the_authority() -> None:
    rig = ready()
    pendant = rig.pendant()
    pendant.stop()
    assert pendant.reset() is V.NOT_IN_CONTROL


def test_a_stop_outlives_who_pressed_it() -> None:
    rig = ready()
    observer = rig.pendant()
    observer.stop()
    observer.close()
    assert rig.holder().move(0.5, 0.5) is V.STOP_LATCHED


@pytest.mark.parametrize(
    ("rate", "count"), [(0.0, 0), (1.0, 1), (25.0, 25), (100.0, 100), (125.0, 100)]
)
def test_state_comes_at_the_rate_that_was_asked_for_or_that_of_the_ticks(
    rate: float, count: int
) -> None:
    rig = ready()
    pendant = rig.pendant(state_rate=rate)
    rig.wait(10)
    pendant.got.clear()
    rig.wait(1_000)
    assert len(pendant.all(State)) == count


def test_the_rate_can_be_changed() -> None:
    rig = ready()
    pendant = rig.pendant(state_rate=100.0)
    assert pendant.code(Subscribe(5, 0.0)) is V.ACCEPTED
    rig.wait(100)
    assert pendant.all(State) == []


def test_state_carries_where_the_robot_is_what_it_does_and_how_old_that_is() -> None:
    rig, holder = in_control()
    pendant = rig.pendant(state_rate=100.0)
    holder.move(1.0, 0.5)
    rig.wait(500)
    rig.controller.reports = False
    rig.wait(120)
    state = pendant.all(State)[-1]
    assert state.positions[:2] == rig.core.cell.feedback.position
    assert (state.activity, state.holder) == (Activity.MOVING, holder.session)
    assert state.request_id == holder.last_request
    assert state.age == pytest.approx(0.12)
    assert state.link == LinkState.STALE
    assert (state.time_s * 10**9 + state.time_ns) == rig.now


def test_before_the_first_report_the_age_is_minus_1_and_no_field_valid() -> None:
    rig = ServerRig()
    pendant = rig.pendant(state_rate=100.0)
    rig.wait(10)
    (state,) = pendant.all(State)
    assert (state.age, state.valid_fields, state.link) == (-1.0, 0, LinkState.DOWN)


def test_state_is_encoded_once_for_all_who_were_equally_slow_and_each_is_told_how_slow() -> None:
    rig = ready()
    pendants = [rig.pendant(state_rate=100.0) for _ in range(3)]
    first, second, third = (pendant.session for pendant in pendants)
    for skipped, spread, dropped in (
        ((), [(first, second, third)], [0, 0, 0]),
        ((second, second), [(first, third), (second,)], [0, 2, 0]),
        ((first, third), [(first, third), (second,)], [1, 2, 1]),
    ):
        for session in skipped:
            rig.core.handle(Skipped((session,)), 0)
        out = rig.wait(10)
        assert [item.sessions for item in out if isinstance(item, Broadcast)] == spread
        assert [pendant.all(State)[-1].dropped for pendant in pendants] == dropped
        assert len({pendant.all(State)[-1].sequence for pendant in pendants}) == 1


@pytest.mark.parametrize("reason", list(motion_jog.JogSlowdown))
def test_every_reason_of_a_jogger_has_its_number_on_the_wire(
    reason: motion_jog.JogSlowdown,
) -> None:
    state = State.__new__(State)
    rows = SimpleNamespace(step=SimpleNamespace(scale=0.5, cause=JogCause(reason, 1.0, 0.5, 2)))
    state_report._tell_jog(state, cast(JogRows, rows))
    assert state.jog_reason is JogReason[reason.name]
    assert (state.jog_scale, state.jog_joint) == (0.5, 2)
