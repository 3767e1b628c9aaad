"""Records of reals as they came: they are the tuple that they would make, and their bytes."""

import copy
import pickle
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.simplemsg import PENDANT, ByteOrder, Codec, RealRecords, codec_for, joint_array
from openpendant.simplemsg.pendant import JointPath, JointWaypoint, PosePath, PoseWaypoint

FORMS = [codec_for(PENDANT, order, size) for order in ByteOrder for size in (4, 8)]

PATH = PosePath(
    7,
    1,
    0.5,
    "base",
    tuple(PoseWaypoint((at / 4, -1.0, 2.0), (0.0, 1.0, 0.0, at / 8)) for at in range(5)),
)


def came(codec: Codec) -> RealRecords[PoseWaypoint]:
    received = codec.decode(codec.encode(PATH))
    assert isinstance(received, PosePath)
    assert isinstance(received.waypoints, RealRecords)
    return received.waypoints


@pytest.fixture(params=FORMS, ids=lambda codec: f"{codec.byte_order.name}{codec.real_size}")
def codec(request: pytest.FixtureRequest) -> Codec:
    found: Codec = request.param
    return found


def test_a_message_that_came_equals_one_that_was_made(codec: Codec) -> None:
    received = codec.decode(codec.encode(PATH))
    assert received == PATH
    assert PATH == received
    assert repr(received) == repr(PATH)


def test_it_is_sent_on_as_it_came(codec: Codec) -> None:
    frame = codec.encode(PATH)
    assert codec.encode(codec.decode(frame)) == frame


def test_its_bytes_are_the_reals_of_all_records_in_order(codec: Codec) -> None:
    records = came(codec)
    count = len(records.data) // codec.real_size
    reals = struct.unpack(f"{records.real[0]}{count}{records.real[1]}", records.data)
    assert reals == tuple(
        real for each in PATH.waypoints for real in (*each.position, *each.orientation)
    )


@given(st.integers(-7, 7), st.integers(-7, 7), st.integers(1, 3))
def test_records_are_found_as_in_a_tuple(first: int, last: int, step: int) -> None:
    records, wanted = came(FORMS[0]), tuple(PATH.waypoints)
    assert len(records) == len(wanted)
    assert records[first:last:step] == wanted[first:last:step]
    if -len(wanted) <= first < len(wanted):
        assert records[first] == wanted[first]
    else:
        with pytest.raises(IndexError):
            records[first]


def test_it_differs_from_other_records_and_from_what_is_none() -> None:
    records = came(FORMS[0])
    assert records != tuple(PATH.waypoints[:4])
    assert records != (*PATH.waypoints[:4], PoseWaypoint((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)))
    assert records != "records"


def test_a_copy_of_it_is_the_tuple() -> None:
    records = came(FORMS[0])
    for copied in (pickle.loads(pickle.dumps(records)), copy.deepcopy(records)):
        assert copied == tuple(PATH.waypoints)
        assert isinstance(copied, tuple)


def test_a_record_is_made_when_it_is_asked_for_and_not_kept() -> None:
    codec = codec_for(PENDANT)
    waypoint = JointWaypoint(joint_array((0.5, 1.0)))
    received = codec.decode(codec.encode(JointPath(1, 0.5, 2, (waypoint,) * 1_600)))
    assert isinstance(received, JointPath)
    one, same = received.waypoints[9], received.waypoints[9]
    assert (one, same) == (waypoint, waypoint)
    assert one is not same
