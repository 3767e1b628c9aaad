"""How the terminal pendant opens, creates and dry-runs programs, and shows which one runs."""

from dataclasses import replace
from typing import Any, cast

import pytest
from rigs.cells.panel_rig import DRY_RUN, HELLO, PROGRAM, PanelRig, snapshot

from openpendant.simplemsg.pendant import ProgramReport, ProgramState, RunKind
from openpendant.simplemsg.pendant.management.cell import ProgramUnderWay
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import PendantClient, Refused
from openpendant.tools.pendants.panel import commands as do
from openpendant.tools.pendants.panel import lcd
from openpendant.tools.pendants.panel.keyboard import Page
from openpendant.tools.pendants.panel.performer import OpenPrograms
from openpendant.tools.pendants.panel.prompts import Choice, ProgramChoice
from openpendant.tools.pendants.panel.taught_program import (
    REACHABLE,
    DryRunFindings,
    RecordHere,
    TaughtProgram,
)
from openpendant.tools.pendants.terminal import screen_text

NAMES = ("five points", "Pick", "pick2", "unpick")


def offered(rig: PanelRig) -> tuple[str, ...]:
    assert isinstance(rig.panel.question, ProgramChoice)
    return rig.panel.question.offers


def open_list(rig: PanelRig, names: tuple[str, ...] = NAMES) -> None:
    assert rig.strike("n") == [do.AskPrograms()]
    rig.panel.listed(names)


@pytest.mark.parametrize(
    ("keys", "name"),
    [
        (["enter"], "five points"),
        (["down", "enter"], "Pick"),
        ([*["down"] * 9, "enter"], "unpick"),
        (["down", "up", "up", "enter"], "five points"),
        ([*"five", "enter"], "five points"),
        ([*"fivep", "enter"], "five points"),
        ([*"POINT", "enter"], "five points"),
        ([*"pick2", "enter"], "pick2"),
        ([*"pick", "enter"], "Pick"),
        ([*"pick", "down", "down", "enter"], "unpick"),
        ([*"zz", "backspace", "backspace", "enter"], "five points"),
    ],
)
def test_a_program_is_chosen_from_the_list_or_by_a_part_of_its_name(
    rig: PanelRig, keys: list[str], name: str
) -> None:
    open_list(rig)
    assert rig.strike(*keys) == [do.OpenProgram(name)]
    assert (rig.panel.question, rig.panel.page) == (None, Page.PROGRAM)


def test_a_whole_name_comes_before_longer_ones(rig: PanelRig) -> None:
    open_list(rig, ("a pick", "pick", "pick2"))
    rig.strike(*"pick")
    assert offered(rig) == ("pick", "pick2", "a pick")


def test_a_name_that_no_program_has_is_asked_about_before_it_is_made(rig: PanelRig) -> None:
    open_list(rig)
    assert rig.strike(*"fvie", "enter") == []
    assert isinstance(rig.panel.question, Choice)
    assert rig.panel.question.title == "Create fvie?"
    assert rig.strike("1") == [do.MakeProgram("fvie")]


def test_a_new_name_that_is_part_of_another_can_be_chosen_too(rig: PanelRig) -> None:
    open_list(rig, ("pick2",))
    assert rig.strike(*"pick", "down", "enter") == []
    assert rig.strike("1") == [do.MakeProgram("pick")]


@pytest.mark.parametrize("key", ["5", "escape", "enter", "q"])
def test_any_other_key_makes_no_program(rig: PanelRig, key: str) -> None:
    open_list(rig)
    assert rig.strike(*"fvie", "enter", key) == []
    assert rig.panel.question is None


def test_a_name_may_be_typed_before_the_list_is_here(rig: PanelRig) -> None:
    assert rig.strike("n", *"pick", "enter") == [do.AskPrograms(), do.OpenProgram("pick")]
    rig.panel.listed(NAMES)
    assert rig.panel.question is None
    rig.panel.not_there("pick")
    assert "there is no program pick: create it?" in rig.said
    assert rig.strike("1") == [do.MakeProgram("pick")]


def test_nothing_is_opened_where_there_is_nothing_and_no_name(rig: PanelRig) -> None:
    open_list(rig, ())
    assert rig.strike("enter") == []


