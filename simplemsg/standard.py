"""The standard messages of ROS-Industrial simple message, each declared once, and undeclared ones.

Layouts: REP-I0006 and the `load`/`unload` routines of industrial_core's `simple_message` 0.7.3;
where the two disagree the C++ library is followed (`docs/simplemsg.md` lists the cases). Bare
replies, and types that the dialect does not know, have a body that is not taken apart.
"""

import dataclasses
from dataclasses import dataclass
from typing import Annotated

from .codes import (
    MAX_TRAJECTORY_POINTS,
    CommType,
    ControllerMode,
    MsgType,
    ReplyCode,
    SpecialSequence,
    TriState,
    ValidField,
)
from .declaration import (
    Array,
    CountPlace,
    Direction,
    Int,
    Message,
    Place,
    Real,
    Reals,
    Record,
    Reply,
    Topic,
    message,
    record,
)
from .verdicts import STATUS_ERROR_OFFSET

_JOINT_UNIT = "rad, m for a linear axis"

_PointSequence = Annotated[
    int, Int("index of the point from 0, or a special sequence", values=SpecialSequence)
]
_ValidFields = Annotated[
    int, Int("bits: 1 time, 2 position, 4 velocity, 8 acceleration", values=ValidField)
]


@message(
    Place(
        MsgType.PING,
        "ping",
        Direction.BOTH,
        reply="ping, header only",
        source="industrial_core ping_message.cpp; REP-I0006 describes a 40-byte body",
        about="Asks whether the peer is there.",
        any_body=True,
    )
)
class Ping(Message):
    """PING: sent with an empty body, accepted with any."""


@message(
    Place(
        MsgType.GET_VERSION,
        "get_version",
        Direction.TO_CONTROLLER,
        reply="get_version with three integers",
        source="REP-I0006",
        about="Asks for the version of the controller's server program.",
    )
)
class GetVersion(Message):
    """GET_VERSION request: an empty body."""


@message(
    Place(
        MsgType.GET_VERSION,
        "get_version",
        Direction.FROM_CONTROLLER,
        reply="none",
        source="REP-I0006",
        about="Version of the controller's server program.",
        is_reply=True,
    )
)
class GetVersionReply(Reply):
    """GET_VERSION reply."""

    major: Annotated[int, Int("major version")]
    minor: Annotated[int, Int("minor version")]
    patch: Annotated[int, Int("patch level")]


@message(
    Place(
        MsgType.JOINT_POSITION,
        "joint_position",
        Direction.FROM_CONTROLLER,
        reply="none",
        source="REP-I0006; industrial_core joint_message.h",
        about="Where the joints stand; the only joint state that the generic ROS-I client decodes.",
    )
)
class JointPosition(Topic):
    """JOINT_POSITION: joint values, base to tip."""

    sequence: Annotated[int, Int("0 when reporting state")]
    joints: Annotated[tuple[float, ...], Reals("joint positions, unused slots 0", _JOINT_UNIT)]


@message(
    Place(
        MsgType.JOINT_TRAJ_PT,
        "joint_traj_pt",
        Direction.TO_CONTROLLER,
        reply="joint_traj_pt, header only (vendors also send bodies); none when sent as a topic",
        source="REP-I0006; industrial_core joint_traj_pt.h",
        about="One trajectory point; request when streaming, topic when downloading.",
    )
)
class JointTrajPt(Message):
    """JOINT_TRAJ_PT: one point with a speed ratio and the time of its segment."""

    sequence: _PointSequence
    joints: Annotated[tuple[float, ...], Reals("target positions, unused slots 0", _JOINT_UNIT)]
    velocity: Annotated[float, Real("fraction of the largest joint speed, 0 to 1")]
    duration: Annotated[float, Real("time allotted to this segment, not a time stamp", "s")]


@record
class TrajPoint(Record):
    """One point of a JOINT_TRAJ; the same fields as a JOINT_TRAJ_PT."""

    sequence: _PointSequence
    joints: Annotated[tuple[float, ...], Reals("target positions, unused slots 0", _JOINT_UNIT)]
    velocity: Annotated[float, Real("fraction of the largest joint speed, 0 to 1")]
    duration: Annotated[float, Real("time allotted to this segment, not a time stamp", "s")]


@message(
    Place(
        MsgType.JOINT_TRAJ,
        "joint_traj",
        Direction.TO_CONTROLLER,
        reply="joint_traj, header only",
        source="industrial_core joint_traj.cpp (points, then their number); REP-I0006 has the"
        " number first",
        about="A whole trajectory; deprecated, no vendor's server is known to take it.",
    )
)
class JointTraj(Message):
    """JOINT_TRAJ: 1 to 200 points, their number behind them."""

    points: Annotated[
        tuple[TrajPoint, ...],
        Array(
            "the points in order",
            of=TrajPoint,
            count_name="size",
            count_place=CountPlace.AFTER,
            most=MAX_TRAJECTORY_POINTS,
        ),
    ]


