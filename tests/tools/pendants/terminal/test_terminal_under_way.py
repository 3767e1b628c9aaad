"""Only the program that runs is marked as running, and any other that does is named."""

from dataclasses import replace
from typing import Any

import pytest
from rigs.cells.panel_rig import HELLO, PROGRAM, PanelRig, snapshot

from openpendant.simplemsg.pendant import ProgramState
from openpendant.simplemsg.pendant.management.cell import ProgramUnderWay
from openpendant.tools.pendants.terminal import lcd, screen_text
from openpendant.tools.pendants.terminal.keyboard import Page
from openpendant.tools.pendants.terminal.taught_program import TaughtProgram

UNMARKED = [">    1 move PTP home", "     2 wait 2 s", "     3 move LIN P1"]


@pytest.fixture
def rig() -> PanelRig:
    made = PanelRig()
    made.panel.page = Page.PROGRAM
    return made


def page(rig: PanelRig) -> list[str]:
    return [row.rstrip() for row in lcd.page(rig.panel, rig.now)]


def listed(rig: PanelRig) -> list[str]:
    return screen_text.program_list(rig.panel).splitlines()


def connect_anew(rig: PanelRig, program: ProgramUnderWay | None) -> None:
    rig.panel.lost("cable")
    rig.panel.greeted()
    rig.panel.cell.connected(HELLO, snapshot(program=program))
    rig.panel.connected()


def test_the_open_program_is_marked_while_it_runs(rig: PanelRig) -> None:
    rig.open()
    rig.runs("pick", 10)
    assert page(rig)[0] == "pick         running"
    assert page(rig)[2] == " =2 wait 2 s"
    assert listed(rig)[0] == "pick, revision 3, running"
    assert listed(rig)[3] == " =   2 wait 2 s"


@pytest.mark.parametrize("line", [9, 10, 11])
def test_another_program_that_runs_is_named_and_no_line_of_the_open_one_marked(
    rig: PanelRig, line: int
) -> None:
    """One runs, and the teacher opens another meanwhile."""
    rig.runs("a", line)
    rig.open()
    assert page(rig) == ["pick              r3", "=a           running", *_statements(2)]
    assert listed(rig)[:2] == ["pick, revision 3", f"under way: a, running, line {line}"]
    assert listed(rig)[3:] == UNMARKED


def _statements(count: int) -> list[str]:
    return ["> 1 move PTP home", "  2 wait 2 s", "  3 move LIN P1"][:count]


def test_during_a_call_the_called_program_is_named_and_afterwards_the_caller_marked(
    rig: PanelRig,
) -> None:
    rig.open()
    rig.runs("pick", 9)
    rig.runs("gripper", 10, revision=1)
    assert page(rig)[:2] == ["pick              r3", "=gripper     running"]
    assert listed(rig)[3:] == UNMARKED
    rig.runs("pick", 11)
    assert listed(rig)[-1] == " =   3 move LIN P1"


def test_another_revision_of_the_open_program_is_another_program(rig: PanelRig) -> None:
    rig.open(replace(PROGRAM, revision=4))
    rig.runs("pick", 10, program_state=ProgramState.PAUSED)
    assert page(rig)[:2] == ["pick              r4", "=pick r3      paused"]
    assert listed(rig)[:2] == ["pick, revision 4", "under way: pick r3, paused, line 10"]


def test_it_is_named_where_no_program_is_open_or_the_open_one_is_empty(rig: PanelRig) -> None:
    rig.runs("a", 0, program_state=ProgramState.AT_BREAKPOINT)
    assert page(rig)[1:3] == ["No program is open", "=a     at breakpoint"]
    assert listed(rig)[1] == "under way: a, at breakpoint"
    rig.open(TaughtProgram("new", 1))
    assert page(rig)[:3] == ["new               r1", "=a     at breakpoint", "empty"]
    assert listed(rig)[1] == "under way: a, at breakpoint"


def test_the_end_of_a_run_takes_mark_and_name_away(rig: PanelRig) -> None:
    rig.open()
    for name in ("pick", "a"):
        rig.runs(name, 10)
        rig.runs(name, 0, program_state=ProgramState.NONE)
        assert page(rig) == ["pick              r3", *_statements(3)]
        assert listed(rig)[2:] == UNMARKED


def test_news_of_the_end_counts_before_the_state_that_goes_with_it(rig: PanelRig) -> None:
    rig.runs("a", 10)
    before = rig.panel.cell.state
    rig.runs("a", 0, program_state=ProgramState.NONE)
    rig.panel.cell.state = before
    rig.open()
    assert page(rig) == ["pick              r3", *_statements(3)]


def test_a_pendant_that_comes_later_learns_the_name_from_the_snapshot(rig: PanelRig) -> None:
    rig.open()
    connect_anew(rig, ProgramUnderWay(name="a", state="running", line=9, revision=1))
    rig.state(program_state=ProgramState.RUNNING, program_line=9)
    assert listed(rig)[1] == "under way: a, running, line 9"
    connect_anew(rig, None)
    rig.state(program_state=ProgramState.RUNNING, program_line=9)
    assert listed(rig)[0] == "pick, revision 3"


@pytest.mark.parametrize(
    ("news", "told"),
    [
        ({"name": "b", "line": 4}, ["under way: b, running, line 4"]),
        ({"name": "a", "line": 0, "program_state": ProgramState.NONE}, []),
    ],
)
def test_news_that_overtakes_the_snapshot_counts(
    rig: PanelRig, news: dict[str, Any], told: list[str]
) -> None:
    rig.panel.lost("cable")
    rig.panel.greeted()
    rig.runs(**news)
    run = ProgramUnderWay(name="a", state="running", line=9, revision=1)
    rig.panel.cell.connected(HELLO, snapshot(program=run))
    rig.state(program_state=ProgramState.RUNNING, program_line=9)
    assert listed(rig)[1:] == told
