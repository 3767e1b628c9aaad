from __future__ import annotations

import json
from typing import cast

import pytest
from pydantic import TypeAdapter
from rigs.data.program_samples import program

from openpendant.server.events.management_requests import parse
from openpendant.server.programs.editing.edits import apply
from openpendant.server.programs.language.printer import print_program
from openpendant.simplemsg.pendant.management.points import TeachPoint
from openpendant.simplemsg.pendant.management.programs import EditProgram
from openpendant.simplemsg.pendant.management.statements import (
    Call,
    CommentPoint,
    CommentStatement,
    DeletePoint,
    DeleteStatements,
    DescribeProgram,
    Edit,
    End,
    InsertStatements,
    Loop,
    Move,
    RecordPoint,
    RenamePoint,
    ReorderPoint,
    ReorderStatements,
    ReplaceStatement,
    TouchUp,
    Wait,
    Way,
)
from openpendant.simplemsg.pendant.management.words import ProgramError
from openpendant.simplemsg.verdicts import VerdictCode as V

D = TeachPoint("d", (0.5,) * 6)
BEFORE = program("move PTP a\nloop 2\nmove CIRC b via a\nend\nwait 1 s")


def statements_after(edit: Edit) -> list[str]:
    text = print_program(apply(BEFORE, edit))
    return [line.strip() for line in text.rpartition("\n\n")[2].splitlines()]


def test_recording_adds_a_point_and_appends_its_move() -> None:
    after = apply(BEFORE, RecordPoint(D, Move(Way.LIN, "d")))
    assert after.points[-1] == D
    assert after.statements == (*BEFORE.statements, Move(Way.LIN, "d"))


def test_a_recorded_point_is_inserted_where_asked() -> None:
    after = apply(BEFORE, RecordPoint(D, Move(Way.LIN, "d"), at=1))
    assert after.statements[1] == Move(Way.LIN, "d")
    assert len(after.statements) == len(BEFORE.statements) + 1


def test_a_point_may_be_recorded_without_a_move() -> None:
    assert apply(BEFORE, RecordPoint(D)).statements == BEFORE.statements


def test_touching_up_changes_where_a_point_is_and_nothing_else() -> None:
    commented = apply(BEFORE, CommentPoint("a", "grip here"))
    after = apply(commented, TouchUp("a", (1.0,) * 6))
    assert after.point("a") == TeachPoint("a", (1.0,) * 6, comment="grip here")
    assert after.statements == BEFORE.statements


def test_renaming_a_point_renames_it_in_all_statements() -> None:
    after = apply(BEFORE, RenamePoint("a", "start"))
    assert [point.name for point in after.points] == ["start", "b", "c"]
    assert after.statements[0] == Move(Way.PTP, "start")
    assert after.statements[2] == Move(Way.CIRC, "b", ("start",))


def test_a_used_point_is_not_deleted_and_its_statements_are_named() -> None:
    with pytest.raises(
        ProgramError, match=r"is used in line 11, 'move PTP a' and line 13, 'move CIRC b via a'$"
    ) as caught:
        apply(BEFORE, DeletePoint("a"))
    assert caught.value.code is V.POINT_IN_USE


def test_an_unused_point_is_deleted() -> None:
    assert [point.name for point in apply(BEFORE, DeletePoint("c")).points] == ["a", "b"]


def test_points_are_reordered() -> None:
    names = [point.name for point in apply(BEFORE, ReorderPoint("c", 0)).points]
    assert names == ["c", "a", "b"]


