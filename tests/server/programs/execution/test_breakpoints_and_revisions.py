"""Breakpoints follow their statements; a run is of exactly the revision that was asked for."""

from typing import Any

import pytest
from rigs.cells.program_cell import BODY_LINE, HEAD, A, ProgramCell

from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.pendant import ProgramState, RunKind, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME, STOP = messages.MotionControlAction
B = (0.1, *A[1:])
THREE = "move PTP a\nmove PTP b\nmove PTP c\n"
NEW = [{"statement": "comment", "comment": "new"}, {"statement": "wait", "duration": 0.1}]
LOST = "breakpoints dropped, their statements are gone: 1 of 'main'"


@pytest.fixture
def cell() -> ProgramCell:
    made = ProgramCell(main=THREE)
    assert breakpoints(made, 2)["statements"] == [2]
    return made


def breakpoints(cell: ProgramCell, *statements: int, name: str = "main") -> dict[str, Any]:
    return cell.user.ask("programs.breakpoints", name=name, statements=statements)


def edit(cell: ProgramCell, revision: int, kind: str, **fields: Any) -> dict[str, Any]:
    about = {"edit": kind, **fields}
    return cell.user.ask("programs.edit", name="main", expected_revision=revision, edit=about)


def shown(cell: ProgramCell, name: str = "main") -> list[int]:
    found: list[int] = cell.user.ask("programs.load", name=name).get("breakpoints", [])
    return found


def pauses_at(cell: ProgramCell, name: str = "main") -> list[str]:
    lines = cell.user.ask("programs.load", name=name)["body"].splitlines()
    assert cell.run(name) is V.ACCEPTED
    paused: list[str] = []
    for _ in range(10):
        for _ in range(1_000):
            last = cell.reports()[-1]
            if last.state in (ProgramState.AT_BREAKPOINT, ProgramState.NONE):
                break
            cell.pass_time(10)
        if last.state != ProgramState.AT_BREAKPOINT:
            break
        paused.append(lines[last.line - 1])
        assert cell.control(RESUME) is V.ACCEPTED
    assert cell.until_outcomes()[-1] is V.ACCEPTED
    return paused


EDITS: dict[str, tuple[dict[str, Any], list[int]]] = {
    "inserted before": ({"kind": "insert", "at": 0, "statements": NEW}, [4]),
    "inserted behind": ({"kind": "insert", "statements": NEW}, [2]),
    "deleted before": ({"kind": "delete", "first": 0, "count": 2}, [0]),
    "deleted itself": ({"kind": "delete", "first": 2}, []),
    "moved": ({"kind": "reorder", "first": 2, "count": 1, "to": 0}, [0]),
    "made way": ({"kind": "reorder", "first": 0, "count": 1, "to": 2}, [1]),
    "replaced": ({"kind": "comment", "at": 2, "comment": "slow"}, [2]),
    "its point renamed": ({"kind": "rename-point", "name": "c", "new_name": "far"}, [2]),
}


@pytest.mark.parametrize("what", EDITS)
def test_a_breakpoint_follows_an_edit_and_its_undo_and_redo(cell: ProgramCell, what: str) -> None:
    fields, expected = EDITS[what]
    answer = edit(cell, 1, **fields)
    assert (answer["breakpoints"], shown(cell)) == (expected, expected)
    assert answer.get("dropped_breakpoints", 0) == (0 if expected else 1)
    back = cell.user.ask("programs.undo", name="main", expected_revision=2)
    assert back["breakpoints"] == ([2] if expected else [])
    again = cell.user.ask("programs.redo", name="main", expected_revision=3)
    assert again["breakpoints"] == expected


def test_a_run_pauses_at_the_statement_that_others_were_put_before(cell: ProgramCell) -> None:
    edit(cell, 1, "insert", at=0, statements=NEW)
    assert pauses_at(cell) == ["move PTP c"]


