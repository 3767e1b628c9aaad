"""Chunks of a recording that wait until all of it was read and found good.

So the lock of the store, which a server waits for as well, is taken for the time of the inserts and
not for that of reading a file of hours.
"""

from __future__ import annotations

import contextlib
import tempfile
from collections.abc import Iterable, Iterator
from types import TracebackType

from .errors import StoreFailed

_MOST_IN_MEMORY = 16 << 20


class ChunkSpool:
    """Chunks in order; a temporary file holds them where they are many."""

    def __init__(self) -> None:
        """Begin with none; to be closed, as the end of a `with` does."""
        self._file = tempfile.SpooledTemporaryFile(_MOST_IN_MEMORY)
        self._sizes: list[int] = []

    def __enter__(self) -> ChunkSpool:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._file.close()

    def take(self, chunks: Iterable[bytes]) -> None:
        """Keep the next chunks.

        Raises:
            StoreFailed: the temporary file cannot be written.
        """
        for chunk in chunks:
            with _failures_told():
                self._file.write(chunk)
            self._sizes.append(len(chunk))

    def __iter__(self) -> Iterator[bytes]:
        """Yield all chunks again, from the first.

        Raises:
            StoreFailed: the temporary file cannot be read.
        """
        with _failures_told():
            self._file.seek(0)
        for size in self._sizes:
            with _failures_told():
                chunk = self._file.read(size)
            yield chunk


@contextlib.contextmanager
def _failures_told() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        folder = tempfile.gettempdir()
        raise StoreFailed(f"the temporary file in {folder}: {error.strerror or error}") from None
