from __future__ import annotations

import json
from typing import Any

import pytest
from rigs.cells.server_rig import ServerRig, ready
from rigs.peers.server_clients import Pendant

from openpendant.server.endpoints.pendant.management import Failure
from openpendant.server.events.effects import Send
from openpendant.server.events.management_requests import ReplyTo
from openpendant.server.refusal import Refusal
from openpendant.simplemsg import ReplyCode
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, Capability, HelloReply, Management
from openpendant.simplemsg.verdicts import VerdictCode as V


def ask(pendant: Pendant, body: bytes) -> tuple[int, Any]:
    (reply,) = pendant.send(Management(7, body))
    assert isinstance(reply, Management)
    assert reply.request_id == 7
    assert len(reply.body) < MAX_PENDANT_FRAME - 100
    return reply.reply_code, json.loads(reply.body)


def snapshot(rig: ServerRig) -> Any:
    code, body = ask(rig.pendant(), b'{"op": "snapshot"}')
    assert code == ReplyCode.SUCCESS
    return body


def test_a_snapshot_describes_robot_and_cell() -> None:
    body = snapshot(ready())
    assert body["cell"] == "cell"
    assert body["joints"][1] == {
        "name": "elbow",
        "unit": "rad",
        "lower": -2.0,
        "upper": 2.0,
        "velocity": 2.0,
        "acceleration": 4.0,
    }
    assert (body["activity"], body["link"], body["mode"]) == ("idle", "up", "auto")
    assert (body["owner"], body["stop"], body["obstacle"]) == (None, None, "")


def test_a_snapshot_names_the_owner_the_stop_and_the_obstacle() -> None:
    rig = ready()
    rig.holder("anna").stop("tea")
    body = snapshot(rig)
    assert body["owner"] == {"session": 1, "client": "anna"}
    assert body["stop"] == {"session": 1, "client": "anna", "reason": "tea"}
    assert "tea" in body["obstacle"]


def test_a_pendant_is_told_which_cells_there_are() -> None:
    code, body = ask(ready().pendant(), b'{"op": "cells"}')
    assert code == ReplyCode.SUCCESS
    assert body == {"cells": [{"cell": "cell", "robot": "two-joints"}]}


def test_a_cell_without_surroundings_offers_nothing_of_them() -> None:
    rig = ready()
    body = snapshot(rig)
    assert body["signals"] == {"offered": False, "inputs": [], "outputs": []}
    assert (body["tool"], body["recording"], body["program"]) == (None, None, None)
    assert body["recording_problem"] == ""
    (hello,) = ready().stranger().hello()
    assert isinstance(hello, HelloReply)
    offered = Capability(hello.capabilities)
    assert Capability.JOG in offered
    assert not offered & (Capability.RECORDING | Capability.SIGNALS | Capability.SCENE)


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"null",
        b"[]",
        b'{"op": "format-disk"}',
        b"{}",
        b'{"op": "snapshot", "more": 1}',
        b'{"op": NaN}',
        b"\xff\xfe\x00",
        b"[" * 60_000,
        b'{"op": "snapshot", "' + b"k" * 60_000 + b'": 1}',
        b'{"op": "' + b"x" * 60_000 + b'"}',
        b'{"op": "\\ud800"}',
    ],
)
def test_anything_else_is_refused_with_code_and_text(body: bytes) -> None:
    code, answer = ask(ready().pendant(), body)
    assert code == ReplyCode.FAILURE
    assert answer["code"] == V.BAD_ARGUMENT
    assert answer["text"]


def _refusals() -> list[dict[str, Any]]:
    reply_to: ReplyTo[Any] = ReplyTo(1, 7, "ann")
    later = reply_to.refuse(Refusal(V.OUT_OF_RANGE, "too far", 2, 1.5, 1.25))
    in_text = reply_to.refuse(Refusal(V.PROGRAM_SYNTAX), line=3, column=4)
    bodies = [ask(ready().pendant(), b'{"op": "nonsense"}')[1]]
    for (out,) in (later, in_text):
        assert isinstance(out, Send)
        assert isinstance(out.message, Management)
        bodies.append(json.loads(out.message.body))
    return bodies


def test_a_refusal_names_the_joint_the_value_and_the_limit() -> None:
    at_once, later, in_text = _refusals()
    told = [(body["joint"], body["value"], body["limit"]) for body in (at_once, later, in_text)]
    assert told == [(-1, 0.0, 0.0), (2, 1.5, 1.25), (-1, 0.0, 0.0)]
    assert "line" not in later
    assert (in_text["line"], in_text["column"]) == (3, 4)


def test_every_refusal_is_of_the_published_schema() -> None:
    for body in _refusals():
        assert Failure.model_validate(body).model_dump(exclude_none=True) == body
