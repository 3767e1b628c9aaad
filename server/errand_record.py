"""What the store is asked, and its answers, as data in the server's journal; the answers back.

What the store says comes from outside like any packet, and is noted whole, so that a journal is run
again without a store. Bodies and chunks go there as they are: an event loop has no time to spell
out a megabyte, so the journal's writer does.
"""

from __future__ import annotations

import base64
from dataclasses import replace
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, TypeAdapter, ValidationError

from openpendant.simplemsg.journal_text import base64_value, with_long_texts

from .field_fault import field_fault
from .store import errors
from .store.documents import Document, Extent, Heading
from .store.door import NoStore
from .store.errors import StoreError
from .store.requests import Answer, AppendChunk, Request, Save

_ERRORS: dict[str, type[StoreError]] = {
    kind.__name__: kind
    for kind in (*vars(errors).values(), NoStore)
    if isinstance(kind, type) and issubclass(kind, StoreError)
}

_Scalar = str | bool | int | float | None


class ErrandRecordError(ValueError):
    """The record holds no answer of a store; the text says why."""


class _Failed(BaseModel):
    model_config = ConfigDict(extra="forbid")

    kind: str
    text: str
    fields: dict[str, _Scalar]


class _Record(BaseModel):
    model_config = ConfigDict(extra="ignore")

    what: Literal["document", "heading", "extent", "headings", "chunks", "failed"]
    answer: Any


_DOCUMENT = TypeAdapter(Document)
_HEADING = TypeAdapter(Heading)
_EXTENT = TypeAdapter(Extent)
_HEADINGS = TypeAdapter(tuple[Heading, ...])
_TEXTS = TypeAdapter(tuple[str, ...])
_FAILED = TypeAdapter(_Failed)


def request_to_bytes(request: Request) -> bytes:
    """Return what is asked: its words, and behind them what is to be kept."""
    match request:
        case Save(body=body):
            return repr(replace(request, body="")).encode() + body.encode("utf-8", "surrogatepass")
        case AppendChunk(data=data):
            return repr(replace(request, data=b"")).encode() + data
    return repr(request).encode()


def answer_to_json(answer: Answer) -> dict[str, Any]:
    """Return an answer as data for a journal."""
    match answer:
        case Document():
            document = _DOCUMENT.dump_python(answer, mode="json")
            return {"what": "document", "answer": with_long_texts(document)}
        case Heading():
            return {"what": "heading", "answer": _HEADING.dump_python(answer, mode="json")}
        case Extent():
            return {"what": "extent", "answer": _EXTENT.dump_python(answer, mode="json")}
        case StoreError():
            failed = _Failed(
                kind=type(answer).__name__,
                text=str(answer),
                # An exception's notes and causes are no part of what it says.
                fields={name: value for name, value in vars(answer).items() if name[0] != "_"},
            )
            return {"what": "failed", "answer": failed.model_dump(mode="json")}
    chunks = [part for part in answer if isinstance(part, bytes)]
    if chunks:
        return {"what": "chunks", "answer": [base64_value(part) for part in chunks]}
    headings = tuple(part for part in answer if isinstance(part, Heading))
    return {"what": "headings", "answer": _HEADINGS.dump_python(headings, mode="json")}


def answer_from_json(record: dict[str, Any]) -> Answer:
    """Return the answer that a record holds; other keys are ignored.

    Raises:
        ErrandRecordError: the record is damaged.
    """
    try:
        read = _Record.model_validate(record)
        match read.what:
            case "document":
                return _DOCUMENT.validate_python(read.answer)
            case "heading":
                return _HEADING.validate_python(read.answer)
            case "extent":
                return _EXTENT.validate_python(read.answer)
            case "headings":
                return _HEADINGS.validate_python(read.answer)
            case "chunks":
                texts = _TEXTS.validate_python(read.answer)
                return tuple(base64.b64decode(text, validate=True) for text in texts)
            case "failed":
                return _error(_FAILED.validate_python(read.answer))
    except ValidationError as error:
        raise ErrandRecordError(field_fault(error)) from None
    except ValueError as error:
        raise ErrandRecordError(str(error)) from None


def _error(failed: _Failed) -> StoreError:
    """Return an error that says the same; its constructor would have to word it again."""
    kind = _ERRORS.get(failed.kind)
    if kind is None:
        raise ErrandRecordError(f"no error of a store is called {failed.kind!r}")
    error = kind.__new__(kind)
    error.args = (failed.text,)
    vars(error).update(failed.fields)
    return error
