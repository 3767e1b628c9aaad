from __future__ import annotations

import json

import pytest
from rigs.cells import memory_store
from rigs.cells.program_cell import HEAD, A, ProgramCell, ask
from rigs.peers.server_clients import Pendant

from openpendant.server.programs.library.program_library import CHUNK
from openpendant.server.store.documents import DocumentKind, check_name
from openpendant.server.store.store_errors import DiskFull
from openpendant.simplemsg.verdicts import VerdictCode as V

TEXT = HEAD.format(name="main") + "move PTP a\nmove PTP b\n"


@pytest.fixture
def cell() -> ProgramCell:
    return ProgramCell()


def save(pendant: Pendant, text: str = TEXT, revision: int = 0) -> int:
    answer = ask(pendant, "programs.save", name="main", body=text, expected_revision=revision)
    assert isinstance(answer["revision"], int), answer
    return int(answer["revision"])


def edit(pendant: Pendant, revision: int, **change: object) -> dict[str, object]:
    return ask(pendant, "programs.edit", name="main", expected_revision=revision, edit=change)


def body_of(pendant: Pendant, name: str = "main") -> str:
    return str(ask(pendant, "programs.load", name=name)["body"])


@pytest.mark.parametrize("form", ["text", "json"])
def test_a_saved_program_is_listed_and_comes_back_as_it_was(cell: ProgramCell, form: str) -> None:
    save(cell.user)
    loaded = ask(cell.user, "programs.load", name="main", format=form)
    again = ask(
        cell.user,
        "programs.save",
        name="main",
        format=form,
        body=loaded["body"],
        expected_revision=loaded["revision"],
    )
    assert again["revision"] == 2
    assert ask(cell.user, "programs.load", name="main", format=form)["body"] == loaded["body"]
    (listed,) = ask(cell.user, "programs.list")["programs"]
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


def test_whole_programs_conflict_too(cell: ProgramCell) -> None:
    other = cell.pendant("other")
    first = save(cell.user)
    save(cell.user, revision=first)
    refused = ask(other, "programs.save", name="main", body=TEXT, expected_revision=first)
    assert refused["code"] == V.REVISION_CONFLICT


def test_edits_are_undone_and_redone_as_new_revisions(cell: ProgramCell) -> None:
    revision = save(cell.user)
    before = body_of(cell.user)
    edit(cell.user, revision, edit="delete", first=1)
    after = body_of(cell.user)
    undone = ask(cell.user, "programs.undo", name="main", expected_revision=2)
    assert body_of(cell.user) == before
    redone = ask(cell.user, "programs.redo", name="main", expected_revision=undone["revision"])
    assert body_of(cell.user) == after
    assert redone["revision"] == 4
    nothing = ask(cell.user, "programs.redo", name="main", expected_revision=4)
    assert nothing["code"] == V.NOTHING_TO_UNDO


def test_what_another_app_saved_in_between_is_not_undone_over(cell: ProgramCell) -> None:
    revision = save(cell.user)
    edit(cell.user, revision, edit="comment", at=0, comment="mine")
    stored = cell.store.load(DocumentKind.PROGRAM, "main")
    cell.store.save(
        DocumentKind.PROGRAM, "main", stored.body, expected_revision=2, author="another server"
    )
    refused = ask(cell.user, "programs.undo", name="main", expected_revision=3)
    assert refused["code"] == V.NOTHING_TO_UNDO


def test_a_taught_point_holds_joints_pose_frame_tool_and_configuration(cell: ProgramCell) -> None:
    ask(cell.user, "programs.create", name="main")
    answer = ask(
        cell.user,
        "programs.record",
        name="main",
        expected_revision=1,
        point="here",
        move={"way": "PTP", "point": "here", "speed": {"kind": "fraction", "value": 0.5}},
    )
    assert answer["revision"] == 2
    program = json.loads(ask(cell.user, "programs.load", name="main", format="json")["body"])
    (point,) = program["points"]
    assert point["joints"] == pytest.approx(cell.position, abs=1e-6)
    assert (point["pose"]["frame"], point["pose"]["tool"]) == ("base", "flange")
    assert point["configuration"]["elbow"] in ("up", "down")
    assert [statement["point"] for statement in program["statements"]] == ["here"]


