"""A file that gets its name once it is whole, so that a kill leaves none that is cut short.

Owns how it gets it: in one step that fails where the name is taken, after the disk has the file.
What was killed before is left beside under a name of its own, `NAME.partial-…`, which nothing
writes to again; it may be removed.
"""

from __future__ import annotations

import contextlib
import errno
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

_OF_SQLITE = ("", "-journal", "-wal", "-shm")
"""What SQLite adds to the name of a file for those that belong to it."""

_OWNER_ONLY = 0o600


@contextlib.contextmanager
def whole_file(target: Path, *, replace: bool = False) -> Iterator[Path]:
    """Give an empty file, its owner's only, that is `target` once the context ends well.

    Args:
        target: the name.
        replace: it may be in use, and is then taken from the file that has it.

    Yields:
        The file, beside the target; what SQLite puts beside it goes with it.

    Raises:
        FileExistsError: the name is in use.
        OSError: the disk or the folder does not take it.
    """
    if not replace and os.path.lexists(target):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target))
    beside = _new_file(target)
    try:
        yield beside
        _sync(beside)
        if replace:
            os.replace(beside, target)
        else:
            _give_name(beside, target)
        sync_folder(target)
    finally:
        for ending in _OF_SQLITE:
            beside.with_name(beside.name + ending).unlink(missing_ok=True)


def sync_folder(path: Path) -> None:
    """Have the disk take the names in the folder of a file."""
    _sync(path.parent)


def _new_file(target: Path) -> Path:
    # A name of its own for each: two may make the same file at once.
    try:
        opened, name = tempfile.mkstemp(prefix=f"{target.name}.partial-", dir=target.parent)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(target)) from None
    os.close(opened)
    return Path(name)


def _give_name(whole: Path, target: Path) -> None:
    with contextlib.suppress(OSError):
        os.link(whole, target)
        return
    # The name is taken, and opening tells; or there are no links here, as on many a USB stick.
    # Then a kill between the next two steps leaves an empty file, which no store is.
    os.close(os.open(target, os.O_CREAT | os.O_EXCL | os.O_WRONLY, _OWNER_ONLY))
    try:
        os.replace(whole, target)
    except OSError:
        target.unlink(missing_ok=True)
        raise


def _sync(path: Path) -> None:
    opened = os.open(path, os.O_RDONLY)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