def test_both_displays_show_the_offers(rig: PanelRig) -> None:
    rig.strike("n")
    assert [row.rstrip() for row in lcd.page(rig.panel, rig.now)[:2]] == ["Open: _", "asking"]
    rig.panel.listed(NAMES)
    rig.strike(*"pic", "down")
    assert [row.rstrip() for row in lcd.page(rig.panel, rig.now)] == [
        "Open: pic_",
        " Pick",
        ">pick2",
        " unpick",
    ]
    assert screen_text.program_list(rig.panel).splitlines() == [
        "open which program? pic_",
        "  Pick",
        "> pick2",
        "  unpick",
        "  pic  new",
        "type a part of its name, ↑ ↓, Enter",
    ]


# The revision that is shown.


def report(revision: int, program: str = "pick") -> ProgramReport:
    return ProgramReport(
        state=ProgramState.RUNNING, line=9, loop=1, revision=revision, program=program, text=""
    )


def test_another_revision_ends_a_question_about_the_one_that_was_shown(rig: PanelRig) -> None:
    rig.open()
    rig.strike("4")
    rig.open(replace(PROGRAM, revision=4))
    assert rig.strike("1") == [do.ApplyEdit(RecordHere("PTP"))]


@pytest.mark.parametrize(
    ("news", "asked"),
    [
        (report(4), [do.ReloadProgram("pick")]),
        (report(3), []),
        (report(2), []),
        (report(9, "other"), []),
    ],
)
def test_news_of_a_run_of_a_newer_revision_loads_it(
    rig: PanelRig, news: ProgramReport, asked: list[do.Command]
) -> None:
    rig.open()
    assert rig.panel.program_moved(news) == asked


class Emptied:
    """A client whose server keeps no such program any more."""

    async def manage(self, request: dict[str, Any]) -> dict[str, Any]:
        raise Refused(VerdictCode.NOT_FOUND, f"no {request['name']}", -1, 0.0, 0.0)


async def test_a_program_that_somebody_deleted_is_shown_no_more(rig: PanelRig) -> None:
    rig.open()
    programs = OpenPrograms(cast(PendantClient, Emptied()), rig.panel)
    with pytest.raises(Refused):
        await programs.load_anew("pick")
    assert rig.panel.teaching.program is None
    assert rig.strike("6") == []


async def test_a_program_that_is_not_there_is_asked_about_and_not_made(rig: PanelRig) -> None:
    await OpenPrograms(cast(PendantClient, Emptied()), rig.panel).open("pcik")
    assert isinstance(rig.panel.question, Choice)
    assert rig.panel.question.title == "Create pcik?"


def refused_move(program: str = "pick", line: int = 11, point: str = "P1") -> dict[str, Any]:
    text = "joint 3 at 3.5 rad is outside its range -3.1415926536 to 3.1415926536 rad"
    code = int(VerdictCode.OUT_OF_RANGE)
    place = {"program": program, "line": line, "point": point}
    prefix = f"{program}, line {line}, point {point}: "
    return {**place, "reachable": False, "code": code, "text": prefix + text}


WHY = "OUT_OF_RANGE: joint 3 at 200.54° is outside its range -180.00 to 180.00°"

TOO_FAR = {"refused": 1, "moves": [DRY_RUN["moves"][0], refused_move()]}


@pytest.fixture
def opened() -> PanelRig:
    made = PanelRig()
    made.open()
    return made


def dry_run_rows(opened: PanelRig) -> list[str]:
    return screen_text.program_list(opened.panel).splitlines()


def test_every_statement_that_moves_gets_its_verdict_and_the_program_its_duration(
    opened: PanelRig,
) -> None:
    opened.walk()
    assert dry_run_rows(opened)[1:] == [
        "dry run: all reachable, 4.2 s",
        ">    1 move PTP home  reachable",
        "     2 wait 2 s",
        "     3 move LIN P1  reachable",
    ]
    assert opened.said == "pick, dry run: all reachable, 4.2 s"


def test_a_refusal_stands_beside_its_point_in_degrees(opened: PanelRig) -> None:
    opened.walk(**TOO_FAR)
    assert dry_run_rows(opened)[1] == "dry run: REFUSED, 4.2 s without what is refused"
    assert dry_run_rows(opened)[-1] == f"     3 move LIN P1  REFUSED: {WHY}"


