import itertools
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.case_table import every
from rigs.data.example_counts import few
from rigs.data.golden_vectors import exact
from rigs.data.message_samples import DECLARED, SAMPLES

from openpendant.simplemsg import (
    DIALECTS,
    ByteOrder,
    Codec,
    CommType,
    HeaderOnly,
    Message,
    ReplyCode,
    codec_for,
)
from openpendant.simplemsg.declaration import Array, Field, Int, Real, Reals, Record, Tail, Text
from openpendant.simplemsg.packet_text import packet_to_json

FORMS = tuple(itertools.product(ByteOrder, (4, 8)))
REPLIES = [(CommType.REPLY, ReplyCode.SUCCESS), (CommType.REPLY, ReplyCode.FAILURE)]
OTHERS = [(CommType.TOPIC, ReplyCode.UNUSED), (CommType.REQUEST, ReplyCode.UNUSED)]

ALL = [(name, name) for name in DECLARED]


def _codec(declared: str, byte_order: ByteOrder, real_size: int) -> Codec:
    return codec_for(DIALECTS[declared.split(":")[0]], byte_order, real_size)


def _headers(codec: Codec, cls: type[Message]) -> list[tuple[CommType, ReplyCode]]:
    """Return the headers with which a message stands for itself in a dialect."""
    if cls.PLACE.is_reply:
        return REPLIES
    answered_by = codec.message_class(cls.PLACE.msg_type, CommType.REPLY)
    return OTHERS + REPLIES if answered_by is cls else OTHERS


def test_every_sample_decodes_from_any_bytes_like_object() -> None:
    every(ALL, _decodes_from_any_bytes)


def _decodes_from_any_bytes(declared: str) -> None:
    codec, sample = _codec(declared, ByteOrder.LITTLE, 4), SAMPLES[DECLARED[declared]]
    frame = codec.encode(sample)
    assert codec.decode(bytearray(frame)) == sample
    assert codec.decode(memoryview(frame)) == sample
    assert codec.decode(memoryview(bytearray(frame))) == sample


def test_a_bare_reply_to_any_message_is_header_only() -> None:
    every(ALL, _has_a_bare_reply)


def _has_a_bare_reply(declared: str) -> None:
    codec, cls = _codec(declared, ByteOrder.LITTLE, 4), DECLARED[declared]
    reply = HeaderOnly(cls.PLACE.msg_type, reply_code=ReplyCode.FAILURE)
    decoded = codec.decode(codec.encode(reply))
    assert decoded.reply_code is ReplyCode.FAILURE
    assert decoded == reply or not cls.FIELDS


_FLOATS = st.floats(width=32)
_SIX = struct.Struct("<6f")


def _values(field: Field) -> st.SearchStrategy[Any]:
    match field:
        case Int():
            if field.mask is not None:
                return st.integers(0, field.mask)
            return st.integers(-(2**31), 2**31 - 1)
        case Real():
            return _FLOATS
        case Reals():
            # Eight values, over and over, six of them in one draw: a draw each takes seconds.
            eight = st.tuples(_FLOATS, _FLOATS, st.binary(min_size=24, max_size=24))
            return eight.map(
                lambda drawn: ((*drawn[:2], *_SIX.unpack(drawn[2])) * field.count)[: field.count]
            )
        case Text():
            return _texts(field.size)
        case Tail():
            return st.binary(max_size=64)
        case Array():
            assert field.of is not None
            records = st.lists(
                _records(field.of), min_size=field.least, max_size=min(field.most, field.least + 2)
            )
            return records.map(tuple)
    raise AssertionError(f"no strategy for {type(field).__name__}")


def _texts(size: int) -> st.SearchStrategy[str]:
    # All that UTF-8 has; with `codec="utf-8"` hypothesis would try each code point, for seconds.
    characters = st.characters(exclude_categories=["Cs"], exclude_characters="\0")
    texts = st.text(characters, max_size=size)
    return texts.map(lambda text: text.encode()[:size].decode(errors="ignore"))


_RECORDS: dict[type[Record], st.SearchStrategy[Any]] = {}
"""Made once: hypothesis checks each strategy anew, which takes longer than the examples do."""


def _records(cls: type[Record]) -> st.SearchStrategy[Any]:
    if cls not in _RECORDS:
        built = st.builds(cls, **{name: _values(field) for name, field in cls.FIELDS.items()})
        _RECORDS[cls] = built.map(_with_true_counts)
    return _RECORDS[cls]


def _with_true_counts(record: Record) -> Record:
    for name, field in record.FIELDS.items():
        if isinstance(field, Array) and field.meant_by:
            setattr(record, field.meant_by, len(getattr(record, name)))
    return record


@pytest.mark.parametrize("declared", DECLARED)
@few(15)
@given(data=st.data())
def test_decoding_undoes_encoding(declared: str, data: st.DataObject) -> None:
    byte_order, real_size = data.draw(st.sampled_from(FORMS))
    codec, cls = _codec(declared, byte_order, real_size), DECLARED[declared]
    message = data.draw(_records(cls))
    message.comm_type, message.reply_code = data.draw(st.sampled_from(_headers(codec, cls)))
    frame = codec.encode(message)
    decoded = codec.decode(frame)
    assert type(decoded) is cls
    assert exact(packet_to_json(decoded, codec)) == exact(packet_to_json(message, codec))
    assert codec.encode(decoded) == frame or "nan" in exact(packet_to_json(message, codec))
