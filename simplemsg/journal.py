"""The journal of one process: every byte in and out with its time, so that it can be run again.

Owns the lines of a journal file, with the spelling of the values in them. Cores and connections are
pure, so the events and their times alone decide every byte that leaves: whoever plays them to the
same code gets the same bytes. What a shell learns from outside by asking (is a listener behind?) is
an event, too: an `answer`.

Opens no file and reads no clock; a stream and the time of each event are given. Whoever has
something to note asks before whether a journal is kept (`is_kept`): most runs keep none.

A file is JSON lines: a header first, then for each event `{"t": ns since the header's now, "on":
what, "link": who, "hex": bytes, …}`. Behind an event stands what it caused, `{"out": link, "hex":
bytes}`, and what was asked, `{"ask": question, "link": link}`, where the answer was yes. The last
line is `{"end": true}`; without it the process was killed, and its last event may lack effects.

To spell out a megabyte takes milliseconds, which an event loop does not have, and one call for it
keeps all threads of the process from running. So a long value goes to the journal's writer as it
is, and is spelled out there in pieces; and so does a text that is still to be made (`LateText`).
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

LONG = 4_096
"""Bytes or characters from which a value is spelled out later; less takes some microseconds."""

PIECE = 3 * 16_384
"""Bytes or characters of a piece; whole groups of base64, so that pieces follow without a seam."""

_GAP = {"": ""}
"""Key of a long value's place in JSON: no other key of a journal is empty."""

_GAP_TEXT = json.dumps(_GAP)  # in a text its quotation marks would be escaped


@dataclass(frozen=True, slots=True, eq=False)
class LongValue:
    """A value that is not spelled out yet, and never changes."""

    content: str | bytes | memoryview
    spell: Callable[[Any], str]

    def __len__(self) -> int:
        """Return how long it is, before it is spelled out."""
        return len(self.content)

    def pieces(self) -> Iterator[str]:
        """Spell it out piece by piece, with its quotation marks."""
        yield '"'
        for begin in range(0, len(self.content), PIECE):
            yield self.spell(self.content[begin : begin + PIECE])
        yield '"'


@dataclass(frozen=True, slots=True, eq=False)
class LateText:
    """A text that is not made yet, of what never changes; it is noted as its bytes.

    Attributes:
        size: about how many characters it has.
        make: makes it, in pieces of a millisecond or less each.
    """

    size: int
    make: Callable[[], Iterator[str]]

    def __len__(self) -> int:
        """Return about how long it is."""
        return self.size

    def __bytes__(self) -> bytes:
        """Return the text in UTF-8, made now."""
        return "".join(self.make()).encode()

    def pieces(self) -> Iterator[str]:
        """Spell it out piece by piece, as `hexadecimal` does its bytes."""
        yield '"'
        for text in self.make():
            yield text.encode().hex()
        yield '"'


Part: TypeAlias = str | LongValue | LateText
"""A part of a line: text that stands there so, or a value that is not spelled out yet."""


def hexadecimal(data: bytes) -> Part:
    """Return bytes as hexadecimal digits in quotation marks."""
    return f'"{data.hex()}"' if len(data) < LONG else LongValue(data, bytes.hex)


def base64_value(data: bytes | memoryview) -> Part:
    """Return bytes, or a view of single bytes, as a value for `json_parts`, spelled in base64."""
    return _base64(data) if len(data) < LONG else LongValue(data, _base64)


def with_long_texts(value: Any) -> Any:
    """Return JSON data with its long texts marked, so that `json_parts` leaves them to the writer.

    Looks at every value, so it is for data of few parts.
    """
    match value:
        case str():
            return value if len(value) < LONG else LongValue(value, _escaped)
        case dict():
            return {key: with_long_texts(each) for key, each in value.items()}
        case list() | tuple():
            return [with_long_texts(each) for each in value]
    return value


def json_parts(value: Any) -> Iterator[Part]:
    """Return JSON data as text; what is long and marked so is left for later.

    Raises:
        TypeError: it holds something else.
    """
    later: list[LongValue] = []

    def leave(each: object) -> object:
        if not isinstance(each, LongValue):
            raise TypeError(f"{type(each).__name__} cannot stand in a journal")
        later.append(each)
        return _GAP

    first, *rest = json.dumps(value, default=leave).split(_GAP_TEXT)
    yield first
    for each, text in zip(later, rest, strict=True):
        yield each
        yield text


def spelled(part: Part) -> str:
    """Return a part as it stands in the file; for long ones this takes long."""
    return part if isinstance(part, str) else "".join(part.pieces())


def _base64(data: bytes | memoryview) -> str:
    return base64.b64encode(data).decode("ascii")


def _escaped(text: str) -> str:
    return json.dumps(text)[1:-1]


JOURNAL_FORMAT = "openpendant-journal/1"
"""Name and version of the format, in the header line."""


class Stream(Protocol):
    """Destination of a journal."""

    def write(self, *parts: Part) -> object:
        """Take a line, or some of it; raises OSError where it cannot."""


class Journal:
    """Record of events and of what followed from them, kept where a stream is given.

    Attributes:
        is_kept: whether anything is written.
    """

    def __init__(self) -> None:
        """Make a journal that is not kept yet."""
        self._stream: Stream | None = None
        self._on_failure: Callable[[OSError], None] = _raise
        self._began = 0
        self.is_kept = False

    def keep(
        self,
        stream: Stream,
        on_failure: Callable[[OSError], None],
        now: int,
        *,
        kind: str,
        started: str,
        **about: Any,
    ) -> None:
        """Write from now on, a header first.

        Args:
            stream: where to; whoever opened it closes it.
            on_failure: called once if it cannot be written; the journal ends there.
            now: the monotonic time [ns], from which that of events counts in the file.
            kind: `server` or `emulator`.
            started: wall-clock time, ISO 8601 with its offset from UTC.
        """
        self._stream, self._on_failure, self.is_kept = stream, on_failure, True
        self._began = now
        header = {"format": JOURNAL_FORMAT, "of": kind, "started": started, "now": now}
        self._write(json.dumps(header | about) + "\n")

    def end(self) -> None:
        """Write the line that marks the journal complete; afterwards the stream may be closed."""
        self._write('{"end": true}\n')
        self._stream, self.is_kept = None, False

    def _write(self, *parts: Part) -> None:
        if self._stream is None:
            return
        try:
            self._stream.write(*parts)
        except OSError as error:
            self._stream, self.is_kept = None, False
            self._on_failure(error)

    def begin(
        self,
        now: int,
        event: str,
        link: str | int = "",
        data: bytes = b"",
        more: Mapping[str, Any] = {},
    ) -> None:
        """Note an event, before anything follows from it.

        Args:
            now: its time [ns].
            more: what else must be known to repeat it, as plain JSON data and long values, which
                never change.
        """
        head = f'{{"t": {now - self._began}, "on": "{event}", "link": "{link}", "hex": '
        extra: list[Part] = []
        for key, each in more.items():
            extra += f', "{key}": ', *json_parts(each)
        self._write(head, hexadecimal(data), *extra, "}\n")

    def out(self, link: str | int, data: bytes | LateText) -> None:
        """Note bytes that leave because of the event."""
        value = data if isinstance(data, LateText) else hexadecimal(data)
        self._write(f'{{"out": "{link}", "hex": ', value, "}\n")

    def answer(self, question: str, link: str | int, answer: bool) -> bool:
        """Note what the world outside answered, and return it."""
        if answer:
            self._write(f'{{"ask": "{question}", "link": "{link}"}}\n')
        return answer


def _raise(error: OSError) -> None:
    raise error
