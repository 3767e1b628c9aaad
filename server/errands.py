"""What cores ask of the store, and who waits for the answer.

Owns the numbers of errands and what is to be done with each answer. The shell has an errand done
and tells the core; a core never waits.
"""

from __future__ import annotations

from itertools import count

from .outgoing import Errand, Outgoing
from .store.questions import Then
from .store.requests import Answer, Request


class Errands:
    """The errands of one cell that are not done yet."""

    def __init__(self) -> None:
        """Begin with none."""
        self._numbers = count(1)
        self._waiting: dict[int, Then] = {}

    def ask(self, request: Request, then: Then) -> list[Outgoing]:
        """Ask the store for something.

        Args:
            request: what.
            then: called once with the answer.
        """
        number = next(self._numbers)
        self._waiting[number] = then
        return [Errand(number, request)]

    def done(self, errand_id: int, answer: Answer, now: int) -> list[Outgoing]:
        """Take the answer to an errand; one that nobody waits for is dropped."""
        then = self._waiting.pop(errand_id, None)
        return [] if then is None else then(answer, now)
