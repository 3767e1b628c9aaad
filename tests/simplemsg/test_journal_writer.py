from __future__ import annotations

import errno
import os
from pathlib import Path

import pytest

from openpendant.simplemsg import journal_writer
from openpendant.simplemsg.journal import PIECE, hexadecimal
from openpendant.simplemsg.journal_writer import JournalWriter


def test_what_was_taken_is_in_the_file_when_it_is_closed(tmp_path: Path) -> None:
    writer = JournalWriter(tmp_path / "journal")
    for number in range(1_000):
        writer.write(f"{number}\n")
    writer.close()
    assert (tmp_path / "journal").read_text() == "".join(f"{number}\n" for number in range(1_000))


def test_what_is_long_is_spelled_out_in_its_place(tmp_path: Path) -> None:
    writer = JournalWriter(tmp_path / "journal")
    data = b"\x01\xfe" * PIECE
    writer.write('{"hex": ', hexadecimal(data), "}\n")
    writer.write("next")
    writer.close()
    assert (tmp_path / "journal").read_text() == f'{{"hex": "{data.hex()}"}}\nnext'


def test_an_older_journal_is_kept_under_a_number(tmp_path: Path) -> None:
    for run in ("first", "second", "third"):
        writer = JournalWriter(tmp_path / "journal")
        writer.write(run)
        writer.close()
    assert (tmp_path / "journal").read_text() == "third"
    assert (tmp_path / "journal.1").read_text() == "first"
    assert (tmp_path / "journal.2").read_text() == "second"


def test_a_full_disk_is_told_at_the_latest_when_the_file_is_closed() -> None:
    writer = JournalWriter(Path("/dev/full"))
    writer.write("x")
    with pytest.raises(OSError, match="space") as told:
        writer.close()
    assert told.value.errno == errno.ENOSPC


def test_a_pipe_is_refused_because_nobody_may_read_it(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(OSError, match="pipe"):
        JournalWriter(tmp_path / "pipe")


def test_a_disk_that_does_not_keep_up_ends_the_journal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(journal_writer, "MOST_WAITING", 10)
    for waiting in ("x" * 11, hexadecimal(b"x" * PIECE)):
        writer = JournalWriter(tmp_path / "journal")
        with pytest.raises(OSError, match="too slow"):
            writer.write(waiting)
        writer.close()
