"""Names that people give: to programs, recordings and other documents, and to what is in them.

Owns the rule for such a name. It is not the name of a file, but people read it on one line and type
it on a command line.
"""

from __future__ import annotations

import unicodedata
from typing import NamedTuple

LONGEST_NAME = 64
"""Greatest number of characters of a document's name, and of its author's."""

OF_A_DOCUMENT = f"accepted: 1 to {LONGEST_NAME} printable characters"
"""What the name of a document may be, in the words of a refusal."""

_FORBIDDEN = frozenset("/\\")


class NameFault(NamedTuple):
    """Why a name is none.

    Attributes:
        problem: what is wrong, and what is accepted.
        size: its characters or bytes, where these are too many; else 0.
        limit: how many are accepted; else 0.
    """

    problem: str
    size: int = 0
    limit: int = 0


def name_fault(name: str) -> NameFault | None:
    """Return why a document may not have a name; None where it may."""
    fault = author_fault(name)
    if fault is not None:
        return fault
    found = _FORBIDDEN.intersection(name)
    if found:
        return NameFault(f"has {min(found)!r}; accepted: a name without / and \\")
    if set(name) == {"."}:
        return NameFault("consists of dots; accepted: a name with other characters, too")
    return None


def author_fault(name: str) -> NameFault | None:
    """As `name_fault`, of the name of whoever saves, which may hold slashes."""
    if not 1 <= len(name) <= LONGEST_NAME:
        return NameFault(f"has {len(name)} characters; {OF_A_DOCUMENT}", len(name), LONGEST_NAME)
    for place, character in enumerate(name):
        if not character.isprintable():
            problem = f"holds U+{ord(character):04X} as character {place + 1}"
            return NameFault(f"{problem}; {OF_A_DOCUMENT}")
    if name != name.strip():
        return NameFault("begins or ends with a space; accepted: a name without")
    # Two encodings of one letter would make two documents that look the same.
    if not unicodedata.is_normalized("NFC", name):
        return NameFault("is not in Unicode's composed form; accepted: form NFC")
    return None
