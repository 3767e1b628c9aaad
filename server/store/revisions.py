"""The rule of revisions: a change is made from the kept one, and becomes the next.

The number alone tells what is newer, whatever the clock says. Knows no file.
"""

from __future__ import annotations

from .documents import DocumentKind, Heading
from .errors import Conflict


def check_revision(kind: DocumentKind, name: str, expected: int, current: Heading | None) -> None:
    """Refuse a change that was not made from the kept revision.

    Args:
        kind: kind of the document.
        name: its name.
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
        raise Conflict(
            kind,
            name,
            expected,
            current.revision,
            current.saved_by,
            current.saved_at,
            deleted=current.deleted,
        )


def revision_after(current: Heading | None) -> int:
    """Return the number of the next revision; it goes on after a deletion."""
    return 1 if current is None else current.revision + 1
