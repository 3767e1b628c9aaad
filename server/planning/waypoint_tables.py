"""Waypoints of a job as one table of numbers.

A path may have more than a thousand waypoints. As objects they take an event loop milliseconds to
make and to pickle; as the bytes of a table next to nothing. A planning process makes each when it
asks for it. What a table says, and that it equals a tuple, is as if it were the tuple of them.
"""

from __future__ import annotations

import struct
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import Any, TypeVar, overload

from openpendant.motion.pose import Array

from .jobs import JointVector, PoseGoal

_RowT = TypeVar("_RowT")


class _Table(Sequence[_RowT]):
    """A sequence of rows of so many reals each."""

    __slots__ = ("_data", "_width")

    def __init__(self, rows: Array) -> None:
        """Take the values of (m, w) rows."""
        self._width: int = rows.shape[1]
        self._data: bytes = rows.astype("<f8").tobytes()

    @staticmethod
    @abstractmethod
    def _row(values: tuple[float, ...]) -> _RowT:
        """Make a row of its values."""

    def __iter__(self) -> Iterator[_RowT]:
        """Make one row after the other."""
        return map(self._row, struct.iter_unpack(f"<{self._width}d", self._data))

    def __len__(self) -> int:
        """Return how many rows there are."""
        return len(self._data) // (8 * self._width)

    @overload
    def __getitem__(self, index: int) -> _RowT: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[_RowT, ...]: ...

    def __getitem__(self, index: int | slice) -> Any:
        """Make a row, or several."""
        if isinstance(index, slice):
            return tuple(self)[index]
        at = range(len(self))[index]
        return self._row(struct.unpack_from(f"<{self._width}d", self._data, at * 8 * self._width))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _Table | tuple):
            return NotImplemented
        return tuple(self) == tuple(other)

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __repr__(self) -> str:
        return repr(tuple(self))


class JointWaypoints(_Table[JointVector]):
    """Joint positions, (m, n) [rad or m]."""

    __slots__ = ()

    @staticmethod
    def _row(values: tuple[float, ...]) -> JointVector:
        return values


class PoseWaypoints(_Table[PoseGoal]):
    """Tool poses, (m, 7): x, y, z [m] and the quaternion x, y, z, w of each."""

    __slots__ = ()

    @staticmethod
    def _row(values: tuple[float, ...]) -> PoseGoal:
        return PoseGoal(values[:3], values[3:])