def test_the_small_display_has_a_sign_for_each(opened: PanelRig) -> None:
    opened.walk(**TOO_FAR)
    opened.panel.page = Page.PROGRAM
    assert [row.rstrip() for row in lcd.page(opened.panel, opened.now)] == [
        "pick              r3",
        "> 1+move PTP home",
        "  2 wait 2 s",
        "  3!move LIN P1",
    ]


def test_a_point_that_no_walk_came_to_has_the_verdict_of_the_point(opened: PanelRig) -> None:
    point = {key: value for key, value in refused_move().items() if key not in ("program", "line")}
    opened.walk(refused=1, moves=[], points=[{"point": "home", "reachable": True}, point])
    assert opened.panel.teaching.refusal(0) == REACHABLE
    assert opened.panel.teaching.refusal(1) is None
    assert str(opened.panel.teaching.refusal(2)).startswith("OUT_OF_RANGE")


def test_a_statement_that_is_walked_twice_is_refused_if_it_is_once(opened: PanelRig) -> None:
    opened.walk(refused=1, moves=[refused_move(), *DRY_RUN["moves"]])
    assert opened.panel.teaching.refusal(2) == WHY


def test_what_a_called_program_cannot_do_is_told_with_its_place(opened: PanelRig) -> None:
    opened.walk(refused=1, moves=[*DRY_RUN["moves"], refused_move("grip", 7, "P9")])
    assert opened.said == f"grip line 7: {WHY}"
    assert opened.strike("5", "1") == []


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
    opened: PanelRig, key: str, changes: dict[str, int]
) -> None:
    assert opened.strike("5", key) == []
    assert opened.said == "no dry run was made of pick, revision 3; . makes a dry run"
    assert isinstance(opened.panel.question, Choice)
    assert opened.panel.question.title == "No dry run. Run?"
    assert opened.strike("5") == [do.RunProgram("pick", 3, RunKind.ALL, **changes)]


def test_a_run_of_what_was_refused_is_asked_for_twice_and_names_it(opened: PanelRig) -> None:
    opened.walk(**TOO_FAR)
    assert opened.strike("5", "1") == []
    assert opened.said == "the dry run refused move LIN P1"
    assert opened.strike("5") == [do.RunProgram("pick", 3, RunKind.ALL)]


def test_an_edit_voids_the_dry_run(opened: PanelRig) -> None:
    opened.walk()
    opened.open(TaughtProgram("pick", 4, PROGRAM.lines, PROGRAM.targets, PROGRAM.points, 9))
    assert opened.panel.teaching.dry_run is None
    assert opened.strike("5", "1") == []
    assert "no dry run was made of pick, revision 4" in opened.said


# Asking for it.


def test_one_dry_run_at_a_time_is_asked_for(opened: PanelRig) -> None:
    assert opened.strike(".") == [do.AskDryRun("pick")]
    assert dry_run_rows(opened)[1] == "dry run under way"
    assert opened.strike(".") == []
    assert opened.said == "a dry run is under way"


def test_a_lost_link_ends_the_wait_for_it(opened: PanelRig) -> None:
    opened.strike(".")
    opened.panel.lost("cable")
    assert not opened.panel.teaching.is_walking


UNMARKED = [">    1 move PTP home", "     2 wait 2 s", "     3 move LIN P1"]


@pytest.fixture
def paged() -> PanelRig:
    made = PanelRig()
    made.panel.page = Page.PROGRAM
    return made


def page(paged: PanelRig) -> list[str]:
    return [row.rstrip() for row in lcd.page(paged.panel, paged.now)]


def listed(paged: PanelRig) -> list[str]:
    return screen_text.program_list(paged.panel).splitlines()


def connect_anew(paged: PanelRig, program: ProgramUnderWay | None) -> None:
    paged.panel.lost("cable")
    paged.panel.greeted()
    paged.panel.cell.connected(HELLO, snapshot(program=program))
    paged.panel.connected()


def test_the_open_program_is_marked_while_it_runs(paged: PanelRig) -> None:
    paged.open()
    paged.runs("pick", 10)
    assert page(paged)[0] == "pick         running"
    assert page(paged)[2] == " =2 wait 2 s"
    assert listed(paged)[0] == "pick, revision 3, running"
    assert listed(paged)[3] == " =   2 wait 2 s"


