import math
import struct
from typing import Any

import pytest
from rigs.data.message_samples import SAMPLES

from openpendant.simplemsg import (
    PENDANT,
    STANDARD,
    BodyFault,
    CommType,
    Dialect,
    GetVersionReply,
    HeaderFault,
    HeaderOnly,
    JointPosition,
    JointTraj,
    JointTrajPt,
    JointTrajPtFull,
    LocalProtocolError,
    Message,
    NotEncodable,
    Opaque,
    Ping,
    ReplyCode,
    TrajPoint,
    codec_for,
    joint_array,
)
from openpendant.simplemsg.pendant import (
    JointMove,
    JointPath,
    JointWaypoint,
    Management,
    SoftwareStop,
)

J = joint_array([0.1, 0.2, 0.3])
BIG = 3.5e38
GOOD = TrajPoint(0, J, 0.1, 1.0)


def _full(**changed: Any) -> JointTrajPtFull:
    values = {"positions": J, "velocities": J, "accelerations": J, **changed}
    return JointTrajPtFull(robot_id=0, sequence=1, valid_fields=15, time=0.5, **values)


def _any(value: object) -> Any:
    """Hand a value of the wrong type past the type checker."""
    return value


UNFIT: dict[str, tuple[Message, str]] = {
    "too large": (JointPosition(2**31, J), "sequence"),
    "too small": (JointPosition(-(2**31) - 1, J), "sequence"),
    "thousands of digits": (JointPosition(10**5000, J), "sequence"),
    "a real for an integer": (JointPosition(_any(1.0), J), "sequence"),
    "nan for an integer": (JointPosition(_any(math.nan), J), "sequence"),
    "nothing for an integer": (JointPosition(_any(None), J), "sequence"),
    "nothing for an array": (JointPosition(0, _any(None)), "joints"),
    "nine joints": (JointPosition(0, J[:9]), "joints"),
    "eleven joints": (JointPosition(0, (*J, 0.0)), "joints"),
    "a text for a joint": (JointPosition(0, (*J[:9], _any("x"))), "joints[9]"),
    "huge for four bytes": (JointPosition(0, (*J[:4], BIG, *J[5:])), "joints[4]"),
    "an integer no real can hold": (JointPosition(0, (10**400, *J[1:])), "joints[0]"),
    "huge behind good arrays": (_full(accelerations=(*J[:9], -BIG)), "accelerations[9]"),
    "arrays that only sum up": (_full(positions=J[:9], velocities=(*J, 0.0)), "positions"),
    "arrays that sum up behind": (_full(velocities=J[:9], accelerations=(*J, 0.0)), "velocities"),
    "nothing for a later array": (_full(velocities=_any(None)), "velocities"),
    "nothing for a real": (JointTrajPt(0, J, _any(None), 1.0), "velocity"),
    "a point too many": (JointTraj((GOOD,) * 201), "points"),
    "no point": (JointTraj(()), "points"),
    "nothing for points": (JointTraj(_any(None)), "points"),
    "a bad point": (JointTraj((GOOD, TrajPoint(1, J, BIG, 1.0))), "points[1].velocity"),
    "no point at all": (JointTraj((_any(None),)), "points[0].sequence"),
    "a text too long": (SoftwareStop(1, "ä" * 33), "reason"),
    "a zero byte": (SoftwareStop(1, "a\0b"), "reason"),
    "a lone surrogate": (SoftwareStop(1, "\ud800"), "reason"),
    "bytes for a text": (SoftwareStop(1, _any(b"x")), "reason"),
    "a number for bytes": (Management(1, _any(5)), "body"),
    "a text for bytes": (Management(1, _any("{}")), "body"),
    "nothing for an opaque body": (Opaque(999, _any(None)), "body"),
    "a number for an opaque body": (Opaque(999, _any(4)), "body"),
    "a bad waypoint": (JointPath(1, 0.5, 3, (JointWaypoint(J[:3]),)), "waypoints[0].joints"),
}


@pytest.mark.parametrize("case", UNFIT)
def test_a_value_that_does_not_fit_is_named(case: str) -> None:
    message, field = UNFIT[case]
    with pytest.raises(NotEncodable) as caught:
        codec_for(PENDANT).encode(message)
    assert caught.value.field == field
    assert f".{field} is " in str(caught.value)
    assert len(str(caught.value)) < 200


def test_a_real_too_large_for_four_bytes_fits_eight() -> None:
    message = JointPosition(0, (BIG,) * 10)
    wide = codec_for(real_size=8)
    assert wide.decode(wide.encode(message)) == message


def test_the_largest_integers_and_reals_that_are_not_finite_are_encoded() -> None:
    largest = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]
    joints = joint_array([math.inf, -math.inf, math.nan, -0.0, largest, -largest])
    decoded = codec_for().decode(codec_for().encode(JointPosition(-(2**31), joints)))
    assert isinstance(decoded, JointPosition)
    assert str(decoded.joints) == str(joints)
    assert decoded.sequence == -(2**31)


def test_truth_values_and_lists_are_taken_as_the_numbers_they_are() -> None:
    frame = codec_for().encode(JointPosition(True, _any(list(J))))
    assert frame == codec_for().encode(JointPosition(1, J))


