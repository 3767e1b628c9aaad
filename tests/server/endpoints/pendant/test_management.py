import json
from functools import cache
from typing import Any, get_args, get_type_hints

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import expect, only
from rigs.cells.server_rig import ready
from rigs.peers.server_clients import Pendant

from openpendant.server.endpoints.pendant.management import Failure
from openpendant.server.events.effects import Effect, Send
from openpendant.server.events.management_requests import ReplyTo, handlers_of, handles
from openpendant.server.refusal import Refusal
from openpendant.server.scene.imports import FramesImport, SceneImport, ToolsImport
from openpendant.simplemsg import ReplyCode
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, Capability, HelloReply, Management
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.management.declaration import Done, Request
from openpendant.simplemsg.pendant.management.devices import ClearTrace
from openpendant.simplemsg.verdicts import VerdictCode as V


def ask(pendant: Pendant, body: bytes) -> tuple[int, Any]:
    reply = only(Management, pendant.send(Management(7, body)))
    assert reply.request_id == 7
    assert len(reply.body) < MAX_PENDANT_FRAME - 100
    return reply.reply_code, json.loads(reply.body)


def test_a_snapshot_describes_robot_and_cell() -> None:
    body = ready().pendant().ask("snapshot")
    assert body["cell"] == "cell"
    assert body["joints"][1] == {
        "name": "elbow",
        "unit": "rad",
        "lower": -2.0,
        "upper": 2.0,
        "velocity": 2.0,
        "acceleration": 4.0,
        "display_name": "elbow",
    }
    assert (body["activity"], body["link"], body["mode"]) == ("idle", "up", "auto")
    assert (body["owner"], body["stop"], body["obstacle"]) == (None, None, "")


def test_a_snapshot_names_the_owner_the_stop_and_the_obstacle() -> None:
    rig = ready()
    rig.holder("anna").stop("tea")
    body = rig.pendant().ask("snapshot")
    assert body["owner"] == {"session": 1, "client": "anna"}
    assert body["stop"] == {"session": 1, "client": "anna", "reason": "tea"}
    assert "tea" in body["obstacle"]


def test_a_pendant_of_version_2_is_told_the_names_of_cells_and_robots() -> None:
    pendant = ready().stranger()
    pendant.hello(version=2)
    assert pendant.ask("cells") == {"cells": [{"cell": "cell", "robot": "two-joints"}]}


def test_a_cell_without_surroundings_offers_nothing_of_them() -> None:
    rig = ready()
    body = rig.pendant().ask("snapshot")
    assert body["signals"] == {"offered": False, "inputs": [], "outputs": []}
    assert (body["tool"], body["recording"], body["program"]) == (None, None, None)
    assert body["recording_problem"] == ""
    hello = only(HelloReply, ready().stranger().hello())
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
        bodies.append(json.loads(expect(Management, expect(Send, out).message).body))
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


@cache
def handlers() -> dict[type[Request[Any]], Any]:
    return dict(EmulatedCell(has_surroundings=True).core.pendants._management._handlers)


def test_a_cell_has_one_handler_for_every_operation() -> None:
    read_apart = {FramesImport, ToolsImport, SceneImport}
    assert set(handlers()) == {*OPERATIONS.values(), *read_apart}
    methods = [
        method
        for service in {type(handler.__self__) for handler in handlers().values()}
        for method in vars(service).values()
    ]
    handled = [method.handles for method in methods if hasattr(method, "handles")]
    assert len(handled) == len(set(handled))


@pytest.mark.parametrize("kind", OPERATIONS.values(), ids=OPERATIONS)
def test_a_handler_takes_its_request_and_answers_with_its_reply(kind: type[Request[Any]]) -> None:
    hints = list(get_type_hints(handlers()[kind]).values())
    assert hints[0] is kind
    assert get_args(hints[1]) == (kind.reply(),)


class Twice:
    @handles(ClearTrace)
    def first(self, asked: ClearTrace, reply: ReplyTo[Done], now: int) -> list[Effect]:
        return reply.answer({})

    @handles(ClearTrace)
    def second(self, asked: ClearTrace, reply: ReplyTo[Done], now: int) -> list[Effect]:
        return reply.answer({})


class Once:
    clear = Twice.first


@pytest.mark.parametrize("services", [(Twice(),), (Once(), Once())])
def test_a_second_handler_for_a_request_is_an_error(services: tuple[object, ...]) -> None:
    with pytest.raises(ValueError, match="ClearTrace has two handlers"):
        handlers_of(*services)
