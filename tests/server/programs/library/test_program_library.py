import json
import tracemalloc
from collections.abc import Callable
from typing import Any

import pytest
from rigs.cells import memory_store
from rigs.cells.program_cell import HEAD, ProgramCell
from rigs.data.large_programs import PIECE, WorkingCell, large_text
from rigs.peers.server_clients import Pendant

from openpendant.server.exchange.document_check import check_entries, program_entry
from openpendant.server.exchange.text_format import ImportedDocument
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.server.store.documents import DocumentKind, check_name
from openpendant.server.store.store_errors import BadDocument, DiskFull
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.simplemsg.verdicts import VerdictCode as V

TEXT = HEAD.format(name="main") + "move PTP a\nmove PTP b\n"


@pytest.fixture
def cell() -> ProgramCell:
    return ProgramCell()


def save(pendant: Pendant, text: str = TEXT, revision: int = 0) -> int:
    answer = pendant.ask("programs.save", name="main", body=text, expected_revision=revision)
    assert isinstance(answer["revision"], int), answer
    return int(answer["revision"])


def edit(pendant: Pendant, revision: int, **change: object) -> dict[str, object]:
    return pendant.ask("programs.edit", name="main", expected_revision=revision, edit=change)


def body_of(pendant: Pendant, name: str = "main") -> str:
    return str(pendant.ask("programs.load", name=name)["body"])


@pytest.mark.parametrize("form", ["text", "json"])
def test_a_saved_program_is_listed_and_comes_back_as_it_was(cell: ProgramCell, form: str) -> None:
    save(cell.user)
    loaded = cell.user.ask("programs.load", name="main", format=form)
    about = {"name": "main", "format": form, "body": loaded["body"]}
    again = cell.user.ask("programs.save", **about, expected_revision=loaded["revision"])
    assert again["revision"] == 2
    assert cell.user.ask("programs.load", name="main", format=form)["body"] == loaded["body"]
    (listed,) = cell.user.ask("programs.list")["programs"]
    assert (listed["name"], listed["revision"], listed["saved_by"]) == ("main", 2, "holder")


def test_of_two_pendants_the_later_write_is_refused_with_both_revisions(cell: ProgramCell) -> None:
    """Two apps edit one program: nothing of either is lost."""
    other = cell.pendant("other")
    first = save(cell.user)
    assert edit(cell.user, first, edit="comment", at=0, comment="mine")["revision"] == 2
    refused = edit(other, first, edit="comment", at=1, comment="theirs")
    assert (refused["code"], refused["value"], refused["limit"]) == (V.REVISION_CONFLICT, 2, 1)
    assert "mine" in body_of(other)
    assert edit(other, 2, edit="comment", at=1, comment="theirs")["revision"] == 3
    assert "mine" in body_of(other)
    assert "theirs" in body_of(other)


def test_what_another_app_saved_in_between_is_not_undone_over(cell: ProgramCell) -> None:
    revision = save(cell.user)
    edit(cell.user, revision, edit="comment", at=0, comment="mine")
    body = cell.store.load(DocumentKind.PROGRAM, "main").body
    cell.store.save(DocumentKind.PROGRAM, "main", body, expected_revision=2, author="another")
    refused = cell.user.ask("programs.undo", name="main", expected_revision=3)
    assert refused["code"] == V.NOTHING_TO_UNDO


def test_a_taught_point_holds_joints_pose_frame_tool_and_configuration(cell: ProgramCell) -> None:
    cell.user.ask("programs.create", name="main")
    move = {"way": "PTP", "point": "here", "speed": {"kind": "fraction", "value": 0.5}}
    about = {"name": "main", "expected_revision": 1, "point": "here", "move": move}
    assert cell.user.ask("programs.record", **about)["revision"] == 2
    program = json.loads(cell.user.ask("programs.load", name="main", format="json")["body"])
    (point,) = program["points"]
    assert point["joints"] == pytest.approx(cell.position, abs=1e-6)
    assert (point["pose"]["frame"], point["pose"]["tool"]) == ("base", "flange")
    assert point["configuration"]["elbow"] in ("up", "down")
    assert [statement["point"] for statement in program["statements"]] == ["here"]


