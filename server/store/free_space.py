"""Reserved disk space for deletions when the disk is full.

Owns the file that holds it, `store.db-reserve` beside the store. SQLite writes every change behind
the others before it finds room for it in its file, also a deletion; without a reserve a disk that
is full to the last byte could never be emptied from a pendant. The space is given back in pieces,
so that several deletions are possible even where none of them frees any.
"""

from __future__ import annotations

import contextlib
import os
import sys
from pathlib import Path

RESERVE_BYTES = 256 << 10
"""Reserved bytes: a deletion takes about 30 KiB, of a recording 4 KiB for each 4 MiB."""

_PIECE = 64 << 10
IN_MEMORY = ":memory:"
_OWNER_ONLY = 0o600


class ReservedSpace:
    """File that only reserves disk space; a store in memory has none.

    Attributes:
        is_whole: it has its full size, as far as it needs any.
    """

    def __init__(self, store: Path) -> None:
        """Take the store's file; nothing is made before `fill`."""
        self.is_whole = True
        self._needed = 0 if str(store) == IN_MEMORY else RESERVE_BYTES
        self._path = store.with_name(store.name + "-reserve")

    def fill(self) -> None:
        """Reserve the space again; without room, it is tried again after the next change."""
        self.is_whole = self._size() >= self._needed
        if self.is_whole:
            return
        with contextlib.suppress(OSError):
            self._extend()
            self.is_whole = True

    def give_back(self) -> bool:
        """Free a piece of the space for a change that needs it; return True if there was any."""
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
                # Not zeros: some file systems compress them to nothing.
                os.posix_fallocate(file, 0, RESERVE_BYTES)
            else:
                os.pwrite(file, bytes(RESERVE_BYTES), 0)
        except OSError:
            os.ftruncate(file, before)
            raise
        finally:
            os.close(file)
