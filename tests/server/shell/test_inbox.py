"""What the inbox owns of each event: its time, the time since the one before, and its record."""

import errno
from collections.abc import Iterator
from unittest.mock import Mock

import pytest

from openpendant.server.shell.inbox import Inbox, Observations
from openpendant.server.shell.loop_timing import Gap
from openpendant.simplemsg.journal import Journal, Part


def inbox_of(journal: Journal, clock: Iterator[int]) -> Inbox:
    return Inbox(journal, Mock(), [], Mock(), lambda: next(clock))


class Lines(list[str]):
    def write(self, *parts: Part) -> None:
        self.append("".join(map(str, parts)))


def test_the_clock_is_read_once_for_each_event() -> None:
    inbox = inbox_of(Journal(), iter([5, 6, 16]))
    assert [inbox.tick(), inbox.wire_bytes(4, b"some"), inbox.shut_down()] == [5, 6, 16]


def test_the_longest_time_between_two_events_is_known_with_what_it_began_with() -> None:
    inbox = inbox_of(Journal(), iter([5, 6, 16, 19, 20, 100]))
    inbox.tick()
    inbox.wire_bytes(4, b"first")
    inbox.wire_bytes(5, b"second")
    inbox.tick()
    assert inbox.longest_gap() == Gap(10, "in", 4, b"first")
    inbox.shut_down()
    assert inbox.longest_gap() == Gap(1, "tick")
    inbox.tick()
    assert inbox.longest_gap() == Gap(80, "shut-down")


def test_an_event_is_noted_with_the_time_that_it_has() -> None:
    lines, journal = Lines(), Journal()
    journal.keep(lines, Mock(), 100, kind="server", started="")
    assert inbox_of(journal, iter([107])).wire_bytes(3, b"\xab") == 107
    assert lines[1:] == ['{"t": 7, "on": "in", "link": "3", "hex": "ab"}\n']


@pytest.mark.parametrize("answer", [True, False])
def test_a_journal_that_is_not_kept_is_asked_nothing(answer: bool) -> None:
    journal = Mock(spec=["is_kept"], is_kept=False)
    inbox_of(journal, iter([1])).wire_bytes(3, b"some")
    observations = Observations(journal)
    observations.sent(3, b"some")
    assert observations.is_flooded(3, answer) is answer


def test_a_journal_that_fails_ends_and_time_and_answers_go_on() -> None:
    class FullDisk(Lines):
        def write(self, *parts: Part) -> None:
            super().write(*parts)
            if len(self) > 1:
                raise OSError(errno.ENOSPC, "No space left on device")

    lines, failures, journal = FullDisk(), Mock(), Journal()
    journal.keep(lines, failures, 0, kind="server", started="")
    inbox = inbox_of(journal, iter([1, 2]))
    assert [inbox.tick(), inbox.tick()] == [1, 2]
    assert Observations(journal).is_clogged(3, True)
    assert not inbox.is_noted
    failures.assert_called_once()
    assert len(lines) == 2