def test_a_point_is_acknowledged_only_when_the_disk_has_it(cell: ProgramCell) -> None:
    save(cell.user)
    cell.store.failure = DiskFull("store.db: database or disk is full")
    refused = cell.user.ask("programs.record", name="main", expected_revision=1, point="p")
    assert refused["code"] == V.DISK_FULL
    cell.store.failure = None
    assert "point p" not in body_of(cell.user)
    kept = cell.user.ask("programs.record", name="main", expected_revision=1, point="p")
    assert kept["revision"] == 2


DELETE_A: dict[str, Any] = {"edit": "delete-point", "name": "a"}


@pytest.mark.parametrize(
    ("op", "fields", "code"),
    [
        ("load", {"name": "a/b"}, V.BAD_NAME),
        ("load", {"name": "a\0b"}, V.BAD_NAME),
        ("load", {"name": "missing"}, V.NOT_FOUND),
        ("fly", {}, V.BAD_ARGUMENT),
        ("load", {}, V.BAD_ARGUMENT),
        ("save", {"name": "x", "body": TEXT, "expected_revision": 0}, V.PROGRAM_INVALID),
        ("save", {"name": "main", "body": TEXT, "expected_revision": 0}, V.REVISION_CONFLICT),
        ("edit", {"name": "main", "expected_revision": 1, "edit": DELETE_A}, V.POINT_IN_USE),
    ],
)
def test_bad_requests_are_refused_by_code(
    cell: ProgramCell, op: str, fields: dict[str, Any], code: V
) -> None:
    save(cell.user)
    assert cell.user.ask(f"programs.{op}", **fields)["code"] == code


def test_a_program_is_renamed_and_deleted(cell: ProgramCell) -> None:
    save(cell.user)
    renamed = cell.user.ask("programs.rename", name="main", new_name="other", expected_revision=1)
    assert (renamed["name"], renamed["revision"]) == ("other", 1)
    assert 'program "other"' in body_of(cell.user, "other")
    gone = cell.user.ask("programs.delete", name="other", expected_revision=1)
    assert gone["revision"] == 2
    assert cell.user.ask("programs.list")["programs"] == []
    history = cell.user.ask("programs.history", name="other")["programs"]
    assert [entry["deleted"] for entry in history] == [False, True]


def test_parts_out_of_order_are_refused(cell: ProgramCell) -> None:
    about = {"name": "main", "body": "x", "expected_revision": 0, "parts": 3}
    answers = [cell.user.ask("programs.save", **about, part=part) for part in (1, 3, 2)]
    codes = [answer.get("code") for answer in answers]
    assert codes == [None, V.PROGRAM_INVALID, V.PROGRAM_INVALID]


def test_a_dry_run_tells_duration_way_and_every_point_and_moves_nothing(cell: ProgramCell) -> None:
    far = TEXT.replace("point c joints 0.2", "point c joints 9")
    save(cell.user, far + "move LIN c\nwait 3 s\n")
    before = cell.position
    found = cell.user.ask("programs.dry_run", name="main")
    assert cell.position == before
    assert found["duration"] > 3.0
    assert found["refused"] == 2
    (worst, *_) = found["moves"]
    assert (worst["point"], worst["reachable"]) == ("c", False)
    assert [each["point"] for each in found["points"] if not each["reachable"]] == ["c"]
    assert len(found["path"]) > 2
    assert cell.user.ask("programs.dry_run_progress")["running"] is False


def test_a_name_that_no_message_could_carry_is_refused_when_the_program_is_made() -> None:
    """What can be made can be run: the start of a program has 64 bytes for its name."""
    user = ProgramCell().user
    refused = user.ask("programs.create", name="ü" * 33)
    assert (refused["code"], refused["value"], refused["limit"]) == (V.BAD_NAME, 66, 64)
    assert user.ask("programs.create", name="ü" * 32)["revision"] == 1
    renamed = user.ask("programs.rename", name="ü" * 32, new_name="ü" * 33, expected_revision=1)
    assert renamed["code"] == V.BAD_NAME


