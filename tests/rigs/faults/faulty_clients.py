"""Clients that break one rule each, with the number of the check that has to find it."""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from typing import Any

from rigs.faults.client_fault import Change, Fault, Form, Neglect

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
_STANDING = Status(1, 0, 0, 0, 0, 2, 1)


def setting(name: str, value: Any) -> Change:
    """Return a change that gives one field of a message another value."""

    def change(message: Message) -> Message:
        setattr(message, name, value)
        return message

    return change


def adding(name: str, by: float) -> Change:
    """Return a change that adds to one field, or to the first joint of an array."""

    def change(message: Message) -> Message:
        value = getattr(message, name)
        changed = (value[0] + by, *value[1:]) if isinstance(value, tuple) else value + by
        setattr(message, name, changed)
        return message

    return change


def _scaled(factor: float) -> Change:
    """Return a change that multiplies the velocities of a full point."""

    def change(message: Message) -> Message:
        assert isinstance(message, JointTrajPtFull)
        message.velocities = tuple(factor * value for value in message.velocities)
        return message

    return change


def _fast_joint_6(message: Message) -> Message:
    assert isinstance(message, JointTrajPtFull)
    message.velocities = (*message.velocities[:5], 2.2, *message.velocities[6:])
    return message


def _one_more_from_6(message: Message) -> Message:
    assert isinstance(message, JointTrajPtFull)
    message.sequence += message.sequence > 5
    return message


def word(at: int, value: int, order: str = "<") -> Callable[[bytes], list[bytes]]:
    """Return a cut that overwrites one integer of a frame."""

    def cut(frame: bytes) -> list[bytes]:
        return [frame[:at] + struct.pack(f"{order}i", value) + frame[at + 4 :]]

    return cut


def frame(length: int, *header: int, body: bytes = b"") -> bytes:
    return struct.pack(f"<{len(header) + 1}i", length, *header) + body


def _swapped(data: bytes) -> list[bytes]:
    """Write each of a frame's four-byte values in the other byte order."""
    values = struct.unpack(f"<{len(data) // 4}i", data)
    return [struct.pack(f">{len(values)}i", *values)]


def _of_type_11(message: Message) -> Message:
    assert isinstance(message, JointTrajPtFull)
    return JointTrajPt(message.sequence, message.positions, 0.2, 0.1)


def _group(index: int, name: str, value: int) -> Change:
    def change(message: Message) -> Message:
        assert isinstance(message, MotomanJointTrajPtFullEx)
        setattr(message.groups[index], name, value)
        return message

    return change


def _padded_with_points(message: Message) -> Message:
    assert isinstance(message, MotomanJointTrajPtFullEx)
    message.groups = (*message.groups, *message.groups)
    return message


FRAMING = [
    Fault("declares 100,000 bytes", "FC01", cut=word(0, 100_000)),
    Fault("declares a negative length", "FC01", cut=word(0, -8)),
    Fault("counts the prefix in the length", "FC05", cut=lambda f: word(0, len(f))(f)),
    Fault("declares less than a header", "FC02", extra=frame(8, 1, 2)),
    Fault("closes inside a frame", "FC03", neglects=Neglect.WHOLE_FRAME),
    Fault("sends 2,000 bytes", "FC04", extra=frame(1996, 1, 2, 0, body=bytes(1984))),
    Fault("sends a body cut short", "FC05", extra=frame(20, 11, 2, 0, body=bytes(8))),
    Fault("writes a frame in two pieces", "FC06", cut=lambda f: [f[:4], f[4:]]),
    Fault("sends message type 0", "HC01", extra=frame(12, 0, 1, 0)),
    Fault("sends communication type 0", "HC02", extra=frame(12, 1, 0, 0)),
    Fault("sends communication type 7", "HC02", extra=frame(12, 1, 7, 0)),
    Fault("puts a reply code into a point", "HC03", cut=word(12, 1)),
    Fault("replies with code 0", "HC04", Mutation.PING_STATE, cut_reply=word(12, 0)),
    Fault("replies with code 5", "HC04", Mutation.PING_STATE, cut_reply=word(12, 5)),
    Fault("reports a status of its own", "HC05", extra=_STANDING),
    Fault("sends PING as a topic", "HC06", extra=frame(12, 1, 1, 0)),
    Fault("changes the byte order", "BC01", cut=_swapped),
    Fault("speaks the other byte order", "BC02", cut=_swapped, at=None),
    Fault("replies in another byte order", "BC03", Mutation.PING_STATE, cut_reply=_swapped),
]