def test_a_point_is_touched_up_where_the_robot_stands_now(cell: ProgramCell) -> None:
    save(cell.user)
    cell.user.move(*A)
    cell.pass_time(3_000)
    ask(cell.user, "programs.touch_up", name="main", expected_revision=1, point="b")
    program = json.loads(ask(cell.user, "programs.load", name="main", format="json")["body"])
    assert program["points"][1]["joints"] == pytest.approx(A, abs=1e-6)


def test_no_point_is_taught_while_the_robot_moves(cell: ProgramCell) -> None:
    save(cell.user)
    cell.user.move(*A)
    cell.pass_time(100)
    refused = ask(cell.user, "programs.touch_up", name="main", expected_revision=1, point="b")
    assert refused["code"] == V.MOVING


def test_a_point_is_acknowledged_only_when_the_disk_has_it(cell: ProgramCell) -> None:
    save(cell.user)
    cell.store.failure = DiskFull("store.db: database or disk is full")
    refused = ask(cell.user, "programs.record", name="main", expected_revision=1, point="p")
    assert refused["code"] == V.DISK_FULL
    cell.store.failure = None
    assert "point p" not in body_of(cell.user)
    kept = ask(cell.user, "programs.record", name="main", expected_revision=1, point="p")
    assert kept["revision"] == 2


def test_a_text_that_is_no_program_is_refused_with_line_and_column(cell: ProgramCell) -> None:
    text = TEXT + "move PTX a\n"
    refused = ask(cell.user, "programs.check", body=text)
    assert (refused["line"], refused["column"]) == (8, 6)
    assert ask(cell.user, "programs.check", body=TEXT)["statements"] == 2


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({"op": "programs.check", "body": TEXT.replace("ur5", "puma560")}, V.PROGRAM_WRONG_ROBOT),
        ({"op": "programs.load", "name": "a/b"}, V.BAD_NAME),
        ({"op": "programs.load", "name": "a\0b"}, V.BAD_NAME),
        ({"op": "programs.load", "name": "missing"}, V.NOT_FOUND),
        ({"op": "programs.fly"}, V.BAD_ARGUMENT),
        ({"op": "programs.load"}, V.BAD_ARGUMENT),
        (
            {"op": "programs.save", "name": "x", "body": TEXT, "expected_revision": 0},
            V.PROGRAM_INVALID,
        ),
        (
            {
                "op": "programs.edit",
                "name": "main",
                "expected_revision": 1,
                "edit": {"edit": "delete-point", "name": "a"},
            },
            V.POINT_IN_USE,
        ),
    ],
)
def test_bad_requests_are_refused_by_code(
    cell: ProgramCell, change: dict[str, object], code: V
) -> None:
    save(cell.user)
    op = str(change.pop("op"))
    assert ask(cell.user, op, **change)["code"] == code


def test_a_program_is_renamed_and_deleted(cell: ProgramCell) -> None:
    save(cell.user)
    renamed = ask(cell.user, "programs.rename", name="main", new_name="other", expected_revision=1)
    assert (renamed["name"], renamed["revision"]) == ("other", 1)
    assert 'program "other"' in body_of(cell.user, "other")
    gone = ask(cell.user, "programs.delete", name="other", expected_revision=1)
    assert gone["revision"] == 2
    assert ask(cell.user, "programs.list")["programs"] == []
    history = ask(cell.user, "programs.history", name="other")["programs"]
    assert [entry["deleted"] for entry in history] == [False, True]


def test_a_long_program_goes_and_comes_in_parts(cell: ProgramCell) -> None:
    points = "".join(f"point p{n} joints 0 -1 1 -1 -1 0.{n} rad\n" for n in range(1_900))
    text = 'openpendant-program/1\nprogram "main" robot ur5\n' + points
    pieces = [text[place : place + 40_000] for place in range(0, len(text), 40_000)]
    for part, piece in enumerate(pieces, 1):
        answer = ask(
            cell.user,
            "programs.save",
            name="main",
            body=piece,
            expected_revision=0,
            part=part,
            parts=len(pieces),
        )
    assert answer["revision"] == 1
    came = ""
    offset: int | None = 0
    while offset is not None:
        answer = ask(cell.user, "programs.load", name="main", offset=offset)
        assert len(answer["body"]) <= CHUNK
        came, offset = came + answer["body"], answer["next"]
    assert ask(cell.user, "programs.check", body=came[:10])["code"] == V.PROGRAM_SYNTAX
    assert came.count("\npoint ") == 1_900