@pytest.mark.parametrize("name", ["ü" * 64, "𝔭" * 64], ids=["128 bytes", "256 bytes"])
def test_an_older_program_with_a_longer_name_is_listed_loaded_and_renamed(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Up to 64 letters once, whatever their bytes: only its start cannot be asked for any more."""
    cell = ProgramCell()
    with monkeypatch.context() as before:
        before.setattr(memory_store, "check_new_name", check_name)
        cell.keep(name, "wait 1 s\n")
    assert [each["name"] for each in cell.user.ask("programs.list")["programs"]] == [name]
    assert cell.user.ask("programs.load", name=name)["name"] == name
    renamed = cell.user.ask("programs.rename", name=name, new_name="short", expected_revision=1)
    assert (renamed["name"], renamed["revision"]) == ("short", 1)
    assert [each["name"] for each in cell.user.ask("programs.list")["programs"]] == ["short"]
    assert cell.run("short") is V.ACCEPTED


@pytest.mark.parametrize(
    ("name", "says"), [("a/b", "the name of the program has '/'"), ("", "has 0 characters")]
)
def test_a_refusal_of_a_name_speaks_of_the_name(name: str, says: str) -> None:
    refused = ProgramCell().user.ask("programs.create", name=name)
    assert says in str(refused["text"])


ONE_MOVE = HEAD.format(name="main") + "move PTP a\n"
JSON = program_to_json(parse(ONE_MOVE))
LONG = program_to_json(parse(large_text(300, 300)))


def changed(change: Callable[[dict[str, object]], object]) -> str:
    fields = json.loads(JSON)
    change(fields)
    return json.dumps(fields)


def with_point(**fields: object) -> str:
    return changed(lambda program: program["points"][0].update(fields))  # type: ignore[index]


BAD: dict[str, tuple[str, str, V]] = {
    "nothing": ("text", " ", V.PROGRAM_SYNTAX),
    "a text that ends early": ("text", ONE_MOVE[:60], V.PROGRAM_SYNTAX),
    "a header alone that ends early": ("text", ONE_MOVE[:40], V.PROGRAM_SYNTAX),
    "JSON that ends early": ("json", JSON[:-1], V.PROGRAM_SYNTAX),
    "long JSON that ends early": ("json", LONG[: len(LONG) // 2], V.PROGRAM_SYNTAX),
    "JSON lists 10^6 deep": ("json", "[" * 10**6, V.PROGRAM_SYNTAX),
    "JSON objects deep": ("json", '{"format":' * 10**5, V.PROGRAM_SYNTAX),
    "loops 10^6 deep": ("text", ONE_MOVE + "loop\n" * 10**6, V.PROGRAM_TOO_LARGE),
    "loops 10^5 deep": ("text", ONE_MOVE + "loop\n" * 10**5, V.PROGRAM_TOO_LARGE),
    "loops 33 deep": ("text", ONE_MOVE + "loop\n" * 33 + "end\n" * 33, V.PROGRAM_INVALID),
    "NUL in a name": ("text", ONE_MOVE.replace("point b", "point b\0"), V.BAD_NAME),
    "a path as a name": ("text", ONE_MOVE.replace("point b", "point ../b"), V.BAD_NAME),
    "a path as a program": ("text", ONE_MOVE + "call ../../etc/passwd\n", V.BAD_NAME),
    "NUL as a program": ("text", ONE_MOVE + "call a\0b\n", V.BAD_NAME),
    "a path in JSON": ("json", with_point(name="/etc/passwd"), V.BAD_NAME),
    "NUL in JSON": ("json", with_point(name="a\0"), V.BAD_NAME),
    "half a character": ("json", with_point(name="\ud800"), V.PROGRAM_SYNTAX),
    "no joints": ("json", with_point(joints=[]), V.PROGRAM_INVALID),
    "17 joints": ("json", with_point(joints=[0.0] * 17), V.PROGRAM_INVALID),
    "one point of another robot": ("json", with_point(joints=[0.0] * 5), V.PROGRAM_INVALID),
    "a joint that is no number": ("json", with_point(joints=["0"] * 6), V.PROGRAM_SYNTAX),
    "an endless joint": ("text", ONE_MOVE.replace("0.1", "1e999"), V.PROGRAM_SYNTAX),
    "another robot": ("text", ONE_MOVE.replace("ur5", "puma560"), V.PROGRAM_WRONG_ROBOT),
    "fewer joints": ("text", ONE_MOVE.replace(" 0 rad", " rad"), V.PROGRAM_WRONG_ROBOT),
    "a linear axis": ("text", ONE_MOVE.replace("ur5", "ur5 linear 1"), V.PROGRAM_INVALID),
    "another's linear axis": ("json", JSON.replace('axes":[', 'axes":[0'), V.PROGRAM_WRONG_ROBOT),
    "a key twice": ("json", JSON.replace('"name":', '"name":"a","name":', 1), V.PROGRAM_SYNTAX),
    "another format": ("text", ONE_MOVE.replace("/1", "/2"), V.PROGRAM_SYNTAX),
    "an unknown field": ("json", changed(lambda program: program.update(x=1)), V.PROGRAM_SYNTAX),
}


@pytest.fixture(scope="module")
def working() -> WorkingCell:
    return WorkingCell()


@pytest.mark.parametrize(("form", "body", "code"), BAD.values(), ids=BAD)
def test_a_bad_program_is_refused_by_code_and_not_kept(
    working: WorkingCell, form: str, body: str, code: V
) -> None:
    refused = working.upload(body, form=form)
    assert refused["code"] == code, refused
    assert refused["code"] in CATALOGUE
    assert len(refused["text"]) < 1_000
    if len(body) <= PIECE:
        checked = working.ask(working.user, "programs.check", format=form, body=body)
        assert checked | {"text": checked["text"].replace("program:", "main:", 1)} == refused
    assert working.ask(working.user, "programs.list")["programs"] == []


IN_FILES = {name: body for name, (_, body, _) in BAD.items() if name != "another robot"}
"""All but what a cell refuses because of what it is."""


def brought_in(body: str) -> ImportedDocument:
    (entry,) = check_entries((program_entry(body, "x"),), "x", lambda kind, name: None)
    return entry


@pytest.mark.parametrize("body", IN_FILES.values(), ids=IN_FILES)
def test_a_file_with_a_bad_program_is_refused_as_well(body: str) -> None:
    with pytest.raises((BadDocument, UnicodeEncodeError)):
        brought_in(body)


@pytest.mark.parametrize(
    ("form", "body"),
    [
        ("text", ONE_MOVE),
        ("json", JSON),
        ("json", json.dumps(json.loads(JSON), indent=2)),
        ("text", "\ufeff" + ONE_MOVE),
        ("json", "\ufeff" + JSON),
    ],
)
def test_a_file_is_kept_as_the_same_program_that_a_pendant_saves(form: str, body: str) -> None:
    working = WorkingCell()
    checked = working.ask(working.user, "programs.check", format=form, body=body)
    assert checked["statements"] == 1
    assert "code" not in working.upload(body, form=form)
    kept = working.ask(working.user, "programs.load", name="main", format="json")["body"]
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
def test_a_bad_request_about_programs_is_refused(working: WorkingCell, body: bytes) -> None:
    assert working.answer_to(body)["code"] in (V.BAD_ARGUMENT, V.PROGRAM_SYNTAX)


def test_a_client_that_goes_on_sending_parts_fills_no_memory(working: WorkingCell) -> None:
    """200 MB would come in 5,000 such parts; what is kept of them does not grow."""
    body = "#" + "x" * (PIECE - 1)
    about = {"name": "main", "body": body, "expected_revision": 0, "parts": 1_000}
    tracemalloc.start()
    try:
        for part in range(1, 201):
            working.ask(working.user, "programs.save", **about, part=part)
            working.user.got.clear()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 4 << 20
