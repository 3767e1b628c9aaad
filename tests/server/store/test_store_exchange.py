"""What goes out of a store and comes in again: documents as JSON, points and recordings as CSV."""

import io
import itertools
import json
import locale
import tracemalloc
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from rigs.data.example_counts import examples
from rigs.data.stored_documents import ANN, begin_recording, opened, save

from openpendant.server.exchange import csv_format, text_format
from openpendant.server.exchange.csv_format import read_points, save_recording
from openpendant.server.exchange.text_format import FORMAT, documents_from_json, save_entries
from openpendant.server.store import store_errors
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import pack_rows, recording_rows
from openpendant.server.store.sqlite_store import SqliteStore
from openpendant.server.store.store_errors import BadDocument, Conflict, StoreError, TooLarge
from openpendant.server.store.strict_json import DEEPEST


def text_of(store: SqliteStore) -> str:
    return "".join(text_format.documents_to_json(store, store.headings()))


def file_of(*documents: Any, **more: Any) -> str:
    return json.dumps({"format": FORMAT, "documents": documents, **more})


def program(body: str = '{"a": 1}', name: str = '"p"') -> str:
    head = f'{{"format": "{FORMAT}", "documents": [\n'
    return head + f'{{"kind": "program", "name": {name}, "body": {body}}}]}}'


def recording(*samples: list[float], **body: Any) -> str:
    return file_of({"kind": "recording", "name": "r", "body": body, "samples": samples})


def test_an_export_is_imported_the_same_to_the_last_bit(store: SqliteStore, tmp_path: Path) -> None:
    rows = [(0.0, 0.1, -1e-300), (0.01, 1 / 3, 5e-324)]
    save(store, "Größe \U0001f600", '{"text": "é\\n", "speed": 0.30000000000000004, "n": 1}')
    begin_recording(store, columns='["t", "j1", "j2"]')
    store.append_chunk("r", 0, pack_rows(rows[:1]))
    store.append_chunk("r", 1, pack_rows(rows[1:]))
    text = text_of(store)
    assert text.isascii()
    with opened(tmp_path / "other.db") as other:
        save_entries(other, documents_from_json(text, "x.json"), ANN, replace=False)
        for heading in store.headings():
            before = json.loads(store.load(heading.kind, heading.name).body)
            after = json.loads(other.load(heading.kind, heading.name).body)
            assert (after, [*after]) == (before, [*before])
        assert list(recording_rows(other, "r", 3)) == rows


def test_an_export_of_nothing_is_a_file_all_the_same(store: SqliteStore) -> None:
    assert documents_from_json(text_of(store), "x.json") == ()


def test_every_document_has_a_line_of_its_own(store: SqliteStore) -> None:
    for name in "abc":
        save(store, name)
    lines = text_of(store).splitlines()
    assert [json.loads(line.rstrip(","))["name"] for line in lines[1:-1]] == ["a", "b", "c"]


texts = st.text(st.characters(codec="utf-8"))
reals = st.floats(allow_nan=False, allow_infinity=False)
values = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**18), 10**18) | texts | reals,
    lambda inner: st.lists(inner) | st.dictionaries(texts, inner),
    max_leaves=10,
)


@settings(max_examples=examples(15, in_soak=5_000))
@given(st.dictionaries(texts, values))
def test_any_body_comes_back_as_it_was(body: dict[str, Any]) -> None:
    text = file_of({"kind": "program", "name": "p", "body": body})
    (entry,) = documents_from_json(text, "x.json")
    assert json.loads(entry.body) == body