HEADERS: dict[str, Message] = {
    "a topic with a reply code": Ping(comm_type=CommType.TOPIC, reply_code=ReplyCode.SUCCESS),
    "a reply without": Ping(comm_type=CommType.REPLY),
    "communication type 0": Ping(comm_type=CommType.INVALID),
    "a bare reply without": HeaderOnly(11, reply_code=ReplyCode.UNUSED),
    "message type 0": HeaderOnly(0),
    "a message type of 33 bits": HeaderOnly(2**32),
    "a message type that is none": Opaque(_any("ping"), b""),
    "a communication type of 33 bits": JointPosition(0, J, comm_type=2**32),
    "no communication type": JointPosition(0, J, comm_type=_any(None)),
    "a variable message as a bare reply": JointTraj((), comm_type=CommType.REPLY),
    "an answer's layout as a topic": GetVersionReply(
        1, 2, 3, comm_type=CommType.TOPIC, reply_code=ReplyCode.UNUSED
    ),
}


@pytest.mark.parametrize("case", HEADERS)
def test_a_header_of_ours_that_breaks_a_rule_is_not_encoded(case: str) -> None:
    with pytest.raises(LocalProtocolError):
        codec_for().encode(HEADERS[case])


def test_a_message_of_another_dialect_is_not_encoded() -> None:
    with pytest.raises(LocalProtocolError, match="JointMove is no message of the standard dialect"):
        codec_for(STANDARD).encode(JointMove(1, 0.5, 6, J))


def test_a_real_has_four_or_eight_bytes() -> None:
    with pytest.raises(ValueError, match="4 or 8 bytes, not 2"):
        codec_for(real_size=2)


def test_one_wire_form_has_one_codec() -> None:
    assert codec_for() is codec_for()


def _request(message: Message, body: bytes) -> bytes:
    return struct.pack("<4i", 12 + len(body), message.PLACE.msg_type, 2, 0) + body


BODIES: dict[str, tuple[Dialect, type[Message], bytes, str]] = {
    "a point cut short": (STANDARD, JointTrajPt, bytes(51), "the body has 51 bytes, not 52"),
    "a point too long": (STANDARD, JointTrajPt, bytes(53), "the body has 53 bytes, not 52"),
    "no body": (STANDARD, JointTraj, b"", "no 1 to 200 records of 52 bytes"),
    "a count alone": (STANDARD, JointTraj, bytes(4), "no 1 to 200 records of 52 bytes"),
    "a wrong count": (
        STANDARD,
        JointTraj,
        bytes(104) + struct.pack("<i", 3),
        "size is 3, the body holds 2 records",
    ),
    "a negative count": (
        PENDANT,
        JointPath,
        bytes(12) + struct.pack("<i", -1) + bytes(40),
        "count is -1, the body holds 1 records",
    ),
    "half a record": (PENDANT, JointPath, bytes(12 + 60), "no 1 to 1600 records of 40 bytes"),
    "no head": (PENDANT, Management, bytes(3), "fewer than the 4 of its head"),
    "bytes that are no text": (PENDANT, SoftwareStop, bytes(4) + b"\xff" + bytes(63), "not UTF-8"),
    "a character cut in two": (
        PENDANT,
        SoftwareStop,
        bytes(4) + b"x" * 63 + "ä".encode()[:1],
        "not UTF-8",
    ),
}


@pytest.mark.parametrize("case", BODIES)
def test_a_body_that_does_not_fit_is_refused_with_its_numbers(case: str) -> None:
    dialect, cls, body, reason = BODIES[case]
    codec = codec_for(dialect)
    with pytest.raises(BodyFault, match=reason) as caught:
        codec.decode(_request(SAMPLES[cls], body))
    assert caught.value.msg_type == cls.PLACE.msg_type
    assert caught.value.comm_type == CommType.REQUEST
    assert str(caught.value).startswith(cls.PLACE.name)


def test_what_stands_behind_the_end_of_a_text_is_ignored() -> None:
    codec = codec_for(PENDANT)
    frame = _request(SAMPLES[SoftwareStop], bytes(4) + b"why\0\xff".ljust(64, b"?"))
    assert codec.decode(frame) == SoftwareStop(0, "why")


@pytest.mark.parametrize("size", [0, 3, 15])
def test_less_than_a_header_is_refused(size: int) -> None:
    with pytest.raises(HeaderFault, match=f"{size} bytes are less than a header"):
        codec_for().decode(bytes(size))


@pytest.mark.parametrize("size", [59, 61])
def test_a_frame_whose_length_field_is_wrong_is_refused(size: int) -> None:
    frame = codec_for().encode(SAMPLES[JointPosition]).ljust(61, b"\0")[:size]
    with pytest.raises(HeaderFault, match=f"length 56 is not the {size - 4} bytes that follow"):
        codec_for().decode(frame)


@pytest.mark.parametrize("body", [bytes(40), bytes(44), bytes(3)])
def test_a_reply_in_a_vendors_own_layout_is_kept_opaque(body: bytes) -> None:
    frame = struct.pack("<4i", 12 + len(body), 11, 3, 1) + body
    answer = {"comm_type": CommType.REPLY, "reply_code": ReplyCode.SUCCESS}
    assert codec_for().decode(frame) == Opaque(11, body, **answer)


def test_a_bare_reply_in_front_of_other_bytes_is_no_frame() -> None:
    with pytest.raises(HeaderFault):
        codec_for().decode(struct.pack("<5i", 12, 11, 3, 1, 0))


def test_codes_that_nobody_defined_are_passed_on() -> None:
    decoded = codec_for().decode(struct.pack("<4i", 12, 1, 7, 0))
    assert decoded == Ping(comm_type=7)
    decoded = codec_for().decode(struct.pack("<4i", 12, 1, 3, -9))
    assert decoded == Ping(comm_type=CommType.REPLY, reply_code=-9)
