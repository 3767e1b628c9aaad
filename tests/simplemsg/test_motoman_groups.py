import struct

import pytest

from openpendant.simplemsg import MOTOMAN, BodyFault, ByteOrder, NotEncodable, codec_for
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.simplemsg.motoman import (
    MotomanGroup,
    MotomanJointFeedbackEx,
    MotomanJointTrajPtFullEx,
)

CODEC = codec_for(MOTOMAN)
ZEROS = (0.0,) * 10
FIRST_VALID_FIELDS = HEADER_SIZE + 12


def _groups(number: int, valid_fields: int = 7) -> tuple[MotomanGroup, ...]:
    return tuple(
        MotomanGroup(index, valid_fields, 0.5, ZEROS, ZEROS, ZEROS) for index in range(number)
    )


@pytest.mark.parametrize(("meant", "records"), [(1, 1), (2, 2), (3, 3), (4, 4), (1, 4), (3, 4)])
def test_as_many_records_as_meant_or_four_travel_both_ways(meant: int, records: int) -> None:
    point = MotomanJointTrajPtFullEx(meant, 5, _groups(records))
    frame = CODEC.encode(point)
    assert len(frame) == 24 + 132 * records
    assert CODEC.decode(frame) == point
    assert CODEC.encode(CODEC.decode(frame)) == frame


@pytest.mark.parametrize(("meant", "records"), [(1, 2), (2, 3), (3, 2), (4, 3), (0, 4), (5, 4)])
def test_any_other_number_of_records_is_malformed(meant: int, records: int) -> None:
    frame = bytearray(CODEC.encode(MotomanJointTrajPtFullEx(records, 5, _groups(records))))
    struct.pack_into("<i", frame, HEADER_SIZE, meant)
    with pytest.raises(BodyFault, match=f"num_groups is {meant}, the body holds {records}"):
        CODEC.decode(frame)


@pytest.mark.parametrize(("meant", "records"), [(1, 2), (3, 2), (0, 4), (5, 4)])
def test_any_other_number_of_records_cannot_be_sent(meant: int, records: int) -> None:
    with pytest.raises(NotEncodable, match=f"num_groups.*there are {records}"):
        CODEC.encode(MotomanJointTrajPtFullEx(meant, 5, _groups(records)))


@pytest.mark.parametrize("byte_order", ByteOrder)
@pytest.mark.parametrize("sent", [0x7F00_0006, -10, 6])
def test_a_receiver_keeps_four_low_bits_of_valid_fields(sent: int, byte_order: ByteOrder) -> None:
    codec = codec_for(MOTOMAN, byte_order)
    point = MotomanJointTrajPtFullEx(2, 5, _groups(2, valid_fields=sent))
    frame = codec.encode(point)
    assert struct.unpack_from(f"{byte_order.value}i", frame, FIRST_VALID_FIELDS) == (sent,)
    received = codec.decode(frame)
    assert isinstance(received, MotomanJointTrajPtFullEx)
    assert [group.valid_fields for group in received.groups] == [6, 6]


def test_feedback_of_several_groups_is_masked_too() -> None:
    received = CODEC.decode(CODEC.encode(MotomanJointFeedbackEx(2, _groups(4, valid_fields=-2))))
    assert isinstance(received, MotomanJointFeedbackEx)
    assert [group.valid_fields for group in received.groups] == [14] * 4
