from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import TypeVar

import numpy as np
import pytest

from openpendant.server.events.effects import Ask, Effect
from openpendant.server.events.pending import Pending, Steps
from openpendant.server.recording import recording_playback
from openpendant.server.recording.recording_playback import Pieces, part_samples
from openpendant.server.recording.recording_service import count_rows
from openpendant.server.refusal import Refusal
from openpendant.server.store.documents import MOST_CHUNK_BYTES, Extent
from openpendant.server.store.recording_format import chunks_together, pack_rows
from openpendant.server.store.requests import Answer, LoadChunks, MeasureRecording, Request
from openpendant.simplemsg.verdicts import VerdictCode as V

T = TypeVar("T")

WIDTH = 8
ROW_BYTES = 8 * WIDTH


def _chunk(begins: float, rows: int) -> bytes:
    """Return rows 10 ms apart."""
    return pack_rows((begins + 0.01 * n, *[0.0] * (WIDTH - 1)) for n in range(rows))


def _recording(rows_in_chunk: int, chunks: int) -> list[bytes]:
    return [_chunk(0.01 * rows_in_chunk * n, rows_in_chunk) for n in range(chunks)]


@pytest.fixture(scope="module")
def too_large() -> list[bytes]:
    rows = np.zeros((16_384 * 65, WIDTH), "<f8")
    rows[:, 0] = 0.01 * np.arange(len(rows))
    return [part.tobytes() for part in np.split(rows, 65)]


class Kept:
    def __init__(self, chunks: list[bytes]) -> None:
        self.chunks = chunks
        self.answered: list[int] = []

    def load_chunks(self, name: str, first: int, most: int) -> tuple[bytes, ...]:
        return tuple(self.chunks[first : first + most])

    def _answer(self, request: Request) -> Answer:
        if isinstance(request, MeasureRecording):
            return Extent(len(self.chunks), sum(map(len, self.chunks)))
        assert isinstance(request, LoadChunks)
        # Has what is used of it.
        answer = chunks_together(self, request.name, request.first, request.most)  # type: ignore[arg-type]
        self.answered.append(sum(map(len, answer)))
        return answer

    def load(self, begins: float = 0.0, ends: float | None = None) -> Pieces | Refusal:
        return self.run(part_samples("arc", WIDTH, begins, ends))

    def run(self, steps: Steps[T]) -> T:
        answer: Answer | None = None
        while True:
            try:
                request = steps.send(answer)
            except StopIteration as end:
                told: T = end.value
                return told
            assert isinstance(request, MeasureRecording | LoadChunks)
            answer = self._answer(request)


CHUNKINGS = [(51, 700), (16_384, 5), (12_000, 5)]
"""Rows of a chunk, and chunks: as recorded, as imported, and what does not divide a portion."""


@pytest.mark.parametrize(("rows", "chunks"), CHUNKINGS)
def test_no_answer_and_no_piece_is_larger_than_one_chunk_may_be(rows: int, chunks: int) -> None:
    kept = Kept(_recording(rows, chunks))
    pieces = kept.load()
    assert not isinstance(pieces, Refusal)
    assert b"".join(pieces) == b"".join(kept.chunks)
    assert max(map(len, pieces)) <= MOST_CHUNK_BYTES
    assert max(kept.answered) <= MOST_CHUNK_BYTES
    assert len(kept.answered) <= 2 * ceil(sum(kept.answered) / MOST_CHUNK_BYTES) + chunks // 128


def test_what_is_counted_comes_in_portions_too() -> None:
    kept = Kept(_recording(16_384, 5))
    columns = ("t", *(f"j{number}" for number in range(1, WIDTH)))
    kept.run(count_rows("arc", columns))
    assert max(kept.answered) <= MOST_CHUNK_BYTES


def test_of_a_part_no_more_than_its_chunks_are_kept_and_nothing_behind_it_is_read() -> None:
    kept = Kept(_recording(100, 1_000))
    pieces = kept.load(begins=2.5, ends=4.5)
    assert not isinstance(pieces, Refusal)
    assert b"".join(pieces) == b"".join(kept.chunks[2:5])
    assert sum(kept.answered) <= MOST_CHUNK_BYTES


def test_a_whole_that_is_too_large_is_refused_before_anything_is_loaded(
    too_large: list[bytes],
) -> None:
    kept = Kept(too_large)
    refused = kept.load()
    assert isinstance(refused, Refusal)
    assert (refused.code, refused.value) == (V.TOO_LARGE, 65 << 20)
    assert "begins and ends" in refused.text
    assert kept.answered == []


@pytest.mark.parametrize("load", [lambda kept: kept.load(1.0), lambda kept: kept.load(0.0, 1e6)])
def test_a_part_that_is_too_large_is_refused_as_soon_as_that_is_known(
    load: Callable[[Kept], Pieces | Refusal],
    too_large: list[bytes],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(recording_playback, "MOST_PLAYED_BYTES", 3 << 20)
    kept = Kept(too_large[:20])
    refused = load(kept)
    assert isinstance(refused, Refusal)
    assert refused.code is V.TOO_LARGE
    assert sum(kept.answered) == 4 << 20


def test_a_part_of_what_is_too_large_as_a_whole_is_played(too_large: list[bytes]) -> None:
    kept = Kept(too_large)
    pieces = kept.load(begins=600.0, ends=610.0)
    assert not isinstance(pieces, Refusal)
    assert sum(map(len, pieces)) == MOST_CHUNK_BYTES


def test_a_chunk_of_half_rows_is_refused_with_its_size() -> None:
    refused = Kept([_chunk(0.0, 3), bytes(ROW_BYTES + 4)]).load()
    assert isinstance(refused, Refusal)
    assert refused.code is V.BAD_DOCUMENT
    assert f"{ROW_BYTES + 4} bytes" in refused.text


def test_nothing_is_told_of_what_was_dropped() -> None:
    pending, told = Pending(), []

    def take(pieces: Pieces | Refusal, now: int) -> list[Effect]:
        told.append(pieces)
        return []

    steps = part_samples("arc", WIDTH, 0.0, None)
    (asked,) = pending.run(steps, take, 0)
    assert isinstance(asked, Ask)
    pending.drop(steps)
    assert pending.resume(asked, Extent(1, 3 * ROW_BYTES), 0) == []
    assert told == []
