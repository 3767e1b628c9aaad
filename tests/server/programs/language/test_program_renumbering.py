from __future__ import annotations

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from rigs.data.program_samples import program

from openpendant.server.programs.editing.edit_history import Renumbering, between, by_edit
from openpendant.server.programs.editing.edits import apply
from openpendant.simplemsg.pendant.management.points import TeachPoint
from openpendant.simplemsg.pendant.management.statements import (
    CommentStatement,
    DeleteStatements,
    DescribeProgram,
    Edit,
    InsertStatements,
    Move,
    RecordPoint,
    RenamePoint,
    ReorderStatements,
    ReplaceStatement,
    Wait,
    Way,
)
from openpendant.simplemsg.pendant.management.words import ProgramError

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
def test_each_statement_that_an_edit_leaves_is_where_the_edit_put_it(edit: Edit) -> None:
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


@given(edits)
def test_the_way_back_leads_each_statement_back_where_it_was(edit: Edit) -> None:
    try:
        apply(ALL_DIFFERENT, edit)
    except ProgramError:
        assume(False)
    renumbering = by_edit(edit, COUNT)
    for number in range(COUNT):
        place = renumbering.place(number)
        assert place is None or renumbering.reversed.place(place) == number


@given(texts, texts, texts, texts)
def test_a_statement_found_again_is_never_one_of_those_beside_it(
    head: list[str], gone: list[str], come: list[str], tail: list[str]
) -> None:
    """One stretch in the middle became another; the places of head and tail are known."""
    before, after = head + gone + tail, head + come + tail
    renumbering = between(before, after)
    for number in range(len(before)):
        place = renumbering.place(number)
        if number < len(head):
            assert place in (number, None)
        elif number >= len(head) + len(gone):
            assert place in (number + len(come) - len(gone), None)


@given(texts, texts)
def test_what_is_found_again_is_the_same_and_found_once(
    before: list[str], after: list[str]
) -> None:
    renumbering = between(before, after)
    pairs = [(number, renumbering.place(number)) for number in range(len(before))]
    places = [place for _, place in pairs if place is not None]
    assert len(set(places)) == len(places)
    assert all(place is None or before[number] == after[place] for number, place in pairs)


@given(texts)
def test_a_text_that_did_not_change_keeps_every_place(text: list[str]) -> None:
    renumbering = between(text, text)
    assert [renumbering.place(number) for number in range(len(text))] == [*range(len(text))]


@given(st.permutations("abcdef"), st.permutations("abcdef"))
def test_a_statement_like_no_other_is_found_wherever_it_went(
    before: list[str], after: list[str]
) -> None:
    renumbering = between(before, after)
    places = [renumbering.place(number) for number in range(len(before))]
    assert places == [after.index(each) for each in before]


@pytest.mark.parametrize(
    ("before", "after", "places"),
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
def test_what_may_have_gone_or_stayed_is_not_found(
    before: str, after: str, places: list[int | None]
) -> None:
    renumbering = between(before, after)
    assert [renumbering.place(number) for number in range(len(before))] == places


def test_places_that_are_gone_are_left_out() -> None:
    assert by_edit(DeleteStatements(1, 2), 5).places({0, 1, 2, 4}) == {0, 2}
    assert Renumbering(()).places({0, 1}) == frozenset()
