import json
from typing import Any

import pytest
from rigs.data.case_table import every, same
from rigs.data.golden_vectors import exact

from openpendant.simplemsg import DIALECTS, ByteOrder, Codec, Message, codec_for
from openpendant.simplemsg.declaration import Int, Reals
from openpendant.simplemsg.packet_text import packet_from_json, packet_to_json
from openpendant.tools.reference.messages import ALL_MESSAGES, every_field
from openpendant.tools.reference.samples import extremes, sample, zeros
from openpendant.tools.reference.vectors import vector_files

FILES = {name: text for name, text in vector_files().items() if name.endswith(".json")}
MESSAGES = [(cls.__name__, cls) for cls in ALL_MESSAGES]


def _codec(file: str) -> Codec:
    dialect, order, real = file.removesuffix(".json").split("-")
    byte_order = ByteOrder.LITTLE if order == "le" else ByteOrder.BIG
    return codec_for(DIALECTS[dialect], byte_order, int(real[1:]) // 8)


def _packet(entry: dict[str, Any]) -> dict[str, Any]:
    return {key: entry[key] for key in ("msg_type", "comm_type", "reply_code", "fields")}


def test_there_is_a_file_for_each_dialect_order_and_width() -> None:
    assert len(FILES) == len(DIALECTS) * 2 * 2


@pytest.mark.parametrize("file", FILES)
def test_every_exported_packet_holds_both_ways(file: str) -> None:
    codec = _codec(file)

    def check(entry: dict[str, Any]) -> None:
        message = codec.decode(bytes.fromhex(entry["hex"]))
        decoded = {**packet_to_json(message, codec)}
        decoded.pop("name")
        same(exact(decoded), exact(_packet(entry)))
        same(codec.encode(packet_from_json(_packet(entry), codec)).hex(), entry["hex"])

    every([(entry["name"], entry) for entry in json.loads(FILES[file])], check)


@pytest.mark.parametrize("file", FILES)
def test_names_are_unique_in_a_file(file: str) -> None:
    names = [entry["name"] for entry in json.loads(FILES[file])]
    assert len(names) == len(set(names))


def test_the_fields_of_every_sample_can_be_told_apart() -> None:
    every(MESSAGES, _has_fields_that_can_be_told_apart)


def _has_fields_that_can_be_told_apart(cls: type[Message]) -> None:
    message = sample(cls)
    plain = [
        value
        for name, field in cls.FIELDS.items()
        if not (isinstance(field, Int) and field.values is not None)
        for value in [getattr(message, name)]
    ]
    assert all(one != other for i, one in enumerate(plain) for other in plain[:i])


def test_every_sample_is_exact_in_four_bytes() -> None:
    every(MESSAGES, _is_exact_in_four_bytes)


def _is_exact_in_four_bytes(cls: type[Message]) -> None:
    codecs = [_codec(f"{name}-le-f32") for name in DIALECTS]
    codec = next(codec for codec in codecs if cls in codec.dialect.messages)
    assert codec.decode(codec.encode(sample(cls))) == sample(cls)


def test_extremes_hold_what_is_no_number_and_zeros_do_not() -> None:
    cls = next(cls for cls in ALL_MESSAGES if cls.__name__ == "State")
    assert any(isinstance(field, Reals) for field in every_field(cls.FIELDS))
    assert "nan" in repr(extremes(cls))
    assert "nan" not in repr(zeros(cls))
