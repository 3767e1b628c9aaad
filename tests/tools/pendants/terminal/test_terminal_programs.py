"""How the terminal pendant opens and creates programs, and that it runs what it shows."""

from dataclasses import replace
from typing import Any, cast

import pytest
from rigs.cells.panel_rig import PROGRAM, PanelRig

from openpendant.simplemsg.pendant import ProgramReport, ProgramState
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import PendantClient, Refused
from openpendant.tools.pendants.terminal import commands as do
from openpendant.tools.pendants.terminal import lcd, screen_text
from openpendant.tools.pendants.terminal.keyboard import Page
from openpendant.tools.pendants.terminal.performer import OpenPrograms
from openpendant.tools.pendants.terminal.prompts import Choice, ProgramChoice
from openpendant.tools.pendants.terminal.taught_program import RecordHere

NAMES = ("five points", "Pick", "pick2", "unpick")


@pytest.fixture
def rig() -> PanelRig:
    return PanelRig()


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
