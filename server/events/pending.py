"""Pending questions of one cell: number of each question to the handler of its answer.

Owns the numbers of questions to the store and the handler of each answer. A core never waits: its
shell passes the question to a backend, and the answer comes back as an event.

Owns work of several steps, too: a generator that yields questions and is sent their answers.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Mapping
from enum import Enum
from functools import partial
from itertools import count
from typing import Any, NamedTuple, TypeAlias, TypeVar, overload

from ..access.accounts import AccountChange
from ..access.admission import VerifyJob
from ..access.connection_loads import ConnectionLoad, LoadQuestion
from ..planning.jobs import Job, PlanAnswer
from ..refusal import Refusal
from ..store.requests import Answer, Request
from .effects import BACKENDS, Ask, Backend, Cancel, Effect, Question

Then: TypeAlias = Callable[[Answer, int], list[Effect]]
"""Takes an answer of the store and the time [ns]; returns what follows."""

AskStore: TypeAlias = Callable[[Request, Then], list[Effect]]
"""Sends a request to the store; returns the effects for the shell."""

ThenPlanned: TypeAlias = Callable[[PlanAnswer, int], list[Effect]]
"""Takes an answer of the planner and the time [ns]; returns what follows."""


class Turn(Enum):
    """Turn that a step of long work asks for, so that it does not block the event loop.

    One task has a turn in each tick: the first that asked for one keeps it until it is done.
    """

    FIRST = "go on at once where nobody waits for a turn"
    NEXT = "go on with the next tick"
    LAST = "go on with a later tick, behind whoever waits for a turn"


_T = TypeVar("_T")

Steps: TypeAlias = Generator[Question | Turn, Any, _T]
"""Work of several steps: each question that it yields comes back with its answer."""


class _Waiting(NamedTuple):
    """A question, and the handler of its answer."""

    asked: Ask
    then: Callable[[Any, int], list[Effect]]


class Pending:
    """The questions of one cell that are not answered yet."""

    def __init__(self) -> None:
        """Make a book without questions."""
        self._store_numbers = count(1)
        self._waiting: dict[tuple[Backend, int], _Waiting] = {}
        self._running: dict[Steps[Any], Callable[[Any, int], list[Effect]]] = {}
        self._turns: deque[Steps[Any]] = deque()

    @overload
    def ask(self, question: Job, then: ThenPlanned) -> list[Effect]: ...

    @overload
    def ask(self, question: Request, then: Then) -> list[Effect]: ...

    @overload
    def ask(
        self, question: VerifyJob, then: Callable[[bool | None, int], list[Effect]]
    ) -> list[Effect]: ...

    @overload
    def ask(
        self, question: AccountChange, then: Callable[[Refusal | None, int], list[Effect]]
    ) -> list[Effect]: ...

    @overload
    def ask(
        self,
        question: LoadQuestion,
        then: Callable[[Mapping[int, ConnectionLoad], int], list[Effect]],
    ) -> list[Effect]: ...

    def ask(self, question: Question, then: Callable[[Any, int], list[Effect]]) -> list[Effect]:
        """Ask something.

        Args:
            question: what; jobs and changes have their numbers already.
            then: called once with the answer.
        """
        if isinstance(question, Request):
            number = next(self._store_numbers)
        elif isinstance(question, AccountChange):
            number = question.number
        else:
            number = question.job_id
        asked = Ask(number, question)
        self._waiting[BACKENDS[type(question)], number] = _Waiting(asked, then)
        return [asked]

    def resume(self, asked: Ask, answer: object, now: int) -> list[Effect]:
        """Pass an answer to its handler; drop one that has none.

        A plan that is being made tells how far it has come, which is not its last answer.
        """
        key = BACKENDS[type(asked.question)], asked.id
        is_final = not isinstance(answer, PlanAnswer) or answer.is_final
        waiting = self._waiting.pop(key, None) if is_final else self._waiting.get(key)
        return [] if waiting is None else waiting.then(answer, now)

    def find(self, backend: Backend, number: int) -> Ask | None:
        """Return a question that is not answered yet; None where there is none."""
        waiting = self._waiting.get((backend, number))
        return None if waiting is None else waiting.asked

    def cancel(self, job_id: int) -> list[Effect]:
        """Stop waiting for a planning job; return no effect if nothing waits for it."""
        waiting = self._waiting.pop((Backend.PLANNER, job_id), None)
        return [] if waiting is None else [Cancel(job_id)]

    # Work of several steps.

    def run(
        self, steps: Steps[_T], then: Callable[[_T, int], list[Effect]], now: int
    ) -> list[Effect]:
        """Start work of several steps.

        Args:
            then: called once with what it returns, unless it is dropped before.
        """
        self._running[steps] = then
        return self._advance(steps, None, now)

    def drop(self, steps: Steps[Any]) -> None:
        """Cancel work: it asks no more questions, and `then` is not called."""
        self._running.pop(steps, None)
        steps.close()

    def tick(self, now: int) -> list[Effect]:
        """Give the turn to the first task that waits for one."""
        while self._turns:
            steps = self._turns.popleft()
            if steps in self._running:
                return self._advance(steps, None, now)
        return []

    def _advance(self, steps: Steps[Any], answer: object, now: int) -> list[Effect]:
        """Advance work to its next question, turn or end."""
        if steps not in self._running:
            return []
        try:
            wanted = steps.send(answer)
            if wanted is Turn.FIRST and not self._turns:
                wanted = next(steps)
        except StopIteration as end:
            then = self._running.pop(steps)
            return then(end.value, now)
        if isinstance(wanted, Turn):
            # The task that has the turn keeps it; a new one, or one that can wait, is the last.
            take = self._turns.appendleft if wanted is Turn.NEXT else self._turns.append
            take(steps)
            return []
        return self.ask(wanted, partial(self._advance, steps))
