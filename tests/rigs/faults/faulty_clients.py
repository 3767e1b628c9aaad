"""What a scripted client can do wrong, and clients that do so: each breaks one rule.

They are those of `client_faults.toml`, and those that need code.
"""

import struct
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Any

from openpendant import simplemsg as wire
from openpendant.simplemsg.motoman import (
    MotomanJointTrajPtFullEx,
    MotomanMotionCtrl,
    MotomanSelectTool,
)
from openpendant.tools.packets.conformance.client.setup import Mutation


class Form(Enum):
    """Which points the client sends."""

    FULL = "type 14"
    SIMPLE = "type 11, streamed"
    DOWNLOAD = "type 11, downloaded"
    MOTOMAN = "type 14 to a Motoman controller"
    GROUPS = "type 2016 to a Motoman controller"

    @property
    def is_motoman(self) -> bool:
        return self in (Form.MOTOMAN, Form.GROUPS)


Neglect = Enum(
    "Neglect",
    "WAIT_FOR_REPLY REFUSAL REPLY_TYPE REPLY_CODE PATIENCE ANSWERING E_STOP MOTION_POSSIBLE "
    "SILENCE STATE_LOST FIRST_REPORT UNANSWERED_POINT ORDER_AFTER_RECONNECT RESTART ONE_LINK "
    "CALM STOP_BEFORE_LEAVING STOP_ENDS READY_QUESTION READY_ANSWER BUSY_POINT BUSY_PAUSE "
    "READY_AFTER_STOP SURVIVING NEW_BEGINNING WHOLE_FRAME POWER HEADER",
)
"""What a client can fail to do."""

Change = Callable[[wire.Message], wire.Message]
Cut = Callable[[bytes], list[bytes]]


@dataclass(frozen=True)
class Fault:
    """One rule that a client breaks.

    Attributes:
        check: number of the check that has to find it.
        mutation: scenario in which it shows.
        point: changes a point's message before it is sent.
        reply: changes an answer to the controller.
        cut: changes the bytes of a point.
        extra: what it sends besides, once, on the motion link.
        extra_state: what it sends besides, once, on the state link.
        neglects: what it fails to do.
        stops_at: index of the point at which it stops and closes, as a user would.
        at: index of the point that is changed, None for all.
        is_habit: a known program has it, so that it is named and does not fail.
    """

    name: str
    check: str
    mutation: Mutation = Mutation.NONE
    form: Form = Form.FULL
    point: Change | None = None
    stop: Change | None = None
    reply: Change | None = None
    cut: Cut | None = None
    cut_reply: Cut | None = None
    extra: wire.Message | bytes | None = None
    extra_state: wire.Message | bytes | None = None
    neglects: Neglect | None = None
    stops_at: int | None = None
    at: int | None = 5
    order: wire.ByteOrder = wire.ByteOrder.LITTLE
    is_habit: bool = False


_NOTHING = wire.joint_array(())


def _changing(what: Mapping[str, Mapping[str, Any]]) -> Change:
    def change(message: wire.Message) -> wire.Message:
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


def _fast_joint_6(message: wire.Message) -> wire.Message:
    assert isinstance(message, wire.JointTrajPtFull)
    message.velocities = (*message.velocities[:5], 2.2, *message.velocities[6:])
    return message


def _one_more_from_6(message: wire.Message) -> wire.Message:
    assert isinstance(message, wire.JointTrajPtFull)
    message.sequence += message.sequence > 5
    return message


def _of_type_11(message: wire.Message) -> wire.Message:
    assert isinstance(message, wire.JointTrajPtFull)
    return wire.JointTrajPt(message.sequence, message.positions, 0.2, 0.1)


def _second_group(robot_id: int) -> Change:
    def change(message: wire.Message) -> wire.Message:
        assert isinstance(message, MotomanJointTrajPtFullEx)
        message.groups[1].robot_id = robot_id
        return message

    return change


def _padded_with_points(message: wire.Message) -> wire.Message:
    assert isinstance(message, MotomanJointTrajPtFullEx)
    message.groups = (*message.groups, *message.groups)
    return message


def _full_stop(time: float) -> Change:
    return lambda _: wire.JointTrajPtFull(0, -4, 0, time, _NOTHING, _NOTHING, _NOTHING)


def _simple_stop(_: wire.Message) -> wire.Message:
    return wire.JointTrajPt(-4, _NOTHING, 0.0, 0.0)


_PING, _STATUS = Mutation.PING_STATE, Mutation.STATUS_REQUEST
_UNKNOWN = Mutation.UNKNOWN_REQUEST_STATE
_BARE_STATUS = struct.pack("<4i", 12, wire.MsgType.STATUS, wire.CommType.REPLY, 1)
_FAILURE_WITH_A_BODY = wire.Opaque(999, bytes(40), comm_type=3, reply_code=2)
_COMMAND = MotomanMotionCtrl(0, 0, 200199, _NOTHING)
_TRAJECTORY = wire.JointTraj((wire.TrajPoint(0, _NOTHING, 0.1, 1.0),))

FAULTS = [
    *_declared(),
    Fault("counts the prefix in the length", "FC05", cut=lambda f: _overwriting(0, len(f))(f)),
    Fault("writes a frame in two pieces", "FC06", cut=lambda f: [f[:4], f[4:]]),
    Fault("reports a status of its own", "HC05", extra=wire.Status(1, 0, 0, 0, 0, 2, 1)),
    Fault("changes the byte order", "BC01", cut=_swapped),
    Fault("speaks the other byte order", "BC02", cut=_swapped, at=None),
    Fault("replies in another byte order", "BC03", _PING, cut_reply=_swapped),
    Fault("asks on the state port", "RC02", extra_state=wire.Ping()),
    Fault("answers twice", "RC04", _PING, cut_reply=lambda f: [f, f]),
    Fault("answers topics", "RC05", extra_state=wire.HeaderOnly(wire.MsgType.STATUS)),
    Fault("replies unasked", "RC06", extra_state=wire.HeaderOnly(wire.MsgType.GET_VERSION)),
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
