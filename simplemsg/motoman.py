"""Messages and numbers of the Motoman dialect (MotoROS for ROS 1, ids 2001 to 2020).

Layouts: ros-industrial/motoman, `motoman_driver/MotoPlus/SimpleMessage.h` 1.9.12 and the message
classes of `motoman_driver`; numbers also from `CtrlGroup.h` of MotoROS 1.9.12. What each number
means, and what helps, stands in `motoman_catalogue`.
"""

from enum import IntEnum
from typing import Annotated, dataclass_transform

from .codes import ValidField
from .declaration import (
    Array,
    Direction,
    Int,
    Message,
    MessageDecorator,
    Place,
    Real,
    Reals,
    Record,
    Reply,
    Topic,
    message,
    record,
)


class MotionCommand(IntEnum):
    """Command of a MOTION_CTRL."""

    CHECK_MOTION_READY = 200101
    CHECK_QUEUE_CNT = 200102
    STOP_MOTION = 200111
    START_SERVOS = 200112
    STOP_SERVOS = 200113
    RESET_ALARM = 200114
    START_TRAJ_MODE = 200121
    STOP_TRAJ_MODE = 200122
    DISCONNECT = 200130


class MotionResult(IntEnum):
    """Verdict of a MOTION_REPLY."""

    SUCCESS = 0
    BUSY = 1
    FAILURE = 2
    INVALID = 3
    ALARM = 4
    NOT_READY = 5
    MP_FAILURE = 6


class Subcode(IntEnum):
    """Reason beside the result: 3000 and up go with INVALID, 5000 and up with NOT_READY."""

    INVALID_UNSPECIFIED = 3000
    INVALID_MESSAGE_SIZE = 3001
    INVALID_HEADER = 3002
    INVALID_MESSAGE_TYPE = 3003
    INVALID_GROUP = 3004
    INVALID_SEQUENCE = 3005
    INVALID_COMMAND = 3006
    INVALID_DATA = 3010
    INVALID_START_POSITION = 3011
    INVALID_POSITION = 3012
    INVALID_SPEED = 3013
    INVALID_ACCELERATION = 3014
    INVALID_INSUFFICIENT_FIELDS = 3015
    INVALID_TIME = 3016
    INVALID_TOOL = 3017
    NOT_READY_UNSPECIFIED = 5000
    NOT_READY_ALARM = 5001
    NOT_READY_ERROR = 5002
    NOT_READY_EMERGENCY_STOP = 5003
    NOT_READY_NOT_IN_PLAY = 5004
    NOT_READY_NOT_REMOTE = 5005
    NOT_READY_SERVO_OFF = 5006
    NOT_READY_HOLD = 5007
    NOT_READY_JOB_NOT_STARTED = 5008
    NOT_READY_NOT_WAITING = 5009
    NOT_READY_SKILLSEND = 5010
    NOT_READY_PFL_ACTIVE = 5011
    NOT_READY_INCREMENT_REJECTED = 5012


class IoResult(IntEnum):
    """Verdict of a reply about I/O or registers."""

    SUCCESS = 0
    READ_ADDRESS_INVALID = 1001
    WRITE_ADDRESS_INVALID = 1002
    WRITE_VALUE_INVALID = 1003
    READ_API_ERROR = 1004
    WRITE_API_ERROR = 1005


MOTOMAN_GROUPS = 4
"""Groups that one Motoman controller can have (`MotoPlus/Controller.h`)."""

_SOURCE = "ros-industrial/motoman, MotoPlus/SimpleMessage.h"
_JOINT_UNIT = "rad, m for a linear axis"


@dataclass_transform()
def _request(msg_type: int, name: str, reply: str, about: str) -> MessageDecorator:
    return message(Place(msg_type, name, Direction.TO_CONTROLLER, reply, _SOURCE, about))


@dataclass_transform()
def _reply(msg_type: int, name: str, about: str, is_reply: bool = False) -> MessageDecorator:
    return message(
        Place(msg_type, name, Direction.FROM_CONTROLLER, "none", _SOURCE, about, is_reply)
    )


@_request(
    2001, "motoman_motion_ctrl", "motoman_motion_reply", "Starts, stops or asks about motion."
)
class MotomanMotionCtrl(Message):
    """MOTION_CTRL 2001."""

    robot_id: Annotated[int, Int("group number")]
    sequence: Annotated[int, Int("echoed in the reply")]
    command: Annotated[int, Int("what to do", values=MotionCommand)]
    data: Annotated[tuple[float, ...], Reals("unused, 0")]


