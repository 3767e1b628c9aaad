from __future__ import annotations

import json
import tracemalloc
from collections.abc import Callable

import pytest
from rigs.cells.program_cell import HEAD
from rigs.data.large_programs import PIECE, WorkingCell, large_text

from openpendant.server.exchange.document_check import check_entries, program_entry
from openpendant.server.exchange.text_format import ImportedDocument
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.store_errors import BadDocument
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.simplemsg.verdicts import VerdictCode as V

TEXT = HEAD.format(name="main") + "move PTP a\n"
JSON = program_to_json(parse(TEXT))
LONG = program_to_json(parse(large_text(300, 300)))


def changed(change: Callable[[dict[str, object]], object]) -> str:
    fields = json.loads(JSON)
    change(fields)
    return json.dumps(fields)


def with_point(**fields: object) -> str:
    return changed(lambda program: program["points"][0].update(fields))  # type: ignore[index]


BAD: list[tuple[str, str, str, V]] = [
    ("nothing", "text", " ", V.PROGRAM_SYNTAX),
    ("a text that ends early", "text", TEXT[:60], V.PROGRAM_SYNTAX),
    ("a header alone that ends early", "text", TEXT[:40], V.PROGRAM_SYNTAX),
    ("JSON that ends early", "json", JSON[:-1], V.PROGRAM_SYNTAX),
    ("long JSON that ends early", "json", LONG[: len(LONG) // 2], V.PROGRAM_SYNTAX),
    ("JSON lists 10^6 deep", "json", "[" * 10**6, V.PROGRAM_SYNTAX),
    ("JSON objects deep", "json", '{"format":' * 10**5, V.PROGRAM_SYNTAX),
    ("loops 10^6 deep", "text", TEXT + "loop\n" * 10**6, V.PROGRAM_TOO_LARGE),
    ("loops 10^5 deep", "text", TEXT + "loop\n" * 10**5, V.PROGRAM_TOO_LARGE),
    ("loops 33 deep", "text", TEXT + "loop\n" * 33 + "end\n" * 33, V.PROGRAM_INVALID),
    ("NUL in a name", "text", TEXT.replace("point b", "point b\0"), V.BAD_NAME),
    ("a path as a name", "text", TEXT.replace("point b", "point ../b"), V.BAD_NAME),
    ("a path as a program", "text", TEXT + "call ../../etc/passwd\n", V.BAD_NAME),
    ("NUL as a program", "text", TEXT + "call a\0b\n", V.BAD_NAME),
    ("a path in JSON", "json", with_point(name="/etc/passwd"), V.BAD_NAME),
    ("NUL in JSON", "json", with_point(name="a\0"), V.BAD_NAME),
    ("half a character", "json", with_point(name="\ud800"), V.PROGRAM_SYNTAX),
    ("no joints", "json", with_point(joints=[]), V.PROGRAM_INVALID),
    ("17 joints", "json", with_point(joints=[0.0] * 17), V.PROGRAM_INVALID),
    ("one point of another robot", "json", with_point(joints=[0.0] * 5), V.PROGRAM_INVALID),
    ("a joint that is no number", "json", with_point(joints=["0"] * 6), V.PROGRAM_SYNTAX),
    ("an endless joint", "text", TEXT.replace("0.1", "1e999"), V.PROGRAM_SYNTAX),
    ("another robot", "text", TEXT.replace("ur5", "puma560"), V.PROGRAM_WRONG_ROBOT),
    ("fewer joints", "text", TEXT.replace(" 0 rad", " rad"), V.PROGRAM_WRONG_ROBOT),
    ("a linear axis", "text", TEXT.replace("ur5", "ur5 linear 1"), V.PROGRAM_INVALID),
    (
        "a linear axis of another robot",
        "json",
        changed(lambda program: program.update(linear_axes=[0])),
        V.PROGRAM_WRONG_ROBOT,
    ),
    ("another format", "text", TEXT.replace("/1", "/2"), V.PROGRAM_SYNTAX),
    ("an unknown field", "json", changed(lambda program: program.update(x=1)), V.PROGRAM_SYNTAX),
    ("a program of another name", "text", TEXT.replace('"main"', "other"), V.PROGRAM_INVALID),
]


@pytest.fixture(scope="module")
def cell() -> WorkingCell:
    return WorkingCell()


@pytest.mark.parametrize(
    ("form", "body", "code"), [each[1:] for each in BAD], ids=[e[0] for e in BAD]
)
def test_a_bad_program_is_refused_by_code_and_not_kept(
    cell: WorkingCell, form: str, body: str, code: V
) -> None:
    refused = cell.upload(body, form=form)
    assert refused["code"] == code, refused
    assert refused["code"] in CATALOGUE
    assert len(refused["text"]) < 1_000
    assert cell.ask(cell.user, "programs.list")["programs"] == []


ONLY_OF_A_CELL = {"another robot", "a program of another name"}
"""What a cell refuses because of what it is, or because of what was asked."""

IN_FILES = [each for each in BAD if each[0] not in ONLY_OF_A_CELL]


def brought_in(body: str) -> ImportedDocument:
    (entry,) = check_entries((program_entry(body, "x"),), "x", lambda kind, name: None)
    return entry


@pytest.mark.parametrize("body", [each[2] for each in IN_FILES], ids=[each[0] for each in IN_FILES])
def test_a_file_with_a_bad_program_is_refused_as_well(body: str) -> None:
    with pytest.raises((BadDocument, UnicodeEncodeError)):
        brought_in(body)


@pytest.mark.parametrize(
    ("form", "body"),
    [
        ("text", TEXT),
        ("json", JSON),
        ("json", json.dumps(json.loads(JSON), indent=2)),
        ("json", "\ufeff" + JSON),
    ],
)
def test_a_file_is_kept_as_the_same_program_that_a_pendant_saves(form: str, body: str) -> None:
    cell = WorkingCell()
    assert "code" not in cell.upload(body, form=form)
    kept = cell.ask(cell.user, "programs.load", name="main", format="json")["body"]
    assert brought_in(body).body == kept


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda program: program["points"][0].update(joints=[0.0] * 5), "6 joints|5 joints"),
        (lambda program: program.update(linear_axes=[0]), "with linear axes 1"),
        (
            lambda program: [each.update(joints=[0.0] * 7) for each in program["points"]],
            "with 7 joints; accepted here: 6 joints",
        ),
        (lambda program: program["statements"][0].update(point="nowhere"), "nowhere"),
        (lambda program: program.update(name="other"), "is 'other'; accepted: 'main'"),
    ],
)
def test_a_program_in_a_file_of_documents_is_judged_by_the_same_rules(
    change: Callable[[dict[str, object]], object], words: str
) -> None:
    entry = ImportedDocument(DocumentKind.PROGRAM, "main", changed(change), where="documents[0]")
    with pytest.raises(BadDocument, match=words):
        check_entries((entry,), "x.json", lambda kind, name: None)


