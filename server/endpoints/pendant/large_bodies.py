"""Large bodies of management requests: read in the planning processes, one at a time a connection.

Owns what is being read for whom, and that a STOP which came meanwhile has overtaken it. What the
connection sends behind such a body is held until it was answered (`HoldClient`), so that a request
is judged with the rights, the authority and the revisions of the moment in which it acts. A body
that outlives its connection is withdrawn.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

from openpendant.simplemsg.pendant import Management
from openpendant.simplemsg.pendant.management.declaration import Request
from openpendant.simplemsg.verdicts import VerdictCode

from ...events.effects import Effect, HoldClient, ReleaseClient
from ...events.pending import Pending
from ...planning.jobs import BodyRead, PlanAnswer, ReadBody
from ...refusal import Refusal

Read: TypeAlias = Callable[[bytes], tuple[str, Request[Any] | Refusal]]
"""Reads a body; a function of a module, since a planning process calls it."""

Acts: TypeAlias = Callable[[str, Request[Any] | Refusal, bool, int], list[Effect]]
"""Takes the operation, what was read of it, whether a STOP has overtaken it, and the time [ns]."""


@dataclass(slots=True)
class BodyUnderWay:
    """A body that is being read."""

    job_id: int
    is_overtaken: bool


class LargeBodies:
    """The large bodies of one cell's pendants.

    Attributes:
        under_way: what is being read, by connection.
    """

    def __init__(self, pending: Pending, new_job_id: Callable[[], int]) -> None:
        """Read nothing yet."""
        self._pending = pending
        self._new_job_id = new_job_id
        self.under_way: dict[int, BodyUnderWay] = {}

    def read(
        self, session: int, message: Management, read: Read, then: Acts, *, is_overtaken: bool
    ) -> list[Effect]:
        """Have a body read; `then` is called once, unless its connection ends before."""
        job = ReadBody(self._new_job_id(), session, message.body, read)
        reading = self.under_way[session] = BodyUnderWay(job.job_id, is_overtaken)

        def answered(planned: PlanAnswer, now: int) -> list[Effect]:
            del self.under_way[session]
            found = planned.result
            if isinstance(found, BodyRead):
                out = then(found.operation, found.asked, reading.is_overtaken, now)
            else:
                lost = found if isinstance(found, Refusal) else _NOT_READ
                out = then("", lost, reading.is_overtaken, now)
            return [*out, ReleaseClient(session)]

        return [HoldClient(session), *self._pending.ask(job, answered)]

    def stopped(self, session: int) -> None:
        """Take note that a connection with a body under way sent a STOP, which acts before it."""
        self.under_way[session].is_overtaken = True

    def closed(self, session: int) -> list[Effect]:
        """Withdraw what is being read for a connection that ended."""
        reading = self.under_way.pop(session, None)
        return [] if reading is None else self._pending.cancel(reading.job_id)


_NOT_READ = Refusal(VerdictCode.PLANNER_FAILED)
