import json
from collections.abc import Sequence
from typing import cast

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pydantic import TypeAdapter
from rigs.data.program_samples import program

from openpendant.server.events.management_requests import parse
from openpendant.server.programs.editing import edit_history
from openpendant.server.programs.editing.edit_history import EditStep, History, Splice, by_edit
from openpendant.server.programs.editing.edits import apply
from openpendant.server.programs.language.printer import print_program
from openpendant.server.programs.language.program_errors import NothingToUndo
from openpendant.server.programs.language.program_json import program_from_json, program_to_json
from openpendant.simplemsg.pendant.management.program_values import ProgramError, TeachPoint
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
from openpendant.simplemsg.verdicts import VerdictCode as V

D = TeachPoint("d", (0.5,) * 6)
LINES = ["move PTP a", "loop 2", "move CIRC b via a", "end", "wait 1 s"]
FIRST, *LOOP, LAST = LINES
BEFORE = program("\n".join(LINES))


def test_recording_adds_a_point_and_appends_its_move() -> None:
    after = apply(BEFORE, RecordPoint(D, Move(Way.LIN, "d")))
    assert (after.points[-1], after.statements) == (D, (*BEFORE.statements, Move(Way.LIN, "d")))


@pytest.mark.parametrize(
    ("edit", "points"),
    [
        (DeletePoint("c"), ["a", "b"]),
        (ReorderPoint("c", 0), ["c", "a", "b"]),
        (RecordPoint(D), ["a", "b", "c", "d"]),
    ],
    ids=["an unused one is deleted", "reordered", "recorded without a move"],
)
def test_points_are_edited_and_no_statement(edit: Edit, points: list[str]) -> None:
    after = apply(BEFORE, edit)
    assert [point.name for point in after.points] == points
    assert after.statements == BEFORE.statements


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


@pytest.mark.parametrize(
    ("edit", "expected"),
    [
        (InsertStatements((Wait(2.0),), at=0), ["wait 2 s", *LINES]),
        (InsertStatements((Loop(), Wait(2.0), End())), [*LINES, "loop", "wait 2 s", "end"]),
        (RecordPoint(D, Move(Way.LIN, "d"), at=1), [FIRST, "move LIN d", *LOOP, LAST]),
        (DeleteStatements(1, 3), [FIRST, LAST]),
        (ReorderStatements(4, 1, 0), [LAST, FIRST, *LOOP]),
        (ReorderStatements(1, 3, 2), [FIRST, LAST, *LOOP]),
        (ReplaceStatement(4, Call("other")), [FIRST, *LOOP, "call other"]),
        (CommentStatement(0, "go"), ["move PTP a  # go", *LOOP, LAST]),
    ],
)
def test_statements_are_edited(edit: Edit, expected: list[str]) -> None:
    text = print_program(apply(BEFORE, edit))
    assert [line.strip() for line in text.rpartition("\n\n")[2].splitlines()] == expected


def test_the_whole_program_is_described() -> None:
    after = apply(BEFORE, DescribeProgram(name="other", comment="for class 7"))
    assert (after.name, after.comment, after.tool) == ("other", "for class 7", "flange")


INVALID = V.PROGRAM_INVALID


