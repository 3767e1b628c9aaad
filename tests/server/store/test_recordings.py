import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from rigs.data.stored_documents import ANN, opened

from openpendant.server.store import recording_format
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import rename_recording, trim_recording
from openpendant.server.store.sqlite_store import SqliteStore
from openpendant.server.store.store_errors import BadDocument, Conflict, NotFound

KIND = DocumentKind.RECORDING
ROWS = [(0.1 * n, float(n), float(n == 6)) for n in range(10)]


@pytest.fixture
def store(tmp_path: Path) -> Iterator[SqliteStore]:
    with opened(tmp_path / "store.db") as made:
        body = json.dumps({"columns": ["t", "j1", "gap"], "robot": "r"})
        made.save(KIND, "arc", body, expected_revision=0, author=ANN)
        for n in range(5):
            made.append_chunk("arc", n, recording_format.pack_rows(ROWS[2 * n : 2 * n + 2]))
        yield made


def _rows(store: SqliteStore, name: str) -> list[recording_format.Row]:
    chunks = store.load_chunks(name, 0, 99)
    return [row for chunk in chunks for row in recording_format.unpack_rows(chunk, 3)]


def test_a_part_counts_time_from_its_first_row_and_rate_without_gaps(store: SqliteStore) -> None:
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
