from __future__ import annotations

import io
import json
import locale
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from rigs.data.stored_documents import ANN, opened

from openpendant.server.exchange.csv_format import (
    read_points,
    save_recording,
    write_points,
    write_recording,
)
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import pack_rows, recording_rows
from openpendant.server.store.sqlite_store import SqliteStore
from openpendant.server.store.store_errors import BadDocument, Conflict, StoreError, TooLarge

RECORDING = DocumentKind.RECORDING

POINTS: list[dict[str, Any]] = [
    {
        "name": "above, left",
        "joints": [0.1, -1.5707963267948966, 1e-7],
        "pose": {"xyz": [0.5, 0.0, 0.25], "quat": [0, 0, 0, 1]},
        "speed": 0.5,
        "comment": 'says "go"',
    },
    {"name": "12", "joints": [1.0, 2.0, 3.0], "dwell": None, "stop": True, "comment": ""},
    {"name": "1,5", "joints": [], "tags": {}, "comment": "two\nlines", "motion": "true"},
]


@pytest.fixture
def store(tmp_path: Path) -> Iterator[SqliteStore]:
    with opened(tmp_path / "store.db") as store:
        yield store


def csv_of(points: object) -> str:
    out = io.StringIO()
    write_points("p", json.dumps({"points": points}), out)
    return out.getvalue()


def points_of(text: str | bytes) -> list[dict[str, Any]]:
    raw = text if isinstance(text, bytes) else text.encode()
    return read_points(io.BytesIO(raw), "x.csv")


def test_points_come_back_as_they_were() -> None:
    assert points_of(csv_of(POINTS)) == POINTS


def test_a_point_is_a_row_and_a_value_a_column_with_dots_in_numbers() -> None:
    lines = csv_of(POINTS[:1]).splitlines()
    assert lines[0] == (
        "name,joints[0],joints[1],joints[2],pose.xyz[0],pose.xyz[1],pose.xyz[2],"
        "pose.quat[0],pose.quat[1],pose.quat[2],pose.quat[3],speed,comment"
    )
    assert lines[1] == (
        '"above, left",0.1,-1.5707963267948966,1e-07,0.5,0.0,0.25,0,0,0,1,0.5,"says ""go"""'
    )


def test_numbers_have_dots_whatever_the_locale(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(locale, "_override_localeconv", {"decimal_point": ",", "grouping": [3]})
    assert locale.str(0.5) == "0,5"
    assert ",0.1," in csv_of(POINTS)
    assert points_of(csv_of(POINTS)) == POINTS


texts = st.text(st.characters(codec="utf-8", exclude_characters="\0"))
scalars = (
    st.none() | st.booleans() | st.integers(-(10**18), 10**18) | texts
    | st.floats(allow_nan=False, allow_infinity=False)
)  # fmt: skip
keys = st.sampled_from(["name", "speed", "motion"])


@example(points=[{"name": "0\r0"}, {"name": "0\r\n"}, {"name": "\n\r"}])
@given(st.lists(st.dictionaries(keys, scalars | st.lists(scalars, max_size=3)), max_size=4))
def test_any_value_comes_back_as_it_was(points: list[dict[str, Any]]) -> None:
    kept = [point for point in points if point]  # a row without any cell is no point
    mixed = {key for key in ("name", "speed", "motion") if _is_list_and_not(kept, key)}
    kept = [{k: v for k, v in point.items() if k not in mixed} for point in kept]
    kept = [point for point in kept if point]
    if kept:
        assert points_of(csv_of(kept)) == kept


def _is_list_and_not(points: list[dict[str, Any]], key: str) -> bool:
    return len({isinstance(point[key], list) for point in points if key in point}) > 1


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused_by_name(raw: bytes) -> None:
    try:
        points_of(raw)
    except StoreError as error:
        assert "x.csv" in str(error)  # noqa: PT017 (either is right)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", r"x\.csv: line 1: accepted: a first line with"),
        ("name;speed\na;1\n", r"line 1: semicolons .* accepted: commas"),
        ("name,name\na,b\n", "line 1: accepted: .*different names"),
        ("name,a b\n1,2\n", r"line 1, column 2: 'a b' names no value"),
        ("name,\n1,2\n", r"line 1, column 2: '' names no value"),
        ("name,[0]\n1,2\n", r"line 1, column 2"),
        ("name,speed\na,1\nb\n", r"line 3: has 1 cells; accepted: 2"),
        ("name,speed\na,1,2\n", r"line 2: has 3 cells; accepted: 2"),
        ('name,speed\n\na,"0,5"\n', r"line 3, column 2 \(speed\): '0,5' is not a number.*0\.5"),
        ("name,speed\na,1.000.000\n", r"line 2, column 2 \(speed\)"),
        ("name,speed\na,1e999\n", r"line 2, column 2 \(speed\): 1e999 is too large"),
        ("name,speed\na," + "9" * 30 + "\n", r"line 2, column 2 \(speed\)"),
        ('name\n"""x\n', r"line 2: is not CSV"),
        ('name\n"""a"x\n', r"line 2: is not CSV"),
        ('name\n"""a"\n', r"line 2, column 1 \(name\): .* is not text in quotes"),
        ("j[0],j[1],j[2]\n1,,3\n", r"line 2, column 3 \(j\[2\]\): the cell of \[1\] is empty"),
        ("a,a.b\n1,2\n", r"line 2, column 2 \(a\.b\): another column puts"),
        ("a[0],a.b\n1,2\n", r"another column puts a value of another kind"),
        ("name\na\0b\n", "line 2: has a NUL"),
        (b"name\n\n\xff\n", r"line 3: is not UTF-8 text \(byte 1"),
        (",".join(f"c{n}" for n in range(257)), "line 1: accepted: .*256"),
    ],
)
def test_what_is_wrong_is_told_with_line_and_column(text: str | bytes, says: str) -> None:
    with pytest.raises(BadDocument, match=says):
        points_of(text)


