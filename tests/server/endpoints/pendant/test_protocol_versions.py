"""Versions of the pendant protocol: each connection speaks that of its hello."""

from functools import partial
from typing import Any

import pytest
from rigs.cells.expectations import only
from rigs.cells.server_rig import ServerRig, ready
from rigs.peers.server_clients import Pendant

from openpendant.server.events.cell_events import MotionEnded, MotionRequest
from openpendant.server.events.effects import Send, Then
from openpendant.server.events.management_requests import ReplyTo, parse
from openpendant.server.events.replies import outcome, verdict
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import Message, ReplyCode
from openpendant.simplemsg.pendant import (
    IN_VERSION_2,
    PENDANT_MESSAGES,
    PROTOCOL_VERSION,
    PROTOCOL_VERSIONS,
    Capability,
    Declare,
    Hello,
    HelloReply,
    Management,
    Notices,
    Outcome,
    Verdict,
)
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.simplemsg.verdicts import in_version_2, since


def welcomed(rig: ServerRig, version: int) -> tuple[Pendant, HelloReply]:
    pendant = rig.stranger()
    return pendant, only(HelloReply, pendant.hello(version=version))


@pytest.mark.parametrize("version", PROTOCOL_VERSIONS)
def test_a_hello_is_answered_in_its_own_version(version: int) -> None:
    assert welcomed(ready(), version)[1].protocol_version == version


@pytest.mark.parametrize("version", [-1, 0, 1, PROTOCOL_VERSION + 1])
def test_the_refusal_of_another_version_says_the_newest(version: int) -> None:
    pendant = ready().stranger()
    told = only(Verdict, pendant.send(Hello(version, 0.0, "", "x")))
    assert (told.code, told.value, told.limit) == (V.VERSION, version, PROTOCOL_VERSION)


def test_version_2_is_offered_nothing_that_it_does_not_know() -> None:
    rig = ready()
    older, newer = (welcomed(rig, version)[1].capabilities for version in PROTOCOL_VERSIONS)
    assert older <= 4096 * 2 - 1
    assert newer & IN_VERSION_2 == older
    assert newer & Capability.NOTICES


def test_version_2_is_answered_a_newer_message_like_an_unknown_one() -> None:
    pendant, _ = welcomed(ready(), 2)
    (told,) = pendant.send(Declare(1, 0.0, Notices.WANTED, "en"))
    assert told.reply_code == ReplyCode.FAILURE
    assert not isinstance(told, Verdict)


@pytest.mark.parametrize("kind", [each for each in PENDANT_MESSAGES if each.PLACE.since > 2])
def test_a_newer_message_has_an_id_of_version_3(kind: type[Message]) -> None:
    assert 65042 <= kind.PLACE.msg_type < 65090


@pytest.mark.parametrize("code", [code for code in V if since(code) > 2])
def test_version_2_is_told_a_code_that_it_knows(code: V) -> None:
    rig = ready()
    (older, _), (newer, _) = (welcomed(rig, version) for version in PROTOCOL_VERSIONS)
    refusal = Refusal(code, "the true text")
    ended = MotionEnded(MotionRequest(0, 5), refusal, plan_time=0.0, motion_time=0.0)
    for pendant, known in ((older, in_version_2(code)), (newer, code)):
        sent = [Send(pendant.session, each) for each in (verdict(4, refusal), outcome(ended))]
        *at_once, then = rig.core.pendants.as_told([*sent, Then(partial(list, sent))])
        assert isinstance(then, Then)
        told = [each.message for each in (*at_once, *then.step()) if isinstance(each, Send)]
        found = [(each.code, each.text) for each in told if isinstance(each, Verdict | Outcome)]
        assert found == [(known, "the true text")] * 4
    assert in_version_2(code) < 180
    assert not 67 <= in_version_2(code) <= 70
    assert since(in_version_2(code)) == 2


@pytest.mark.parametrize("code", [V.STOP_LATCHED, V.LEFT_THE_PATH, V.ROBOT_FIXED])
def test_an_older_code_is_told_as_it_is(code: V) -> None:
    assert (in_version_2(code), since(code)) == (code, 2)


