import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.stored_documents import ANN, opened

from openpendant.server.recording.recording_service import count_rows
from openpendant.server.refusal import Refusal
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import (
    Row,
    RowCount,
    pack_rows,
    rename_recording,
    trim_recording,
    unpack_rows,
)
from openpendant.server.store.requests import Answer, LoadChunks
from openpendant.server.store.sqlite_store import SqliteStore
from openpendant.server.store.store_errors import BadDocument, Conflict, NotFound
from openpendant.simplemsg.verdicts import VerdictCode as V

KIND = DocumentKind.RECORDING
ROWS = [(0.1 * n, float(n), float(n == 6)) for n in range(10)]


@pytest.fixture
def store(tmp_path: Path) -> Iterator[SqliteStore]:
    with opened(tmp_path / "store.db") as made:
        body = json.dumps({"columns": ["t", "j1", "gap"], "robot": "r"})
        made.save(KIND, "arc", body, expected_revision=0, author=ANN)
        for number in range(5):
            made.append_chunk("arc", number, pack_rows(ROWS[2 * number : 2 * number + 2]))
        yield made


def _rows(store: SqliteStore, name: str) -> list[Row]:
    return [row for chunk in store.load_chunks(name, 0, 99) for row in unpack_rows(chunk, 3)]


def test_a_part_counts_its_time_from_its_first_row_and_its_rate_without_gaps(
    store: SqliteStore,
) -> None:
    trim_recording(store, "arc", "part", 0.35, 0.75, ANN)
    times, values, gaps = zip(*_rows(store, "part"), strict=True)
    assert times == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert (values, gaps) == ((4.0, 5.0, 6.0, 7.0), (0.0, 0.0, 1.0, 0.0))
    assert _rows(store, "arc") == ROWS
    body = json.loads(store.load(KIND, "part").body)
    assert (body["samples"], body["gaps"], body["robot"]) == (4, 1, "r")
    numbers = [body[name] for name in ("duration", "rate", "longest_gap")]
    assert numbers == pytest.approx([0.3, 10.0, 0.1])


def test_a_part_of_a_recording_that_broke_off_is_whole(store: SqliteStore) -> None:
    body = json.loads(store.load(KIND, "arc").body)
    broken = json.dumps(body | {"finished": False, "problem": "the link to the robot was lost"})
    store.save(KIND, "arc", broken, expected_revision=1, author=ANN)
    trim_recording(store, "arc", "part", 0.35, 0.75, ANN)
    part = json.loads(store.load(KIND, "part").body)
    assert (part["finished"], part["problem"]) == (True, "")


def test_no_gap_is_left_in_front_of_the_first_row(store: SqliteStore) -> None:
    trim_recording(store, "arc", "part", 0.55, None, ANN)
    assert _rows(store, "part")[0] == (0.0, 6.0, 0.0)


def test_an_empty_part_leaves_nothing_behind(store: SqliteStore) -> None:
    with pytest.raises(BadDocument, match="no sample"):
        trim_recording(store, "arc", "part", 5.0, 6.0, ANN)
    with pytest.raises(NotFound):
        store.load(KIND, "part")


def test_a_taken_name_is_refused(store: SqliteStore) -> None:
    trim_recording(store, "arc", "part", 0.0, None, ANN)
    with pytest.raises(Conflict):
        trim_recording(store, "arc", "part", 0.0, None, ANN)


def test_a_renamed_recording_keeps_every_bit(store: SqliteStore) -> None:
    rename_recording(store, "arc", "bow", 1, ANN)
    assert _rows(store, "bow") == ROWS
    with pytest.raises(NotFound):
        store.load(KIND, "arc")


def test_a_rename_from_an_old_revision_changes_nothing(store: SqliteStore) -> None:
    with pytest.raises(Conflict):
        rename_recording(store, "arc", "bow", 7, ANN)
    assert _rows(store, "arc") == ROWS
    with pytest.raises(NotFound):
        store.load(KIND, "bow")


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
def test_chunks_are_counted_as_rows_are(kept: list[tuple[float, float, float]], most: int) -> None:
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