@message(
    Place(
        MsgType.STATUS,
        "status",
        Direction.FROM_CONTROLLER,
        reply="status, when it was sent as a request",
        source="REP-I0006; industrial_core robot_status.h (wire order is alphabetical)",
        about="State of the controller as a whole.",
    )
)
class Status(Topic):
    """STATUS: seven values, each of which may be unknown (-1)."""

    drives_powered: Annotated[int, Int("tri-state: motors have power", values=TriState)]
    e_stopped: Annotated[int, Int("tri-state: an emergency stop is active", values=TriState)]
    error_code: Annotated[
        int,
        Int(
            "the controller's own error number, 0 for none; from a pendant server also"
            f" {STATUS_ERROR_OFFSET:,} + a verdict of its own"
        ),
    ]
    in_error: Annotated[int, Int("tri-state: an error is active", values=TriState)]
    in_motion: Annotated[int, Int("tri-state: the robot moves", values=TriState)]
    mode: Annotated[int, Int("-1 unknown, 1 manual, 2 automatic", values=ControllerMode)]
    motion_possible: Annotated[
        int, Int("tri-state: a new trajectory would start now", values=TriState)
    ]


@message(
    Place(
        MsgType.JOINT_TRAJ_PT_FULL,
        "joint_traj_pt_full",
        Direction.TO_CONTROLLER,
        reply="joint_traj_pt_full, header only (Motoman: motoman_motion_reply)",
        source="REP-I0006; industrial_core joint_traj_pt_full.h",
        about="One trajectory point with velocity, acceleration and time.",
    )
)
class JointTrajPtFull(Message):
    """JOINT_TRAJ_PT_FULL: fields that are not valid still travel, as zeros."""

    robot_id: Annotated[int, Int("robot or group number, zero based")]
    sequence: _PointSequence
    valid_fields: _ValidFields
    time: Annotated[float, Real("time from the start of the trajectory", "s")]
    positions: Annotated[tuple[float, ...], Reals("joint positions", _JOINT_UNIT)]
    velocities: Annotated[tuple[float, ...], Reals("joint velocities", "rad/s, m/s")]
    accelerations: Annotated[tuple[float, ...], Reals("joint accelerations", "rad/s², m/s²")]


@message(
    Place(
        MsgType.JOINT_FEEDBACK,
        "joint_feedback",
        Direction.FROM_CONTROLLER,
        reply="none",
        source="REP-I0006; industrial_core joint_feedback.h",
        about="Where the joints stand and how they move.",
    )
)
class JointFeedback(Topic):
    """JOINT_FEEDBACK: the state counterpart of JOINT_TRAJ_PT_FULL, without a sequence."""

    robot_id: Annotated[int, Int("robot or group number, zero based")]
    valid_fields: _ValidFields
    time: Annotated[float, Real("the controller's time, where it has one", "s")]
    positions: Annotated[tuple[float, ...], Reals("joint positions", _JOINT_UNIT)]
    velocities: Annotated[tuple[float, ...], Reals("joint velocities", "rad/s, m/s")]
    accelerations: Annotated[tuple[float, ...], Reals("joint accelerations", "rad/s², m/s²")]


STANDARD_MESSAGES: tuple[type[Message], ...] = (
    Ping,
    GetVersion,
    GetVersionReply,
    JointPosition,
    JointTrajPt,
    JointTraj,
    Status,
    JointTrajPtFull,
    JointFeedback,
)


@dataclass(slots=True)
class HeaderOnly(Message):
    """A reply with an empty body, of any type: the plain "taken" or "not taken"."""

    msg_type: int
    comm_type: int = dataclasses.field(default=CommType.REPLY, kw_only=True)
    reply_code: int = dataclasses.field(default=ReplyCode.SUCCESS, kw_only=True)


@dataclass(slots=True)
class Opaque(Message):
    """A frame of a type that the dialect does not know, or a reply in a vendor's own layout."""

    msg_type: int
    body: bytes


_UNDECLARED = HeaderOnly, Opaque


def message_type(message: Message) -> int:
    """Return the message type of any message, declared or not."""
    if isinstance(message, _UNDECLARED):
        return message.msg_type
    return message.PLACE.msg_type


def accepted(request: Message) -> HeaderOnly:
    """Return the bare reply that says: the request could be taken."""
    return HeaderOnly(message_type(request), reply_code=ReplyCode.SUCCESS)


def refused(request: Message) -> HeaderOnly:
    """Return the bare reply that says: the request could not be taken."""
    return HeaderOnly(message_type(request), reply_code=ReplyCode.FAILURE)