def test_a_move_that_is_recorded_before_it_shifts_a_breakpoint(cell: ProgramCell) -> None:
    move = {"statement": "move", "way": "PTP", "point": "here"}
    about = {"name": "main", "expected_revision": 1, "point": "here", "move": move, "at": 0}
    assert cell.user.ask("programs.record", **about)["breakpoints"] == [3]


def test_breakpoints_go_along_to_a_new_name(cell: ProgramCell) -> None:
    about = {"name": "main", "new_name": "other", "expected_revision": 1}
    assert cell.user.ask("programs.rename", **about)["breakpoints"] == [2]
    assert shown(cell, "other") == [2]
    assert pauses_at(cell, "other") == ["move PTP c"]


def test_a_program_of_the_same_name_has_none_of_one_that_was_deleted(cell: ProgramCell) -> None:
    cell.user.ask("programs.delete", name="main", expected_revision=1)
    cell.keep("main", THREE, expected_revision=0)
    assert (shown(cell), pauses_at(cell)) == ([], [])


def test_a_text_that_is_saved_keeps_breakpoints_it_still_has(cell: ProgramCell) -> None:
    breakpoints(cell, 0, 1, 2)
    body = HEAD.format(name="main") + "wait 0.1 s\nmove PTP a\nmove PTP c\n"
    answer = cell.user.ask("programs.save", name="main", body=body, expected_revision=1)
    assert (answer["breakpoints"], answer["dropped_breakpoints"]) == ([1, 2], 1)
    assert pauses_at(cell) == ["move PTP a", "move PTP c"]


def test_a_save_from_elsewhere_is_followed_at_the_next_run(cell: ProgramCell) -> None:
    cell.keep("main", "wait 0.1 s\n" + THREE, expected_revision=1)
    assert pauses_at(cell) == ["move PTP c"]
    assert shown(cell) == [3]


def test_everybody_hears_of_breakpoints_that_went_with_their_statements(cell: ProgramCell) -> None:
    cell.keep("main", "move PTP b\nwait 0.1 s\n", expected_revision=1)
    assert pauses_at(cell) == []
    assert LOST in [report.text for report in cell.reports()]
    before = len(cell.reports())
    pauses_at(cell)
    assert LOST not in [report.text for report in cell.reports()[before:]]


def test_breakpoints_of_a_revision_that_is_kept_no_more_are_dropped(cell: ProgramCell) -> None:
    cell.keep("main", THREE, expected_revision=1)
    del cell.store._revisions[DocumentKind.PROGRAM, "main"][0]
    assert shown(cell) == []
    assert cell.user.ask("programs.load", name="main")["dropped_breakpoints"] == 1


def test_an_edit_during_a_run_leaves_its_breakpoints_where_they_are(cell: ProgramCell) -> None:
    assert cell.run() is V.ACCEPTED
    edit(cell, 1, "insert", at=0, statements=NEW)
    cell.until_state(ProgramState.AT_BREAKPOINT)
    assert cell.reports()[-1].line == BODY_LINE + 2
    assert cell.position == pytest.approx(B, abs=1e-5)


def test_breakpoints_set_during_a_run_are_found_in_the_revision_that_runs() -> None:
    cell = ProgramCell(main="wait 2 s\n" + THREE)
    assert cell.run() is V.ACCEPTED
    edit(cell, 1, "insert", at=0, statements=NEW)
    answer = breakpoints(cell, 0, 5)
    assert (answer["statements"], answer["revision"], answer["next_run"]) == ([0, 5], 2, [0])
    cell.until_state(ProgramState.AT_BREAKPOINT)
    assert cell.reports()[-1].line == BODY_LINE + 3
    assert shown(cell) == [0, 5]


@pytest.mark.parametrize("state", ["running", "paused"])
def test_breakpoints_of_a_program_under_way_are_for_whoever_has_the_authority(state: str) -> None:
    cell = ProgramCell(main="call part\nwait 2 s\n", part="move PTP b\n", other=THREE)
    observer = cell.pendant("observer")
    cell.run()
    if state == "paused":
        assert cell.control(PAUSE) is V.ACCEPTED
    for name in ("main", "part"):
        for statements in ([0], []):
            about = {"name": name, "statements": statements}
            refused = observer.ask("programs.breakpoints", **about)
            assert refused["code"] == V.HELD_BY_OTHER
            assert f"for {name!r}, which is under way; holder is in control" in refused["text"]
    assert observer.ask("programs.breakpoints", name="other", statements=[0])["statements"] == [0]
    assert breakpoints(cell, 1)["statements"] == [1]


