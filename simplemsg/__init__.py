"""ROS-Industrial simple message: the wire format, and nothing else.

Sans-I/O and standard library only: bytes go in, messages come out, and the reverse. Make a
`Connection`, give it what the socket received, write what `send` returns.
"""

from __future__ import annotations

from .codec import DIALECTS, MOTOMAN, PENDANT, STANDARD, Codec, Dialect, codec_for
from .codes import (
    JOINT_SLOTS,
    ByteOrder,
    CommType,
    ControllerMode,
    MsgType,
    ReplyCode,
    SpecialSequence,
    TriState,
    ValidField,
)
from .connection import (
    MAX_REFERENCE_FRAME,
    Arrival,
    Connection,
    Malformed,
    Overtaken,
    Received,
    Role,
    Unasked,
)
from .declaration import Message, joint_array
from .errors import (
    BodyFault,
    FramingFault,
    HeaderFault,
    LengthOutOfBounds,
    LocalProtocolError,
    MessageFault,
    NotEncodable,
    OrderUndetectable,
    ProtocolError,
    RemoteProtocolError,
)
from .real_records import RealRecords
from .standard import (
    GetVersion,
    GetVersionReply,
    HeaderOnly,
    JointFeedback,
    JointPosition,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    Opaque,
    Ping,
    Status,
    TrajPoint,
    accepted,
    message_type,
    refused,
)
from .stop_walk import PENDANT_STOPS, ROS_STOPS, StopRule, WaitingStop

__version__ = "0.1.0"

__all__ = [
    "DIALECTS",
    "JOINT_SLOTS",
    "MAX_REFERENCE_FRAME",
    "MOTOMAN",
    "PENDANT",
    "PENDANT_STOPS",
    "ROS_STOPS",
    "STANDARD",
    "Arrival",
    "BodyFault",
    "ByteOrder",
    "Codec",
    "CommType",
    "Connection",
    "ControllerMode",
    "Dialect",
    "FramingFault",
    "GetVersion",
    "GetVersionReply",
    "HeaderFault",
    "HeaderOnly",
    "JointFeedback",
    "JointPosition",
    "JointTraj",
    "JointTrajPt",
    "JointTrajPtFull",
    "LengthOutOfBounds",
    "LocalProtocolError",
    "Malformed",
    "Message",
    "MessageFault",
    "MsgType",
    "NotEncodable",
    "Opaque",
    "OrderUndetectable",
    "Overtaken",
    "Ping",
    "ProtocolError",
    "RealRecords",
    "Received",
    "RemoteProtocolError",
    "ReplyCode",
    "Role",
    "SpecialSequence",
    "Status",
    "StopRule",
    "TrajPoint",
    "TriState",
    "Unasked",
    "ValidField",
    "WaitingStop",
    "__version__",
    "accepted",
    "codec_for",
    "joint_array",
    "message_type",
    "refused",
]