REPLIES = [
    Fault("does not wait for the reply", "RC01", Mutation.LATE, neglects=Neglect.WAIT_FOR_REPLY),
    Fault("asks on the state port", "RC02", extra_state=Ping()),
    Fault("does not answer PING", "RC03", Mutation.PING_STATE, neglects=Neglect.ANSWERING),
    Fault(
        "ignores an unknown request",
        "RC03",
        Mutation.UNKNOWN_REQUEST_MOTION,
        neglects=Neglect.ANSWERING,
    ),
    Fault("answers twice", "RC04", Mutation.PING_STATE, cut_reply=lambda f: [f, f]),
    Fault("answers topics", "RC05", extra_state=HeaderOnly(MsgType.STATUS)),
    Fault("replies unasked", "RC06", extra_state=HeaderOnly(MsgType.GET_VERSION)),
    Fault("replies with another type", "RC07", Mutation.STATUS_REQUEST, cut_reply=word(4, 1)),
    Fault(
        "succeeds without a body",
        "RC07",
        Mutation.STATUS_REQUEST,
        cut_reply=lambda _: [frame(12, MsgType.STATUS, CommType.REPLY, 1)],
    ),
    Fault("fails PING", "RC08", Mutation.PING_MOTION, cut_reply=word(12, 2)),
    Fault("succeeds at the unknown", "RC09", Mutation.UNKNOWN_REQUEST_STATE, cut_reply=word(12, 1)),
    Fault(
        "fails with a body",
        "RC10",
        Mutation.UNKNOWN_REQUEST_STATE,
        reply=lambda reply: Opaque(999, bytes(40), comm_type=3, reply_code=2),
    ),
    Fault(
        "hangs up on the unknown", "RC11", Mutation.UNKNOWN_TOPIC_MOTION, neglects=Neglect.SURVIVING
    ),
    Fault("takes any reply for its own", "RC12", Mutation.WRONG_TYPE, neglects=Neglect.REPLY_TYPE),
    Fault("takes code 0 for success", "RC13", Mutation.UNREADABLE, neglects=Neglect.REPLY_CODE),
]

MOTION = [
    Fault("begins at sequence 1", "MC01", point=setting("sequence", 1), at=0),
    Fault("skips a sequence number", "MC02", point=adding("sequence", 3)),
    Fault("leaves a sequence number out", "MC02", point=_one_more_from_6, at=None),
    Fault("counts backwards", "MC02", point=adding("sequence", -2)),
    Fault(
        "never ends a download", "MC03", form=Form.DOWNLOAD, point=setting("sequence", 29), at=29
    ),
    Fault("streams topics", "MC04", point=setting("comm_type", CommType.TOPIC)),
    Fault("sends a taken point again", "MC05", cut=lambda f: [f], point=adding("sequence", -1)),
    Fault(
        "changes a repeated point",
        "MC06",
        Mutation.BUSY,
        Form.MOTOMAN,
        neglects=Neglect.BUSY_POINT,
        point=adding("sequence", -1),
        at=6,
    ),
    Fault(
        "fills an unused slot", "MC07", point=setting("positions", (*[0.1] * 6, 0.5, 0.0, 0.0, 0.0))
    ),
    Fault("sends a speed ratio of 2", "MC08", form=Form.SIMPLE, point=setting("velocity", 2.0)),
    Fault(
        "sends a negative speed ratio", "MC08", form=Form.SIMPLE, point=setting("velocity", -0.5)
    ),
    Fault("sends a speed ratio of 0", "MC08", form=Form.SIMPLE, point=setting("velocity", 0.0)),
    Fault("plans for twelve days", "MC10", form=Form.SIMPLE, point=setting("duration", 1e6)),
    Fault("begins after 100 s", "MC11", point=adding("time", 100.0), at=None),
    Fault(
        "does not know its speed", "MC09", form=Form.SIMPLE, point=setting("velocity", 0.1), at=None
    ),
    Fault("gives no time", "MC10", form=Form.SIMPLE, point=setting("duration", 0.0)),
    Fault("gives negative time", "MC10", form=Form.SIMPLE, point=setting("duration", -0.1)),
    Fault("lets time stand still", "MC11", point=setting("time", 0.4)),
    Fault("lets time run backwards", "MC11", point=setting("time", 0.1)),
    Fault("sets undefined bits", "MC12", point=setting("valid_fields", 7 + 64)),
    Fault(
        "leaves bits uninitialised",
        "MC12",
        form=Form.GROUPS,
        cut=lambda data: word(16 + 8 + 4, 0x46F48B47)(data),
    ),
    Fault("sends a point without a position", "MC13", point=setting("valid_fields", 5)),
    Fault("leaves values in invalid fields", "MC14", point=adding("accelerations", 1.0)),
    Fault("changes the robot", "MC15", point=setting("robot_id", 1)),
    Fault("sends to robot -1", "MC15", point=setting("robot_id", -1), at=None),
    Fault("speaks to robot 7", "MC15", point=setting("robot_id", 7), at=None),
    Fault("changes the message type", "MC16", point=_of_type_11),
    Fault("goes on after FAILURE", "MC17", Mutation.REFUSED, neglects=Neglect.REFUSAL),
    Fault(
        "goes on after FAILURE, type 11",
        "MC17",
        Mutation.REFUSED,
        Form.SIMPLE,
        neglects=Neglect.REFUSAL,
    ),
    Fault("waits for ever", "MC18", Mutation.REPLY_LOST, neglects=Neglect.PATIENCE),
    Fault("waits for ever at a dumb link", "MC18", Mutation.HALF_OPEN, neglects=Neglect.PATIENCE),
]

