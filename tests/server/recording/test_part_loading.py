"""Loading what is played of a recording: never much at once, and no more than the part."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil

import pytest

from openpendant.server.outgoing import Outgoing
from openpendant.server.recording import part_loading
from openpendant.server.recording.part_loading import PartLoading, Pieces
from openpendant.server.recording.survey import count_rows
from openpendant.server.refusal import Refusal
from openpendant.server.store.documents import MOST_CHUNK_BYTES, Extent
from openpendant.server.store.questions import Then
from openpendant.server.store.recording_rows import chunks_together
from openpendant.server.store.requests import LoadChunks, MeasureRecording, Request
from openpendant.server.store.samples import pack_rows
from openpendant.simplemsg.verdicts import VerdictCode as V

WIDTH = 8
ROW_BYTES = 8 * WIDTH


def _chunk(begins: float, rows: int) -> bytes:
    """Return rows 10 ms apart."""
    return pack_rows((begins + 0.01 * n, *[0.0] * (WIDTH - 1)) for n in range(rows))


def _recording(rows_in_chunk: int, chunks: int) -> list[bytes]:
    return [_chunk(0.01 * rows_in_chunk * n, rows_in_chunk) for n in range(chunks)]


class Kept:
    """A store with one recording, by the rule of the real one for how much it hands over."""

    def __init__(self, chunks: list[bytes]) -> None:
        self.chunks = chunks
        self.answered: list[int] = []
        self.told: list[Pieces | Refusal] = []

    def load_chunks(self, name: str, first: int, most: int) -> tuple[bytes, ...]:
        return tuple(self.chunks[first : first + most])

    def ask(self, request: Request, then: Then) -> list[Outgoing]:
        if isinstance(request, MeasureRecording):
            return then(Extent(len(self.chunks), sum(map(len, self.chunks))), 0)
        assert isinstance(request, LoadChunks)
        # Has what is used of it.
        answer = chunks_together(self, request.name, request.first, request.most)  # type: ignore[arg-type]
        self.answered.append(sum(map(len, answer)))
        return then(answer, 0)

    def load(self, begins: float = 0.0, ends: float | None = None) -> Pieces | Refusal:
        PartLoading(self.ask, "arc", WIDTH, begins, ends, self._take).begin()
        (told,) = self.told
        return told

    def _take(self, pieces: Pieces | Refusal, now: int) -> list[Outgoing]:
        self.told.append(pieces)
        return []


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
    count_rows(kept.ask, "arc", columns, lambda count, now: [])
    assert max(kept.answered) <= MOST_CHUNK_BYTES


def test_of_a_part_no_more_than_its_chunks_are_kept_and_nothing_behind_it_is_read() -> None:
    kept = Kept(_recording(100, 1_000))
    pieces = kept.load(begins=2.5, ends=4.5)
    assert not isinstance(pieces, Refusal)
    assert b"".join(pieces) == b"".join(kept.chunks[2:5])
    assert sum(kept.answered) <= MOST_CHUNK_BYTES


def test_a_whole_that_is_too_large_is_refused_before_anything_is_loaded() -> None:
    kept = Kept(_recording(16_384, 65))
    refused = kept.load()
    assert isinstance(refused, Refusal)
    assert (refused.code, refused.value) == (V.TOO_LARGE, 65 << 20)
    assert "begins and ends" in refused.text
    assert kept.answered == []


@pytest.mark.parametrize("load", [lambda kept: kept.load(1.0), lambda kept: kept.load(0.0, 1e6)])
def test_a_part_that_is_too_large_is_refused_as_soon_as_that_is_known(
    load: Callable[[Kept], Pieces | Refusal], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(part_loading, "MOST_PLAYED_BYTES", 3 << 20)
    kept = Kept(_recording(16_384, 20))
    refused = load(kept)
    assert isinstance(refused, Refusal)
    assert refused.code is V.TOO_LARGE
    assert sum(kept.answered) == 4 << 20


def test_a_part_of_what_is_too_large_as_a_whole_is_played() -> None:
    kept = Kept(_recording(16_384, 65))
    pieces = kept.load(begins=600.0, ends=610.0)
    assert not isinstance(pieces, Refusal)
    assert sum(map(len, pieces)) == MOST_CHUNK_BYTES


def test_a_chunk_of_half_rows_is_refused_with_its_size() -> None:
    refused = Kept([_chunk(0.0, 3), bytes(ROW_BYTES + 4)]).load()
    assert isinstance(refused, Refusal)
    assert refused.code is V.BAD_DOCUMENT
    assert f"{ROW_BYTES + 4} bytes" in refused.text


def test_nothing_is_told_of_what_was_dropped() -> None:
    kept = Kept([_chunk(0.0, 3)])
    waiting: list[Then] = []

    def ask(request: Request, then: Then) -> list[Outgoing]:
        waiting.append(then)
        return []

    loading = PartLoading(ask, "arc", WIDTH, 0.0, None, kept._take)
    loading.begin()
    loading.drop()
    waiting.pop()(Extent(1, 3 * ROW_BYTES), 0)
    assert (waiting, kept.told) == ([], [])
