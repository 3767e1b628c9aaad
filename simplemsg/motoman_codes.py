"""The numbers of the Motoman dialect, named: commands, results and reasons.

Source: ros-industrial/motoman, `MotoPlus/SimpleMessage.h` and `CtrlGroup.h` of MotoROS 1.9.12. What
each means, and what helps, stands in `motoman_catalogue`. Knows no message and no bytes.
"""

from __future__ import annotations

from enum import IntEnum


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