STOPS = [
    Fault("stops by topic", "SC01", stops_at=5, stop=setting("comm_type", CommType.TOPIC)),
    Fault("stops with values", "SC02", stops_at=5, stop=setting("duration", 1.0)),
    Fault(
        "stops by a full point with a time",
        "SC02",
        stops_at=5,
        stop=lambda _: JointTrajPtFull(0, -4, 0, 1.0, _NOTHING, _NOTHING, _NOTHING),
    ),
    Fault("goes on after STOP", "SC03", stops_at=5, neglects=Neglect.STOP_ENDS),
    Fault("makes up a sequence", "SC04", point=setting("sequence", -7)),
    Fault("leaves the robot moving", "SC05", stops_at=5, neglects=Neglect.STOP_BEFORE_LEAVING),
]

STATUS = [
    Fault("ignores an emergency stop", "QC01", Mutation.EMERGENCY_STOP, neglects=Neglect.E_STOP),
    Fault(
        "ignores an emergency stop, type 11",
        "QC01",
        Mutation.EMERGENCY_STOP,
        Form.SIMPLE,
        neglects=Neglect.E_STOP,
    ),
    Fault(
        "begins where nothing can move",
        "QC02",
        Mutation.NOT_POSSIBLE,
        neglects=Neglect.MOTION_POSSIBLE,
    ),
    Fault("begins anew without power", "QC03", Mutation.EMERGENCY_STOP, neglects=Neglect.POWER),
    Fault("ignores silence", "QC04", Mutation.SILENCE, neglects=Neglect.SILENCE),
    Fault("ignores a lost state link", "QC05", Mutation.STATE_CLOSED, neglects=Neglect.STATE_LOST),
    Fault("begins blindly", "QC06", neglects=Neglect.FIRST_REPORT),
]

LINKS = [
    Fault("connects in a storm", "KC01", neglects=Neglect.CALM),
    Fault("skips the unanswered point", "KC02", Mutation.CLOSED, neglects=Neglect.UNANSWERED_POINT),
    Fault(
        "renumbers after a reconnect",
        "KC03",
        Mutation.CLOSED,
        neglects=Neglect.ORDER_AFTER_RECONNECT,
    ),
    Fault("sends points on two links", "KC04", neglects=Neglect.ONE_LINK),
    Fault(
        "goes on in the middle on a new connection",
        "KC06",
        Mutation.CLOSED,
        neglects=Neglect.NEW_BEGINNING,
    ),
    Fault("resumes at a restarted controller", "KC05", Mutation.RESTART, neglects=Neglect.RESTART),
]

