from __future__ import annotations

import pytest
from rigs.data.journal_records import read_back

from openpendant.server.journal.event_records import (
    AnswerRecordError,
    answer_from_json,
    answer_to_json,
    request_to_bytes,
)
from openpendant.server.store.documents import Document, DocumentKind, Extent, Heading
from openpendant.server.store.requests import Answer, AppendChunk, Load, Request, Save
from openpendant.server.store.store_client import NoStore
from openpendant.server.store.store_errors import (
    BadName,
    Conflict,
    DiskFull,
    NotFound,
    OutOfSequence,
    StoreError,
    TooLarge,
)

HEADING = Heading(DocumentKind.PROGRAM, "größe", 3, 20, "teacher", "2026-01-01T00:00:00+00:00")


@pytest.mark.parametrize(
    "answer",
    [
        Document(HEADING, '{"a": "ö"}'),
        Document(HEADING, '{"a": "ö\\n"}' * 100_000),
        HEADING,
        Extent(3, 4_000),
        (HEADING, HEADING),
        (),
        (b"\0\xff", b"x"),
        (b"\0\xff" * 100_000, b"x"),
    ],
)
def test_an_answer_comes_back_as_it_was(answer: Answer) -> None:
    assert answer_from_json(read_back(answer_to_json(answer))) == answer


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
    back = answer_from_json(read_back(answer_to_json(error)))
    assert isinstance(back, StoreError)
    assert type(back) is type(error)
    assert (str(back), vars(back), back.refusal()) == (str(error), vars(error), error.refusal())


@pytest.mark.parametrize(
    ("request_", "noted"),
    [
        (Load(DocumentKind.PROGRAM, "x"), "Load(kind="),
        (Save(DocumentKind.PROGRAM, "x", "ö\n", 1, "me"), "body='', expected_revision=1"),
        (AppendChunk("x", 2, b"\0\xff"), "AppendChunk(name='x', sequence=2, data=b'')"),
    ],
)
def test_a_request_is_noted_with_all_that_is_to_be_kept(request_: Request, noted: str) -> None:
    """What is long stands behind the words as it is: its spelling would hold up the event loop."""
    said = request_to_bytes(request_)
    assert noted.encode() in said
    kept = {Save: "ö\n".encode(), AppendChunk: b"\0\xff"}
    assert said.endswith(kept.get(type(request_), b")"))


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
    with pytest.raises(AnswerRecordError):
        answer_from_json(record)