@_reply(2002, "motoman_motion_reply", "Verdict on 14, 2001, 2016 and 2018.")
class MotomanMotionReply(Reply):
    """MOTION_REPLY 2002; the verdict is in `result`, the header always says success."""

    robot_id: Annotated[int, Int("group number")]
    sequence: Annotated[int, Int("sequence of the request")]
    command: Annotated[
        int, Int("command of the request, or its message type", values=MotionCommand)
    ]
    result: Annotated[int, Int("0 success, 1 busy, else why not", values=MotionResult)]
    subcode: Annotated[
        int, Int("reason; of CHECK_QUEUE_CNT: increments still queued", values=Subcode)
    ]
    data: Annotated[tuple[float, ...], Reals("unused, 0")]


@_request(2003, "motoman_read_single_io", "motoman_read_single_io_reply", "Reads one bit.")
class MotomanReadSingleIo(Message):
    """READ_IO_BIT 2003."""

    address: Annotated[int, Int("address of the bit")]


@_reply(2004, "motoman_read_single_io_reply", "Value of one bit.")
class MotomanReadSingleIoReply(Reply):
    """READ_IO_BIT reply 2004."""

    value: Annotated[int, Int("0 or 1")]
    result_code: Annotated[int, Int("0 success, 1001 and up failed", values=IoResult)]


@_request(2005, "motoman_write_single_io", "motoman_write_single_io_reply", "Writes one bit.")
class MotomanWriteSingleIo(Message):
    """WRITE_IO_BIT 2005."""

    address: Annotated[int, Int("address of the bit")]
    value: Annotated[int, Int("0 or 1")]


@_reply(2006, "motoman_write_single_io_reply", "Verdict on writing one bit.")
class MotomanWriteSingleIoReply(Reply):
    """WRITE_IO_BIT reply 2006."""

    result_code: Annotated[int, Int("0 success, 1001 and up failed", values=IoResult)]


@_request(2007, "motoman_read_group_io", "motoman_read_group_io_reply", "Reads eight bits.")
class MotomanReadGroupIo(Message):
    """READ_IO_GROUP 2007."""

    address: Annotated[int, Int("address of the group: bit address / 10")]


@_reply(2008, "motoman_read_group_io_reply", "Value of eight bits.")
class MotomanReadGroupIoReply(Reply):
    """READ_IO_GROUP reply 2008."""

    value: Annotated[int, Int("0 to 255")]
    result_code: Annotated[int, Int("0 success, 1001 and up failed", values=IoResult)]


@_request(2009, "motoman_write_group_io", "motoman_write_group_io_reply", "Writes eight bits.")
class MotomanWriteGroupIo(Message):
    """WRITE_IO_GROUP 2009."""

    address: Annotated[int, Int("address of the group: bit address / 10")]
    value: Annotated[int, Int("0 to 255")]


@_reply(2010, "motoman_write_group_io_reply", "Verdict on writing eight bits.")
class MotomanWriteGroupIoReply(Reply):
    """WRITE_IO_GROUP reply 2010."""

    result_code: Annotated[int, Int("0 success, 1001 and up failed", values=IoResult)]


@_request(2012, "motoman_read_mregister", "motoman_read_mregister_reply", "Reads a register.")
class MotomanReadMregister(Message):
    """READ_MREGISTER 2012; its reply has the same number."""

    address: Annotated[int, Int("register number, 0 to 999")]


@_reply(2012, "motoman_read_mregister_reply", "Value of a register.", is_reply=True)
class MotomanReadMregisterReply(Reply):
    """READ_MREGISTER reply 2012."""

    value: Annotated[int, Int("0 to 65535")]
    result_code: Annotated[int, Int("0 success, 1001 and up failed", values=IoResult)]


@_request(2013, "motoman_write_mregister", "motoman_write_mregister_reply", "Writes a register.")
class MotomanWriteMregister(Message):
    """WRITE_MREGISTER 2013; its reply has the same number."""

    address: Annotated[int, Int("register number, 0 to 559")]
    value: Annotated[int, Int("0 to 65535")]