LIMITS = [
    Fault("sends not a number", "LC01", point=setting("positions", joint_array([math.nan] * 6))),
    Fault("sends infinity", "LC01", point=setting("time", math.inf)),
    Fault("leaves the joint range", "LC02", point=adding("positions", 5.0)),
    Fault("leaves the joint range at its lower end", "LC02", point=adding("positions", -5.0)),
    Fault("sends too high a velocity", "LC03", point=adding("velocities", 3.0)),
    Fault("sends too high a velocity backwards", "LC03", point=adding("velocities", -3.0)),
    Fault("sends a velocity a tenth too high", "LC03", point=adding("velocities", 2.0)),
    Fault("sends too high a velocity of joint 6", "LC03", point=_fast_joint_6),
    Fault(
        "sends too high an acceleration",
        "LC04",
        point=lambda p: setting("valid_fields", 15)(adding("accelerations", 9.0)(p)),
    ),
    Fault("jumps", "LC05", point=adding("positions", 0.5)),
    Fault("jumps back", "LC05", point=adding("positions", -0.5), at=29),
    Fault("jumps, type 11", "LC05", form=Form.SIMPLE, point=adding("joints", 0.5)),
    Fault("starts elsewhere", "LC06", point=adding("positions", 0.1), at=0),
    Fault(
        "starts elsewhere, without time",
        "LC06",
        form=Form.SIMPLE,
        point=adding("joints", 0.1),
        at=0,
    ),
    Fault("starts in motion", "LC07", point=adding("velocities", 0.3), at=0),
    Fault("ends in motion", "LC10", point=adding("velocities", 0.3), at=29),
    Fault(
        "ends in motion, Motoman", "LC10", form=Form.MOTOMAN, point=adding("velocities", 0.3), at=29
    ),
    Fault("negates its velocities", "LC09", point=_scaled(-1.0), at=None),
    Fault("triples its velocities", "LC09", point=_scaled(3.0), at=None),
    Fault(
        "triples its velocities, Motoman", "LC09", form=Form.MOTOMAN, point=_scaled(3.0), at=None
    ),
    Fault("sends a whole trajectory", "LC08", extra=JointTraj((TrajPoint(0, _NOTHING, 0.1, 1.0),))),
]

MOTOMAN = [
    Fault("does not ask for readiness", "YC01", form=Form.MOTOMAN, neglects=Neglect.READY_QUESTION),
    Fault(
        "ignores NOT READY", "YC02", Mutation.NOT_READY, Form.MOTOMAN, neglects=Neglect.READY_ANSWER
    ),
    Fault(
        "skips the point that met BUSY",
        "YC03",
        Mutation.BUSY,
        Form.MOTOMAN,
        neglects=Neglect.BUSY_POINT,
    ),
    Fault(
        "hammers a busy controller",
        "YC04",
        Mutation.BUSY,
        Form.MOTOMAN,
        neglects=Neglect.BUSY_PAUSE,
    ),
    Fault(
        "goes on after INVALID", "YC05", Mutation.REFUSED, Form.MOTOMAN, neglects=Neglect.REFUSAL
    ),
    Fault(
        "stops by a point",
        "YC06",
        form=Form.MOTOMAN,
        stops_at=5,
        stop=lambda _: JointTrajPtFull(0, -4, 0, 0.0, _NOTHING, _NOTHING, _NOTHING),
    ),
    Fault(
        "stops by a point of type 11",
        "YC06",
        form=Form.MOTOMAN,
        stops_at=5,
        stop=lambda _: JointTrajPt(-4, _NOTHING, 0.0, 0.0),
    ),
    Fault(
        "sends no velocities",
        "YC07",
        form=Form.MOTOMAN,
        point=lambda p: setting("valid_fields", 3)(setting("velocities", _NOTHING)(p)),
    ),
    Fault("sends type 11", "YC08", form=Form.MOTOMAN, point=_of_type_11),
    Fault(
        "plans for five hours", "YC09", form=Form.MOTOMAN, point=setting("time", 18_000.0), at=29
    ),
    Fault("sends more groups than are meant", "YC10", form=Form.GROUPS, point=_padded_with_points),
    Fault("miscounts the groups", "FC05", form=Form.GROUPS, cut=word(16, 1)),
    Fault(
        "looks at the body only",
        "YC12",
        Mutation.HEADER_FAILURE,
        Form.MOTOMAN,
        neglects=Neglect.HEADER,
    ),
    Fault("names a group twice", "YC11", form=Form.GROUPS, point=_group(1, "robot_id", 0)),
    Fault("names group 7", "YC11", form=Form.GROUPS, point=_group(1, "robot_id", 7)),
    Fault(
        "makes up a command",
        "YC13",
        form=Form.MOTOMAN,
        extra=MotomanMotionCtrl(0, 0, 200199, _NOTHING),
    ),
    Fault("selects tool 99", "YC14", form=Form.MOTOMAN, extra=MotomanSelectTool(0, 99, 0)),
    Fault(
        "begins anew without asking",
        "YC15",
        form=Form.MOTOMAN,
        stops_at=5,
        neglects=Neglect.READY_AFTER_STOP,
    ),
]

FAULTS = [*FRAMING, *REPLIES, *MOTION, *STOPS, *STATUS, *LINKS, *LIMITS, *MOTOMAN]
