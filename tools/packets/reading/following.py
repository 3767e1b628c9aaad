"""Follower of one request: its reply, and the robot's motion that it caused.

Owns the rules of what belongs together. Knows nothing of printing.
"""

from __future__ import annotations

from enum import Enum

from openpendant.simplemsg import CommType, MsgType, ReplyCode, Status, TriState
from openpendant.simplemsg.pendant import (
    JointMove,
    JointPath,
    Outcome,
    PoseMove,
    PosePath,
)

from ..console import PacketToolError
from ..trace import Event, TraceDirection
from .reader import Reading

PATIENCE = 2_000_000_000
"""Longest time from the reply to the start of the robot's motion [ns]."""

_TRAJECTORIES = {11, 12, 14, 2016}
_JOINT_STATES = {MsgType.JOINT_POSITION, MsgType.STATUS, MsgType.JOINT_FEEDBACK, 2017}
_PENDANT_MOTIONS = (JointMove, PoseMove, JointPath, PosePath)


class FollowStage(Enum):
    """Progress of the request."""

    SOUGHT = "the request was not found"
    ASKED = "no reply"
    ANSWERED = "answered"
    MOVED = "in motion"
    ENDED = "ended"


class Follower:
    """Selection of the packets of a trace that belong to one request.

    Attributes:
        stage: how far it has come; after `ENDED` nothing more belongs to it.
        replied: whether its reply was found.
    """

    def __init__(self, number: int) -> None:
        """Make a follower.

        Args:
            number: the request's place among the packets of the trace, from 1.
        """
        self.stage = FollowStage.SOUGHT
        self.replied = False
        self._number = number
        self._seen = 0
        self._request: Reading | None = None
        self._replied_at = 0

    def belongs(self, item: Reading | Event) -> bool:
        """Return True if a packet belongs to the request; events do not.

        Raises:
            PacketToolError: the packet with the number is no request.
        """
        if isinstance(item, Event):
            return False
        self._seen = item.number
        if self._request is None:
            return item.number == self._number and self._found(item)
        if item.packet.scenario != self._request.packet.scenario:
            self.stage = FollowStage.ENDED
        if self.stage is FollowStage.ENDED:
            return False
        if item.answers == self._number:
            self._take_reply(item)
            return True
        if self._is_trajectory:
            return self._is_robot_state(item)
        return self._is_outcome(item)

    def finish(self) -> None:
        """End the trace.

        Raises:
            PacketToolError: it has no packet of that number.
        """
        if self._request is None:
            raise PacketToolError(f"no packet {self._number}: the trace has {self._seen}")

    @property
    def _is_trajectory(self) -> bool:
        header = self._request.header if self._request else None
        return header is not None and header.msg_type in _TRAJECTORIES

    def _found(self, item: Reading) -> bool:
        kind = item.header.comm_type if item.header else None
        if kind != CommType.REQUEST:
            hint = f"; it answers request {item.answers}" if item.answers else ""
            raise PacketToolError(f"packet {self._number} is no request{hint}")
        self._request = item
        self.stage = FollowStage.ASKED
        return True

    def _take_reply(self, reply: Reading) -> None:
        self.replied = True
        self._replied_at = reply.packet.time
        refused = reply.header is None or reply.header.reply_code != ReplyCode.SUCCESS
        moves = self._is_trajectory or isinstance(self._message, _PENDANT_MOTIONS)
        if refused or not moves:
            self.stage = FollowStage.ENDED
        elif self.stage is FollowStage.ASKED:
            self.stage = FollowStage.ANSWERED

    @property
    def _message(self) -> object:
        return self._request.message if self._request else None

    def _is_robot_state(self, item: Reading) -> bool:
        header, packet = item.header, item.packet
        if header is None or packet.direction is not TraceDirection.TO_CLIENT:
            return False
        if header.comm_type != CommType.TOPIC or header.msg_type not in _JOINT_STATES:
            return False
        if self.stage is FollowStage.ANSWERED and packet.time - self._replied_at > PATIENCE:
            self.stage = FollowStage.ENDED
            return False
        if isinstance(item.message, Status):
            self._judge(item.message)
        return True

    def _judge(self, status: Status) -> None:
        if status.in_motion == TriState.TRUE:
            self.stage = FollowStage.MOVED
        elif (
            status.in_motion == TriState.FALSE and self.stage is FollowStage.MOVED and self.replied
        ):
            self.stage = FollowStage.ENDED

    def _is_outcome(self, item: Reading) -> bool:
        asked, request = self._message, self._request
        if request is None or not isinstance(asked, _PENDANT_MOTIONS):
            return False
        if not isinstance(item.message, Outcome) or item.message.request_id != asked.request_id:
            return False
        here, there = item.packet, request.packet
        if (here.port, here.connection) != (there.port, there.connection):
            return False
        self.stage = FollowStage.ENDED
        return True
