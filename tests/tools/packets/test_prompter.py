"""What a rerun compares: whatever left then must leave now, there, in order, and nothing else."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from openpendant.tools.packets.journals.journal_file import Asked, Effect, Happening, Header, Out
from openpendant.tools.packets.journals.reenactment import Difference, Prompter

HEADER = Header("server", "0", "", 1_000, {})
HELLO, POINT = b"hello", b"point"


def played(effects: tuple[Effect, ...], play: Callable[[Prompter], object]) -> Prompter:
    """Play a tick on link 1, 7 ns after the start, from which some effects followed then."""
    prompter = Prompter(HEADER)
    with prompter.prompting(Happening(1, 7, "tick", "1", b"", {}, effects)):
        play(prompter)
    return prompter


def tick(prompter: Prompter) -> None:
    prompter.begin("tick", 1)


def write(prompter: Prompter, link: str = "motion", data: bytes = POINT) -> None:
    tick(prompter)
    prompter.out(link, data)


def test_what_left_then_and_leaves_now_is_counted() -> None:
    prompter = played((Out("motion", POINT),), write)
    assert (prompter.frames, prompter.bytes_out) == (1, len(POINT))


def test_the_time_of_an_event_is_that_of_the_journal() -> None:
    assert played((), tick).now == 1_007


def write_other_bytes(prompter: Prompter) -> None:
    write(prompter, data=HELLO)


def write_to_another_link(prompter: Prompter) -> None:
    write(prompter, link="state")


def write_twice(prompter: Prompter) -> None:
    write(prompter)
    prompter.out("motion", POINT)


def another_event(prompter: Prompter) -> None:
    prompter.begin("in", 1)
    prompter.out("motion", POINT)


def the_event_of_another_link(prompter: Prompter) -> None:
    prompter.begin("tick", 2)
    prompter.out("motion", POINT)


def the_event_twice(prompter: Prompter) -> None:
    write(prompter)
    prompter.begin("tick", 1)


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
    play: Callable[[Prompter], object],
) -> None:
    with pytest.raises(Difference):
        played((Out("motion", POINT),), play)


def test_an_event_that_does_not_happen_is_a_difference_even_if_nothing_followed() -> None:
    with pytest.raises(Difference):
        played((), lambda prompter: None)


@pytest.mark.parametrize("wrong", ["motion", "state"])
def test_two_writes_must_leave_in_their_order(wrong: str) -> None:
    effects = (Out("motion", POINT), Out("state", POINT))

    def swapped(prompter: Prompter) -> None:
        write(prompter, link="state")
        prompter.out(wrong, POINT)

    with pytest.raises(Difference):
        played(effects, swapped)


def test_the_world_answers_as_it_did_then_and_each_question_once() -> None:
    answers: list[bool] = []

    def ask(prompter: Prompter) -> None:
        tick(prompter)
        for question, link in (("flooded", 1), ("clogged", 2), ("clogged", 1), ("clogged", 1)):
            answers.append(prompter.answer(question, link, False))

    played((Asked("clogged", "1"),), ask)
    assert answers == [False, False, True, False]