@_reply(2013, "motoman_write_mregister_reply", "Verdict on writing a register.", is_reply=True)
class MotomanWriteMregisterReply(Reply):
    """WRITE_MREGISTER reply 2013."""

    result_code: Annotated[int, Int("0 success, 1001 and up failed", values=IoResult)]


@record
class MotomanGroup(Record):
    """One group's share of a 2016 or 2017 message."""

    robot_id: Annotated[int, Int("group number")]
    # Real clients leave uninitialised memory in the upper bits.
    valid_fields: Annotated[
        int, Int("bits: 1 time, 2 position, 4 velocity, 8 acceleration", values=ValidField, mask=15)
    ]
    time: Annotated[float, Real("time from the start of the trajectory", "s")]
    positions: Annotated[tuple[float, ...], Reals("joint positions", _JOINT_UNIT)]
    velocities: Annotated[tuple[float, ...], Reals("joint velocities", "rad/s, m/s")]
    accelerations: Annotated[tuple[float, ...], Reals("joint accelerations", "rad/s², m/s²")]


@_request(
    2016,
    "motoman_joint_traj_pt_full_ex",
    "motoman_motion_reply",
    "One trajectory point of several groups; exactly num_groups records, or four.",
)
class MotomanJointTrajPtFullEx(Message):
    """JOINT_TRAJ_PT_FULL_EX 2016."""

    num_groups: Annotated[int, Int("groups that are meant")]
    sequence: Annotated[int, Int("index of the point from 0")]
    groups: Annotated[
        tuple[MotomanGroup, ...],
        Array(
            "a record for each group", of=MotomanGroup, most=MOTOMAN_GROUPS, meant_by="num_groups"
        ),
    ]


@message(
    Place(
        2017,
        "motoman_joint_feedback_ex",
        Direction.FROM_CONTROLLER,
        "none",
        _SOURCE,
        "Joint state of several groups; always four records.",
    )
)
class MotomanJointFeedbackEx(Topic):
    """JOINT_FEEDBACK_EX 2017: the controller's form, with the count first."""

    num_groups: Annotated[int, Int("groups that are meant")]
    groups: Annotated[
        tuple[MotomanGroup, ...],
        Array(
            "a record for each group", of=MotomanGroup, least=MOTOMAN_GROUPS, most=MOTOMAN_GROUPS
        ),
    ]


@_request(2018, "motoman_select_tool", "motoman_motion_reply", "Selects a tool file.")
class MotomanSelectTool(Message):
    """SELECT_TOOL 2018."""

    group: Annotated[int, Int("group number")]
    tool: Annotated[int, Int("tool file, 0 to 63")]
    sequence: Annotated[int, Int("echoed in the reply")]


@_request(
    2020,
    "motoman_get_dh_parameters",
    "motoman_get_dh_parameters with 512 bytes",
    "Asks for the Denavit-Hartenberg parameters.",
)
class MotomanGetDhParameters(Message):
    """GET_DH_PARAMETERS 2020 request: an empty body."""


@_reply(2020, "motoman_get_dh_parameters", "Denavit-Hartenberg parameters.", is_reply=True)
class MotomanGetDhParametersReply(Reply):
    """GET_DH_PARAMETERS 2020 reply: four groups of eight links, unused ones zero."""

    groups: Annotated[
        tuple[float, ...],
        Reals(
            "theta, d, a, alpha of each link of each group",
            "not stated by the vendor",
            count=128,
            shape=(MOTOMAN_GROUPS, 8, 4),
        ),
    ]


MOTOMAN_MESSAGES: tuple[type[Message], ...] = (
    MotomanMotionCtrl,
    MotomanMotionReply,
    MotomanReadSingleIo,
    MotomanReadSingleIoReply,
    MotomanWriteSingleIo,
    MotomanWriteSingleIoReply,
    MotomanReadGroupIo,
    MotomanReadGroupIoReply,
    MotomanWriteGroupIo,
    MotomanWriteGroupIoReply,
    MotomanReadMregister,
    MotomanReadMregisterReply,
    MotomanWriteMregister,
    MotomanWriteMregisterReply,
    MotomanJointTrajPtFullEx,
    MotomanJointFeedbackEx,
    MotomanSelectTool,
    MotomanGetDhParameters,
    MotomanGetDhParametersReply,
)
