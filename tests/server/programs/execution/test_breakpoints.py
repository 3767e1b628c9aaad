from __future__ import annotations

import pytest
from rigs.cells.program_cell import BODY_LINE, ProgramCell, ask

from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.mark.parametrize("statement", [4, 999])
def test_a_breakpoint_at_a_statement_that_is_not_there_is_refused_with_their_number(
    statement: int,
) -> None:
    cell = ProgramCell(main="move PTP a\nmove PTP b\nmove PTP c\nmove PTP a\n")
    refused = ask(cell.user, "programs.breakpoints", name="main", statements=[0, statement])
    assert refused["code"] == V.BAD_ARGUMENT
    assert f"statement {statement}" in refused["text"]
    assert f"has 4; accepted: 0 to 3, which is line {BODY_LINE + 3}" in refused["text"]
    assert "breakpoints" not in ask(cell.user, "programs.load", name="main")


def test_breakpoints_of_a_program_that_is_gone_can_be_taken_away_but_not_set() -> None:
    cell = ProgramCell()
    assert ask(cell.user, "programs.breakpoints", name="main", statements=[0])["code"] == (
        V.NOT_FOUND
    )
    assert ask(cell.user, "programs.breakpoints", name="main", statements=[])["statements"] == []
