"""Atomic file creation: write a temporary file, fsync it, then link it under its name.

Owns that the name appears in one step, which fails where it is taken, and after the disk has the
file. A write that was killed leaves a temporary file `NAME.partial-…` beside the target, which
nothing uses again; it may be removed.
"""

from __future__ import annotations

import contextlib
import errno
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

_OF_SQLITE = ("", "-journal", "-wal", "-shm")
"""Suffixes of the files that SQLite keeps beside a file."""

_OWNER_ONLY = 0o600


@contextlib.contextmanager
def whole_file(target: Path, *, replace: bool = False) -> Iterator[Path]:
    """Yield an empty file, its owner's only, that becomes `target` if the context ends well.

    Args:
        replace: True if the name may be in use, and is then taken from the file that has it.

    Yields:
        The file, beside the target; the files that SQLite keeps beside it are removed with it.

    Raises:
        FileExistsError: the name is in use.
        OSError: the disk or the folder refuses it.
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
    """Fsync the folder of a file, so that the disk has the names in it."""
    _sync(path.parent)


def _new_file(target: Path) -> Path:
    # A separate name for each: two processes may make the same file at once.
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
    # Either the name is taken, which the next call reports, or the file system has no links, as on
    # many USB sticks. Then a kill between the next two steps leaves an empty file, which no store
    # accepts.
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
