"""Room that is kept free for deletions, for the day when the disk is full.

Owns the file that takes it, `store.db-reserve` beside the store. SQLite writes every change behind
the others before it finds room for it in its file, a deletion, too; without a reserve a disk that
is full to the last byte could never be emptied from a pendant. Room is given back in pieces, so
that several deletions are possible even where none of them makes any.
"""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

RESERVE_BYTES = 256 << 10
"""Room that is kept: a deletion takes some 30 KiB, that of a recording 4 KiB for each 4 MiB."""

_PIECE = 64 << 10
IN_MEMORY = ":memory:"
_OWNER_ONLY = 0o600


class RoomReserve:
    """A file that holds nothing but its place on the disk; a store in memory has none.

    Attributes:
        is_whole: it has its full size, as far as it needs any.
    """

    def __init__(self, store: Path) -> None:
        """Take the store's file; nothing is made before `fill`."""
        self.is_whole = True
        self._needed = 0 if str(store) == IN_MEMORY else RESERVE_BYTES
        self._path = store.with_name(store.name + "-reserve")

    def fill(self) -> None:
        """Take the room again; where there is none, it is tried again after the next change."""
        self.is_whole = self._size() >= self._needed
        if self.is_whole:
            return
        with contextlib.suppress(OSError):
            self._extend()
            self.is_whole = True

    def give_back(self) -> bool:
        """Give a piece of the room to whoever needs it now; return whether there was any."""
        size = self._size()
        if not size:
            return False
        try:
            os.truncate(self._path, max(0, size - _PIECE))
        except OSError:
            return False
        self.is_whole = False
        return True

    def _size(self) -> int:
        try:
            return self._path.stat().st_size
        except OSError:
            return 0

    def _extend(self) -> None:
        before = self._size()
        file = os.open(self._path, os.O_CREAT | os.O_WRONLY, _OWNER_ONLY)
        try:
            if sys.platform == "linux":
                # Not by writing zeros, which some file systems compress to nothing.
                os.posix_fallocate(file, 0, RESERVE_BYTES)
            else:
                os.pwrite(file, bytes(RESERVE_BYTES), 0)
        except OSError:
            os.ftruncate(file, before)
            raise
        finally:
            os.close(file)