@pytest.mark.parametrize("text", [b"x" * 70_000, b'name\n"' + b"x\n" * 200_000])
def test_a_line_or_cell_without_end_is_refused(text: bytes) -> None:
    with pytest.raises((TooLarge, BadDocument), match=r"line \d+"):
        points_of(text)


def test_text_that_a_backtracking_pattern_would_choke_on_is_read() -> None:
    cell = "1" * 60_000 + "x"
    assert points_of(f"name\n{cell}\n") == [{"name": cell}]


class Endless(io.RawIOBase):
    def __init__(self, line: bytes, lines: int) -> None:
        self.left = lines
        self._line = line

    def readline(self, size: int | None = -1) -> bytes:
        self.left -= 1
        return self._line if self.left >= 0 else b""


def test_a_point_list_of_200_megabytes_is_refused_on_the_way() -> None:
    line = b"a" * 50_000 + b"\n"
    stream = Endless(line, 4_000)
    with pytest.raises(TooLarge):
        read_points(stream, "x.csv")  # type: ignore[arg-type]  # has what is used of it
    assert stream.left > 3_000


@pytest.mark.parametrize("body", ["{}", "[]", '{"points": 1}', '{"points": [1]}'])
def test_a_document_without_points_has_no_csv(body: str) -> None:
    with pytest.raises(BadDocument, match="points"):
        write_points("p", body, io.StringIO())


def record(store: SqliteStore, chunks: Sequence[Sequence[tuple[float, float]]]) -> None:
    body = '{"columns": ["t", "j1"], "robot": "ur5"}'
    store.save(RECORDING, "r", body, expected_revision=0, author=ANN)
    for number, rows in enumerate(chunks):
        store.append_chunk("r", number, pack_rows(rows))


def test_a_recording_comes_back_to_the_last_bit(store: SqliteStore) -> None:
    rows = [(number / 100, (number * 0.1) ** 9 / 7) for number in range(1_000)]
    record(store, [rows[:300], rows[300:]])
    out = io.StringIO()
    write_recording(store, "r", out)
    assert out.getvalue().splitlines()[:2] == ["t,j1", "0.0,0.0"]
    again = io.BytesIO(out.getvalue().encode())
    save_recording(store, "again", again, "x.csv", ANN)
    assert list(recording_rows(store, "again", 2)) == rows


def test_a_recording_is_imported_whole_or_not_at_all(store: SqliteStore) -> None:
    for text, says in (
        (b"t,j1\n0,1\n1,x\n", r"x\.csv: line 3, column 2 \(j1\): 'x' is not a number"),
        (b"t,j1\n0,1\n1,\n", r"line 3, column 2 \(j1\): '' is not a number"),
        (b"t,j1\n0,nan\n", r"line 2, column 2 \(j1\): 'nan' is not a number"),
        (b"t,t\n0,1\n", "different names"),
    ):
        with pytest.raises(BadDocument, match=says):
            save_recording(store, "r", io.BytesIO(text), "x.csv", ANN)
    assert store.headings() == ()


def test_a_recording_is_never_written_over_by_csv(store: SqliteStore) -> None:
    record(store, [[(0.0, 1.0)]])
    with pytest.raises(Conflict):
        save_recording(store, "r", io.BytesIO(b"t,j1\n0,2\n"), "x.csv", ANN)


def test_a_chunk_that_was_cut_is_told(store: SqliteStore) -> None:
    store.save(RECORDING, "r", '{"columns": ["t", "j1"]}', expected_revision=0, author=ANN)
    store.append_chunk("r", 0, bytes(17))
    with pytest.raises(BadDocument, match="has 17 bytes; accepted: a multiple of 2 x 8"):
        write_recording(store, "r", io.StringIO())
