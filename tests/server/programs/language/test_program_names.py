from __future__ import annotations

import pytest
from rigs.cells import memory_store
from rigs.cells.program_cell import ProgramCell, ask

from openpendant.server.store.documents import check_name
from openpendant.simplemsg.verdicts import VerdictCode as V


def test_a_name_that_no_message_could_carry_is_refused_when_the_program_is_made() -> None:
    """What can be made can be run: the start of a program has 64 bytes for its name."""
    user = ProgramCell().user
    refused = ask(user, "programs.create", name="ü" * 33)
    assert (refused["code"], refused["value"], refused["limit"]) == (V.BAD_NAME, 66, 64)
    assert ask(user, "programs.create", name="ü" * 32)["revision"] == 1
    renamed = ask(user, "programs.rename", name="ü" * 32, new_name="ü" * 33, expected_revision=1)
    assert renamed["code"] == V.BAD_NAME


@pytest.mark.parametrize("name", ["ü" * 64, "𝔭" * 64], ids=["128 bytes", "256 bytes"])
def test_an_older_program_with_a_longer_name_is_listed_loaded_and_renamed(
    monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """Up to 64 letters once, whatever their bytes: only its start cannot be asked for any more."""
    cell = ProgramCell()
    with monkeypatch.context() as before:
        before.setattr(memory_store, "check_new_name", check_name)
        cell.keep(name, "wait 1 s\n")
    assert [each["name"] for each in ask(cell.user, "programs.list")["programs"]] == [name]
    assert ask(cell.user, "programs.load", name=name)["name"] == name
    renamed = ask(cell.user, "programs.rename", name=name, new_name="short", expected_revision=1)
    assert (renamed["name"], renamed["revision"]) == ("short", 1)
    assert [each["name"] for each in ask(cell.user, "programs.list")["programs"]] == ["short"]
    assert cell.run("short") is V.ACCEPTED


@pytest.mark.parametrize(
    ("name", "says"), [("a/b", "the name of the program has '/'"), ("", "has 0 characters")]
)
def test_a_refusal_of_a_name_speaks_of_the_name(name: str, says: str) -> None:
    refused = ask(ProgramCell().user, "programs.create", name=name)
    assert says in str(refused["text"])
