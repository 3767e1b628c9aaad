"""Settings file of a pendant or gateway: plain data from TOML, and the words for what is refused.

Owns how such a file is read: no more of it than it may have, and without waiting for a pipe that
nobody writes to. Which keys there are, each program's own settings know.
"""

from __future__ import annotations

import os
import stat
import tomllib
from pathlib import Path
from typing import Annotated, Any, TypeAlias

from pydantic import AfterValidator

from .connection_errors import server_address

_MOST_FILE = 65_536


class SettingsRefused(Exception):
    """A file or a key that cannot be used; the text names it and what would be accepted."""


def _check_address(text: str) -> str:
    if server_address(text) is None:
        raise ValueError("accepted: HOST or HOST:PORT, PORT 1 to 65535")
    return text


ServerAddress: TypeAlias = Annotated[str, AfterValidator(_check_address)]
"""HOST or HOST:PORT of a pendant server."""


def read_file(path: Path) -> dict[str, Any]:
    """Return the plain data of a file.

    Raises:
        SettingsRefused: it cannot be read, is too large or is no TOML.
    """
    content = beginning_of(path, _MOST_FILE + 1)
    if len(content) > _MOST_FILE:
        raise SettingsRefused(f"{path}: is larger than {_MOST_FILE} bytes")
    try:
        return tomllib.loads(content.decode())
    except (ValueError, RecursionError) as error:
        raise SettingsRefused(f"{path}: is no TOML: {error}") from None


def beginning_of(path: Path, most: int) -> bytes:
    """Return the first bytes of a regular file, without waiting for anybody.

    Raises:
        SettingsRefused: it cannot be read, or is no regular file.
    """
    try:
        # Without waiting: opening a pipe that nobody writes to would block for ever.
        file = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
        with os.fdopen(file, "rb") as stream:
            if not stat.S_ISREG(os.fstat(file).st_mode):
                raise SettingsRefused(f"{path}: is not a regular file")
            return stream.read(most)
    except OSError as error:
        raise SettingsRefused(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError:
        raise SettingsRefused(f"{str(path)!r}: is not a legal file name") from None
