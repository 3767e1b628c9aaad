"""A frame of every declared message, in every dialect that has it and as every kind of exchange."""

import struct
from collections.abc import Iterator
from typing import NamedTuple

from rigs.data.message_samples import SAMPLES

from openpendant.simplemsg import DIALECTS, ByteOrder, CommType, ReplyCode, codec_for

ORDERS = (ByteOrder.LITTLE, ByteOrder.BIG)
REAL_SIZES = (4, 8)
_COMM_AT = 8


class SampleFrame(NamedTuple):
    """A frame, and by what numbers of the fuzz targets' choices it can be read.

    Attributes:
        dialect: place in `DIALECTS`.
        order: place in `ORDERS`.
        real: place in `REAL_SIZES`.
        comm_type: kind of exchange in its header, be it usual for this message or not.
    """

    dialect: int
    order: int
    real: int
    comm_type: CommType
    data: bytes


def sample_frames() -> Iterator[SampleFrame]:
    count = 0
    for place, dialect in enumerate(DIALECTS.values()):
        for sample in (SAMPLES[cls] for cls in dialect.messages):
            for comm_type in (CommType.TOPIC, CommType.REQUEST, CommType.REPLY):
                order, real = count % 2, count // 2 % 2
                codec = codec_for(dialect, ORDERS[order], REAL_SIZES[real])
                frame = bytearray(codec.encode(sample))
                code = ReplyCode.SUCCESS if comm_type is CommType.REPLY else ReplyCode.UNUSED
                struct.pack_into(f"{ORDERS[order].value}2i", frame, _COMM_AT, comm_type, code)
                yield SampleFrame(place, order, real, comm_type, bytes(frame))
                count += 1
