"""Pipes that nobody reads and that take nothing more."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress


def fill(writing: int) -> None:
    """Write until a pipe takes no byte more; it stays blocking."""
    os.set_blocking(writing, False)
    for size in (4_096, 1):
        with suppress(BlockingIOError):
            while True:
                os.write(writing, b"\n" * size)
    os.set_blocking(writing, True)


@contextmanager
def filled_pipe() -> Iterator[int]:
    """Provide the writing end of a full pipe; nobody ever reads the other."""
    reading, writing = os.pipe()
    try:
        fill(writing)
        yield writing
    finally:
        os.close(reading)
        os.close(writing)
