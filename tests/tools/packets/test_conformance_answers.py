"""Which answers the tester takes for "the point was taken", and which for the answer to a PING."""

import math

import pytest

from openpendant.simplemsg import MOTOMAN, HeaderOnly, Message, MsgType, ReplyCode, codec_for
from openpendant.simplemsg.declaration import joint_array
from openpendant.simplemsg.motoman import MotomanMotionReply
from openpendant.tools.packets.conformance.check import RuleBroken
from openpendant.tools.packets.conformance.server.answers import is_taken, must_be_ping
from openpendant.tools.packets.conformance.server.monitor import distance
from openpendant.tools.packets.conformance.server.wire import ReceivedFrame

POINT = MsgType.JOINT_TRAJ_PT
SUCCESS, FAILURE = ReplyCode.SUCCESS, ReplyCode.FAILURE


def frame(message: Message) -> ReceivedFrame:
    codec = codec_for(MOTOMAN)
    return ReceivedFrame(0.0, codec.encode(message), codec)


def motoman(result: int) -> MotomanMotionReply:
    """Return what a Motoman controller answers a point; its header always says success."""
    return MotomanMotionReply(0, 1, POINT, result, 0, joint_array(()))


@pytest.mark.parametrize(
    ("answer", "taken"),
    [
        (HeaderOnly(POINT, reply_code=SUCCESS), True),
        (HeaderOnly(POINT, reply_code=FAILURE), False),
        (motoman(0), True),
        (motoman(1), False),
        (motoman(5), False),
    ],
)
def test_a_point_counts_as_taken_where_its_answer_says_so(answer: Message, taken: bool) -> None:
    assert is_taken(frame(answer)) is taken


@pytest.mark.parametrize(
    "answer", [HeaderOnly(MsgType.PING, reply_code=FAILURE), HeaderOnly(POINT, reply_code=SUCCESS)]
)
def test_a_failure_and_another_type_answer_no_ping(answer: Message) -> None:
    must_be_ping(frame(HeaderOnly(MsgType.PING, reply_code=SUCCESS)), "a PING")
    with pytest.raises(RuleBroken):
        must_be_ping(frame(answer), "a PING")


def test_a_position_that_is_no_number_is_far_from_everywhere() -> None:
    assert distance((0.0, math.nan), (0.0, 0.0)) == math.inf
    assert distance((0.0, 0.1), (0.0, -0.1)) == pytest.approx(0.2)
