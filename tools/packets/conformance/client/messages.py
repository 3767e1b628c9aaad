"""Messages of the scripted controller: replies, reports, and their mutations.

Owns the contents of its messages, in both dialects. When they are sent is `controller`'s.
"""

from __future__ import annotations

import struct

from openpendant.simplemsg import (
    MOTOMAN,
    ByteOrder,
    CommType,
    ControllerMode,
    HeaderOnly,
    JointFeedback,
    JointPosition,
    Message,
    MsgType,
    Opaque,
    Ping,
    ReplyCode,
    Status,
    TriState,
    ValidField,
    accepted,
    codec_for,
    joint_array,
    message_type,
    refused,
)
from openpendant.simplemsg.motoman import MotomanMotionCtrl, MotomanMotionReply

from .setup import Mutation, Setup

UNKNOWN_TYPE = 999
"""A message type that no dialect has."""

SUCCESS, BUSY, FAILURE, INVALID = range(4)
START_POSITION = 3011
SERVO_OFF = 5006

_KNOWN = (MsgType.PING, MsgType.JOINT_TRAJ_PT, MsgType.JOINT_TRAJ_PT_FULL, MsgType.JOINT_TRAJ)


class ControllerMessages:
    """Makes the frames of a controller."""

    def __init__(self, setup: Setup, order: ByteOrder) -> None:
        self._is_motoman = setup.dialect is MOTOMAN
        self._order = order
        self._encode = codec_for(setup.dialect, order, setup.real_size).encode

    def usual(self, request: Message, *, is_ready: bool = True) -> bytes:
        """Return the reply of a good controller.

        Args:
            request: what it answers.
            is_ready: what a Motoman controller says when it is asked.
        """
        if self._is_motoman and message_type(request) != MsgType.PING:
            if not is_ready and isinstance(request, MotomanMotionCtrl):
                return self._verdict(request, FAILURE, SERVO_OFF)
            return self._verdict(request, SUCCESS)
        is_known = message_type(request) in _KNOWN
        return self._encode(accepted(request) if is_known else refused(request))

    def _verdict(
        self,
        request: Message,
        result: int,
        subcode: int = 0,
        reply_code: ReplyCode = ReplyCode.SUCCESS,
    ) -> bytes:
        reply = MotomanMotionReply(
            robot_id=getattr(request, "robot_id", 0),
            sequence=getattr(request, "sequence", 0),
            command=getattr(request, "command", message_type(request)),
            result=result,
            subcode=subcode,
            data=joint_array(()),
            reply_code=reply_code,
        )
        return self._encode(reply)

    def changed(self, mutation: Mutation, request: Message) -> list[bytes]:
        """Return what a scenario answers to a point instead; nothing where the reply is lost."""
        match mutation:
            case Mutation.REPLY_LOST:
                return []
            case Mutation.REFUSED if self._is_motoman:
                return [self._verdict(request, INVALID, START_POSITION)]
            case Mutation.REFUSED:
                return [self._encode(refused(request))]
            case Mutation.BUSY if self._is_motoman:
                return [self._verdict(request, BUSY)]
            case Mutation.HEADER_FAILURE if self._is_motoman:
                return [self._verdict(request, SUCCESS, reply_code=ReplyCode.FAILURE)]
            case Mutation.WRONG_TYPE:
                return [self._encode(HeaderOnly(MsgType.PING))]
            case Mutation.UNREADABLE:
                # No codec writes a reply without a verdict.
                header = (12, message_type(request), CommType.REPLY, ReplyCode.UNUSED)
                return [struct.pack(f"{self._order.value}4i", *header)]
            case Mutation.MERGED:
                return [self.usual(request), self._encode(Ping())]
        return [self.usual(request)]

    def besides(self, mutation: Mutation, status: Status) -> bytes | None:
        """Return what a scenario sends besides; None where it sends nothing."""
        match mutation:
            case Mutation.UNKNOWN_TOPIC_MOTION | Mutation.UNKNOWN_TOPIC_STATE:
                return self._encode(Opaque(UNKNOWN_TYPE, b"", comm_type=CommType.TOPIC))
            case Mutation.UNKNOWN_REQUEST_MOTION | Mutation.UNKNOWN_REQUEST_STATE:
                return self._encode(Opaque(UNKNOWN_TYPE, b"", comm_type=CommType.REQUEST))
            case Mutation.PING_MOTION | Mutation.PING_STATE:
                return self._encode(Ping())
            case Mutation.STATUS_REQUEST:
                status.comm_type = CommType.REQUEST
                return self._encode(status)
        return None

    def joints(self, positions: tuple[float, ...]) -> bytes:
        """Return the report of where the joints stand, (10,) [rad or m]."""
        if not self._is_motoman:
            return self._encode(JointPosition(sequence=0, joints=positions))
        nothing = joint_array(())
        return self._encode(JointFeedback(0, ValidField.POSITION, 0.0, positions, nothing, nothing))

    @staticmethod
    def status(*, is_stopped: bool, moves: bool, is_possible: bool) -> Status:
        """Return the controller's status.

        Args:
            is_stopped: an emergency stop is active; the drives have no power then.
            moves: the robot moves.
            is_possible: a trajectory would start now, but for an emergency stop.
        """
        return Status(
            drives_powered=_tri(not is_stopped),
            e_stopped=_tri(is_stopped),
            error_code=0,
            in_error=TriState.FALSE,
            in_motion=_tri(moves),
            mode=ControllerMode.AUTO,
            motion_possible=_tri(is_possible and not is_stopped),
        )


def _tri(value: bool) -> TriState:
    return TriState.TRUE if value else TriState.FALSE
