from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from openpendant.server.recording.recording_service import count_rows
from openpendant.server.refusal import Refusal
from openpendant.server.store.recording_format import RowCount, pack_rows
from openpendant.server.store.requests import Answer, LoadChunks
from openpendant.server.store.store_errors import NotFound
from openpendant.simplemsg.verdicts import VerdictCode as V

COLUMNS = ("t", "j1", "gap")

rows = st.lists(st.tuples(st.floats(0.001, 1.0), st.booleans()), max_size=60).map(
    lambda steps: [
        (sum(step for step, _ in steps[: n + 1]), 0.0, float(marked))
        for n, (_, marked) in enumerate(steps)
    ]
)


class Chunks:
    def __init__(self, chunks: list[bytes]) -> None:
        self.chunks = chunks
        self.error: NotFound | None = None

    def count(self, columns: tuple[str, ...] = COLUMNS) -> RowCount | Refusal:
        steps = count_rows("arc", columns)
        answer: Answer | None = None
        while True:
            try:
                request = steps.send(answer)
            except StopIteration as end:
                counted: RowCount | Refusal = end.value
                return counted
            assert isinstance(request, LoadChunks)
            part = tuple(self.chunks[request.first : request.first + request.most])
            answer = part if self.error is None else self.error


def test_rate_and_longest_gap_leave_the_time_in_gaps_out() -> None:
    count = RowCount()
    for time, after_gap in ((1.0, True), (1.1, False), (1.9, True), (2.0, False), (2.4, True)):
        count.take(time, after_gap=after_gap)
    assert (count.rows, count.gaps) == (5, 2)
    assert count.duration == pytest.approx(1.4)
    assert count.longest_gap == pytest.approx(0.8)
    assert count.rate == pytest.approx(10.0)


@pytest.mark.parametrize("times", [(), (0.0,), (0.0, 0.0)])
def test_too_few_rows_have_no_rate(times: tuple[float, ...]) -> None:
    count = RowCount()
    for time in times:
        count.take(time)
    assert count.rate == 0.0


@given(rows, st.integers(1, 7))
def test_chunks_are_counted_as_their_rows_are(
    kept: list[tuple[float, float, float]], most: int
) -> None:
    wanted = RowCount()
    for time, _, mark in kept:
        wanted.take(time, after_gap=mark != 0.0)
    chunks = [pack_rows(kept[n : n + most]) for n in range(0, len(kept), most)]
    assert Chunks(chunks).count() == wanted


def test_a_recording_without_marks_has_no_gaps() -> None:
    counted = Chunks([pack_rows([(0.0, 1.0), (9.0, 1.0)])]).count(("t", "j1"))
    assert counted == RowCount(rows=2, last=9.0)


def test_a_chunk_of_half_rows_is_refused_with_its_size() -> None:
    refused = Chunks([bytes(20)]).count()
    assert isinstance(refused, Refusal)
    assert refused.code is V.BAD_DOCUMENT
    assert "20 bytes" in refused.text


def test_what_the_store_cannot_is_told() -> None:
    store = Chunks([])
    store.error = NotFound("recording", "arc")
    refused = store.count()
    assert isinstance(refused, Refusal)
    assert refused.code is V.NOT_FOUND
