"""Secret: a password or pairing code that no log, error or dump can show by accident.

Owns that protection (promise 30): whatever prints, formats, pickles or compares the value gets
asterisks or an error.
"""

from __future__ import annotations

from typing import Final, NoReturn, final

_SHOWN: Final = "********"


@final
class Secret:
    """A text that only `reveal` gives out."""

    __slots__ = ("_text",)

    def __init__(self, text: str) -> None:
        self._text = text

    def reveal(self) -> str:
        """Return the text itself; for hashing and comparing only."""
        return self._text

    def __repr__(self) -> str:
        return f"Secret({_SHOWN})"

    def __str__(self) -> str:
        return _SHOWN

    def __format__(self, format_spec: str) -> str:
        return _SHOWN

    def __reduce__(self) -> NoReturn:
        raise TypeError("a secret is not pickled")
