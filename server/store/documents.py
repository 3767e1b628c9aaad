"""Documents: their kinds, names, sizes and revisions; and the interface of every store of them.

Owns the rules for a document's size and the rule of revisions: a change is made from the kept
revision and becomes the next one. Only the number orders revisions, never the clock. Plain data;
knows no file.

All calls of a store block until the disk has answered, so none belongs on an event loop:
`store_client` makes them from a thread. A change that was acknowledged survives a crash.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol

from openpendant.simplemsg.names import NameFault, author_fault, name_fault

from .store_errors import BadDocument, BadName, Conflict, TooLarge

MOST_NAME_BYTES = 64
"""Greatest number of bytes of UTF-8 of a new document's name: the size of message fields."""

MOST_CHUNK_BYTES = 1 << 20
"""Largest chunk of a recording [bytes]: minutes of samples."""


class DocumentKind(StrEnum):
    """Kind of a document; each kind has names of its own."""

    PROGRAM = "program"
    RECORDING = "recording"
    FRAMES = "frames"
    TOOLS = "tools"
    SCENE = "scene"
    POSITIONS = "positions"
    ACCOUNT = "account"
    SETTING = "setting"


MOST_BODY_BYTES: Mapping[DocumentKind, int] = {
    DocumentKind.PROGRAM: 4 << 20,
    DocumentKind.RECORDING: 1 << 20,
    DocumentKind.FRAMES: 1 << 20,
    DocumentKind.TOOLS: 1 << 20,
    DocumentKind.SCENE: 4 << 20,
    DocumentKind.POSITIONS: 64 << 10,
    DocumentKind.ACCOUNT: 64 << 10,
    DocumentKind.SETTING: 64 << 10,
}
"""Largest body [bytes of UTF-8]. A recording's samples are chunks, without a cap in sum."""

KEPT_REVISIONS: Mapping[DocumentKind, int] = {
    # Old password hashes are not kept: they would help only an attacker.
    kind: 1 if kind is DocumentKind.ACCOUNT else 20
    for kind in DocumentKind
}
"""Number of latest revisions kept, so that a wrong save loses nothing."""


@dataclass(frozen=True, slots=True)
class Heading:
    """Revision of a document without its body.

    Attributes:
        name: its name, unique among its kind.
        revision: counts its changes, from 1; goes on after a deletion.
        size: of its body [bytes].
        saved_at: wall-clock time in UTC, ISO 8601; for display only, clocks jump.
        deleted: True if this revision is its deletion.
    """

    kind: DocumentKind
    name: str
    revision: int
    size: int
    saved_by: str
    saved_at: str
    deleted: bool = False


@dataclass(frozen=True, slots=True)
class Document:
    """Revision of a document."""

    heading: Heading
    body: str


@dataclass(frozen=True, slots=True)
class Extent:
    """Size of a recording in the store.

    Attributes:
        chunks: number of chunks; chunk numbers start at 0, so this is the next one.
        size: of all of them [bytes].
    """

    chunks: int
    size: int


def check_name(name: str) -> None:
    """Refuse a name that a document may not have.

    Raises:
        BadName: it is empty, too long, not printable, not trimmed, or looks like a path.
    """
    _refuse(name, name_fault(name))


def check_new_name(name: str) -> None:
    """Refuse a name that a new document may not have; older ones with such a name are still read.

    Raises:
        BadName: as `check_name`, or it does not fit into a message.
    """
    check_name(name)
    size = len(name.encode())
    if size > MOST_NAME_BYTES:
        problem = (
            f"has {size} bytes of UTF-8; accepted: up to {MOST_NAME_BYTES}"
            " (letters beyond ASCII take 2 to 4)"
        )
        raise BadName(name, problem, size=size, limit=MOST_NAME_BYTES)


def check_author(author: str) -> None:
    """Refuse what cannot be the name of whoever saves; as `check_name`, but may hold slashes."""
    _refuse(author, author_fault(author))


def _refuse(name: str, fault: NameFault | None) -> None:
    if fault is not None:
        raise BadName(name, fault.problem, size=fault.size, limit=fault.limit)


