"""Text from outside as it may stand on a terminal or in a log."""

from __future__ import annotations


def printable(text: str) -> str:
    """Return a text without anything that a terminal would act on or turn round."""
    return "".join(
        sign if sign.isprintable() else sign.encode("unicode_escape").decode() for sign in text
    )
