"""A journal: what its lines say, what is long in them, and the file they are written to."""

import base64
import errno
import io
import json
import os
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from openpendant.simplemsg import journal_writer
from openpendant.simplemsg.journal import (
    JOURNAL_FORMAT,
    LONG,
    PIECE,
    Journal,
    LongValue,
    Part,
    base64_value,
    hexadecimal,
    json_parts,
    spelled,
    with_long_texts,
)
from openpendant.simplemsg.journal_writer import JournalWriter

START = 5_000_000_000
SAID: dict[str, Any] = {"started": "then", "version": "1", "settings": {"a": 1}}
NEVER = Mock(side_effect=AssertionError)


class Lines(io.StringIO):
    """A stream that spells out at once what is long."""

    def write(self, *parts: Part) -> int:
        return super().write("".join(map(spelled, parts)))


def _kept(stream: Lines) -> Journal:
    journal = Journal()
    journal.keep(stream, NEVER, START, kind="server", **SAID)
    return journal


def test_lines_say_what_happened_and_what_followed() -> None:
    stream = Lines()
    journal = _kept(stream)
    journal.begin(START + 7, "opened", 3, b"\xab", {"port": "motion"})
    journal.out(3, b"\xcd")
    journal.answer("clogged", 3, True)
    assert [json.loads(line) for line in stream.getvalue().splitlines()] == [
        {"format": JOURNAL_FORMAT, "of": "server", "now": START, **SAID},
        {"t": 7, "on": "opened", "link": "3", "hex": "ab", "port": "motion"},
        {"out": "3", "hex": "cd"},
        {"ask": "clogged", "link": "3"},
    ]


def test_what_is_long_reaches_the_stream_as_it_is() -> None:
    """To spell it out is the stream's business, which has the time."""
    taken: list[Part] = []

    class Taking(Lines):
        def write(self, *parts: Part) -> int:
            taken.extend(parts)
            return super().write(*parts)

    stream = Taking()
    journal = _kept(stream)
    journal.begin(START, "in", 1, b"\xab" * LONG, {"body": with_long_texts("x" * LONG)})
    journal.out(1, b"\xcd" * LONG)
    long = [part.content for part in taken if isinstance(part, LongValue)]
    assert long == [b"\xab" * LONG, "x" * LONG, b"\xcd" * LONG]
    _, event, effect = map(json.loads, stream.getvalue().splitlines())
    assert (event["hex"], event["body"]) == ("ab" * LONG, "x" * LONG)
    assert effect == {"out": "1", "hex": "cd" * LONG}


def test_only_answers_of_yes_are_noted() -> None:
    stream = Lines()
    assert not _kept(stream).answer("gone", 1, False)
    assert "gone" not in stream.getvalue()


def test_nothing_is_written_after_the_end() -> None:
    stream = Lines()
    journal = _kept(stream)
    before = stream.getvalue()
    journal.end()
    stream.close()
    journal.begin(START, "tick")
    journal.out(1, b"\x01")
    assert before
    assert not journal.is_kept


def test_a_full_disk_ends_the_journal_once_and_nothing_else() -> None:
    told: list[OSError] = []
    journal = Journal()
    disk = Mock(write=Mock(side_effect=OSError(errno.ENOSPC, "No space left on device")))
    journal.keep(disk, told.append, START, kind="emulator", started="")
    journal.begin(START, "tick")
    journal.out(1, b"\x01")
    assert [error.errno for error in told] == [errno.ENOSPC]
    assert not journal.is_kept


# What is long is spelled out later, and reads as if it had been at once.

DATA = bytes(range(256)) * 1_000


def spelled_out(value: Any) -> str:
    return "".join(map(spelled, json_parts(value)))


@pytest.mark.parametrize("size", [0, 1, LONG - 1, LONG, PIECE - 1, PIECE, PIECE + 1, len(DATA)])
def test_bytes_read_the_same_however_long_they_are(size: int) -> None:
    data = DATA[:size]
    assert spelled(hexadecimal(data)) == f'"{data.hex()}"'
    assert json.loads(spelled_out(base64_value(data))) == base64.b64encode(data).decode()
    assert isinstance(hexadecimal(data), LongValue) == (size >= LONG)
    assert isinstance(base64_value(data), LongValue) == (size >= LONG)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "short",
        "größe 😀 " * 20_000,
        '"\\\n\x00' * 20_000,
        "\ud83d" * LONG,
        '{"": ""}' * LONG,
    ],
)
def test_texts_read_the_same_and_long_ones_are_left_for_later(text: str) -> None:
    record = {"body": text, "parts": [text, "{}", {"n": 1, "none": None, "text": text}]}
    marked = with_long_texts(record)
    assert json.loads(spelled_out(marked)) == record
    left = [part for part in json_parts(marked) if isinstance(part, LongValue)]
    assert len(left) == (3 if len(text) >= LONG else 0)
    assert sum(len(part) for part in json_parts(marked) if isinstance(part, str)) < 4 * LONG


def test_a_piece_of_a_long_value_is_short() -> None:
    value = hexadecimal(DATA)
    assert isinstance(value, LongValue)
    assert len(value) == len(DATA)
    assert max(map(len, value.pieces())) == 2 * PIECE


def test_what_cannot_stand_in_a_journal_is_refused_by_its_type() -> None:
    with pytest.raises(TypeError, match="bytearray cannot stand in a journal"):
        spelled_out({"body": bytearray(3)})


# The file.


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


@pytest.fixture
def open_umask() -> Iterator[None]:
    """Files that are made without a mode of their own can be read by everybody."""
    before = os.umask(0)
    yield
    os.umask(before)


def mode(file: Path) -> int:
    return stat.S_IMODE(file.stat().st_mode)


def test_a_journal_is_its_owners_alone_from_its_first_byte(
    tmp_path: Path, open_umask: None
) -> None:
    JournalWriter(tmp_path / "journal").close()
    assert mode(tmp_path / "journal") == 0o600


@pytest.mark.parametrize("content", ["", "an older journal"])
def test_a_file_that_was_open_to_others_is_not_when_a_journal_is_in_it(
    content: str, tmp_path: Path, open_umask: None
) -> None:
    file = tmp_path / "journal"
    file.write_text(content)
    assert mode(file) == 0o666
    writer = JournalWriter(file)
    assert mode(file) == 0o600
    assert file.read_text() == ""
    writer.close()


def test_a_journal_behind_a_link_is_its_owners_alone(tmp_path: Path, open_umask: None) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "journal")
    JournalWriter(tmp_path / "link").close()
    assert mode(tmp_path / "journal") == 0o600


def test_a_journal_to_a_device_leaves_it_as_it_is(open_umask: None) -> None:
    before = mode(Path("/dev/null"))
    JournalWriter(Path("/dev/null")).close()
    assert mode(Path("/dev/null")) == before


def test_a_file_that_cannot_be_made_its_owners_alone_takes_no_journal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: int, mode: int) -> None:
        raise PermissionError(errno.EPERM, "Operation not permitted")

    (tmp_path / "journal").touch(0o644)
    (tmp_path / "journal").chmod(0o644)
    monkeypatch.setattr(os, "fchmod", refuse)
    with pytest.raises(PermissionError) as told:
        JournalWriter(tmp_path / "journal")
    assert told.value.filename == str(tmp_path / "journal")


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
