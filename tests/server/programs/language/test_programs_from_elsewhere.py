from __future__ import annotations

import pytest
from rigs.cells.program_cell import HEAD, ProgramCell, ask

from openpendant.simplemsg.verdicts import VerdictCode as V

TEXT = HEAD.format(name="main") + "move PTP a\n"
JSON = '{"format":"openpendant-program/1","name":"main","robot":"ur5"}'


@pytest.mark.parametrize(("form", "body"), [("text", TEXT), ("json", JSON)])
def test_a_byte_order_mark_in_front_changes_nothing(form: str, body: str) -> None:
    cell = ProgramCell()
    marked = "\ufeff" + body
    assert "code" not in ask(cell.user, "programs.check", format=form, body=marked)
    saved = {"name": "main", "format": form, "body": marked, "expected_revision": 0}
    assert ask(cell.user, "programs.save", **saved)["revision"] == 1
    loaded = ask(cell.user, "programs.load", name="main", format=form)["body"]
    assert not str(loaded).startswith("\ufeff")


def test_a_key_that_stands_twice_is_refused() -> None:
    body = JSON.replace('"name":"main"', '"name":"main","name":"other"')
    refused = ask(ProgramCell().user, "programs.check", format="json", body=body)
    assert refused["code"] == V.PROGRAM_SYNTAX
    assert "has the key 'name' twice" in str(refused["text"])
