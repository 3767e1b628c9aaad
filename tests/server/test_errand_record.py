"""The store's answers in a journal, and back."""

from __future__ import annotations

import json

import pytest

from openpendant.server.errand_record import (
    ErrandRecordError,
    answer_from_json,
    answer_to_json,
)
from openpendant.server.store.documents import Document, DocumentKind, Extent, Heading
from openpendant.server.store.door import NoStore
from openpendant.server.store.errors import (
    BadName,
    Conflict,
    DiskFull,
    NotFound,
    OutOfSequence,
    StoreError,
    TooLarge,
)
from openpendant.server.store.requests import Answer

HEADING = Heading(DocumentKind.PROGRAM, "größe", 3, 20, "teacher", "2026-01-01T00:00:00+00:00")


@pytest.mark.parametrize(
    "answer",
    [
        Document(HEADING, '{"a": "ö"}'),
        HEADING,
        Extent(3, 4_000),
        (HEADING, HEADING),
        (),
        (b"\0\xff", b"x"),
    ],
)
def test_an_answer_comes_back_as_it_was(answer: Answer) -> None:
    assert answer_from_json(json.loads(json.dumps(answer_to_json(answer)))) == answer


@pytest.mark.parametrize(
    "error",
    [
        Conflict("program", "x", 1, 2, "me", "now"),
        NotFound("program", "x"),
        BadName("a/b", "has a slash"),
        TooLarge("it", 5, 4, "cut it"),
        OutOfSequence("r", 2, 1),
        DiskFull("store.db: database or disk is full"),
        NoStore("this server was started without a store"),
    ],
)
def test_an_error_comes_back_with_its_kind_words_and_numbers(error: StoreError) -> None:
    back = answer_from_json(json.loads(json.dumps(answer_to_json(error))))
    assert isinstance(back, StoreError)
    assert type(back) is type(error)
    assert (str(back), vars(back), back.refusal()) == (str(error), vars(error), error.refusal())


@pytest.mark.parametrize(
    "record",
    [
        {},
        {"what": "heading", "answer": {"name": "x"}},
        {"what": "chunks", "answer": ["?"]},
        {"what": "failed", "answer": {"kind": "OSError", "text": "", "fields": {}}},
    ],
)
def test_a_damaged_record_is_refused(record: dict[str, object]) -> None:
    with pytest.raises(ErrandRecordError):
        answer_from_json(record)
