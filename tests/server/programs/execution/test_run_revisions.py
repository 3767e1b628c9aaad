"""A run is of exactly the revision that a pendant shows and has checked, or nothing moves."""

from __future__ import annotations

import json
from typing import Any

import pytest
from rigs.cells.program_cell import BODY_LINE, HEAD, ProgramCell, ask

from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant import (
    Activity,
    MotionControlAction,
    ProgramReport,
    ProgramState,
    RunKind,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME, STOP = MotionControlAction
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


def under_way(cell: ProgramCell) -> dict[str, Any]:
    told: dict[str, Any] = ask(cell.user, "snapshot")["program"]
    return told


def test_the_revision_that_is_kept_runs(edited: ProgramCell) -> None:
    assert edited.run(revision=2) is V.ACCEPTED
    assert edited.until_outcomes() == [V.ACCEPTED]


def test_without_a_revision_the_newest_runs(edited: ProgramCell) -> None:
    assert edited.run() is V.ACCEPTED
    assert edited.reports()[-1].revision == 2


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
    assert edited.position == before
    assert edited.motions == []
    assert edited.core.cell.activity is Activity.IDLE
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


@pytest.mark.parametrize("kind", [ALL, FORWARD, BACKWARD])
@pytest.mark.parametrize("revision", [0, 1])
def test_a_paused_run_goes_on_as_the_revision_that_it_began_with(
    stepped: ProgramCell, kind: RunKind, revision: int
) -> None:
    if kind is BACKWARD:  # which takes two points to go between
        stepped.run(kind=FORWARD, revision=1)
        stepped.until_outcomes(2)
    before = len(stepped.user.outcomes())
    assert stepped.run(kind=kind, revision=revision) is V.ACCEPTED
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


def test_a_resume_goes_on_with_the_revision_that_runs() -> None:
    cell = ProgramCell(main="wait 1 s\nmove PTP b\n")
    cell.run(revision=1)
    cell.control(PAUSE)
    cell.keep("main", SECOND, expected_revision=1)
    assert cell.control(RESUME) is V.ACCEPTED
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert {report.revision for report in cell.reports()} == {1}


def test_the_revision_asked_for_is_of_the_named_program_alone() -> None:
    """What it calls is the newest; each place is told with the revision of its own program."""
    cell = ProgramCell(main="call inner\nwait 1 s\n", inner="wait 1 s\n")
    for before in (1, 2):
        cell.keep("inner", "wait 1 s\n", expected_revision=before)
    assert cell.run(revision=1) is V.ACCEPTED
    assert cell.until_outcomes() == [V.ACCEPTED]
    told = {(report.program, report.revision) for report in cell.reports()}
    assert told == {("main", 1), ("inner", 3)}


def test_who_comes_later_sees_which_revision_runs(edited: ProgramCell) -> None:
    edited.run(kind=FORWARD)
    edited.until_outcomes()
    edited.keep("main", FIRST, expected_revision=2)
    shown = under_way(edited)
    assert (shown["name"], shown["state"], shown["revision"]) == ("main", "stepped", 2)


def test_a_program_that_ended_is_reported_with_its_revision(edited: ProgramCell) -> None:
    edited.run(revision=2)
    edited.until_outcomes()
    last = edited.user.all(ProgramReport)[-1]
    assert (last.state, last.program, last.revision) == (ProgramState.NONE, "main", 2)


def test_a_dry_run_tells_the_revision_that_it_walked_through(edited: ProgramCell) -> None:
    assert ask(edited.user, "programs.dry_run", name="main")["revision"] == 2


def test_a_program_kept_under_another_name_has_the_revision_it_is_kept_as() -> None:
    cell = ProgramCell()
    body = json.loads(program_to_json(parse(HEAD.format(name="main") + FIRST)))
    for before in (0, 1):
        cell.store.save(
            DocumentKind.PROGRAM, "copy", json.dumps(body), expected_revision=before, author="test"
        )
    assert cell.run("copy", revision=1) is V.REVISION_CONFLICT
    assert cell.run("copy", revision=2) is V.ACCEPTED
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert {(each.program, each.revision) for each in cell.reports()} == {("main", 2)}