@pytest.mark.parametrize("line", [9, 10, 11])
def test_another_program_that_runs_is_named_and_no_line_of_the_open_one_marked(
    paged: PanelRig, line: int
) -> None:
    """One runs, and the teacher opens another meanwhile."""
    paged.runs("a", line)
    paged.open()
    assert page(paged) == ["pick              r3", "=a           running", *_statements(2)]
    assert listed(paged)[:2] == ["pick, revision 3", f"under way: a, running, line {line}"]
    assert listed(paged)[3:] == UNMARKED


def _statements(count: int) -> list[str]:
    return ["> 1 move PTP home", "  2 wait 2 s", "  3 move LIN P1"][:count]


def test_during_a_call_the_called_program_is_named_and_afterwards_the_caller_marked(
    paged: PanelRig,
) -> None:
    paged.open()
    paged.runs("pick", 9)
    paged.runs("gripper", 10, revision=1)
    assert page(paged)[:2] == ["pick              r3", "=gripper     running"]
    assert listed(paged)[3:] == UNMARKED
    paged.runs("pick", 11)
    assert listed(paged)[-1] == " =   3 move LIN P1"


def test_another_revision_of_the_open_program_is_another_program(paged: PanelRig) -> None:
    paged.open(replace(PROGRAM, revision=4))
    paged.runs("pick", 10, program_state=ProgramState.PAUSED)
    assert page(paged)[:2] == ["pick              r4", "=pick r3      paused"]
    assert listed(paged)[:2] == ["pick, revision 4", "under way: pick r3, paused, line 10"]


def test_it_is_named_where_no_program_is_open_or_the_open_one_is_empty(paged: PanelRig) -> None:
    paged.runs("a", 0, program_state=ProgramState.AT_BREAKPOINT)
    assert page(paged)[1:3] == ["No program is open", "=a     at breakpoint"]
    assert listed(paged)[1] == "under way: a, at breakpoint"
    paged.open(TaughtProgram("new", 1))
    assert page(paged)[:3] == ["new               r1", "=a     at breakpoint", "empty"]
    assert listed(paged)[1] == "under way: a, at breakpoint"


def test_the_end_of_a_run_takes_mark_and_name_away(paged: PanelRig) -> None:
    paged.open()
    for name in ("pick", "a"):
        paged.runs(name, 10)
        paged.runs(name, 0, program_state=ProgramState.NONE)
        assert page(paged) == ["pick              r3", *_statements(3)]
        assert listed(paged)[2:] == UNMARKED


def test_news_of_the_end_counts_before_the_state_that_goes_with_it(paged: PanelRig) -> None:
    paged.runs("a", 10)
    before = paged.panel.cell.state
    paged.runs("a", 0, program_state=ProgramState.NONE)
    paged.panel.cell.state = before
    paged.open()
    assert page(paged) == ["pick              r3", *_statements(3)]


def test_a_pendant_that_comes_later_learns_the_name_from_the_snapshot(paged: PanelRig) -> None:
    paged.open()
    connect_anew(paged, ProgramUnderWay(name="a", state="running", line=9, revision=1))
    paged.state(program_state=ProgramState.RUNNING, program_line=9)
    assert listed(paged)[1] == "under way: a, running, line 9"
    connect_anew(paged, None)
    paged.state(program_state=ProgramState.RUNNING, program_line=9)
    assert listed(paged)[0] == "pick, revision 3"


@pytest.mark.parametrize(
    ("news", "told"),
    [
        ({"name": "b", "line": 4}, ["under way: b, running, line 4"]),
        ({"name": "a", "line": 0, "program_state": ProgramState.NONE}, []),
    ],
)
def test_news_that_overtakes_the_snapshot_counts(
    paged: PanelRig, news: dict[str, Any], told: list[str]
) -> None:
    paged.panel.lost("cable")
    paged.panel.greeted()
    paged.runs(**news)
    run = ProgramUnderWay(name="a", state="running", line=9, revision=1)
    paged.panel.cell.connected(HELLO, snapshot(program=run))
    paged.state(program_state=ProgramState.RUNNING, program_line=9)
    assert listed(paged)[1:] == told
