"""Reader of a journal: the header, then one `JournalEvent` after the other, with its effects.

Owns the check of a journal file; how it is written is `simplemsg.journal`'s business. Reads line by
line, so a journal of a day needs no more memory than one of a minute.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

from openpendant.simplemsg.journal import JOURNAL_FORMAT

from ..console import PacketToolError

MAX_LINE = 64 * 1024 * 1024
"""Longest accepted line, bytes; a planned motion of an hour needs half of it."""


_LATEST = 2**63 - 1
"""Greatest time [ns]."""


class JournalError(PacketToolError):
    """The file is no journal, or a damaged one; the text says where and why."""


@dataclass(frozen=True, slots=True)
class BytesOut:
    """Bytes that left."""

    link: str
    data: bytes


@dataclass(frozen=True, slots=True)
class GrantedQuestion:
    """A question to the world outside that was answered with yes."""

    question: str
    link: str


Effect = BytesOut | GrantedQuestion


@dataclass(frozen=True, slots=True)
class JournalEvent:
    """One event and what followed from it at once.

    Attributes:
        number: of the event in the journal, from 1.
        time: since the start of the journal [ns].
        event: what happened, one word.
        data: the bytes that came.
        more: everything else that was noted.
    """

    number: int
    time: int
    event: str
    link: str
    data: bytes
    more: dict[str, Any]
    effects: tuple[Effect, ...]


@dataclass(frozen=True, slots=True)
class Header:
    """Header of a journal: the process that wrote it.

    Attributes:
        kind: `server` or `emulator`.
        started: wall-clock time, ISO 8601.
        now: monotonic time of the start [ns].
    """

    kind: str
    version: str
    started: str
    now: int
    settings: dict[str, Any]


class JournalFile:
    """A journal that is being read.

    Attributes:
        is_cut: True once reading ended before the end line: the process was killed or still runs,
            or the disk was full. The last event may lack effects and is left out.
    """

    def __init__(self, path: Path, stream: BinaryIO) -> None:
        """Read the header; raise JournalError where this is no journal."""
        self._path = path
        self._stream = stream
        self._line = 0
        self.is_cut = False
        first = self._next()
        if first is None or first.get("format") != JOURNAL_FORMAT:
            raise JournalError(f"{path}: {_what_it_is(first)}")
        self.header = Header(
            kind=self._field(first, "of", str),
            version=self._field(first, "version", str),
            started=self._field(first, "started", str),
            now=self._field(first, "now", int),
            settings=self._field(first, "settings", dict),
        )

    def happenings(self) -> Iterator[JournalEvent]:
        """Yield the events in order; raise JournalError at a damaged line."""
        number = 0
        head: dict[str, Any] | None = None
        effects: list[Effect] = []
        is_whole = False
        while (line := self._next()) is not None:
            if "end" in line:
                is_whole = True
            elif "on" in line:
                if head is not None:
                    number += 1
                    yield self._happening(number, head, effects)
                head, effects = line, []
            elif "out" in line:
                effects.append(BytesOut(self._field(line, "out", str), self._data(line)))
            else:
                question, link = self._field(line, "ask", str), self._field(line, "link", str)
                effects.append(GrantedQuestion(question, link))
        self.is_cut = not is_whole
        if head is not None and is_whole:
            yield self._happening(number + 1, head, effects)

    def _happening(self, number: int, head: dict[str, Any], effects: list[Effect]) -> JournalEvent:
        return JournalEvent(
            number,
            self._field(head, "t", int),
            self._field(head, "on", str),
            self._field(head, "link", str),
            self._data(head),
            head,
            tuple(effects),
        )

    def _next(self) -> dict[str, Any] | None:
        raw = self._stream.readline(MAX_LINE + 1)
        self._line += 1
        if not raw:
            return None
        if not raw.endswith(b"\n"):
            if len(raw) > MAX_LINE:
                raise self._error(f"longer than {MAX_LINE} bytes")
            return None
        try:
            line = json.loads(raw)
        except (ValueError, RecursionError):
            raise self._error("no JSON") from None
        if not isinstance(line, dict):
            raise self._error("no JSON object")
        return line

    def _field(self, line: dict[str, Any], key: str, kind: type[Any]) -> Any:
        value = line.get(key)
        if not isinstance(value, kind) or isinstance(value, bool):
            raise self._error(f"{key} is missing or of the wrong kind")
        if isinstance(value, int) and not 0 <= value <= _LATEST:
            raise self._error(f"{key} is no time")
        return value

    def _data(self, line: dict[str, Any]) -> bytes:
        try:
            return bytes.fromhex(self._field(line, "hex", str))
        except ValueError:
            raise self._error("hex holds no hexadecimal digits") from None

    def _error(self, problem: str) -> JournalError:
        return JournalError(f"{self._path}: line {self._line}: {problem}")


def _what_it_is(first: dict[str, Any] | None) -> str:
    wanted = "no journal of `serve --journal` or `emulate --journal`"
    if first is None or not str(first.get("format")).startswith("openpendant-trace/"):
        return wanted
    # Between two programs nobody sees their timers, without which no run is exact.
    return f"a trace of `packets record`, and {wanted}"
