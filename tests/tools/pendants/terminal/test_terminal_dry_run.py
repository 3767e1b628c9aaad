"""Which points of the open program can be reached, as shown before it is run."""

from typing import Any

import pytest
from rigs.cells.panel_rig import DRY_RUN, PROGRAM, PanelRig

from openpendant.simplemsg.pendant import RunKind
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.terminal import commands as do
from openpendant.tools.pendants.terminal import lcd, screen_text
from openpendant.tools.pendants.terminal.keyboard import Page
from openpendant.tools.pendants.terminal.prompts import Choice
from openpendant.tools.pendants.terminal.taught_program import (
    REACHABLE,
    DryRunFindings,
    TaughtProgram,
)


def refused(program: str = "pick", line: int = 11, point: str = "P1") -> dict[str, Any]:
    text = "joint 3 at 3.5 rad is outside its range -3.1415926536 to 3.1415926536 rad"
    code = int(VerdictCode.OUT_OF_RANGE)
    place = {"program": program, "line": line, "point": point}
    prefix = f"{program}, line {line}, point {point}: "
    return {**place, "reachable": False, "code": code, "text": prefix + text}


WHY = "OUT_OF_RANGE: joint 3 at 200.54° is outside its range -180.00 to 180.00°"

TOO_FAR = {"refused": 1, "moves": [DRY_RUN["moves"][0], refused()]}


@pytest.fixture
def rig() -> PanelRig:
    made = PanelRig()
    made.open()
    return made


def rows(rig: PanelRig) -> list[str]:
    return screen_text.program_list(rig.panel).splitlines()


def test_every_statement_that_moves_gets_its_verdict_and_the_program_its_duration(
    rig: PanelRig,
) -> None:
    rig.walk()
    assert rows(rig)[1:] == [
        "dry run: all reachable, 4.2 s",
        ">    1 move PTP home  reachable",
        "     2 wait 2 s",
        "     3 move LIN P1  reachable",
    ]
    assert rig.said == "pick, dry run: all reachable, 4.2 s"


def test_a_refusal_stands_beside_its_point_in_degrees(rig: PanelRig) -> None:
    rig.walk(**TOO_FAR)
    assert rows(rig)[1] == "dry run: REFUSED, 4.2 s without what is refused"
    assert rows(rig)[-1] == f"     3 move LIN P1  REFUSED: {WHY}"


def test_the_small_display_has_a_sign_for_each(rig: PanelRig) -> None:
    rig.walk(**TOO_FAR)
    rig.panel.page = Page.PROGRAM
    assert [row.rstrip() for row in lcd.page(rig.panel, rig.now)] == [
        "pick              r3",
        "> 1+move PTP home",
        "  2 wait 2 s",
        "  3!move LIN P1",
    ]


def test_a_point_that_no_walk_came_to_has_the_verdict_of_the_point(rig: PanelRig) -> None:
    point = {key: value for key, value in refused().items() if key not in ("program", "line")}
    rig.walk(refused=1, moves=[], points=[{"point": "home", "reachable": True}, point])
    assert rig.panel.teaching.refusal(0) == REACHABLE
    assert rig.panel.teaching.refusal(1) is None
    assert str(rig.panel.teaching.refusal(2)).startswith("OUT_OF_RANGE")


def test_a_statement_that_is_walked_twice_is_refused_if_it_is_once(rig: PanelRig) -> None:
    rig.walk(refused=1, moves=[refused(), *DRY_RUN["moves"]])
    assert rig.panel.teaching.refusal(2) == WHY


def test_what_a_called_program_cannot_do_is_told_with_its_place(rig: PanelRig) -> None:
    rig.walk(refused=1, moves=[*DRY_RUN["moves"], refused("grip", 7, "P9")])
    assert rig.said == f"grip line 7: {WHY}"
    assert rig.strike("5", "1") == []


@pytest.mark.parametrize(
    ("changes", "end"),
    [
        ({"endless": True}, "4.2 s for two passes of its endless loop"),
        ({"complete": False}, "4.2 s, not every branch was walked"),
    ],
)
def test_the_summary_says_what_the_duration_is_of(changes: dict[str, Any], end: str) -> None:
    assert DryRunFindings.read("pick", 3, {**DRY_RUN, **changes}).summary.endswith(end)


# Before a run.


@pytest.mark.parametrize(("key", "changes"), [("1", {}), ("2", {"line": 9}), ("3", {"loops": 0})])
def test_a_run_without_a_dry_run_is_asked_for_twice(
    rig: PanelRig, key: str, changes: dict[str, int]
) -> None:
    assert rig.strike("5", key) == []
    assert rig.said == "no dry run was made of pick, revision 3; . makes a dry run"
    assert isinstance(rig.panel.question, Choice)
    assert rig.panel.question.title == "No dry run. Run?"
    assert rig.strike("5") == [do.RunProgram("pick", 3, RunKind.ALL, **changes)]


def test_a_run_of_what_was_refused_is_asked_for_twice_and_names_it(rig: PanelRig) -> None:
    rig.walk(**TOO_FAR)
    assert rig.strike("5", "1") == []
    assert rig.said == "the dry run refused move LIN P1"
    assert rig.strike("5") == [do.RunProgram("pick", 3, RunKind.ALL)]


def test_an_edit_voids_the_dry_run(rig: PanelRig) -> None:
    rig.walk()
    rig.open(TaughtProgram("pick", 4, PROGRAM.lines, PROGRAM.targets, PROGRAM.points, 9))
    assert rig.panel.teaching.dry_run is None
    assert rig.strike("5", "1") == []
    assert "no dry run was made of pick, revision 4" in rig.said


# Asking for it.


def test_one_dry_run_at_a_time_is_asked_for(rig: PanelRig) -> None:
    assert rig.strike(".") == [do.AskDryRun("pick")]
    assert rows(rig)[1] == "dry run under way"
    assert rig.strike(".") == []
    assert rig.said == "a dry run is under way"


def test_a_lost_link_ends_the_wait_for_it(rig: PanelRig) -> None:
    rig.strike(".")
    rig.panel.lost("cable")
    assert not rig.panel.teaching.is_walking
