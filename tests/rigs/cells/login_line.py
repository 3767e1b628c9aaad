"""Logins that wait for one password worker, on a hand-driven clock: each check takes as long."""

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import count
from typing import NamedTuple

from rigs.cells.admission_desk import SECOND, START, Desk, is_right

from openpendant.server.access.admission import VerifyJob
from openpendant.server.access.login_queue import LoginQueue, QueuedCheck
from openpendant.server.access.passwords import Secret
from openpendant.server.access.request_gate import Granted
from openpendant.server.refusal import Refusal

CHECK = SECOND // 4
"""How long a check of a password takes [ns]."""


class Answer(NamedTuple):
    """An answer to a login.

    Attributes:
        at: when it came [ns].
        checks: passwords that had been checked by then, its own included.
    """

    outcome: Granted | Refusal
    at: int
    checks: int

    @property
    def is_in(self) -> bool:
        return isinstance(self.outcome, Granted)


@dataclass
class LoginLine:
    """A desk, the queue behind it, and who comes when."""

    desk: Desk
    queue: LoginQueue = field(default_factory=LoginQueue)
    now: int = START
    answers: dict[int, Answer] = field(default_factory=dict)
    checked: list[VerifyJob] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._coming: list[tuple[int, int, Callable[[], None]]] = []
        self._order, self._sessions = count(), count(1)
        self._jobs: dict[int, VerifyJob] = {}
        self._under_way: VerifyJob | None = None

    def at(self, time: int, step: Callable[[], None]) -> None:
        """Have something happen at a time [ns]."""
        heapq.heappush(self._coming, (time, next(self._order), step))

    def come(self, address: str, name: str, password: str = "", after: int = 0) -> int:
        """Have a new connection log in, with the right password unless told another.

        Args:
            after: from now [ns].

        Returns:
            Its number.
        """
        session = next(self._sessions)
        typed = password or f"{name}'s password"
        self.at(self.now + after, lambda: self._log_in(session, address, name, typed))
        return session

    def leave(self, session: int) -> None:
        """End a connection now."""
        job_id = self.desk.login.closed(session, self.now)
        if job_id is not None and self.queue.withdraw(job_id):
            self._settle(self._jobs.pop(job_id), None)

    def run(self, until: int) -> None:
        """Go on to a time [ns]; what happens then has happened."""
        while self._coming and self._coming[0][0] <= until:
            self.now, _, step = heapq.heappop(self._coming)
            step()
        self.now = max(self.now, until)

    def _log_in(self, session: int, address: str, name: str, typed: str) -> None:
        self.desk.login.welcomed(session, address, f"app {session}", "cell", self.now)
        job = self.desk.login.try_password(session, name, Secret(typed), self.now)
        if isinstance(job, Refusal):
            self.answers[session] = Answer(job, self.now, len(self.checked))
            return
        self._jobs[job.job_id] = job
        turned_away = self.queue.put(
            QueuedCheck(job.job_id, job.source, job.account, job.has_failed)
        )
        if turned_away is not None:
            self._settle(self._jobs.pop(turned_away.number), None)
        self._go_on()

    def _go_on(self) -> None:
        if self._under_way is not None:
            return
        place = self.queue.take(self.now)
        if isinstance(place, int):
            self.at(self.now + place, self._go_on)
        elif place is not None:
            self._under_way = self._jobs.pop(place.number)
            self.at(self.now + CHECK, self._done)

    def _done(self) -> None:
        job, self._under_way = self._under_way, None
        assert job is not None
        self.checked.append(job)
        outcome = is_right(job)
        self.queue.settle(outcome, self.now)
        self._settle(job, outcome)
        self._go_on()

    def _settle(self, job: VerifyJob, outcome: bool | None) -> None:
        login = self.desk.login
        if outcome is None:
            answer: Granted | Refusal = login.not_verified(job.job_id)
        else:
            answer = login.verified(job.job_id, outcome, self.now)
        self.answers[job.session] = Answer(answer, self.now, len(self.checked))
