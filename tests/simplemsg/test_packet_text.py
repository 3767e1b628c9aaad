import json
from typing import Any

import pytest

from openpendant.simplemsg import (
    MOTOMAN,
    PENDANT,
    CommType,
    HeaderOnly,
    LocalProtocolError,
    Opaque,
    ReplyCode,
    codec_for,
    joint_array,
)
from openpendant.simplemsg.packet_text import packet_from_json, packet_to_json
from openpendant.simplemsg.pendant import JointPath, JointWaypoint

ZEROS = [0.0] * 10
POSITION = {"sequence": 0, "joints": ZEROS}
TRAJECTORY = {"points": [{**POSITION, "velocity": 0.1, "duration": 1.0}], "size": 1}
HEADER = {"msg_type": 10, "comm_type": 1, "reply_code": 0}


def _packet(fields: Any = POSITION, **header: Any) -> dict[str, Any]:
    return {**HEADER, **header, "fields": fields}


def _with_joints(*joints: Any) -> dict[str, Any]:
    return _packet({**POSITION, "joints": [*joints, *ZEROS[len(joints) :]]})


def _trajectory(**fields: Any) -> dict[str, Any]:
    return _packet({**TRAJECTORY, **fields}, msg_type=12)


REFUSED: dict[str, tuple[Any, str]] = {
    "no object": ([1], r"a packet is a JSON object, not \[1\]"),
    "no type": ({"comm_type": 1, "reply_code": 0}, "msg_type must be an integer, not None"),
    "no fields": (HEADER, "fields must be a JSON object"),
    "fields in a list": (_packet([]), "fields must be a JSON object"),
    "an unknown key": ({**_packet(), "hex": ""}, "a packet has no key 'hex'"),
    "a true type": (_packet(msg_type=True), "msg_type must be an integer, not True"),
    "a real type": (_packet(msg_type=10.0), "msg_type must be an integer, not 10.0"),
    "an unknown field": (_packet({**POSITION, "x": 1}), "joint_position has no field 'x'"),
    "a missing field": (_packet({"sequence": 0}), "joint_position.joints is missing"),
    "too few joints": (_packet({**POSITION, "joints": [0.0]}), "joints must be a list of 10 real"),
    "a text for joints": (_packet({**POSITION, "joints": "0"}), "joints must be a list of 10 real"),
    "an unknown real": (_with_joints(0.0, "NaN"), r"joints\[1\] must be a real number, not 'NaN'"),
    "a true real": (_with_joints(True), r"joints\[0\] must be"),
    "a huge real": (_with_joints(10**400), "too large"),
    "a real beyond all": (_with_joints(json.loads("-1e400")), r"joints\[0\] is not finite"),
    "a real sequence": (_packet({**POSITION, "sequence": 0.0}), "sequence must be an integer"),
    "a wrong count": (_trajectory(size=2), "joint_traj.size is 2, there are 1 records"),
    "a true count": (_trajectory(size=True), "size must be an integer"),
    "a bad record": (_packet({"points": [7]}, msg_type=12), r"points\[0\] must be a JSON object"),
    "no records": (_packet({"points": {}}, msg_type=12), "points must be a list of objects"),
    "fields of an opaque packet": (_packet({"x": 1}, msg_type=999), "only a body"),
    "a body of odd digits": (_packet({"body": "abc"}, msg_type=999), "hexadecimal digits"),
    "a body that is no text": (_packet({"body": 12}, msg_type=999), "hexadecimal digits"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_packet_that_is_none_is_refused_with_its_key(case: str) -> None:
    packet, reason = REFUSED[case]
    with pytest.raises(LocalProtocolError, match=reason):
        packet_from_json(packet, codec_for())


def test_lists_of_another_shape_are_refused() -> None:
    packet = {"msg_type": 2020, "comm_type": 3, "reply_code": 1}
    flat = {**packet, "fields": {"groups": [[[0.0] * 8] * 4] * 4}}
    with pytest.raises(LocalProtocolError, match="a list of 4 lists of 8 lists of 4 real numbers"):
        packet_from_json(flat, codec_for(MOTOMAN))


def test_a_count_may_be_left_out() -> None:
    packet = packet_from_json(_packet({"points": TRAJECTORY["points"]}, msg_type=12), codec_for())
    assert packet_to_json(packet, codec_for())["fields"] == TRAJECTORY


def test_the_count_of_a_path_stands_where_it_travels() -> None:
    path = JointPath(1, 0.5, 6, (JointWaypoint(joint_array([])),))
    fields = packet_to_json(path, codec_for(PENDANT))["fields"]
    assert list(fields) == ["request_id", "speed", "joint_count", "count", "waypoints"]


def test_any_type_can_be_written_as_a_body() -> None:
    packet = packet_from_json(_packet({"body": "00 ff"}, comm_type=3, reply_code=1), codec_for())
    assert packet == Opaque(10, b"\0\xff", comm_type=CommType.REPLY, reply_code=ReplyCode.SUCCESS)


def test_an_opaque_reply_of_a_type_with_a_body_field_comes_back() -> None:
    codec = codec_for(PENDANT)
    short = Opaque(65001, b"\1\2\3", comm_type=CommType.REPLY, reply_code=ReplyCode.FAILURE)
    packet = packet_to_json(short, codec)
    assert packet["name"] == "management"
    assert packet_from_json(packet, codec) == short


def test_empty_fields_are_an_empty_body() -> None:
    packet = packet_from_json(_packet({}, comm_type=3, reply_code=2), codec_for())
    assert packet == HeaderOnly(10, reply_code=ReplyCode.FAILURE)


@pytest.mark.parametrize(
    ("msg_type", "name"), [(20, "read_input"), (21, "write_output"), (999, "unknown")]
)
def test_a_type_without_layout_has_a_name_all_the_same(msg_type: int, name: str) -> None:
    packet = Opaque(msg_type, b"", comm_type=CommType.TOPIC)
    assert packet_to_json(packet, codec_for())["name"] == name
