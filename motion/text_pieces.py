"""Long texts of what never changes, made in pieces with other work in between, and kept.

A journal has the `repr` of scenes and frames, of thousands of values, with each job that has them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol, TypeVar

A_PIECE = 8
"""Number of values of a piece: the text of a frame takes 70 µs to make, of its numpy arrays."""

_Value = TypeVar("_Value")


class KeepsText(Protocol):
    """A value that keeps its text once it is made."""

    @property
    def _texts(self) -> tuple[str, ...] | None: ...


def made_once(owner: KeepsText, making: Iterator[str]) -> Iterator[str]:
    """Return the pieces that an owner keeps; where it has none yet, those that are made now."""
    if owner._texts is not None:
        yield from owner._texts
        return
    texts: list[str] = []
    for text in making:
        texts.append(text)
        yield text
    object.__setattr__(owner, "_texts", tuple(texts))


def joined(values: Sequence[_Value], spell: Callable[[_Value], str]) -> Iterator[str]:
    """Return the texts of values with commas in between, in pieces."""
    for first in range(0, len(values), A_PIECE):
        between = ", " if first else ""
        yield between + ", ".join(map(spell, values[first : first + A_PIECE]))