def test_parts_out_of_order_are_refused(cell: ProgramCell) -> None:
    def part(number: int) -> dict[str, object]:
        return ask(
            cell.user,
            "programs.save",
            name="main",
            body="x",
            expected_revision=0,
            part=number,
            parts=3,
        )

    assert "code" not in part(1)
    assert part(3)["code"] == V.PROGRAM_INVALID
    assert part(2)["code"] == V.PROGRAM_INVALID


def test_a_dry_run_tells_duration_way_and_every_point_and_moves_nothing(cell: ProgramCell) -> None:
    far = TEXT.replace("point c joints 0.2", "point c joints 9")
    save(cell.user, far + "move LIN c\nwait 3 s\n")
    before = cell.position
    found = ask(cell.user, "programs.dry_run", name="main")
    assert cell.position == before
    assert found["duration"] > 3.0
    assert found["refused"] == 2
    (worst, *_) = found["moves"]
    assert (worst["point"], worst["reachable"]) == ("c", False)
    assert [each["point"] for each in found["points"] if not each["reachable"]] == ["c"]
    assert len(found["path"]) > 2
    assert ask(cell.user, "programs.dry_run_progress")["running"] is False


def test_a_name_that_no_message_could_carry_is_refused_when_the_program_is_made() -> None:
    """What can be made can be run: the start of a program has 64 bytes for its name."""
    user = ProgramCell().user
    refused = ask(user, "programs.create", name="ü" * 33)
    assert (refused["code"], refused["value"], refused["limit"]) == (V.BAD_NAME, 66, 64)
    assert ask(user, "programs.create", name="ü" * 32)["revision"] == 1
    renamed = ask(user, "programs.rename", name="ü" * 32, new_name="ü" * 33, expected_revision=1)
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
    assert [each["name"] for each in ask(cell.user, "programs.list")["programs"]] == [name]
    assert ask(cell.user, "programs.load", name=name)["name"] == name
    renamed = ask(cell.user, "programs.rename", name=name, new_name="short", expected_revision=1)
    assert (renamed["name"], renamed["revision"]) == ("short", 1)
    assert [each["name"] for each in ask(cell.user, "programs.list")["programs"]] == ["short"]
    assert cell.run("short") is V.ACCEPTED


@pytest.mark.parametrize(
    ("name", "says"), [("a/b", "the name of the program has '/'"), ("", "has 0 characters")]
)
def test_a_refusal_of_a_name_speaks_of_the_name(name: str, says: str) -> None:
    refused = ask(ProgramCell().user, "programs.create", name=name)
    assert says in str(refused["text"])


ONE_MOVE = HEAD.format(name="main") + "move PTP a\n"
NO_STATEMENT = '{"format":"openpendant-program/1","name":"main","robot":"ur5"}'


@pytest.mark.parametrize(("form", "body"), [("text", ONE_MOVE), ("json", NO_STATEMENT)])
def test_a_byte_order_mark_in_front_changes_nothing(form: str, body: str) -> None:
    cell = ProgramCell()
    marked = "\ufeff" + body
    assert "code" not in ask(cell.user, "programs.check", format=form, body=marked)
    saved = {"name": "main", "format": form, "body": marked, "expected_revision": 0}
    assert ask(cell.user, "programs.save", **saved)["revision"] == 1
    loaded = ask(cell.user, "programs.load", name="main", format=form)["body"]
    assert not str(loaded).startswith("\ufeff")


def test_a_key_that_stands_twice_is_refused() -> None:
    body = NO_STATEMENT.replace('"name":"main"', '"name":"main","name":"other"')
    refused = ask(ProgramCell().user, "programs.check", format="json", body=body)
    assert refused["code"] == V.PROGRAM_SYNTAX
    assert "has the key 'name' twice" in str(refused["text"])
