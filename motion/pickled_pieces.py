"""Pickles of a long tuple, a piece at a time: what stays the same is not pickled again.

An event loop hands scenes and frames to its planning processes with every job. Thousands of values
take it milliseconds to pickle, their pickles, made in steps and kept, only to be copied.
"""

from __future__ import annotations

import pickle
from collections.abc import Generator, Sequence
from typing import Any, Generic, TypeVar

A_PIECE = 64
"""Number of values of a piece."""

PER_VALUE = 5.0
"""About how long it takes to pickle one on an ordinary machine [µs]."""

_PER_KEPT = 0.1  # µs

_Value = TypeVar("_Value")


class PickledPieces(Generic[_Value]):
    """Pickles of the values of a tuple; a pickle of this is made of them."""

    def __init__(self, pieces: Sequence[tuple[Sequence[_Value], bytes]]) -> None:
        """Take pieces, each with its pickle."""
        self._pieces = pieces

    @classmethod
    def steps(
        cls, values: Sequence[_Value], before: PickledPieces[_Value] | None
    ) -> Generator[float, None, PickledPieces[_Value]]:
        """Pickle values in steps; yield before each how long it will take [µs].

        Args:
            before: pickles of other values, of which the pieces that are the same are kept.
        """
        known: Any = () if before is None else before._pieces
        pieces: list[tuple[Sequence[_Value], bytes]] = []
        for index, first in enumerate(range(0, len(values), A_PIECE)):
            piece = values[first : first + A_PIECE]
            same = known[index] if index < len(known) else None
            if same is not None and _is_same(same[0], piece):
                yield _PER_KEPT * len(piece)
                pieces.append(same)
            else:
                yield PER_VALUE * len(piece)
                pieces.append((piece, pickle.dumps(piece)))
        return cls(pieces)

    @property
    def pickles(self) -> tuple[bytes, ...]:
        """Pickle of each piece."""
        return tuple([pickled for _, pickled in self._pieces])


def _is_same(one: Sequence[Any], other: Sequence[Any]) -> bool:
    return len(one) == len(other) and all(a is b for a, b in zip(one, other, strict=True))


def unpickled(pickles: Sequence[bytes]) -> tuple[Any, ...]:
    """Return the values of pieces."""
    return tuple([value for piece in pickles for value in pickle.loads(piece)])
