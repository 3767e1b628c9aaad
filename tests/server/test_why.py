"""Why is it not moving: the whole chain, the first broken condition, its cause and remedy."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from jog_pad import JogPad
from server_rig import ServerRig, ready

from openpendant.server.controller_path import ControllerPath
from openpendant.server.readiness import Condition
from openpendant.simplemsg import ReplyCode
from openpendant.simplemsg.pendant import Management
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

V = VerdictCode


def ask(pad: JogPad, **request: str) -> Any:
    (reply,) = pad.pendant.send(Management(7, json.dumps({"op": "why", **request}).encode()))
    assert isinstance(reply, Management)
    assert reply.reply_code == ReplyCode.SUCCESS
    return json.loads(reply.body)


def nothing(rig: ServerRig, pad: JogPad) -> None:
    return


def no_authority(rig: ServerRig, pad: JogPad) -> None:
    pad.pendant.release()


def stopped(rig: ServerRig, pad: JogPad) -> None:
    pad.pendant.stop("tea")


def no_link(rig: ServerRig, pad: JogPad) -> None:
    rig.path(ControllerPath.MOTION, False)


def stale(rig: ServerRig, pad: JogPad) -> None:
    rig.controller.reports = False
    rig.wait(200)


def moving(rig: ServerRig, pad: JogPad) -> None:
    pad.pendant.move(1.0, 0.5)
    pad.hold(100)


def emergency_stop(rig: ServerRig, pad: JogPad) -> None:
    rig.controller.e_stopped = True
    rig.wait(20)


def manual(rig: ServerRig, pad: JogPad) -> None:
    pad.mode(1)


def recovery(rig: ServerRig, pad: JogPad) -> None:
    pad.mode(4)


def outside(rig: ServerRig, pad: JogPad) -> None:
    rig.controller.position = (2.1, 0.0)
    rig.wait(20)


CASES: list[tuple[Callable[[ServerRig, JogPad], None], str, V]] = [
    (no_authority, "authority", V.NOT_IN_CONTROL),
    (stopped, "stop", V.STOP_LATCHED),
    (no_link, "link", V.CONTROLLER_DOWN),
    (stale, "feedback", V.FEEDBACK_STALE),
    (moving, "standing", V.MOVING),
    (emergency_stop, "controller", V.CONTROLLER_NOT_READY),
    (manual, "enabling", V.NOT_ENABLED),
    (recovery, "mode", V.MODE_FORBIDS),
    (outside, "limits", V.OUTSIDE_LIMITS),
]


@pytest.mark.parametrize(("happens", "condition", "code"), CASES, ids=[case[1] for case in CASES])
def test_the_first_broken_condition_is_named_with_cause_and_remedy(
    happens: Callable[[ServerRig, JogPad], None], condition: str, code: V
) -> None:
    rig = ready()
    pad = JogPad(rig)
    happens(rig, pad)
    answer = ask(pad)
    assert (answer["ready"], answer["broken"]) == (False, condition)
    report = next(each for each in answer["conditions"] if each["condition"] == condition)
    assert (report["holds"], report["code"], report["name"]) == (False, code, code.name)
    assert (report["cause"], report["remedy"]) == (CATALOGUE[code].cause, CATALOGUE[code].remedy)
    assert report["text"]
    # What it says is what a motion would be refused for.
    assert pad.pendant.move(0.1, 0.1) is code


def test_the_chain_is_complete_where_all_is_well() -> None:
    rig = ready()
    answer = ask(JogPad(rig))
    assert (answer["ready"], answer["broken"], answer["cell"]) == (True, "", "cell")
    assert {each["condition"] for each in answer["conditions"]} == {
        condition.name.lower() for condition in Condition
    }


def test_an_onlooker_asks_for_whoever_is_in_control_or_for_itself() -> None:
    rig = ready()
    JogPad(rig)
    onlooker = JogPad(rig, "onlooker", takes=False)
    assert ask(onlooker)["ready"]
    assert ask(onlooker, whose="mine")["broken"] == "authority"


def test_each_kind_of_motion_has_its_own_answer() -> None:
    rig = ready()
    pad = JogPad(rig)
    assert ask(pad, kind="program")["ready"]
    assert ask(pad, kind="jog")["broken"] == "mode"


def test_asking_changes_nothing() -> None:
    rig = ready()
    pad = JogPad(rig)
    moving(rig, pad)
    before = len(rig.stops), rig.activity()
    ask(pad)
    assert (len(rig.stops), rig.activity()) == before


@pytest.mark.parametrize("request_body", [{"kind": "fly"}, {"whose": "theirs"}, {"more": "1"}])
def test_a_question_that_is_none_is_refused(request_body: dict[str, str]) -> None:
    pad = JogPad(ready())
    body = json.dumps({"op": "why", **request_body}).encode()
    (reply,) = pad.pendant.send(Management(7, body))
    assert isinstance(reply, Management)
    assert reply.reply_code == ReplyCode.FAILURE
