"""Numbers of the simple-message specification, each with its source.

Owns the closed sets of the standard (REP-I0004, REP-I0006, industrial_core's headers) and nothing
that behaves.
"""

from __future__ import annotations

from enum import Enum, IntEnum, IntFlag

JOINT_SLOTS = 10
"""Every standard joint array has ten slots; unused ones are 0 (industrial_core, `joint_data.h`)."""

MAX_TRAJECTORY_POINTS = 200
"""Most points of one JOINT_TRAJ message (industrial_core, `joint_traj.h`)."""


class ByteOrder(Enum):
    """Order of bytes on the wire; the value is `struct`'s prefix."""

    LITTLE = "<"
    BIG = ">"


class CommType(IntEnum):
    """Kind of exchange to which a frame belongs (REP-I0006, header)."""

    INVALID = 0
    TOPIC = 1
    REQUEST = 2
    REPLY = 3


class ReplyCode(IntEnum):
    """Verdict in the header of a reply; UNUSED in everything else (REP-I0006, header)."""

    UNUSED = 0
    SUCCESS = 1
    FAILURE = 2


class MsgType(IntEnum):
    """Message types of the standard (REP-I0004)."""

    PING = 1
    GET_VERSION = 2
    JOINT_POSITION = 10
    JOINT_TRAJ_PT = 11
    JOINT_TRAJ = 12
    STATUS = 13
    JOINT_TRAJ_PT_FULL = 14
    JOINT_FEEDBACK = 15
    READ_INPUT = 20
    WRITE_OUTPUT = 21


class SpecialSequence(IntEnum):
    """Sequence numbers of trajectory points with a meaning (`joint_traj_pt.h`)."""

    START_DOWNLOAD = -1
    START_STREAMING = -2
    END = -3
    STOP = -4


class TriState(IntEnum):
    """A truth value that may be unknown (industrial_msgs, TriState)."""

    UNKNOWN = -1
    FALSE = 0
    TRUE = 1


class ControllerMode(IntEnum):
    """Operating mode as a controller reports it (industrial_msgs, RobotMode)."""

    UNKNOWN = -1
    MANUAL = 1
    AUTO = 2


class ValidField(IntFlag):
    """Bits of `valid_fields`: which values of a point are meant (`joint_traj_pt_full.h`)."""

    TIME = 1
    POSITION = 2
    VELOCITY = 4
    ACCELERATION = 8
    ALL = 15