@given(st.text() | st.binary().map(lambda raw: raw.decode("latin-1")))
def test_any_other_text_is_refused_by_name(text: str) -> None:
    with pytest.raises(StoreError, match=r"x\.json"):
        documents_from_json(text, "x.json")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", r"x\.json: line 1, column 1: is not JSON"),
        ("{}\n{", r"x\.json: line 2, column 1: is not JSON"),
        (program()[:-10], r"x\.json: line 2, column \d+: is not JSON"),
        ("[]", r"an object with .format"),
        ("{}", r"x\.json: format: accepted: 'openpendant-store/1'"),
        ('{"format": "openpendant-store/2", "documents": []}', "x.json: format"),
        (file_of(extra=1), r"x\.json: extra: unknown; known here: documents, format"),
        (json.dumps({"format": FORMAT, "documents": {}}), "documents: accepted: a list"),
        (file_of(1), r"documents\[0\]: accepted: an object"),
        (file_of({"kind": "poem"}), r"documents\[0\]\.kind: accepted: program, recording"),
        (file_of({"kind": []}), r"documents\[0\]\.kind"),
        (file_of({"kind": "program", "name": 1}), r"documents\[0\]\.name: accepted: a text"),
        (file_of({"kind": "program", "nmae": 1}), r"documents\[0\]\.nmae: unknown"),
        (program("[]"), r"documents\[0\]\.body: accepted: an object"),
        (program('{"a": NaN}'), "has NaN; accepted: finite"),
        (program('{"a": -Infinity}'), "has -Infinity"),
        (program('{"b": {"a": [0, 1e999]}}'), r"documents\[0\]\.body\.b\.a\[1\]: .*too large"),
        (program('{"a": ' + "9" * 20 + "}"), "integer of 20 digits; accepted: 19"),
        (program('{"a": ' + "9" * 100_000 + "}"), "integer of 100000 digits"),
        (program('{"a": 1, "a": 2}'), "the key 'a' twice"),
        (program('{"a": "\\ud800"}'), "surrogate"),
        (program('{"a": ' + "[" * DEEPEST + "]" * DEEPEST + "}"), "nests too deeply"),
        (program('{"a": ' + "[" * 10**6 + "]" * 10**6 + "}"), "nests too deeply"),
        ("[" * 10**6, "nests too deeply"),
        ('{"a":' * 10**6, "nests too deeply"),
        (file_of(*[{"kind": "tools", "name": "a", "body": {}}] * 2), "'a' is there twice"),
        (
            file_of({"kind": "program", "name": "p", "body": {}, "samples": []}),
            r"documents\[0\]\.samples: only a recording has samples",
        ),
        (recording(), r"documents\[0\]\.body\.columns"),
        (
            recording([0.0, 1], [0.0, True], columns=["t", "j1"]),
            r"documents\[0\]\.samples\[1\]: accepted: a list of 2 numbers",
        ),
    ],
    ids=lambda value: value[:40] if isinstance(value, str) else None,
)
def test_what_is_wrong_is_told_with_its_place(text: str, says: str) -> None:
    with pytest.raises(BadDocument, match=says):
        documents_from_json(text, "x.json")


@pytest.mark.parametrize("name", ["../../etc/passwd", "a\0b", "", "C:\\x"])
def test_a_name_in_a_file_obeys_the_rules_of_names(name: str) -> None:
    with pytest.raises(store_errors.BadName, match=r"x\.json, documents\[0\]\.name"):
        documents_from_json(program(name=json.dumps(name)), "x.json")


def test_a_body_as_deep_as_allowed_is_taken(store: SqliteStore) -> None:
    depth = DEEPEST - 4  # the object, the list, the document and its body are around it
    text = program('{"a": ' + "[" * depth + "]" * depth + "}")
    save_entries(store, documents_from_json(text, "x.json"), ANN, replace=False)


def test_all_is_imported_or_nothing(store: SqliteStore) -> None:
    save(store, "b", '{"mine": 1}')
    three = ({"kind": "program", "name": name, "body": {}} for name in "abc")
    entries = documents_from_json(file_of(*three), "x.json")
    with pytest.raises(Conflict, match="program 'b'"):
        save_entries(store, entries, ANN, replace=False)
    assert [heading.name for heading in store.headings()] == ["b"]
    saved = save_entries(store, entries, ANN, replace=True)
    assert [(heading.name, heading.revision) for heading in saved] == [("a", 1), ("b", 2), ("c", 1)]
    assert store.load(DocumentKind.PROGRAM, "b", 1).body == '{"mine": 1}'