def test_anybody_may_set_breakpoints_of_a_program_that_is_not_under_way() -> None:
    cell = ProgramCell(main=THREE)
    observer = cell.pendant("observer")
    assert observer.ask("programs.breakpoints", name="main", statements=[2])["statements"] == [2]
    assert pauses_at(cell) == ["move PTP c"]


def test_a_program_of_another_robot_is_neither_edited_nor_given_breakpoints() -> None:
    cell = ProgramCell()
    program = parse(HEAD.format(name="main").replace("ur5", "puma560") + THREE)
    kind, body = DocumentKind.PROGRAM, program_to_json(program)
    cell.store.save(kind, "main", body, expected_revision=0, author="test")
    described, cut = edit(cell, 1, "describe", comment="z"), edit(cell, 1, "delete", first=99)
    for refused in (described, cut, breakpoints(cell, 1)):
        assert refused["code"] == V.PROGRAM_WRONG_ROBOT
        assert "'puma560'" in refused["text"]
        assert "'ur5'" in refused["text"]


ANOTHER = "accepted: that, or another after a program stop"
LOOPS, SECOND_AT = "move PTP a\nmove PTP b\n", BODY_LINE + 1


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"loops": 3}, "is under way once; accepted: loops 1 to go on, or 3 after a program stop"),
        ({"loops": 0}, "is under way once; accepted: loops 1 to go on, or 0 after a program stop"),
        ({"line": SECOND_AT}, f"line 0 to go on there, or line {SECOND_AT} after a program stop"),
        *(({"program": "other", "kind": kind}, ANOTHER) for kind in RunKind),
    ],
)
def test_a_paused_program_goes_on_as_it_was_begun_or_the_request_is_refused(
    fields: dict[str, Any], said: str
) -> None:
    cell = ProgramCell(main=LOOPS, other=LOOPS)
    cell.run()
    cell.pass_time(200)
    cell.control(PAUSE)
    cell.pass_time(1_000)
    stood = cell.position
    assert cell.run(**fields) is V.PROGRAM_RUNNING
    assert said in cell.user.all(Verdict)[-1].text
    cell.pass_time(1_000)
    assert cell.position == stood
    assert (cell.user.outcomes(), cell.run()) == ([], V.ACCEPTED)
    assert cell.until_outcomes(2) == [V.ACCEPTED, V.ACCEPTED]
    assert cell.reports()[-1].loop == 1


def test_a_step_is_taken_whatever_the_loops_of_the_run() -> None:
    cell = ProgramCell(main=LOOPS)
    cell.run(kind=RunKind.STEP_FORWARD, loops=2)
    cell.until_outcomes(1)
    assert cell.run(kind=RunKind.STEP_FORWARD) is V.ACCEPTED
    cell.until_outcomes(2)
    assert cell.run(loops=2) is V.ACCEPTED
    assert cell.until_outcomes(3)[-1] is V.ACCEPTED
    assert cell.reports()[-1].loop == 2


@pytest.mark.parametrize("statement", [4, 999])
def test_a_breakpoint_at_no_statement_is_refused_with_their_number(statement: int) -> None:
    cell = ProgramCell(main="move PTP a\nmove PTP b\nmove PTP c\nmove PTP a\n")
    refused = cell.user.ask("programs.breakpoints", name="main", statements=[0, statement])
    assert refused["code"] == V.BAD_ARGUMENT
    assert f"statement {statement}" in refused["text"]
    assert f"has 4; accepted: 0 to 3, which is line {BODY_LINE + 3}" in refused["text"]
    assert "breakpoints" not in cell.user.ask("programs.load", name="main")


