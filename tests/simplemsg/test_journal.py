from __future__ import annotations

import errno
import io
import json

import pytest

from openpendant.simplemsg.journal import (
    JOURNAL_FORMAT,
    LONG,
    Journal,
    LongValue,
    Part,
    spelled,
    with_long_texts,
)

START = 5_000_000_000


class Lines(io.StringIO):
    """A stream that spells out at once what is long."""

    def write(self, *parts: Part) -> int:
        return super().write("".join(map(spelled, parts)))


class Clock:
    def __init__(self) -> None:
        self.now = START

    def __call__(self) -> int:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def _kept(clock: Clock, stream: Lines) -> Journal:
    journal = Journal(clock)
    journal.keep(stream, _fail, kind="server", started="then", version="1", settings={"a": 1})
    return journal


def _fail(error: OSError) -> None:
    raise AssertionError(error)


def test_an_event_has_one_time_however_long_it_is_handled(clock: Clock) -> None:
    journal = Journal(clock)
    assert journal.begin("tick") == START
    clock.now += 10
    assert journal.now == START


def test_a_journal_that_is_not_kept_tells_the_time_and_passes_answers_on(clock: Clock) -> None:
    journal = Journal(clock)
    journal.begin("in", 1, b"\x01")
    journal.out(1, b"\x02")
    assert journal.answer("clogged", 1, True) is True
    assert journal.answer("clogged", 1, False) is False
    assert not journal.is_kept


def test_lines_say_what_happened_and_what_followed(clock: Clock) -> None:
    stream = Lines()
    journal = _kept(clock, stream)
    clock.now += 7
    journal.begin("opened", 3, b"\xab", port="motion")
    journal.out(3, b"\xcd")
    journal.answer("clogged", 3, True)
    assert [json.loads(line) for line in stream.getvalue().splitlines()] == [
        {
            "format": JOURNAL_FORMAT,
            "of": "server",
            "started": "then",
            "now": START,
            "version": "1",
            "settings": {"a": 1},
        },
        {"t": 7, "on": "opened", "link": "3", "hex": "ab", "port": "motion"},
        {"out": "3", "hex": "cd"},
        {"ask": "clogged", "link": "3"},
    ]


def test_what_is_long_reaches_the_stream_as_it_is(clock: Clock) -> None:
    """To spell it out is the stream's business, which has the time."""
    taken: list[Part] = []

    class Taking(Lines):
        def write(self, *parts: Part) -> int:
            taken.extend(parts)
            return super().write(*parts)

    stream = Taking()
    journal = _kept(clock, stream)
    journal.begin("in", 1, b"\xab" * LONG, body=with_long_texts("x" * LONG))
    journal.out(1, b"\xcd" * LONG)
    assert [part.content for part in taken if isinstance(part, LongValue)] == [
        b"\xab" * LONG,
        "x" * LONG,
        b"\xcd" * LONG,
    ]
    _, event, effect = map(json.loads, stream.getvalue().splitlines())
    assert (event["hex"], event["body"]) == ("ab" * LONG, "x" * LONG)
    assert effect == {"out": "1", "hex": "cd" * LONG}


def test_only_answers_of_yes_are_noted(clock: Clock) -> None:
    stream = Lines()
    assert not _kept(clock, stream).answer("gone", 1, False)
    assert "gone" not in stream.getvalue()


def test_nothing_is_written_after_the_end(clock: Clock) -> None:
    stream = Lines()
    journal = _kept(clock, stream)
    before = stream.getvalue()
    journal.end()
    stream.close()
    journal.begin("tick")
    journal.out(1, b"\x01")
    assert before
    assert not journal.is_kept


class FullDisk(Lines):
    def write(self, *parts: Part) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_ends_the_journal_once_and_nothing_else(clock: Clock) -> None:
    told: list[OSError] = []
    journal = Journal(clock)
    journal.keep(FullDisk(), told.append, kind="emulator", started="")
    assert journal.begin("tick") == START
    journal.out(1, b"\x01")
    assert [error.errno for error in told] == [errno.ENOSPC]
    assert not journal.is_kept
