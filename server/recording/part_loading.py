"""Loading the samples of a part of a recording, a little at a time.

Owns how much of a recording is held in memory, and that no turn of the event loop handles more than
one chunk may have, however long the recording is: its extent is asked for first, and only chunks
with rows of the part are kept.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from typing import TypeAlias

import numpy as np

from openpendant.simplemsg.verdicts import VerdictCode

from ..outgoing import Outgoing
from ..refusal import Refusal
from ..store.documents import Extent
from ..store.errors import BadDocument
from ..store.questions import AskStore
from ..store.requests import Answer, LoadChunks, MeasureRecording
from .store_refusal import store_refusal

MOST_PLAYED_BYTES = 64 << 20
"""Largest part that is played in one piece: an hour of seven joints at 250 Hz."""

_CHUNKS_AT_ONCE = 128
_REAL_BYTES = 8

Pieces: TypeAlias = tuple[bytes, ...]
PartLoaded: TypeAlias = Callable[[Pieces | Refusal, int], list[Outgoing]]
"""Takes the rows in pieces, each no larger than a chunk, or why there are none; and the time."""


class PartLoading:
    """The samples of a part of one recording, on their way from the store."""

    def __init__(
        self,
        ask: AskStore,
        name: str,
        columns: int,
        begins: float,
        ends: float | None,
        loaded: PartLoaded,
    ) -> None:
        """Make one that has asked for nothing yet.

        Args:
            ask: the way to the store.
            name: of the recording.
            columns: how many reals a row has, the time first.
            begins: first time that is wanted [s].
            ends: last time [s]; None for the end.
            loaded: is told once; the first and last rows may lie outside the part.
        """
        self._ask = ask
        self._name = name
        self._columns = columns
        self._begins = begins
        self._ends = inf if ends is None else ends
        self._loaded = loaded
        self._pieces: list[bytes] = []
        self._size = 0
        self._next = 0
        self._chunks = 0
        self._is_dropped = False

    def begin(self) -> list[Outgoing]:
        """Ask how much there is, then for the samples."""
        return self._ask(MeasureRecording(self._name), self._measured)

    def drop(self) -> None:
        """Ask for no more and tell nobody."""
        self._is_dropped = True
        self._pieces.clear()

    def _measured(self, answer: Answer, now: int) -> list[Outgoing]:
        if self._is_dropped:
            return []
        if not isinstance(answer, Extent):
            return self._loaded(store_refusal(answer), now)
        if self._begins <= 0.0 and self._ends == inf and answer.size > MOST_PLAYED_BYTES:
            return self._loaded(self._too_large(answer.size), now)
        self._chunks = answer.chunks
        return self._go_on(now)

    def _go_on(self, now: int) -> list[Outgoing]:
        if self._next >= self._chunks:
            return self._loaded(tuple(self._pieces), now)
        most = min(_CHUNKS_AT_ONCE, self._chunks - self._next)
        return self._ask(LoadChunks(self._name, self._next, most), self._take)

    def _take(self, answer: Answer, now: int) -> list[Outgoing]:
        """Keep what is of the part; chunks follow each other in time, as their rows do."""
        if self._is_dropped:
            return []
        if not isinstance(answer, tuple):
            return self._loaded(store_refusal(answer), now)
        wanted: list[bytes] = []
        for chunk in answer:
            assert isinstance(chunk, bytes)
            times = self._times(chunk)
            if isinstance(times, Refusal):
                return self._loaded(times, now)
            first, last = times
            if first > self._ends:
                self._chunks = self._next
                break
            self._next += 1
            if last >= self._begins:
                wanted.append(chunk)
        if not answer:
            self._chunks = self._next  # there is less than there was: it was made anew
        if wanted:
            self._pieces.append(b"".join(wanted))
            self._size += len(self._pieces[-1])
        if self._size > MOST_PLAYED_BYTES:
            return self._loaded(self._too_large(self._size), now)
        return self._go_on(now)

    def _times(self, chunk: bytes) -> tuple[float, float] | Refusal:
        """Return the least and the greatest time of a chunk's rows [s]."""
        if len(chunk) % (_REAL_BYTES * self._columns):
            problem = f"has {len(chunk)} bytes, no whole rows of {self._columns} reals"
            return BadDocument(f"a chunk of recording {self._name!r}", problem).refusal()
        times = np.frombuffer(chunk, "<f8")[:: self._columns]
        return float(times.min()), float(times.max())

    def _too_large(self, size: int) -> Refusal:
        text = (
            f"{self._name!r} has {size} bytes or more to be played; accepted: at most"
            f" {MOST_PLAYED_BYTES}, so play a part of it, with begins and ends"
        )
        return Refusal(VerdictCode.TOO_LARGE, text, value=size, limit=MOST_PLAYED_BYTES)
