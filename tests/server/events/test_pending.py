from __future__ import annotations

import pytest

from openpendant.server.events.effects import Ask, Backend, Cancel, Effect
from openpendant.server.events.pending import Pending, Steps, Turn
from openpendant.server.planning.jobs import PlanAnswer, ProgramJob
from openpendant.server.programs.editing.program_tasks import PrintBody
from openpendant.server.refusal import Refusal
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.requests import Answer, ListHeadings, Load
from openpendant.server.store.store_errors import NotFound
from openpendant.simplemsg.verdicts import VerdictCode as V

LOAD = Load(DocumentKind.PROGRAM, "a")
MISSING = NotFound("program", "a")


class Book:
    def __init__(self) -> None:
        self.pending = Pending()
        self.told: list[tuple[object, int]] = []

    def take(self, answer: object, now: int) -> list[Effect]:
        self.told.append((answer, now))
        return []


@pytest.fixture
def book() -> Book:
    return Book()


def asked(outgoing: list[Effect]) -> Ask:
    (ask,) = outgoing
    assert isinstance(ask, Ask)
    return ask


def test_each_answer_goes_to_who_waits_for_it_and_only_once(book: Book) -> None:
    first = asked(book.pending.ask(LOAD, book.take))
    second = asked(book.pending.ask(ListHeadings(), book.take))
    assert (first.id, second.id) == (1, 2)
    book.pending.resume(second, (), 7)
    assert book.told == [((), 7)]
    assert book.pending.find(Backend.STORE, 1) is first
    assert book.pending.find(Backend.STORE, 2) is None
    book.pending.resume(second, (), 8)
    assert book.told == [((), 7)]


def test_a_job_and_a_request_of_one_number_are_two_questions(book: Book) -> None:
    job = ProgramJob(1, PrintBody("{}", "a"))
    planner, store = (
        asked(book.pending.ask(job, book.take)),
        asked(book.pending.ask(LOAD, book.take)),
    )
    assert (planner.backend, store.backend) == (Backend.PLANNER, Backend.STORE)
    book.pending.resume(store, MISSING, 1)
    assert book.told == [(MISSING, 1)]
    assert book.pending.find(Backend.PLANNER, 1) is planner


def test_a_job_is_cancelled_once_and_its_answer_ignored(book: Book) -> None:
    job = ProgramJob(5, PrintBody("{}", "a"))
    ask = asked(book.pending.ask(job, book.take))
    assert book.pending.cancel(5) == [Cancel(5)]
    assert book.pending.cancel(5) == []
    planned = PlanAnswer(5, Refusal(V.PLANNER_FAILED), 0.0)
    assert book.pending.resume(ask, planned, 1) == []
    assert book.told == []


def two_answers() -> Steps[tuple[Answer, Answer]]:
    first = yield LOAD
    second = yield ListHeadings()
    return first, second


def test_work_of_several_steps_is_sent_each_answer_and_ends_once(book: Book) -> None:
    first = asked(book.pending.run(two_answers(), book.take, 1))
    second = asked(book.pending.resume(first, MISSING, 2))
    assert (first.question, second.question) == (LOAD, ListHeadings())
    assert book.pending.resume(second, (), 3) == []
    assert book.told == [((MISSING, ()), 3)]


def test_work_that_was_dropped_asks_for_no_more_and_tells_nobody(book: Book) -> None:
    steps = two_answers()
    first = asked(book.pending.run(steps, book.take, 1))
    book.pending.drop(steps)
    assert book.pending.resume(first, MISSING, 2) == []
    assert book.told == []


def long_work(name: str, turns: int, done: list[str]) -> Steps[str]:
    yield Turn.FIRST
    for _ in range(turns):
        done.append(name)
        yield Turn.NEXT
    done.append(name)
    return name


def test_one_task_has_a_turn_in_each_tick_and_keeps_it_to_its_end(book: Book) -> None:
    done: list[str] = []
    dropped = long_work("c", 2, done)
    for steps in (long_work("a", 2, done), long_work("b", 1, done), dropped):
        book.pending.run(steps, book.take, 0)
    assert done == ["a"]
    book.pending.drop(dropped)
    seen = []
    for now in range(1, 6):
        book.pending.tick(now)
        seen.append("".join(done))
    assert seen == ["aa", "aaa", "aaab", "aaabb", "aaabb"]
    assert book.told == [("a", 2), ("b", 4)]