def test_an_imported_recording_takes_the_place_of_the_kept_one(store: SqliteStore) -> None:
    for sample in (1.0, 2.0):
        entries = documents_from_json(recording([sample], columns=["t"]), "x.json")
        save_entries(store, entries, ANN, replace=True)
    assert list(recording_rows(store, "r", 1)) == [(2.0,)]


def test_a_recording_too_long_for_json_is_told_before_the_file_is_whole(
    store: SqliteStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(text_format, "MOST_FILE_BYTES", 10_000)
    begin_recording(store, columns='["t"]')
    store.append_chunk("r", 0, pack_rows((row / 7,) for row in range(1_000)))
    with pytest.raises(TooLarge, match="export the recording as CSV, or make a backup"):
        text_of(store)


def test_a_file_of_200_megabytes_is_refused_unread(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    with path.open("wb") as file:
        file.truncate(200_000_000)
    tracemalloc.start()
    with pytest.raises(TooLarge, match=f"at most {text_format.MOST_FILE_BYTES}"):
        text_format.read_file(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3 * text_format.MOST_FILE_BYTES


def test_a_file_that_is_no_text_is_told_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(b"{\n\n\xff")
    with pytest.raises(BadDocument, match="line 3: is not UTF-8"):
        text_format.read_file(path)


def test_a_file_that_cannot_be_read_is_told_with_the_system_s_words(tmp_path: Path) -> None:
    for name, says in (("nothing", "No such file"), (".", "directory"), ("a\0b", "null")):
        with pytest.raises(store_errors.StoreFailed, match=says):
            text_format.read_file(tmp_path / name)


def test_a_mark_of_byte_order_is_taken(tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    path.write_text(program(), encoding="utf-8-sig")
    assert len(documents_from_json(text_format.read_file(path), "x.json")) == 1


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


def csv_of(points: object) -> str:
    out = io.StringIO()
    csv_format.write_points("p", json.dumps({"points": points}), out)
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


cells = st.text(st.characters(codec="utf-8", exclude_characters="\0"))
scalars = (
    st.none() | st.booleans() | st.integers(-(10**18), 10**18) | cells
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


def test_a_point_list_of_200_megabytes_is_refused_on_the_way() -> None:
    readline = Mock(side_effect=itertools.repeat(b"a" * 50_000 + b"\n", 4_000))
    with pytest.raises(TooLarge):
        read_points(Mock(readline=readline), "x.csv")
    assert readline.call_count < 1_000


@pytest.mark.parametrize("body", ["{}", "[]", '{"points": 1}', '{"points": [1]}'])
def test_a_document_without_points_has_no_csv(body: str) -> None:
    with pytest.raises(BadDocument, match="points"):
        csv_format.write_points("p", body, io.StringIO())


def record(store: SqliteStore, chunks: Sequence[Sequence[tuple[float, float]]]) -> None:
    begin_recording(store)
    for number, rows in enumerate(chunks):
        store.append_chunk("r", number, pack_rows(rows))


def test_a_recording_comes_back_to_the_last_bit(store: SqliteStore) -> None:
    rows = [(number / 100, (number * 0.1) ** 9 / 7) for number in range(1_000)]
    record(store, [rows[:300], rows[300:]])
    out = io.StringIO()
    csv_format.write_recording(store, "r", out)
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
    begin_recording(store)
    store.append_chunk("r", 0, bytes(17))
    with pytest.raises(BadDocument, match="has 17 bytes; accepted: a multiple of 2 x 8"):
        csv_format.write_recording(store, "r", io.StringIO())