@pytest.mark.parametrize(
    ("edit", "expected"),
    [
        (
            InsertStatements((Wait(2.0),), at=0),
            ["wait 2 s", "move PTP a", "loop 2", "move CIRC b via a", "end", "wait 1 s"],
        ),
        (
            InsertStatements((Loop(), Wait(2.0), End())),
            [
                *("move PTP a", "loop 2", "move CIRC b via a", "end", "wait 1 s"),
                *("loop", "wait 2 s", "end"),
            ],
        ),
        (DeleteStatements(1, 3), ["move PTP a", "wait 1 s"]),
        (
            ReorderStatements(4, 1, 0),
            ["wait 1 s", "move PTP a", "loop 2", "move CIRC b via a", "end"],
        ),
        (
            ReorderStatements(1, 3, 2),
            ["move PTP a", "wait 1 s", "loop 2", "move CIRC b via a", "end"],
        ),
        (
            ReplaceStatement(4, Call("other")),
            ["move PTP a", "loop 2", "move CIRC b via a", "end", "call other"],
        ),
        (
            CommentStatement(0, "go"),
            ["move PTP a  # go", "loop 2", "move CIRC b via a", "end", "wait 1 s"],
        ),
    ],
)
def test_statements_are_edited(edit: Edit, expected: list[str]) -> None:
    assert statements_after(edit) == expected


def test_the_whole_program_is_described() -> None:
    after = apply(BEFORE, DescribeProgram(name="other", comment="for class 7"))
    assert (after.name, after.comment, after.tool) == ("other", "for class 7", "flange")


@pytest.mark.parametrize(
    ("edit", "code", "message"),
    [
        (RecordPoint(TeachPoint("a", (0.0,) * 6)), V.POINT_EXISTS, "'a' already"),
        (RecordPoint(D, Move(Way.LIN, "a")), V.PROGRAM_INVALID, "accepted: a move to d"),
        (RecordPoint(TeachPoint("d", (0.0,))), V.PROGRAM_INVALID, "d has 1 joints"),
        (TouchUp("x", (0.0,) * 6), V.POINT_UNKNOWN, "points: 'a', 'b', 'c'"),
        (RenamePoint("a", "b"), V.POINT_EXISTS, "'b' already"),
        (RenamePoint("a", "x/y"), V.BAD_NAME, "accepted: a name without"),
        (
            DeleteStatements(3),
            V.PROGRAM_INVALID,
            "line 12 of the edited text, 'loop 2': the block is not closed",
        ),
        (DeleteStatements(4, 2), V.PROGRAM_INVALID, "there are 5; 4 is line 15, 'wait 1 s'"),
        (ReorderStatements(3, 1, 0), V.PROGRAM_INVALID, "end closes nothing"),
        (InsertStatements((Move(Way.PTP, "x"),)), V.POINT_UNKNOWN, "named 'x'"),
        (
            InsertStatements((), at=6),
            V.PROGRAM_INVALID,
            "is 6, counted from 0; accepted: 0 to 5; 4 is line 15, 'wait 1 s'",
        ),
        (InsertStatements((), at=-1), V.PROGRAM_INVALID, "is -1, counted from 0"),
        (DeleteStatements(0, 0), V.PROGRAM_INVALID, "the count is 0; accepted: 1"),
        (
            InsertStatements((Move(Way.PTP, "x"),), at=1),
            V.POINT_UNKNOWN,
            "line 12 of the edited text, 'move PTP x': no point is named 'x'",
        ),
        (CommentStatement(0, "a\nb"), V.PROGRAM_INVALID, "U+000A"),
        (DescribeProgram(name=""), V.BAD_NAME, "has 0 characters"),
    ],
)
def test_an_edit_that_leaves_no_valid_program_is_refused(edit: Edit, code: V, message: str) -> None:
    with pytest.raises(ProgramError) as caught:
        apply(BEFORE, edit)
    assert caught.value.code is code
    assert message in str(caught.value)


@pytest.mark.parametrize(
    "edit",
    [
        RecordPoint(D, Move(Way.LIN, "d"), at=1),
        TouchUp("a", (1.0,) * 6),
        InsertStatements((Loop(3), Wait(2.0), End())),
        ReorderStatements(1, 3, 2),
        DescribeProgram(comment="x"),
    ],
)
def test_an_edit_comes_back_from_the_json_of_its_request(edit: Edit) -> None:
    told = TypeAdapter(type(edit)).dump_python(edit, mode="json")
    body = {"op": "programs.edit", "name": "weld", "expected_revision": 1, "edit": told}
    _, asked = parse(json.dumps(body).encode())
    assert isinstance(asked, EditProgram)
    assert cast(Edit, asked.edit) == edit
