"""What a rerun compares: whatever left then must leave now, there, in order, and nothing else."""

from collections.abc import Callable

import pytest

from openpendant.tools.packets.journals.journal_file import (
    BytesOut,
    Effect,
    GrantedQuestion,
    Header,
    JournalEvent,
)
from openpendant.tools.packets.journals.reenactment import Difference, ReplayedJournal

HEADER = Header("server", "0", "", 1_000, {})
HELLO, POINT = b"hello", b"point"


def played(
    effects: tuple[Effect, ...], play: Callable[[ReplayedJournal], object]
) -> ReplayedJournal:
    """Play a tick on link 1, 7 ns after the start, from which some effects followed then."""
    replayed = ReplayedJournal(HEADER)
    with replayed.expecting(JournalEvent(1, 7, "tick", "1", b"", {}, effects)):
        play(replayed)
    return replayed


def tick(replayed: ReplayedJournal) -> None:
    replayed.begin(replayed.now, "tick", 1)


def write(replayed: ReplayedJournal, link: str = "motion", data: bytes = POINT) -> None:
    tick(replayed)
    replayed.out(link, data)


def test_what_left_then_and_leaves_now_is_counted() -> None:
    replayed = played((BytesOut("motion", POINT),), write)
    assert (replayed.frames, replayed.bytes_out) == (1, len(POINT))


def test_the_time_of_an_event_is_that_of_the_journal() -> None:
    assert played((), tick).now == 1_007


def write_other_bytes(replayed: ReplayedJournal) -> None:
    write(replayed, data=HELLO)


def write_to_another_link(replayed: ReplayedJournal) -> None:
    write(replayed, link="state")


def write_twice(replayed: ReplayedJournal) -> None:
    write(replayed)
    replayed.out("motion", POINT)


def another_event(replayed: ReplayedJournal) -> None:
    replayed.begin(replayed.now, "in", 1)
    replayed.out("motion", POINT)


def the_event_of_another_link(replayed: ReplayedJournal) -> None:
    replayed.begin(replayed.now, "tick", 2)
    replayed.out("motion", POINT)


def the_event_twice(replayed: ReplayedJournal) -> None:
    write(replayed)
    replayed.begin(replayed.now, "tick", 1)


@pytest.mark.parametrize(
    "play",
    [
        tick,
        write_other_bytes,
        write_to_another_link,
        write_twice,
        another_event,
        the_event_of_another_link,
        the_event_twice,
    ],
    ids=lambda play: play.__name__,
)
def test_whatever_is_missing_more_or_other_is_a_difference(
    play: Callable[[ReplayedJournal], object],
) -> None:
    with pytest.raises(Difference):
        played((BytesOut("motion", POINT),), play)


def test_an_event_that_does_not_happen_is_a_difference_even_if_nothing_followed() -> None:
    with pytest.raises(Difference):
        played((), lambda replayed: None)


@pytest.mark.parametrize("wrong", ["motion", "state"])
def test_two_writes_must_leave_in_their_order(wrong: str) -> None:
    effects = (BytesOut("motion", POINT), BytesOut("state", POINT))

    def swapped(replayed: ReplayedJournal) -> None:
        write(replayed, link="state")
        replayed.out(wrong, POINT)

    with pytest.raises(Difference):
        played(effects, swapped)


def test_the_world_answers_as_it_did_then_and_each_question_once() -> None:
    answers: list[bool] = []

    def ask(replayed: ReplayedJournal) -> None:
        tick(replayed)
        for question, link in (("flooded", 1), ("clogged", 2), ("clogged", 1), ("clogged", 1)):
            answers.append(replayed.answer(question, link, False))

    played((GrantedQuestion("clogged", "1"),), ask)
    assert answers == [False, False, True, False]
