"""Records of reals in a message that was received, kept as they came.

A path of a thousand waypoints is as many records of ten reals. To make them all takes an event loop
milliseconds, and whoever computes with them wants one table of numbers. So each is made when it is
asked for, and the bytes of all are there for whoever reads a table.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Generic, TypeVar, overload

from .declaration import Record

_RecordT = TypeVar("_RecordT", bound=Record)


class RealRecords(Sequence[_RecordT], Generic[_RecordT]):
    """A sequence of records that consist of reals alone; equal to a tuple of the same records.

    Attributes:
        data: the bytes of all of them.
        real: byte order and width of each real, as `struct` and numpy write them, such as `<f`.
    """

    __slots__ = ("_count", "_unpack", "data", "real")
    __hash__ = None  # type: ignore[assignment]  # as a record, which may be changed

    def __init__(
        self, data: bytes, count: int, real: str, unpack: Callable[[bytes], Iterator[_RecordT]]
    ) -> None:
        """Take the bytes of so many records, and what makes records of the bytes of some."""
        self.data = data
        self.real = real
        self._count = count
        self._unpack = unpack

    def __len__(self) -> int:
        """Return how many records there are."""
        return self._count

    def __iter__(self) -> Iterator[_RecordT]:
        """Make one record after the other."""
        return self._unpack(self.data)

    @overload
    def __getitem__(self, index: int) -> _RecordT: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[_RecordT, ...]: ...

    def __getitem__(self, index: int | slice) -> _RecordT | tuple[_RecordT, ...]:
        """Make a record, or several."""
        if isinstance(index, slice):
            return tuple(self)[index]
        at = range(self._count)[index]
        size = len(self.data) // self._count
        return next(self._unpack(self.data[at * size : (at + 1) * size]))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, RealRecords | tuple):
            return NotImplemented
        return tuple(self) == tuple(other)

    def __repr__(self) -> str:
        return repr(tuple(self))

    def __reduce__(self) -> tuple[Any, ...]:
        return tuple, (tuple(self),)
