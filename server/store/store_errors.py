"""Store errors by kind, each with its verdict code and its numbers.

Knows nothing of SQLite or of files of text: those map their own faults to these kinds.
"""

from __future__ import annotations

from typing import ClassVar

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import NO_JOINT, Refusal


class StoreError(Exception):
    """Failure of a store request; nothing was changed."""

    code: ClassVar[VerdictCode] = VerdictCode.STORE_FAILED
    numbers: ClassVar[tuple[str, ...]] = ()
    """Names of the attributes that are the value and the limit of its refusal, if it has any."""

    def refusal(self) -> Refusal:
        """Return the refusal for a pendant."""
        numbers = (float(getattr(self, name)) for name in self.numbers)
        return Refusal(self.code, str(self), NO_JOINT, *numbers)


class Conflict(StoreError):
    """Change from a revision that is no longer the kept one.

    Attributes:
        expected: the revision that the change was made from; 0 for a new document.
        current: the revision that is kept; 0 where there never was one.
        saved_at: when, wall-clock time as text.
        deleted: True if the current revision is its deletion.
    """

    code = VerdictCode.REVISION_CONFLICT
    numbers = ("current", "expected")

    def __init__(
        self,
        kind: str,
        name: str,
        expected: int,
        current: int,
        saved_by: str = "",
        saved_at: str = "",
        *,
        deleted: bool = False,
    ) -> None:
        asked = f"made from revision {expected}" if expected else "of a new document"
        if current:
            did = "deleted as" if deleted else "saved as"
            kept = f"it was {did} revision {current} by {saved_by!r} at {saved_at}"
        else:
            kept = "there is no such document"
        super().__init__(f"{kind} {name!r}: the change was {asked}, but {kept}")
        self.kind, self.name = kind, name
        self.expected, self.current = expected, current
        self.saved_by, self.saved_at, self.deleted = saved_by, saved_at, deleted


class NotFound(StoreError):
    """Missing document, or missing revision of one.

    Attributes:
        revision: the revision asked for; None for the latest.
    """

    code = VerdictCode.NOT_FOUND

    def __init__(self, kind: str, name: str, revision: int | None = None) -> None:
        what = f"no {kind} {name!r}" if revision is None else f"no such revision of {kind} {name!r}"
        super().__init__(f"there is {what}" + ("" if revision is None else f": {revision}"))
        self.kind, self.name, self.revision = kind, name, revision


class BadName(StoreError):
    """Name that cannot be shown on one line, or that looks like a path.

    Attributes:
        size: its characters or bytes, where these are too many; else 0.
        limit: how many are accepted; else 0.
    """

    code = VerdictCode.BAD_NAME
    numbers = ("size", "limit")

    def __init__(self, name: str, problem: str, *, size: int = 0, limit: int = 0) -> None:
        shown = ascii(name if len(name) <= 80 else name[:77] + "...")
        super().__init__(f"name {shown}: {problem}")
        self.name, self.problem = name, problem
        self.size, self.limit = size, limit


class TooLarge(StoreError):
    """Document, chunk or file above its greatest size.

    Attributes:
        size: its size [bytes]; at least so much where reading ended early.
        limit: the largest size accepted [bytes].
    """

    code = VerdictCode.TOO_LARGE
    numbers = ("size", "limit")

    def __init__(self, what: str, size: int, limit: int, advice: str = "") -> None:
        more = f"; {advice}" if advice else ""
        super().__init__(f"{what} has {size} bytes or more; accepted: at most {limit}{more}")
        self.what = what
        self.size, self.limit = size, limit


class BadDocument(StoreError):
    """Text that is no document, or a file of another format.

    Attributes:
        file: the file, or what was asked to be saved.
        line: line of the fault, from 1; 0 where it has none.
        place: column of the text, or the field, as `column 7` or `points[2].speed`; may be empty.
    """

    code = VerdictCode.BAD_DOCUMENT

    def __init__(self, file: str, problem: str, *, line: int = 0, place: str = "") -> None:
        where = ", ".join(part for part in (f"line {line}" if line else "", place) if part)
        super().__init__(f"{file}: {where}: {problem}" if where else f"{file}: {problem}")
        self.file, self.line = file, line
        self.place, self.problem = place, problem


class OutOfSequence(StoreError):
    """Chunk of a recording that is not the next one."""

    code = VerdictCode.OUT_OF_SEQUENCE
    numbers = ("sequence", "following")

    def __init__(self, name: str, sequence: int, following: int) -> None:
        super().__init__(f"recording {name!r}: chunk {sequence} came, chunk {following} is next")
        self.name = name
        self.sequence, self.following = sequence, following


class StoreFailed(StoreError):
    """The file could not be read or written; the text holds the system's own words."""


class DiskFull(StoreFailed):
    """There is no room for what was to be saved; what was saved before is untouched."""

    code = VerdictCode.DISK_FULL


class ReadOnly(StoreFailed):
    """The file or its folder may not be written."""

    code = VerdictCode.STORE_READ_ONLY


class StoreBusy(StoreError):
    """Another process holds the file, or too much waits to be written already."""

    code = VerdictCode.STORE_BUSY


class StoreTooNew(StoreFailed):
    """The file was written by a later version of this program."""

    def __init__(self, path: str, found: int, known: int) -> None:
        super().__init__(
            f"{path}: has schema version {found}; this program knows versions up to {known}:"
            f" use a newer openpendant"
        )
        self.found, self.known = found, known


class ForeignFile(StoreFailed):
    """The file is a database, but not one of ours."""