def test_a_program_of_a_robot_that_only_its_cell_knows_comes_in() -> None:
    body = changed(lambda program: program.update(robot="our own arm"))
    assert json.loads(brought_in(body).body)["robot"] == "our own arm"


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"\0",
        b'{"op":"programs.edit","name":"main","expected_revision":0,"edit":' + b"[" * 60_000,
        b'{"op":"programs.save","name":"main","expected_revision":0,"body":"\\ud800"}',
        b'{"op":"programs.save","name":"main","expected_revision":-1,"body":""}',
        b'{"op":"programs.save","name":"main","expected_revision":0,"body":"","parts":1000000}',
        b'{"op":"programs.load","name":"main","offset":-1}',
    ],
)
def test_a_bad_request_about_programs_is_refused(cell: WorkingCell, body: bytes) -> None:
    assert cell.answer_to(body)["code"] in (V.BAD_ARGUMENT, V.PROGRAM_SYNTAX)


def test_a_client_that_goes_on_sending_parts_fills_no_memory(cell: WorkingCell) -> None:
    """200 MB would come in 5,000 such parts; what is kept of them does not grow."""
    piece = "#" + "x" * (PIECE - 1)
    tracemalloc.start()
    try:
        for part in range(1, 201):
            cell.ask(
                cell.user,
                "programs.save",
                name="main",
                body=piece,
                expected_revision=0,
                part=part,
                parts=1_000,
            )
            cell.user.got.clear()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 4 << 20