def check_body(kind: DocumentKind, name: str, body: str) -> int:
    """Return the size of a body [bytes].

    Raises:
        TooLarge: it exceeds the cap of its kind.
        BadDocument: it cannot be encoded.
    """
    limit = MOST_BODY_BYTES[kind]
    what = f"{kind} {name!r}"
    if len(body) > limit:
        raise TooLarge(what, len(body), limit)
    try:
        size = len(body.encode())
    except UnicodeEncodeError as error:
        problem = f"half a surrogate pair (U+{ord(body[error.start]):04X}) is no text"
        raise BadDocument(what, problem, place=f"character {error.start + 1}") from None
    if size > limit:
        raise TooLarge(what, size, limit)
    return size


def check_chunk(name: str, data: bytes) -> None:
    """Refuse a chunk that is empty or too large.

    Raises:
        TooLarge: it exceeds the cap.
        BadDocument: it is empty.
    """
    what = f"a chunk of recording {name!r}"
    if not data:
        raise BadDocument(what, f"is empty; accepted: 1 to {MOST_CHUNK_BYTES} bytes")
    if len(data) > MOST_CHUNK_BYTES:
        raise TooLarge(what, len(data), MOST_CHUNK_BYTES)


def check_revision(kind: DocumentKind, name: str, expected: int, current: Heading | None) -> None:
    """Refuse a change that was not made from the kept revision.

    Args:
        expected: the revision that the change was made from; 0 for a new document.
        current: the kept revision, perhaps a deletion; None where there never was one.

    Raises:
        Conflict: somebody else was faster, or there is no such document.
    """
    if current is None:
        if expected:
            raise Conflict(kind, name, expected, 0)
        return
    kept = 0 if current.deleted else current.revision
    if expected != kept:
        by, at, gone = current.saved_by, current.saved_at, current.deleted
        raise Conflict(kind, name, expected, current.revision, by, at, deleted=gone)


def revision_after(current: Heading | None) -> int:
    """Return the number of the next revision; it goes on after a deletion."""
    return 1 if current is None else current.revision + 1


class Store(Protocol):
    """Documents with revisions, and recordings in chunks.

    Every call raises a `StoreError` where it fails, and then has changed nothing: `BadName`,
    `NotFound`, `Conflict`, `TooLarge`, `BadDocument`, `OutOfSequence`; `DiskFull`, `ReadOnly`,
    `StoreBusy` or `StoreFailed` with the system's words.
    """

    def load(self, kind: DocumentKind, name: str, revision: int | None = None) -> Document:
        """Return a document.

        Args:
            revision: an older one, if it is still kept; the latest if None.
        """

    def headings(self, kind: DocumentKind | None = None) -> tuple[Heading, ...]:
        """Return the latest revision of every document, by kind and name; deleted ones not."""

    def history(self, kind: DocumentKind, name: str) -> tuple[Heading, ...]:
        """Return the revisions of a document that are kept, deletions included, oldest first."""

    def save(
        self, kind: DocumentKind, name: str, body: str, *, expected_revision: int, author: str
    ) -> Heading:
        """Save a document and return its new revision."""

    def delete(
        self, kind: DocumentKind, name: str, *, expected_revision: int, author: str
    ) -> Heading:
        """Delete a document and return the revision that is its deletion.

        Its older revisions stay in its history; the chunks of a recording go at once.
        """

    def append_chunk(self, name: str, sequence: int, data: bytes) -> Extent:
        """Append to a recording whose document is there; return how much it holds now.

        Repeating the last chunk, because its acknowledgement was lost, changes nothing.
        """

    def load_chunks(self, name: str, first: int, most: int) -> tuple[bytes, ...]:
        """Return up to `most` chunks of a recording, from number `first` on."""

    def extent(self, name: str) -> Extent:
        """Return how much of a recording is kept."""

    def together(self) -> AbstractContextManager[None]:
        """Return a context whose changes are kept all or, if it raises, not at all."""

    def close(self) -> None:
        """Close the store."""
