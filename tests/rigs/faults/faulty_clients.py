"""Clients that break one rule each: those of `client_faults.toml`, and those that need code."""

import struct
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rigs.faults.client_fault import Change, Cut, Fault, Form, Neglect

from openpendant.simplemsg import (
    CommType,
    HeaderOnly,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    MsgType,
    Opaque,
    Ping,
    Status,
    TrajPoint,
    joint_array,
)
from openpendant.simplemsg.motoman import (
    MotomanJointTrajPtFullEx,
    MotomanMotionCtrl,
    MotomanSelectTool,
)
from openpendant.tools.packets.conformance.client.setup import Mutation

_NOTHING = joint_array(())


def _changing(what: Mapping[str, Mapping[str, Any]]) -> Change:
    def change(message: Message) -> Message:
        for name, value in what.get("set", {}).items():
            setattr(message, name, tuple(value) if isinstance(value, list) else value)
        for name, by in what.get("add", {}).items():
            value = getattr(message, name)
            changed = (value[0] + by, *value[1:]) if isinstance(value, tuple) else value + by
            setattr(message, name, changed)
        for name, factor in what.get("scale", {}).items():
            setattr(message, name, tuple(factor * value for value in getattr(message, name)))
        return message

    return change


def _overwriting(at: int, value: int) -> Cut:
    return lambda frame: [frame[:at] + struct.pack("<i", value) + frame[at + 4 :]]


_READERS: dict[str, Any] = {
    "mutation": lambda name: Mutation[name],
    "form": lambda name: Form[name],
    "neglects": lambda name: Neglect[name],
    "point": _changing,
    "stop": _changing,
    "cut": lambda about: _overwriting(*about),
    "cut_reply": lambda about: _overwriting(*about),
    "extra": lambda about: (
        struct.pack(f"<{len(about['header'])}i", *about["header"]) + bytes(about.get("body", 0))
    ),
    "at": lambda index: None if index == "all" else index,
}


def _declared() -> list[Fault]:
    tables = tomllib.loads((Path(__file__).parent / "client_faults.toml").read_text("utf-8"))
    return [
        Fault(**{key: _READERS.get(key, lambda same: same)(value) for key, value in row.items()})
        for table in tables.values()
        for row in table
    ]


def _swapped(data: bytes) -> list[bytes]:
    """Write each of a frame's four-byte values in the other byte order."""
    values = struct.unpack(f"<{len(data) // 4}i", data)
    return [struct.pack(f">{len(values)}i", *values)]


def _fast_joint_6(message: Message) -> Message:
    assert isinstance(message, JointTrajPtFull)
    message.velocities = (*message.velocities[:5], 2.2, *message.velocities[6:])
    return message


def _one_more_from_6(message: Message) -> Message:
    assert isinstance(message, JointTrajPtFull)
    message.sequence += message.sequence > 5
    return message


def _of_type_11(message: Message) -> Message:
    assert isinstance(message, JointTrajPtFull)
    return JointTrajPt(message.sequence, message.positions, 0.2, 0.1)


def _second_group(robot_id: int) -> Change:
    def change(message: Message) -> Message:
        assert isinstance(message, MotomanJointTrajPtFullEx)
        message.groups[1].robot_id = robot_id
        return message

    return change


def _padded_with_points(message: Message) -> Message:
    assert isinstance(message, MotomanJointTrajPtFullEx)
    message.groups = (*message.groups, *message.groups)
    return message


def _full_stop(time: float) -> Change:
    return lambda _: JointTrajPtFull(0, -4, 0, time, _NOTHING, _NOTHING, _NOTHING)


def _simple_stop(_: Message) -> Message:
    return JointTrajPt(-4, _NOTHING, 0.0, 0.0)


_PING, _STATUS = Mutation.PING_STATE, Mutation.STATUS_REQUEST
_UNKNOWN = Mutation.UNKNOWN_REQUEST_STATE
_BARE_STATUS = struct.pack("<4i", 12, MsgType.STATUS, CommType.REPLY, 1)
_FAILURE_WITH_A_BODY = Opaque(999, bytes(40), comm_type=3, reply_code=2)
_COMMAND = MotomanMotionCtrl(0, 0, 200199, _NOTHING)
_TRAJECTORY = JointTraj((TrajPoint(0, _NOTHING, 0.1, 1.0),))

FAULTS = [
    *_declared(),
    Fault("counts the prefix in the length", "FC05", cut=lambda f: _overwriting(0, len(f))(f)),
    Fault("writes a frame in two pieces", "FC06", cut=lambda f: [f[:4], f[4:]]),
    Fault("reports a status of its own", "HC05", extra=Status(1, 0, 0, 0, 0, 2, 1)),
    Fault("changes the byte order", "BC01", cut=_swapped),
    Fault("speaks the other byte order", "BC02", cut=_swapped, at=None),
    Fault("replies in another byte order", "BC03", _PING, cut_reply=_swapped),
    Fault("asks on the state port", "RC02", extra_state=Ping()),
    Fault("answers twice", "RC04", _PING, cut_reply=lambda f: [f, f]),
    Fault("answers topics", "RC05", extra_state=HeaderOnly(MsgType.STATUS)),
    Fault("replies unasked", "RC06", extra_state=HeaderOnly(MsgType.GET_VERSION)),
    Fault("succeeds without a body", "RC07", _STATUS, cut_reply=lambda _: [_BARE_STATUS]),
    Fault("fails with a body", "RC10", _UNKNOWN, reply=lambda _: _FAILURE_WITH_A_BODY),
    Fault("leaves a sequence number out", "MC02", point=_one_more_from_6, at=None),
    Fault("changes the message type", "MC16", point=_of_type_11),
    Fault("stops by a full point with a time", "SC02", stops_at=5, stop=_full_stop(1.0)),
    Fault("sends too high a velocity of joint 6", "LC03", point=_fast_joint_6),
    Fault("sends a whole trajectory", "LC08", extra=_TRAJECTORY),
    Fault("stops by a point", "YC06", form=Form.MOTOMAN, stops_at=5, stop=_full_stop(0.0)),
    Fault(
        "stops by a point of type 11",
        "YC06",
        form=Form.MOTOMAN,
        stops_at=5,
        stop=_simple_stop,
        is_habit=True,
    ),
    Fault("sends type 11", "YC08", form=Form.MOTOMAN, point=_of_type_11),
    Fault("sends more groups than are meant", "YC10", form=Form.GROUPS, point=_padded_with_points),
    Fault("names a group twice", "YC11", form=Form.GROUPS, point=_second_group(0)),
    Fault("names group 7", "YC11", form=Form.GROUPS, point=_second_group(7)),
    Fault("makes up a command", "YC13", form=Form.MOTOMAN, extra=_COMMAND),
    Fault("selects tool 99", "YC14", form=Form.MOTOMAN, extra=MotomanSelectTool(0, 99, 0)),
]
