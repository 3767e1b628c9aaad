"""The pendant face: hello, who is closed for silence, and names as they are shown."""

from __future__ import annotations

import math

import pytest
from promises.promise_table import figure
from rigs.cells.server_rig import ready
from rigs.peers.server_clients import hello, joints, pose

from openpendant.simplemsg import CommType, Message, Ping, ReplyCode
from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityChanged,
    Hello,
    HelloReply,
    ResetStop,
    SoftwareStop,
    State,
    StopChanged,
    Subscribe,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

HELLO, SILENCE = round(figure(8, "hello").ms), round(figure(8, "silence").ms)


def test_hello_is_answered_with_who_and_what_is_here() -> None:
    pendant = ready().stranger()
    (reply,) = pendant.hello()
    assert isinstance(reply, HelloReply)
    assert (reply.cell, reply.robot, reply.dof, reply.session) == (
        "cell",
        "two-joints",
        2,
        pendant.session,
    )
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
    assert rig.stops == []
    assert rig.points == []


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
