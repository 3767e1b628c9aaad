"""Store requests of other modules, and their answers; plain data.

A core that must not block gives a request to its shell, and gets the answer as one more event.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from .documents import Document, DocumentKind, Extent, Heading, Store
from .recording_format import chunks_together, rename_recording, trim_recording
from .store_errors import StoreError


@dataclass(frozen=True, slots=True)
class Load:
    """Ask for a `Document`; the latest revision if None is named."""

    kind: DocumentKind
    name: str
    revision: int | None = None


@dataclass(frozen=True, slots=True)
class ListHeadings:
    """Ask for the latest headings of one kind, or of all."""

    kind: DocumentKind | None = None


@dataclass(frozen=True, slots=True)
class ListHistory:
    """Ask for the headings of all revisions of a document that are kept."""

    kind: DocumentKind
    name: str


@dataclass(frozen=True, slots=True)
class Save:
    """Ask to save a document; the answer is its new `Heading`."""

    kind: DocumentKind
    name: str
    body: str
    expected_revision: int
    author: str


@dataclass(frozen=True, slots=True)
class Delete:
    """Ask to delete a document; the answer is the `Heading` of its deletion."""

    kind: DocumentKind
    name: str
    expected_revision: int
    author: str


@dataclass(frozen=True, slots=True)
class AppendChunk:
    """Ask to append to a recording; the answer is its new `Extent`."""

    name: str
    sequence: int
    data: bytes


@dataclass(frozen=True, slots=True)
class LoadChunks:
    """Ask for some chunks of a recording, as bytes: together no more than one may have.

    At least one comes where there is one, so that an empty answer says that there are no more.
    """

    name: str
    first: int
    most: int


@dataclass(frozen=True, slots=True)
class MeasureRecording:
    """Ask for the `Extent` of a recording."""

    name: str


@dataclass(frozen=True, slots=True)
class TrimRecording:
    """Ask to save a part of a recording as a new one; the answer is its `Heading`."""

    name: str
    new_name: str
    begins: float
    ends: float | None
    author: str


@dataclass(frozen=True, slots=True)
class RenameRecording:
    """Ask to give a recording another name; the answer is its `Heading` under that."""

    name: str
    new_name: str
    expected_revision: int
    author: str


Request: TypeAlias = (
    Load
    | ListHeadings
    | ListHistory
    | Save
    | Delete
    | AppendChunk
    | LoadChunks
    | MeasureRecording
    | TrimRecording
    | RenameRecording
)
Result: TypeAlias = Document | Heading | Extent | tuple[Heading, ...] | tuple[bytes, ...]
Answer: TypeAlias = Result | StoreError
"""What was asked for, on the disk where it was a change; or why not."""


def size_of(request: Request) -> int:
    """Return the approximate memory of a waiting request [bytes]."""
    match request:
        case Save():
            return len(request.body)
        case AppendChunk():
            return len(request.data)
    return 0


def perform(store: Store, request: Request) -> Result:
    """Return the answer to a request.

    Raises:
        StoreError: the store cannot.
    """
    match request:
        case Load():
            return store.load(request.kind, request.name, request.revision)
        case ListHeadings():
            return store.headings(request.kind)
        case ListHistory():
            return store.history(request.kind, request.name)
        case Save():
            return store.save(
                request.kind,
                request.name,
                request.body,
                expected_revision=request.expected_revision,
                author=request.author,
            )
        case Delete():
            return store.delete(
                request.kind,
                request.name,
                expected_revision=request.expected_revision,
                author=request.author,
            )
        case AppendChunk():
            return store.append_chunk(request.name, request.sequence, request.data)
        case LoadChunks():
            return chunks_together(store, request.name, request.first, request.most)
        case MeasureRecording():
            return store.extent(request.name)
        case TrimRecording():
            return trim_recording(
                store, request.name, request.new_name, request.begins, request.ends, request.author
            )
        case RenameRecording():
            return rename_recording(
                store, request.name, request.new_name, request.expected_revision, request.author
            )
