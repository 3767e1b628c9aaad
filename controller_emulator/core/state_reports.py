"""Periodic reports on the state port, and replies to questions there.

Owns the composition of state messages and when STATUS goes along. Knows no servo and no errors: the
controller hands in the motion and its STATUS.
"""

from __future__ import annotations

from openpendant.simplemsg import (
    CommType,
    GetVersion,
    GetVersionReply,
    HeaderOnly,
    JointFeedback,
    JointPosition,
    Malformed,
    Message,
    MsgType,
    Ping,
    Received,
    ReplyCode,
    Status,
    Unasked,
    ValidField,
    __version__,
    accepted,
    joint_array,
    refused,
)

from ..interpolation.segment import State
from ..profiles import ControllerProfile

_ALL_VALID = int(ValidField.ALL)
_VERSION = tuple(int(part) for part in __version__.split("."))


class StateReports:
    """Reports of the state port by rounds, with the last STATUS that was sent."""

    def __init__(self, profile: ControllerProfile) -> None:
        self._profile = profile
        self._rounds = 0
        self._told: Status | None = None

    def change(self, status: Status) -> Status | None:
        """Return STATUS if it differs from the last one reported, and keep it as reported."""
        if status == self._told:
            return None
        self._told = status
        return status

    def round(self, state: State, status: Status, seconds: float) -> list[Message]:
        """Return one round.

        Args:
            status: STATUS; sent along when it changed, and every so many rounds.
            seconds: the controller's own time [s].
        """
        position, velocity, acceleration = state
        joints = joint_array(position)
        messages: list[Message] = []
        for kind in self._profile.state:
            if kind is MsgType.JOINT_POSITION:
                messages.append(JointPosition(0, joints))
            elif kind is MsgType.JOINT_FEEDBACK:
                messages.append(
                    JointFeedback(
                        robot_id=0,
                        valid_fields=_ALL_VALID,
                        time=seconds,
                        positions=joints,
                        velocities=joint_array(velocity),
                        accelerations=joint_array(acceleration),
                    )
                )
        has_changed = self.change(status) is not None
        if has_changed or self._rounds % self._profile.status_every == 0:
            messages.append(status)
        self._rounds += 1
        return messages


def answer(message: Received, status: Status) -> Message | None:
    """Return the reply to a question that changes nothing; either port may ask it.

    Anything else that wants a reply is refused. A STATUS request is answered whatever its body is:
    it travels the unusual way round and carries no question.

    Args:
        status: STATUS of this moment; it becomes the reply where it is asked for.
    """
    if isinstance(message, Unasked) or message.comm_type != CommType.REQUEST:
        return None
    match message:
        case Ping():
            return accepted(message)
        case GetVersion():
            major, minor, patch = _VERSION
            return GetVersionReply(major, minor, patch)
        case Status() | Malformed(msg_type=MsgType.STATUS):
            status.comm_type, status.reply_code = CommType.REPLY, ReplyCode.SUCCESS
            return status
        case Malformed(msg_type=0):
            return None  # a reply of type 0 would itself be malformed
        case Malformed(msg_type=msg_type):
            return HeaderOnly(msg_type, reply_code=ReplyCode.FAILURE)
        case _:
            return refused(message)
