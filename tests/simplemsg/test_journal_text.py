"""What is long in a journal's line is spelled out later, and reads as if it had been at once."""

from __future__ import annotations

import base64
import json
from typing import Any

import pytest

from openpendant.simplemsg.journal import (
    LONG,
    PIECE,
    LongValue,
    base64_value,
    hexadecimal,
    json_parts,
    spelled,
    with_long_texts,
)

DATA = bytes(range(256)) * 1_000


def spelled_out(value: Any) -> str:
    return "".join(map(spelled, json_parts(value)))


@pytest.mark.parametrize("size", [0, 1, LONG - 1, LONG, PIECE - 1, PIECE, PIECE + 1, len(DATA)])
def test_bytes_read_the_same_however_long_they_are(size: int) -> None:
    data = DATA[:size]
    assert spelled(hexadecimal(data)) == f'"{data.hex()}"'
    assert json.loads(spelled_out(base64_value(data))) == base64.b64encode(data).decode()
    assert isinstance(hexadecimal(data), LongValue) == (size >= LONG)
    assert isinstance(base64_value(data), LongValue) == (size >= LONG)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "short",
        "größe 😀 " * 20_000,
        '"\\\n\x00' * 20_000,
        "\ud83d" * LONG,
        '{"": ""}' * LONG,
    ],
)
def test_texts_read_the_same_and_long_ones_are_left_for_later(text: str) -> None:
    record = {"body": text, "parts": [text, "{}", {"n": 1, "none": None, "text": text}]}
    marked = with_long_texts(record)
    assert json.loads(spelled_out(marked)) == record
    left = [part for part in json_parts(marked) if isinstance(part, LongValue)]
    assert len(left) == (3 if len(text) >= LONG else 0)
    assert sum(len(part) for part in json_parts(marked) if isinstance(part, str)) < 4 * LONG


def test_a_piece_of_a_long_value_is_short() -> None:
    value = hexadecimal(DATA)
    assert isinstance(value, LongValue)
    assert len(value) == len(DATA)
    assert max(map(len, value.pieces())) == 2 * PIECE


def test_what_cannot_stand_in_a_journal_is_refused_by_its_type() -> None:
    with pytest.raises(TypeError, match="bytearray cannot stand in a journal"):
        spelled_out({"body": bytearray(3)})
