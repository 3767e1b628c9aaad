from __future__ import annotations

import json

import pytest
from rigs.peers.server_clients import hello

from openpendant.server.access.request_gate import OF_MESSAGE, OVERTAKEN, is_overtaken
from openpendant.server.events.management_requests import parse
from openpendant.simplemsg import CommType, Message, Ping, joint_array
from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityAction,
    Home,
    JogRelease,
    JogSpace,
    JogStart,
    JointMove,
    Management,
    MotionControl,
    MotionControlAction,
    OperatingMode,
    ResetStop,
    SetMode,
    SetSpeed,
    SoftwareStop,
    Subscribe,
)
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.roles import Permission

REQUEST = CommType.REQUEST
JOINTS = RATES = joint_array((0.5, 0.5))
MOVING = {"recordings.play", "scene.attach", "scene.detach", "signals.set", "tools.select"}


def told(number: int, **body: object) -> Management:
    return Management(number, json.dumps(body).encode())


def named(message: Message) -> str:
    return parse(message.body)[0] if isinstance(message, Management) else ""


def test_it_is_decided_for_every_permission() -> None:
    assert OVERTAKEN.keys() == set(Permission)


def test_what_is_in_no_table_is_overtaken(monkeypatch: pytest.MonkeyPatch) -> None:
    assert is_overtaken(told(1), "robots.explode")
    monkeypatch.delitem(OF_MESSAGE, SetMode)
    assert is_overtaken(SetMode(1, OperatingMode.AUTOMATIC))


@pytest.mark.parametrize(
    "message",
    [
        Authority(1, AuthorityAction.REQUEST),
        Authority(1, AuthorityAction.FORCE),
        JointMove(1, 0.5, 2, JOINTS),
        Home(1, 0.5, "home"),
        JogStart(1, 1, 1, 0.15, JogSpace.JOINTS, "", 2, RATES),
        SetSpeed(1, 0.5, 0.0),
        SetMode(1, OperatingMode.AUTOMATIC),
        ResetStop(1),
        MotionControl(1, MotionControlAction.RESUME),
        *(told(1, op=op) for op in sorted(MOVING)),
    ],
)
def test_what_would_undo_a_stop_is_overtaken(message: Message) -> None:
    assert is_overtaken(message, named(message))


@pytest.mark.parametrize(
    "message",
    [
        hello(),
        Subscribe(1, 10.0),
        SoftwareStop(1, ""),
        JogRelease(1, 1),
        Authority(1, AuthorityAction.RELEASE),
        MotionControl(1, MotionControlAction.PAUSE),
        MotionControl(1, MotionControlAction.PROGRAM_STOP),
        Ping(comm_type=REQUEST),
        *(told(1, op=op) for op in ("snapshot", "programs.save", "programs.dry_run")),
        *(told(1, op=op) for op in ("recordings.start", "access.logout")),
    ],
)
def test_what_moves_nothing_is_not(message: Message) -> None:
    assert not is_overtaken(message, named(message))


def test_every_message_and_operation_that_moves_is_overtaken() -> None:
    moving = {kind for kind, needed in OF_MESSAGE.items() if OVERTAKEN[needed]}
    assert {ResetStop, JointMove, JogStart, Home, SetMode, Authority} <= moving
    assert {op for op in OPERATIONS if is_overtaken(told(1), op)} == MOVING