def test_breakpoints_of_a_program_that_is_gone_can_be_taken_away_but_not_set() -> None:
    cell = ProgramCell()
    assert breakpoints(cell, 0)["code"] == V.NOT_FOUND
    assert breakpoints(cell)["statements"] == []


ALL, FORWARD, BACKWARD = RunKind
FIRST = "move PTP a\nmove PTP b\nmove PTP a\n"
SECOND = "move PTP a\nmove PTP c\n"


@pytest.fixture
def edited() -> ProgramCell:
    """A cell whose program somebody else saved once more: revision 2 is kept."""
    cell = ProgramCell(main=FIRST)
    cell.keep("main", SECOND, expected_revision=1)
    return cell


@pytest.fixture
def stepped() -> ProgramCell:
    """A cell where the first step of revision 1 is done, and revision 2 was saved since."""
    cell = ProgramCell(main=FIRST)
    assert cell.run(kind=FORWARD, revision=1) is V.ACCEPTED
    cell.until_outcomes(1)
    cell.keep("main", SECOND, expected_revision=1)
    return cell


def verdict(cell: ProgramCell) -> Verdict:
    return cell.user.all(Verdict)[-1]


@pytest.mark.parametrize("revision", [2, 0], ids=["the one that is kept", "the newest"])
def test_the_revision_that_is_kept_runs_and_is_told(edited: ProgramCell, revision: int) -> None:
    assert edited.run(revision=revision) is V.ACCEPTED
    assert edited.reports()[-1].revision == 2
    assert edited.until_outcomes() == [V.ACCEPTED]
    last = edited.reports()[-1]
    assert (last.state, last.program, last.revision) == (ProgramState.NONE, "main", 2)


@pytest.mark.parametrize("kind", [ALL, FORWARD])
@pytest.mark.parametrize("asked", [1, 3])
@pytest.mark.parametrize("line", [0, BODY_LINE + 1])
def test_no_other_revision_runs_and_both_are_named(
    edited: ProgramCell, kind: RunKind, asked: int, line: int
) -> None:
    before = edited.position
    assert edited.run(kind=kind, revision=asked, line=line) is V.REVISION_CONFLICT
    told = verdict(edited)
    assert (told.value, told.limit) == (2.0, float(asked))
    assert told.text.startswith(f"revision {asked} was asked for, revision 2 is kept: ")
    edited.pass_time(1_000)
    assert (edited.position, edited.motions) == (before, [])
    assert edited.core.cell.activity is messages.Activity.IDLE
    assert edited.run(revision=2) is V.ACCEPTED


def test_the_longest_names_leave_both_revisions_in_the_text(edited: ProgramCell) -> None:
    name = "x" * 64
    body = program_to_json(parse(HEAD.format(name=name) + FIRST))
    edited.store.save(DocumentKind.PROGRAM, name, body, expected_revision=0, author="y" * 64)
    assert edited.run(name, revision=2_147_483_647) is V.REVISION_CONFLICT
    assert "revision 2147483647 was asked for, revision 1 is kept" in verdict(edited).text


def test_a_revision_below_zero_is_no_revision(edited: ProgramCell) -> None:
    assert edited.run(revision=-1) is V.BAD_ARGUMENT
    assert verdict(edited).text == "revision -1; accepted: 0 for the newest, or from 1"


def test_a_program_that_was_deleted_is_not_found_whatever_the_revision(edited: ProgramCell) -> None:
    edited.store.delete(DocumentKind.PROGRAM, "main", expected_revision=2, author="test")
    assert edited.run(revision=2) is V.NOT_FOUND


def test_one_that_was_made_anew_after_a_deletion_is_another(edited: ProgramCell) -> None:
    edited.store.delete(DocumentKind.PROGRAM, "main", expected_revision=2, author="test")
    edited.keep("main", FIRST)
    assert edited.run(revision=1) is V.REVISION_CONFLICT
    assert verdict(edited).value == 4.0