NEW_OPERATIONS = [op for op, kind in OPERATIONS.items() if kind.SINCE > 2]


@pytest.mark.parametrize("op", NEW_OPERATIONS)
def test_version_2_does_not_know_a_newer_operation(op: str) -> None:
    rig = ready()
    pendant, _ = welcomed(rig, 2)
    told, other = (pendant.ask(name) for name in (op, f"{op.partition('.')[0]}.nothing_like_it"))
    assert told["code"] == other["code"] == V.BAD_ARGUMENT
    assert not any(f"'{each}'" in told["text"] for each in NEW_OPERATIONS if each != op)


def test_a_management_refusal_of_version_2_has_a_code_that_it_knows() -> None:
    def told(version: int) -> bytes:
        (sent,) = ReplyTo[Any](1, 1, "ann", version).refuse(Refusal(V.NOTHING_GRIPPED, "far"))
        assert isinstance(sent, Send)
        assert isinstance(sent.message, Management)
        return sent.message.body

    assert b'"code":87' in told(2)
    assert b'"code":190' in told(3)


def refused(body: str, version: int = PROTOCOL_VERSION) -> str:
    """Return the text with which a body is refused; empty where it is read."""
    _, asked = parse(body.encode(), version)
    if not isinstance(asked, Refusal):
        return ""
    assert asked.code is V.BAD_ARGUMENT
    return asked.text


@pytest.mark.parametrize("value", ["true", "false"])
def test_a_field_of_version_3_is_an_unknown_key_of_version_2(value: str) -> None:
    body = f'{{"op":"programs.dry_run","name":"main","samples":{value}}}'
    assert refused(body, 2) == "programs.dry_run.samples: Extra inputs are not permitted"
    assert refused(body) == ""


@pytest.mark.parametrize(
    ("body", "place"),
    [
        ('"plans.samples","plan":"22"', "plans.samples.plan"),
        ('"plans.samples","plan":true', "plans.samples.plan"),
        ('"plans.samples","plan":22,"with_tool":"yes"', "plans.samples.with_tool"),
        ('"plans.samples","plan":22,"with_tool":1', "plans.samples.with_tool"),
        (
            '"plans.make","goal":{"kind":"ptp","joints":[true,0]}',
            "plans.make.goal.ptp.joints",
        ),
        ('"plans.make","goal":{"kind":"ptp","joints":["0",0]}', "plans.make.goal.ptp.joints"),
        ('"plans.make","goal":{"kind":"position","name":"a"},"speed":"1"', "plans.make.speed"),
        ('"kinematics.fk","joints":[true]', "kinematics.fk.joints"),
        ('"kinematics.ik","pose":{"position":["0",0,0]}', "kinematics.ik.pose.position"),
        ('"positions.save","name":"a","expected_revision":"1"', "positions.save.expected_revision"),
        ('"programs.dry_run","name":"main","samples":1', "programs.dry_run.samples"),
        (
            '"tools.add","name":"a","tcp":{"position":[0,0,0]},"grasp":{"part":true}',
            "tools.add.grasp.part",
        ),
        (
            '"tools.add","name":"a","tcp":{"position":[0,0,0]},"grasp":{"reach":"0.01"}',
            "tools.add.grasp.reach",
        ),
    ],
)
def test_a_wrong_type_is_refused_with_its_place_where_version_3_brought_the_field(
    body: str, place: str
) -> None:
    assert refused(f'{{"op":{body}}}').startswith(place)


def test_an_operation_of_version_2_takes_the_types_that_it_took() -> None:
    assert refused('{"op":"programs.load","name":"main","revision":"1"}') == ""


def test_declare_is_accepted_and_a_value_that_is_none_refused() -> None:
    pendant, _ = welcomed(ready(), 3)
    assert pendant.code(Declare(1, 0.0, Notices.WANTED, "en")) is V.ACCEPTED
    assert pendant.code(Declare(2, 0.0, 2, "en")) is V.BAD_ARGUMENT
    assert pendant.code(Declare(3, 0.0, Notices.WANTED, "e\x07")) is V.BAD_ARGUMENT
