"""Which events of a journal are run again, and what a difference does to the end of the command."""

from __future__ import annotations

import io
import json
from pathlib import Path
from typing import Any

import pytest

from openpendant.tools.packets.journals.journal_file import (
    BytesOut,
    GrantedQuestion,
    JournalError,
    JournalFile,
)
from openpendant.tools.packets.rerun import main

HEADER = {
    "format": "openpendant-journal/1",
    "of": "emulator",
    "version": "0",
    "started": "",
    "now": 1,
    "settings": {"robot": "ur5"},
}
END = {"end": True}
WRITE = {"out": "1", "hex": "00ff"}
QUESTION = {"ask": "clogged", "link": "1"}


def tick(time: int) -> dict[str, Any]:
    return {"t": time, "on": "tick", "link": "1", "hex": ""}


def journal(*lines: dict[str, Any] | str) -> bytes:
    texts = [line if isinstance(line, str) else json.dumps(line) for line in (HEADER, *lines)]
    return "".join(f"{text}\n" for text in texts).encode()


def read(content: bytes) -> tuple[list[tuple[int, tuple[BytesOut | GrantedQuestion, ...]]], bool]:
    """Return the times of the events with what followed from each, and whether the end is cut."""
    file = JournalFile(Path("journal"), io.BytesIO(content))
    happened = [(each.time, each.effects) for each in file.happenings()]
    return happened, file.is_cut


def test_every_event_of_a_whole_journal_happens_with_all_that_followed() -> None:
    happened, is_cut = read(journal(tick(1), WRITE, QUESTION, tick(2), WRITE, END))
    write = BytesOut("1", b"\x00\xff")
    assert happened == [(1, (write, GrantedQuestion("clogged", "1"))), (2, (write,))]
    assert not is_cut


def test_the_last_event_of_a_journal_without_its_end_is_left_out_and_that_is_told() -> None:
    assert read(journal(tick(1), WRITE, tick(2))) == ([(1, (BytesOut("1", b"\x00\xff"),))], True)


def test_a_damaged_line_is_told_and_not_passed_over() -> None:
    with pytest.raises(JournalError, match="line 3: no JSON"):
        read(journal(tick(1), '{"out": "1", "he', tick(2), END))


@pytest.mark.parametrize(("effects", "code"), [([], 0), ([WRITE], 1)])
def test_a_run_in_which_a_write_is_missing_ends_as_one_with_findings(
    effects: list[dict[str, Any]], code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    opened = {"t": 1, "on": "opened", "link": "1", "hex": "", "port": "motion"}
    file = tmp_path / "journal"
    file.write_bytes(journal(opened, *effects, END))
    assert main([str(file)]) == code
    assert ("DIFFERENCE" in capsys.readouterr().out) == bool(code)
