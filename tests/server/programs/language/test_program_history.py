from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.program_samples import program

from openpendant.server.programs.editing.edit_history import (
    MOST_UNDO,
    MOST_UNDO_CHARACTERS,
    EditStep,
    History,
    Splice,
    splice_between,
)
from openpendant.server.programs.editing.edits import apply
from openpendant.server.programs.language.program_errors import NothingToUndo
from openpendant.server.programs.language.program_json import program_from_json, program_to_json
from openpendant.simplemsg.pendant.management.points import TeachPoint
from openpendant.simplemsg.pendant.management.statements import (
    DeleteStatements,
    DescribeProgram,
    Edit,
    Move,
    RecordPoint,
    RenamePoint,
    Way,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

BEFORE = program_to_json(program("move PTP a\nloop 2\nmove CIRC b via a\nend\nwait 1 s"))
EDITS: list[Edit] = [
    RecordPoint(TeachPoint("d", (0.5,) * 6), Move(Way.LIN, "d")),
    RenamePoint("a", "start"),
    DeleteStatements(4),
]


def edit_made(body: str, edit: Edit) -> Splice:
    return splice_between(body, program_to_json(apply(program_from_json(body), edit)))


def edited() -> tuple[History, list[str]]:
    history, seen = History(), [BEFORE]
    for edit in EDITS:
        splice = edit_made(seen[-1], edit)
        history = history.edited(EditStep(splice))
        seen.append(splice.applied(seen[-1]))
    return history, seen


@given(st.text("ab"), st.text("ab"))
def test_a_splice_leads_from_one_text_to_the_other_and_back(first: str, second: str) -> None:
    splice = splice_between(first, second)
    assert splice.applied(first) == second
    assert splice.reversed.applied(second) == first


def test_a_splice_holds_what_changed_and_no_more() -> None:
    assert splice_between("x" * 1_000 + "old" + "y" * 1_000, "x" * 1_000 + "y" * 1_000) == Splice(
        1_000, "old", ""
    )


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
    history, body = History(), BEFORE
    for number in range(MOST_UNDO + 20):
        splice = edit_made(body, DescribeProgram(comment=str(number)))
        history, body = history.edited(EditStep(splice)), splice.applied(body)
    for _ in range(MOST_UNDO):
        history, step = history.undone()
        body = step.splice.applied(body)
    assert program_from_json(body).comment == "19"
    with pytest.raises(NothingToUndo):
        history.undone()


def test_a_history_is_bounded_in_characters_but_for_the_last_edit() -> None:
    half = EditStep(Splice(0, "", "x" * (MOST_UNDO_CHARACTERS // 2)))
    assert len(History().edited(half).edited(half).edited(half).past) == 2
    whole = EditStep(Splice(0, "x" * MOST_UNDO_CHARACTERS, "y" * MOST_UNDO_CHARACTERS))
    assert History().edited(half).edited(whole).past == (whole,)
