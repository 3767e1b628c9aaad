"""Rules of correct answers: to a PING, to a point, and to the liveness probe.

Vendors answer points with bodies of their own, and some know no PING; this module alone
distinguishes their habits from faults.
"""

from __future__ import annotations

from openpendant.simplemsg import (
    CommType,
    JointTrajPt,
    JointTrajPtFull,
    MsgType,
    Ping,
    ReplyCode,
    SpecialSequence,
    ValidField,
    joint_array,
)
from openpendant.simplemsg.motoman import MotomanMotionReply

from ..check import PASSED, CheckFinding, RuleBroken, deviates
from .wire import REPLY_WITHIN, ReceivedFrame, Wire

_ZEROS = joint_array(())

STOP = JointTrajPt(SpecialSequence.STOP, _ZEROS, 0.0, 0.0)
STOP_TOPIC = JointTrajPt(SpecialSequence.STOP, _ZEROS, 0.0, 0.0, comm_type=CommType.TOPIC)
FULL_STOP = JointTrajPtFull(0, SpecialSequence.STOP, 0, 0.0, _ZEROS, _ZEROS, _ZEROS)

MOTION_REPLY: int = MotomanMotionReply.PLACE.msg_type
"""Type 2002, with which Motoman answers everything."""

_POINT_BODY = 52


def must_be_ping(reply: ReceivedFrame, what: str) -> None:
    """Raise RuleBroken unless a frame is a whole answer to a PING: its type, a reply, success."""
    if (reply.msg_type, reply.comm_type, reply.reply_code) != (
        MsgType.PING,
        CommType.REPLY,
        ReplyCode.SUCCESS,
    ):
        raise RuleBroken(f"{what} was answered by {reply}")


async def ping(wire: Wire, what: str = "a PING", within: float = REPLY_WITHIN) -> ReceivedFrame:
    """Return the answer to a PING; raise RuleBroken where there is none, or something else."""
    reply = await wire.ask(Ping(), what, within)
    must_be_ping(reply, what)
    return reply


def judge_point_reply(reply: ReceivedFrame) -> CheckFinding:
    """Judge the form of a reply that takes a point, with vendors' bodies; RuleBroken for none."""
    if reply.comm_type != CommType.REPLY or reply.reply_code != ReplyCode.SUCCESS:
        raise RuleBroken(f"the point was answered by {reply}")
    body = len(reply.body)
    match reply.msg_type:
        case MsgType.JOINT_TRAJ_PT if body == 0 or reply.body == bytes(40):
            return PASSED
        case MsgType.JOINT_TRAJ_PT if body == _POINT_BODY:
            return deviates("Stäubli: a point is answered by a whole point", str(reply))
        case MsgType.JOINT_POSITION if body == 44:
            return deviates("Fanuc: points are answered by type 10, before the motion", str(reply))
        case _ if reply.msg_type == MOTION_REPLY:
            return deviates("Motoman: points are answered by type 2002", str(reply))
    raise RuleBroken(f"the point was answered by {reply}")


def full_point(sequence: int, joints: tuple[float, ...], time: float = 0.0) -> JointTrajPtFull:
    """Return a full point at rest: joints (10,) [rad or m], time from the start [s]."""
    valid = int(ValidField.TIME | ValidField.POSITION | ValidField.VELOCITY)
    return JointTrajPtFull(0, sequence, valid, time, joints, _ZEROS, _ZEROS)


def is_taken(reply: ReceivedFrame) -> bool:
    """Return True if a reply says that a point was taken; Motoman says it in the body."""
    if reply.msg_type == MOTION_REPLY:
        return reply.integers(5)[3] == 0
    return reply.comm_type == CommType.REPLY and reply.reply_code == ReplyCode.SUCCESS


class LivenessProbe:
    """Liveness probe: a PING, or STOP where the target does not know PING."""

    def __init__(self, *, knows_ping: bool) -> None:
        self.message = Ping() if knows_ping else STOP
        self.name = "PING" if knows_ping else "STOP"

    def judge(self, reply: ReceivedFrame, what: str) -> None:
        """Raise RuleBroken unless a frame answers it."""
        if self.name == "PING":
            must_be_ping(reply, what)
        else:
            judge_point_reply(reply)

    async def answered(self, wire: Wire, what: str) -> None:
        """Wait for the answer to what was sent; RuleBroken where none came, or something else."""
        self.judge(await wire.expect(f"an answer to {what}"), what)

    async def ask(self, wire: Wire, when: str = "") -> None:
        """Ask, and wait for the answer; RuleBroken where none came, or something else."""
        wire.send(self.message)
        await self.answered(wire, f"a {self.name} {when}".rstrip())