def test_a_recording_is_no_program_whatever_the_revision(edited: ProgramCell) -> None:
    edited.store.save(DocumentKind.RECORDING, "swing", "{}", expected_revision=0, author="test")
    assert edited.run("swing", revision=1) is V.NOT_FOUND


@pytest.mark.parametrize("kind", [ALL, FORWARD, BACKWARD, None], ids=str)
@pytest.mark.parametrize("revision", [0, 1])
def test_a_paused_run_goes_on_as_the_revision_that_it_began_with(
    stepped: ProgramCell, kind: RunKind | None, revision: int
) -> None:
    """By another run of it, or by a resume."""
    if kind is BACKWARD:  # which takes two points to go between
        stepped.run(kind=FORWARD, revision=1)
        stepped.until_outcomes(2)
    before = len(stepped.user.outcomes())
    goes_on = stepped.run(kind=kind, revision=revision) if kind else stepped.control(RESUME)
    assert goes_on is V.ACCEPTED
    assert stepped.until_outcomes(before + 1)[-1] is V.ACCEPTED
    assert {report.revision for report in stepped.reports()} == {1}


@pytest.mark.parametrize("kind", [ALL, FORWARD, BACKWARD])
def test_a_paused_run_does_not_turn_into_the_revision_saved_since(
    stepped: ProgramCell, kind: RunKind
) -> None:
    before, motions = stepped.position, len(stepped.motions)
    assert stepped.run(kind=kind, revision=2) is V.REVISION_CONFLICT
    told = verdict(stepped)
    assert (told.value, told.limit) == (1.0, 2.0)
    assert told.text == (
        "revision 2 was asked for, revision 1 of program 'main' is under way;"
        " accepted: 1, or 2 after a program stop"
    )
    stepped.pass_time(1_000)
    assert (stepped.position, len(stepped.motions)) == (before, motions)
    assert stepped.reports()[-1].state == ProgramState.STEPPED
    assert stepped.run(kind=FORWARD, revision=1) is V.ACCEPTED


def test_after_a_program_stop_the_revision_saved_since_runs(stepped: ProgramCell) -> None:
    stepped.control(STOP)
    assert stepped.run(revision=1) is V.REVISION_CONFLICT
    assert stepped.run(revision=2) is V.ACCEPTED
    assert stepped.reports()[-1].revision == 2


def test_the_revision_asked_for_is_of_the_named_program_alone() -> None:
    """What it calls is the newest; each place is told with the revision of its own program."""
    cell = ProgramCell(main="call inner\nwait 1 s\n", inner="wait 1 s\n")
    for before in (1, 2):
        cell.keep("inner", "move PTP b\n", expected_revision=before)
    assert cell.run(revision=1) is V.ACCEPTED
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert cell.position == pytest.approx(B, abs=1e-5)
    told = {(report.program, report.revision) for report in cell.reports()}
    assert told == {("main", 1), ("inner", 3)}


def test_who_comes_later_sees_which_revision_runs(edited: ProgramCell) -> None:
    edited.run(kind=FORWARD)
    edited.until_outcomes()
    edited.keep("main", FIRST, expected_revision=2)
    shown = edited.user.ask("snapshot")["program"]
    assert (shown["name"], shown["state"], shown["revision"]) == ("main", "stepped", 2)


def test_a_dry_run_tells_the_revision_that_it_walked_through(edited: ProgramCell) -> None:
    assert edited.user.ask("programs.dry_run", name="main")["revision"] == 2


def test_a_program_kept_under_another_name_has_the_revision_it_is_kept_as() -> None:
    cell = ProgramCell()
    kind, body = DocumentKind.PROGRAM, program_to_json(parse(HEAD.format(name="main") + FIRST))
    for before in (0, 1):
        cell.store.save(kind, "copy", body, expected_revision=before, author="test")
    assert cell.run("copy", revision=1) is V.REVISION_CONFLICT
    assert cell.run("copy", revision=2) is V.ACCEPTED
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert {(each.program, each.revision) for each in cell.reports()} == {("main", 2)}
