"""Trace files of every kind, as entries: JSON lines, capture lists, pcap and pcapng.

Owns what tells the kinds apart, the bounds of what is read, and the errors that say where a file
goes wrong. Files are read as they come, never whole; a capture list is the exception, and bounded.
"""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from enum import Enum
from pathlib import Path
from typing import Any, BinaryIO

from openpendant.simplemsg.errors import shown

from ..console import LineError, PacketToolError, lines_of, text_of
from ..trace import FORMAT, MAX_ENTRY, Entry, EntryError, entry_from_json
from .capture_files import MAGIC as PCAPNG_MAGIC
from .capture_files import MAGICS as PCAP_MAGICS
from .capture_files import CaptureFault, read_pcap, read_pcapng
from .pcap_trace import entries_of

MAX_CAPTURE = 64 * 1024 * 1024
"""Largest capture list, bytes: JSON arrays are read whole."""

_BLANK = b" \t\r\n\v\f"
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_LONGEST_LEAD = 4_096


class FileKind(Enum):
    """Kind of a file's content; the value is its name on the command line."""

    HEX = "hex"
    TRACE = "trace"
    CAPTURE = "capture"
    PCAP = "pcap"


class TraceFileError(PacketToolError):
    """A file cannot be read on from here; the text names the file and the line or offset."""


class PeekedStream(io.RawIOBase):
    """A stream whose first bytes were looked at and are to be read again.

    Closing it leaves the stream below open.
    """

    def __init__(self, lead: bytes, rest: BinaryIO) -> None:
        self.name = _name_of(rest)
        self._lead = lead
        # A pipe gives what is there; `read` would wait for as much as was asked for.
        self._read = rest.read1 if isinstance(rest, io.BufferedIOBase) else rest.read

    def readable(self) -> bool:
        """Return True: this stream can be read."""
        return True

    def readinto(self, buffer: Any) -> int:
        """Read as `io.RawIOBase` demands."""
        chunk = self._lead[: len(buffer)] or self._read(len(buffer))
        self._lead = self._lead[len(chunk) :]
        buffer[: len(chunk)] = chunk
        return len(chunk)


def detect(stream: BinaryIO) -> tuple[FileKind, BinaryIO]:
    """Return the kind of a stream, reading no more than that needs.

    Returns:
        The kind, hexadecimal lines where it is none of the others, and a stream that starts where
        the given one started.
    """
    lead = b""
    kind = None
    while kind is None:
        byte = stream.read(1)
        lead += byte
        kind = _kind_of(lead) if byte and len(lead) < _LONGEST_LEAD else FileKind.HEX
    return kind, io.BufferedReader(PeekedStream(lead, stream))


def _kind_of(lead: bytes) -> FileKind | None:
    """Return the kind of a file from its first bytes, None where more of them are needed."""
    magics = (*PCAP_MAGICS, PCAPNG_MAGIC)
    if lead in magics:
        return FileKind.PCAP
    if any(magic.startswith(lead) for magic in magics) or _BYTE_ORDER_MARK.startswith(lead):
        return None
    match lead.removeprefix(_BYTE_ORDER_MARK).lstrip(_BLANK)[:1]:
        case b"":
            return None
        case b"{":
            return FileKind.TRACE
        case b"[":
            return FileKind.CAPTURE
    return FileKind.HEX


def read_trace(source: Path | BinaryIO, kind: FileKind | None = None) -> Iterator[Entry]:
    """Yield the entries of a trace file in their order, each as soon as it is complete.

    Raises:
        TraceFileError: this is no trace, or is one no further; what came before was given.
        OSError: the file cannot be opened or read.
    """
    opened: AbstractContextManager[BinaryIO] = (
        source.open("rb") if isinstance(source, Path) else nullcontext(source)
    )
    with opened as stream:
        name = _name_of(stream)
        if kind is None:
            kind, stream = detect(stream)
        try:
            yield from _READERS[kind](stream)
        except _Fault as fault:
            raise TraceFileError(f"{name}: {fault}") from None
        except CaptureFault as fault:
            raise TraceFileError(f"{name}: offset {fault.offset}: {fault}") from None


def _name_of(stream: BinaryIO) -> str:
    # Streams in memory have no name, and that of a descriptor is a number.
    name = getattr(stream, "name", None)
    return name if isinstance(name, str) and name != "<stdin>" else "standard input"


class _Fault(Exception):
    """Something is wrong with the file; the text says where and what, without its name."""


def _read_lines(stream: BinaryIO) -> Iterator[Entry]:
    for number, raw in enumerate(lines_of(stream, MAX_ENTRY), start=1):
        try:
            line = text_of(raw, MAX_ENTRY)
            if not line:
                continue
            value = _parsed(line)
            if number == 1 and isinstance(value, dict) and "format" in value:
                _check_format(value["format"])
                continue
            yield entry_from_json(value)
        except (LineError, EntryError) as error:
            cut = "" if raw.endswith(b"\n") or len(raw) > MAX_ENTRY else "the file ends here: "
            raise _Fault(f"line {number}: {cut}{error}") from None


def _check_format(name: object) -> None:
    if name != FORMAT:
        raise EntryError(f"the format is {shown(name)}, not {FORMAT}")


def _read_array(stream: BinaryIO) -> Iterator[Entry]:
    raw = stream.read(MAX_CAPTURE + 1)
    if len(raw) > MAX_CAPTURE:
        raise _Fault(f"a capture list of more than {MAX_CAPTURE} bytes")
    try:
        values = _parsed(raw.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        raise _Fault(f"offset {error.start}: not UTF-8") from None
    except EntryError as error:
        raise _Fault(str(error)) from None
    if not isinstance(values, list):
        raise _Fault("a capture is a JSON array of entries")
    for number, value in enumerate(values, start=1):
        try:
            yield entry_from_json(value)
        except EntryError as error:
            raise _Fault(f"entry {number}: {error}") from None


def _parsed(text: str) -> object:
    try:
        value: object = json.loads(text)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise EntryError(f"no JSON: {error.msg} at {where}") from None
    except RecursionError:
        raise EntryError("nested too deeply") from None
    except ValueError:  # Python refuses to read integers of thousands of digits
        raise EntryError("an integer of thousands of digits") from None
    return value


def _read_packets(stream: BinaryIO) -> Iterator[Entry]:
    magic = stream.read(4)
    if magic == PCAPNG_MAGIC:
        return entries_of(read_pcapng(stream))
    return entries_of(read_pcap(stream, magic))


def _refuse_digits(stream: BinaryIO) -> Iterator[Entry]:
    if not stream.read(1):
        raise _Fault("the file is empty")
    raise _Fault("neither JSON lines, a capture list, pcap nor pcapng")


_READERS = {
    FileKind.TRACE: _read_lines,
    FileKind.CAPTURE: _read_array,
    FileKind.PCAP: _read_packets,
    FileKind.HEX: _refuse_digits,
}
