"""Store requests of other modules, and their answers; plain data.

A core that must not block gives a request to its shell, and gets the answer as one more event.
"""

from __future__ import annotations

from dataclasses import dataclass, field
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
    """Ask to save a document; the answer is its new `Heading`.

    Attributes:
        session: connection that it is done for, 0 for the server; the store does not keep it.
        renames: the document of which this is a copy that takes its place; None for none.
    """

    kind: DocumentKind
    name: str
    body: str
    expected_revision: int
    author: str
    session: int = field(default=0, repr=False)
    renames: str | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True)
class Delete:
    """Ask to delete a document; the answer is the `Heading` of its deletion.

    Attributes:
        session: as of `Save`.
        renamed_to: the copy that has taken its place; None where nothing has.
    """

    kind: DocumentKind
    name: str
    expected_revision: int
    author: str
    session: int = field(default=0, repr=False)
    renamed_to: Heading | None = field(default=None, repr=False)


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
    """Ask to save a part of a recording as a new one; the answer is its `Heading`.

    Attributes:
        session: as of `Save`.
    """

    name: str
    new_name: str
    begins: float
    ends: float | None
    author: str
    session: int = field(default=0, repr=False)


@dataclass(frozen=True, slots=True)
class RenameRecording:
    """Ask to give a recording another name; the answer is its `Heading` under that.

    Attributes:
        session: as of `Save`.
    """

    name: str
    new_name: str
    expected_revision: int
    author: str
    session: int = field(default=0, repr=False)


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
        case Load(kind, name, revision):
            return store.load(kind, name, revision)
        case ListHeadings(kinds):
            return store.headings(kinds)
        case ListHistory(kind, name):
            return store.history(kind, name)
        case Save(kind, name, body, expected, author):  # the rest is for whoever asked
            return store.save(kind, name, body, expected_revision=expected, author=author)
        case Delete(kind, name, expected, author):
            return store.delete(kind, name, expected_revision=expected, author=author)
        case AppendChunk(name, sequence, data):
            return store.append_chunk(name, sequence, data)
        case LoadChunks(name, first, most):
            return chunks_together(store, name, first, most)
        case MeasureRecording(name):
            return store.extent(name)
        case TrimRecording(name, new_name, begins, ends, author):
            return trim_recording(store, name, new_name, begins, ends, author)
        case RenameRecording(name, new_name, expected, author):
            return rename_recording(store, name, new_name, expected, author)
