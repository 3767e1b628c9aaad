"""How a name stands in a program's text: bare where nothing else could be meant, else quoted."""

from __future__ import annotations

import re

_BARE = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*", re.ASCII)

_CLAUSE_WORDS = frozenset(
    "via speed zone dwell robot linear frame tool joints pose config into timeout".split()
)
"""Words that may follow a name; a name that is one of them is quoted, to be read by people too."""


def named(name: str) -> str:
    """Return a name as the text has it."""
    if _BARE.fullmatch(name) and name not in _CLAUSE_WORDS:
        return name
    return f'"{name}"'
