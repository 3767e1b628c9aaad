"""Pickles of a long tuple, a piece at a time: what stays the same is not pickled again.

An event loop hands scenes and frames to its planning processes with every job. Thousands of values
take it milliseconds to pickle, their pickles, made in steps and kept, only to be copied. What comes
back from such a process arrives as pickles of pieces, too, and is unpickled in steps (`LongTuple`).
"""

from __future__ import annotations

import pickle
from collections.abc import Callable, Sequence
from typing import Any, Generic, TypeVar

from .steps import Stepwise

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
    ) -> Stepwise[PickledPieces[_Value]]:
        """Pickle values in steps.

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


class LongTuple(Generic[_Value]):
    """Values that another process made, unpickled in steps where they are needed.

    In the process that made them they are at hand, and the steps are the same.
    """

    def __init__(self, values: Sequence[_Value], effort: float) -> None:
        """Take values.

        Args:
            effort: about how long it takes to unpickle one on an ordinary machine [µs].
        """
        self._count, self._effort = len(values), effort
        self._pieces: Sequence[Sequence[_Value] | bytes] = [
            values[first : first + A_PIECE] for first in range(0, len(values), A_PIECE)
        ]

    def __reduce__(self) -> tuple[Callable[..., LongTuple[Any]], tuple[object, ...]]:
        return _arrived, (self._count, self._effort, tuple(map(_pickled, self._pieces)))

    def __len__(self) -> int:
        """Return how many they are."""
        return self._count

    def steps(self) -> Stepwise[tuple[_Value, ...]]:
        """Return the values, a piece in each step."""
        values: list[_Value] = []
        for first, piece in zip(range(0, self._count, A_PIECE), self._pieces, strict=True):
            yield self._effort * min(A_PIECE, self._count - first)
            values += pickle.loads(piece) if isinstance(piece, bytes) else piece
        return tuple(values)


def _pickled(piece: Sequence[Any] | bytes) -> bytes:
    return piece if isinstance(piece, bytes) else pickle.dumps(piece, pickle.HIGHEST_PROTOCOL)


def _arrived(count: int, effort: float, pieces: Sequence[bytes]) -> LongTuple[Any]:
    made: LongTuple[Any] = LongTuple((), effort)
    made._count, made._pieces = count, pieces
    return made
