"""The journal of one process: every byte in and out with its time, so that it can be run again.

Owns the time of an event (one reading of the clock for all that follows from it) and the lines of a
journal file. Cores and connections are pure, so the events alone decide every byte that leaves:
whoever plays them to the same code gets the same bytes. What a shell learns from outside by asking
(is a listener behind?) is an event, too: an `answer`.

Opens no file and reads no clock of its own; both are given.

A file is JSON lines: a header first, then for each event `{"t": ns since the header's now, "on":
what, "link": who, "hex": bytes, …}`. Behind an event stands what it caused, `{"out": link, "hex":
bytes}`, and what was asked, `{"ask": question, "link": link}`, where the answer was yes. The last
line is `{"end": true}`; without it the process was killed, and its last event may lack effects.
Long values are handed on as they are, because to spell them out takes longer than an event may.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

from .journal_text import Part, hexadecimal, json_parts

JOURNAL_FORMAT = "openpendant-journal/1"
"""Name and version of the format, in the header line."""


class Stream(Protocol):
    """Destination of a journal."""

    def write(self, *parts: Part) -> object:
        """Take a line, or some of it; raises OSError where it cannot."""


class Gap(NamedTuple):
    """A time in which no event started.

    Attributes:
        lasted: how long it was [ns].
        event: what happened at its beginning; empty before the first event.
        link: on which connection.
        data: the bytes that came.
    """

    lasted: int = 0
    event: str = ""
    link: str | int = ""
    data: bytes = b""


class Journal:
    """Clock of events, and record of them where a stream is given.

    Attributes:
        now: time of the event that is being handled, monotonic [ns]; 0 before the first.
        is_kept: whether anything is written, so that what is costly to note need not be made, and
            what the world outside answers need not be told, in vain.
    """

    def __init__(self, clock: Callable[[], int]) -> None:
        """Make a journal that only tells the time.

        Args:
            clock: the monotonic time [ns].
        """
        self._clock = clock
        self._stream: Stream | None = None
        self._on_failure: Callable[[OSError], None] = _raise
        self._began = 0
        self._event: tuple[str, str | int, bytes] = ("", "", b"")
        self._longest = Gap()
        self.now = 0
        self.is_kept = False

    def keep(
        self,
        stream: Stream,
        on_failure: Callable[[OSError], None],
        *,
        kind: str,
        started: str,
        **about: Any,
    ) -> None:
        """Write from now on, a header first.

        Args:
            stream: where to; whoever opened it closes it.
            on_failure: called once if it cannot be written; the journal ends there.
            kind: `server` or `emulator`.
            started: wall-clock time, ISO 8601 with its offset from UTC.
            about: what is needed to build the same process again, as plain JSON data.
        """
        self._stream, self._on_failure, self.is_kept = stream, on_failure, True
        self._began = self.now = self._clock()
        header = {"format": JOURNAL_FORMAT, "of": kind, "started": started, "now": self.now}
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

    def begin(self, event: str, link: str | int = "", data: bytes = b"", **more: Any) -> int:
        """Begin to handle an event; return its time [ns].

        Args:
            event: what happened, one word.
            link: on which connection.
            data: the bytes that came.
            more: what else must be known to repeat it, as plain JSON data and long values, which
                never change.
        """
        before, self.now = self.now, self._clock()
        if self.now - before > self._longest.lasted and before:
            self._longest = Gap(self.now - before, *self._event)
        self._event = event, link, data
        if self._stream is not None:
            head = f'{{"t": {self.now - self._began}, "on": "{event}", "link": "{link}", "hex": '
            extra = [
                part for key, each in more.items() for part in (f', "{key}": ', *json_parts(each))
            ]
            self._write(head, hexadecimal(data), *extra, "}\n")
        return self.now

    def longest_gap(self) -> Gap:
        """Return the longest time between two events since this was asked last."""
        gap, self._longest = self._longest, Gap()
        return gap

    def out(self, link: str | int, data: bytes) -> None:
        """Note bytes that leave because of the event."""
        if self._stream is not None:
            self._write(f'{{"out": "{link}", "hex": ', hexadecimal(data), "}\n")

    def answer(self, question: str, link: str | int, answer: bool) -> bool:
        """Note what the world outside answered, and return it.

        Args:
            question: one word, such as `clogged`.
            link: of which connection.
            answer: the answer.
        """
        if answer and self._stream is not None:
            self._write(f'{{"ask": "{question}", "link": "{link}"}}\n')
        return answer


def _raise(error: OSError) -> None:
    raise error
