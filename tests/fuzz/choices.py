"""Decisions and payload out of a fuzzer's bytes, the same ones whoever calls."""

from collections.abc import Iterator, Sequence
from typing import TypeVar

_T = TypeVar("_T")


class Choices:
    """Spends a fuzzer's bytes from the front; what is missing counts as 0."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    @property
    def more(self) -> bool:
        return self._at < len(self._data)

    def number(self, bound: int) -> int:
        """Return 0 to bound - 1, from one byte."""
        value = self._data[self._at] if self.more else 0
        self._at += 1
        return value % bound

    def pick(self, options: Sequence[_T]) -> _T:
        return options[self.number(len(options))]

    def take(self, size: int) -> bytes:
        taken = self._data[self._at : self._at + size]
        self._at += size
        return taken

    def rest(self) -> bytes:
        return self.take(len(self._data))


def portions(data: bytes, sizes: bytes) -> Iterator[bytes]:
    """Cut data into pieces of the given sizes, again and again; a size of 0 is an empty piece."""
    at = turn = 0
    sizes = sizes if any(sizes) else b"\x01"
    while at < len(data):
        size = sizes[turn % len(sizes)]
        yield data[at : at + size]
        at, turn = at + size, turn + 1
