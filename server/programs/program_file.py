"""A program as a file holds it, text or JSON: told apart by how it begins.

Owns that rule, and what is said of a file that is too large, of which only the beginning is read.
Opens no file.
"""

from __future__ import annotations

from codecs import BOM_UTF8

from .document import MOST_JSON_BYTES, program_from_source
from .errors import ProgramTooLarge
from .parser import Source, parse_bytes
from .tokens import MOST_BYTES

MOST_READ = MOST_JSON_BYTES + 1
"""Bytes to read of a file: one more than is taken, so that a larger file is known to be one."""


def is_json(raw: bytes) -> bool:
    """Tell whether a file is JSON: its first character is `{`; text begins with its format."""
    return raw[:4096].removeprefix(BOM_UTF8).lstrip()[:1] == b"{"


def source_of(raw: bytes, file: str) -> Source:
    """Return the program in a file, with the lines of its parts; 0 for each where it is JSON.

    Args:
        raw: the file's first `MOST_READ` bytes.
        file: its name, for the error.

    Raises:
        ProgramError: it is no program; the error says where.
    """
    if len(raw) >= MOST_READ:
        limit = MOST_JSON_BYTES if is_json(raw) else MOST_BYTES
        raise ProgramTooLarge(f"bytes in {file}", len(raw), limit, is_counted=False)
    if not is_json(raw):
        return parse_bytes(raw, file)
    program = program_from_source(raw, file)
    return Source(program, (0,) * len(program.points), (0,) * len(program.statements))
