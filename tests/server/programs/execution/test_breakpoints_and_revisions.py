from __future__ import annotations

from typing import Any

import pytest
from rigs.cells.program_cell import BODY_LINE, HEAD, ProgramCell, ask

from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant import MotionControlAction, ProgramState, RunKind, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME, STOP = MotionControlAction
THREE = "move PTP a\nmove PTP b\nmove PTP c\n"
NEW = [{"statement": "comment", "comment": "new"}, {"statement": "wait", "duration": 0.1}]
LOST = "breakpoints dropped, their statements are gone: 1 of 'main'"


@pytest.fixture
def cell() -> ProgramCell:
    made = ProgramCell(main=THREE)
    assert breakpoints(made, 2)["statements"] == [2]
    return made


def breakpoints(cell: ProgramCell, *statements: int, name: str = "main") -> dict[str, Any]:
    return ask(cell.user, "programs.breakpoints", name=name, statements=statements)


def edit(cell: ProgramCell, revision: int, kind: str, **fields: Any) -> dict[str, Any]:
    about = {"edit": kind, **fields}
    return ask(cell.user, "programs.edit", name="main", expected_revision=revision, edit=about)


def shown(cell: ProgramCell, name: str = "main") -> list[int]:
    found: list[int] = ask(cell.user, "programs.load", name=name).get("breakpoints", [])
    return found


def save(cell: ProgramCell, statements: str, revision: int = 1) -> dict[str, Any]:
    body = HEAD.format(name="main") + statements
    about = {"name": "main", "body": body, "expected_revision": revision}
    return ask(cell.user, "programs.save", **about)


def pauses_at(cell: ProgramCell, name: str = "main") -> list[str]:
    lines = ask(cell.user, "programs.load", name=name)["body"].splitlines()
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
    back = ask(cell.user, "programs.undo", name="main", expected_revision=2)
    assert back["breakpoints"] == ([2] if expected else [])
    again = ask(cell.user, "programs.redo", name="main", expected_revision=3)
    assert again["breakpoints"] == expected


def test_a_run_pauses_at_the_statement_after_statements_were_put_before_it(
    cell: ProgramCell,
) -> None:
    edit(cell, 1, "insert", at=0, statements=NEW)
    assert pauses_at(cell) == ["move PTP c"]


def test_a_move_that_is_recorded_before_it_shifts_a_breakpoint(cell: ProgramCell) -> None:
    move = {"statement": "move", "way": "PTP", "point": "here"}
    about = {"name": "main", "expected_revision": 1, "point": "here", "move": move, "at": 0}
    assert ask(cell.user, "programs.record", **about)["breakpoints"] == [3]


def test_breakpoints_go_along_to_a_new_name(cell: ProgramCell) -> None:
    about = {"name": "main", "new_name": "other", "expected_revision": 1}
    assert ask(cell.user, "programs.rename", **about)["breakpoints"] == [2]
    assert shown(cell, "other") == [2]
    assert pauses_at(cell, "other") == ["move PTP c"]


def test_a_program_of_the_same_name_has_none_of_one_that_was_deleted(cell: ProgramCell) -> None:
    ask(cell.user, "programs.delete", name="main", expected_revision=1)
    cell.keep("main", THREE, expected_revision=0)
    assert (shown(cell), pauses_at(cell)) == ([], [])


def test_a_text_that_is_saved_keeps_breakpoints_it_still_has(cell: ProgramCell) -> None:
    breakpoints(cell, 0, 1, 2)
    answer = save(cell, "wait 0.1 s\nmove PTP a\nmove PTP c\n")
    assert (answer["breakpoints"], answer["dropped_breakpoints"]) == ([1, 2], 1)
    assert pauses_at(cell) == ["move PTP a", "move PTP c"]


def test_a_save_from_elsewhere_is_followed_at_the_next_run(cell: ProgramCell) -> None:
    cell.keep("main", "wait 0.1 s\n" + THREE, expected_revision=1)
    assert pauses_at(cell) == ["move PTP c"]
    assert shown(cell) == [3]


def test_everybody_hears_at_the_run_of_breakpoints_that_went_with_their_statements(
    cell: ProgramCell,
) -> None:
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
    assert ask(cell.user, "programs.load", name="main")["dropped_breakpoints"] == 1


def test_an_edit_during_a_run_leaves_the_breakpoints_of_the_run_where_they_are(
    cell: ProgramCell,
) -> None:
    assert cell.run() is V.ACCEPTED
    edit(cell, 1, "insert", at=0, statements=NEW)
    for _ in range(2_000):
        if cell.reports()[-1].state == ProgramState.AT_BREAKPOINT:
            break
        cell.pass_time(10)
    assert cell.reports()[-1].line == BODY_LINE + 2


def test_breakpoints_set_during_a_run_are_found_in_the_revision_that_runs() -> None:
    cell = ProgramCell(main="wait 2 s\n" + THREE)
    assert cell.run() is V.ACCEPTED
    edit(cell, 1, "insert", at=0, statements=NEW)
    answer = breakpoints(cell, 0, 5)
    assert (answer["statements"], answer["revision"], answer["next_run"]) == ([0, 5], 2, [0])
    for _ in range(2_000):
        if cell.reports()[-1].state == ProgramState.AT_BREAKPOINT:
            break
        cell.pass_time(10)
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
            refused = ask(observer, "programs.breakpoints", **about)
            assert (refused["code"], refused["text"]) == (V.HELD_BY_OTHER, "holder is in control")
    assert ask(observer, "programs.breakpoints", name="other", statements=[0])["statements"] == [0]
    assert breakpoints(cell, 1)["statements"] == [1]


def test_anybody_may_set_breakpoints_of_a_program_that_is_not_under_way() -> None:
    cell = ProgramCell(main=THREE)
    observer = cell.pendant("observer")
    assert ask(observer, "programs.breakpoints", name="main", statements=[2])["statements"] == [2]
    assert pauses_at(cell) == ["move PTP c"]


@pytest.fixture
def foreign() -> ProgramCell:
    cell = ProgramCell()
    program = parse(HEAD.format(name="main").replace("ur5", "puma560") + THREE)
    kind, body = DocumentKind.PROGRAM, program_to_json(program)
    cell.store.save(kind, "main", body, expected_revision=0, author="test")
    return cell


def test_a_program_of_another_robot_is_neither_edited_nor_given_breakpoints(
    foreign: ProgramCell,
) -> None:
    refusals = [
        edit(foreign, 1, "describe", comment="z"),
        edit(foreign, 1, "delete", first=99),
        breakpoints(foreign, 1),
    ]
    for refused in refusals:
        assert refused["code"] == V.PROGRAM_WRONG_ROBOT
        assert "'puma560'" in refused["text"]
        assert "'ur5'" in refused["text"]


LOOPS = "move PTP a\nmove PTP b\n"


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"loops": 3}, "is under way once; accepted: loops 1 to go on, or 3 after a program stop"),
        ({"loops": 0}, "is under way once; accepted: loops 1 to go on, or 0 after a program stop"),
        (
            {"line": BODY_LINE + 1},
            f"line 0 to go on there, or line {BODY_LINE + 1} after a program stop",
        ),
        ({"program": "other"}, "accepted: that, or another after a program stop"),
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
    assert cell.run(**fields) is V.PROGRAM_RUNNING
    assert said in cell.user.all(Verdict)[-1].text
    assert cell.user.outcomes() == []
    assert cell.run() is V.ACCEPTED
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