@pytest.mark.parametrize(
    ("edit", "code", "message"),
    [
        (RecordPoint(TeachPoint("a", (0.0,) * 6)), V.POINT_EXISTS, "'a' already"),
        (RecordPoint(D, Move(Way.LIN, "a")), INVALID, "accepted: a move to d"),
        (RecordPoint(TeachPoint("d", (0.0,))), INVALID, "d has 1 joints"),
        (TouchUp("x", (0.0,) * 6), V.POINT_UNKNOWN, "points: 'a', 'b', 'c'"),
        (RenamePoint("a", "b"), V.POINT_EXISTS, "'b' already"),
        (RenamePoint("a", "x/y"), V.BAD_NAME, "accepted: a name without"),
        (
            DeleteStatements(3),
            INVALID,
            "line 12 of the edited text, 'loop 2': the block is not closed",
        ),
        (DeleteStatements(4, 2), INVALID, "there are 5; 4 is line 15, 'wait 1 s'"),
        (ReorderStatements(3, 1, 0), INVALID, "end closes nothing"),
        (InsertStatements((Move(Way.PTP, "x"),)), V.POINT_UNKNOWN, "named 'x'"),
        (
            InsertStatements((), at=6),
            INVALID,
            "is 6, counted from 0; accepted: 0 to 5; 4 is line 15, 'wait 1 s'",
        ),
        (InsertStatements((), at=-1), INVALID, "is -1, counted from 0"),
        (DeleteStatements(0, 0), INVALID, "the count is 0; accepted: 1"),
        (
            InsertStatements((Move(Way.PTP, "x"),), at=1),
            V.POINT_UNKNOWN,
            "line 12 of the edited text, 'move PTP x': no point is named 'x'",
        ),
        (CommentStatement(0, "a\nb"), INVALID, "U+000A"),
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


BODY = program_to_json(BEFORE)
EDITS: list[Edit] = [
    RecordPoint(TeachPoint("d", (0.5,) * 6), Move(Way.LIN, "d")),
    RenamePoint("a", "start"),
    DeleteStatements(4),
]


def edit_made(body: str, edit: Edit) -> Splice:
    return edit_history.splice_between(body, program_to_json(apply(program_from_json(body), edit)))


def edited() -> tuple[History, list[str]]:
    history, seen = History(), [BODY]
    for edit in EDITS:
        splice = edit_made(seen[-1], edit)
        history = history.edited(EditStep(splice))
        seen.append(splice.applied(seen[-1]))
    return history, seen


@given(st.text("ab"), st.text("ab"))
def test_a_splice_leads_from_one_text_to_the_other_and_back(first: str, second: str) -> None:
    splice = edit_history.splice_between(first, second)
    assert splice.applied(first) == second
    assert splice.reversed.applied(second) == first


def test_a_splice_holds_what_changed_and_no_more() -> None:
    head, tail = "x" * 1_000, "y" * 1_000
    assert edit_history.splice_between(head + "old" + tail, head + tail) == Splice(1_000, "old", "")


def test_every_edit_is_undone_and_redone() -> None:
    history, seen = edited()
    body = seen[-1]
    for expected in reversed(seen[:-1]):
        history, step = history.undone()
        body = step.splice.applied(body)
        assert body == expected
    for expected in seen[1:]:
        history, step = history.redone()
        body = step.splice.applied(body)
        assert body == expected


def test_an_edit_after_an_undo_ends_what_could_be_redone() -> None:
    history, _ = edited()[0].undone()
    with pytest.raises(NothingToUndo, match="no edit is left to redo"):
        history.edited(EditStep(Splice(0, "", "x"))).redone()


def test_there_is_nothing_before_the_first_edit() -> None:
    with pytest.raises(NothingToUndo) as caught:
        History().undone()
    assert caught.value.code is V.NOTHING_TO_UNDO


def test_a_history_is_bounded_in_edits() -> None:
    history, body = History(), BODY
    for number in range(edit_history.MOST_UNDO + 20):
        splice = edit_made(body, DescribeProgram(comment=str(number)))
        history, body = history.edited(EditStep(splice)), splice.applied(body)
    for _ in range(edit_history.MOST_UNDO):
        history, step = history.undone()
        body = step.splice.applied(body)
    assert program_from_json(body).comment == "19"
    with pytest.raises(NothingToUndo):
        history.undone()


def test_a_history_is_bounded_in_characters_but_for_the_last_edit() -> None:
    most = edit_history.MOST_UNDO_CHARACTERS
    half = EditStep(Splice(0, "", "x" * (most // 2)))
    assert len(History().edited(half).edited(half).edited(half).past) == 2
    whole = EditStep(Splice(0, "x" * most, "y" * most))
    assert History().edited(half).edited(whole).past == (whole,)


COUNT = 6
ALL_DIFFERENT = program("\n".join(f"wait {number + 1} s" for number in range(COUNT)))

numbers = st.integers(0, COUNT)
edits: st.SearchStrategy[Edit] = st.one_of(
    st.builds(InsertStatements, st.just((Wait(50.0), Wait(60.0))), st.none() | numbers),
    st.builds(
        lambda at: RecordPoint(TeachPoint("d", (0.5,) * 6), Move(Way.LIN, "d"), at),
        st.none() | numbers,
    ),
    st.builds(DeleteStatements, numbers, numbers),
    st.builds(ReorderStatements, numbers, numbers, numbers),
    st.builds(ReplaceStatement, numbers, st.just(Wait(70.0))),
    st.builds(CommentStatement, numbers, st.just("here")),
    st.just(RenamePoint("a", "start")),
    st.just(DescribeProgram(comment="all")),
)
texts = st.lists(st.sampled_from("abc"), max_size=8)


@given(edits)
def test_each_statement_that_an_edit_leaves_is_where_it_was_put_and_leads_back(edit: Edit) -> None:
    try:
        after = apply(ALL_DIFFERENT, edit).statements
    except ProgramError:
        assume(False)
    renumbering = by_edit(edit, COUNT)
    changed = edit.at if isinstance(edit, ReplaceStatement | CommentStatement) else None
    for number, statement in enumerate(ALL_DIFFERENT.statements):
        place = renumbering.place(number)
        if number == changed:
            assert place == number
        else:
            assert place == (after.index(statement) if statement in after else None)
        assert place is None or renumbering.reversed.place(place) == number


def places(before: Sequence[str], after: Sequence[str]) -> list[int | None]:
    renumbering = edit_history.between(before, after)
    return [renumbering.place(number) for number in range(len(before))]


@given(texts, texts, texts, texts)
def test_a_statement_found_again_is_never_one_of_those_beside_it(
    head: list[str], gone: list[str], come: list[str], tail: list[str]
) -> None:
    """One stretch in the middle became another; the places of head and tail are known."""
    for number, place in enumerate(places(head + gone + tail, head + come + tail)):
        if number < len(head):
            assert place in (number, None)
        elif number >= len(head) + len(gone):
            assert place in (number + len(come) - len(gone), None)


@given(texts, texts)
def test_what_is_found_again_is_the_same_and_once_only(before: list[str], after: list[str]) -> None:
    pairs = list(zip(before, places(before, after), strict=True))
    found = [place for _, place in pairs if place is not None]
    assert len(set(found)) == len(found)
    assert all(place is None or line == after[place] for line, place in pairs)


@given(texts)
def test_a_text_that_did_not_change_keeps_every_place(text: list[str]) -> None:
    assert places(text, text) == [*range(len(text))]


@given(st.permutations("abcdef"), st.permutations("abcdef"))
def test_a_unique_statement_is_found_wherever_it_went(before: list[str], after: list[str]) -> None:
    assert places(before, after) == [after.index(each) for each in before]


@pytest.mark.parametrize(
    ("before", "after", "found"),
    [
        ("aba", "xaba", [1, 2, 3]),
        ("aba", "aba" + "x", [0, 1, 2]),
        ("abc", "ac", [0, None, 1]),
        ("aab", "ab", [None, None, 1]),
        ("ab", "aab", [None, 2]),
        ("abab", "xy", [None, None, None, None]),
        ("abc", "cab", [1, 2, 0]),
        ("", "a", []),
    ],
)
def test_what_may_have_gone_is_not_found(before: str, after: str, found: list[int | None]) -> None:
    assert places(before, after) == found


def test_places_that_are_gone_are_left_out() -> None:
    assert by_edit(DeleteStatements(1, 2), 5).places({0, 1, 2, 4}) == {0, 2}
    assert edit_history.Renumbering(()).places({0, 1}) == frozenset()
