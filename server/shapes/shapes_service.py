"""Shapes service: what robots look like, and the bytes of the meshes of this cell's robot.

Owns what is kept of the answers, which depend on files that no cell changes, and what is withdrawn
with a connection. Anybody who may look on may ask. What the cell's own robot looks like is known
when the cell is made: each page asks for that first, and does not wait until the process for
questions has started. No robot file and no mesh is read on the event loop: that is the business of
that process, and an answer that is kept is its text.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from itertools import count
from typing import Any

from openpendant.simplemsg.pendant.management import shapes as op
from openpendant.simplemsg.verdicts import VerdictCode

from ..access.connection_loads import ConnectionLoad, LoadQuestion
from ..events.effects import Effect
from ..events.management_requests import ReplyTo, handles
from ..events.pending import Pending
from ..planning.jobs import PlanAnswer, ShapesFound, ShapesQuestion
from ..refusal import Refusal
from .chunk_rates import ChunkRates

LONGEST_NAME = 64
"""Longest name of a robot [characters]; no robot has a longer one."""


class ShapesService:
    """The questions of one cell's pendants."""

    def __init__(
        self, pending: Pending, new_job_id: Callable[[], int], own: Mapping[str, Any]
    ) -> None:
        """Keep the first answer.

        Args:
            own: what the cell's robot looks like.
        """
        self._pending = pending
        self._new_job_id = new_job_id
        self._rates = ChunkRates()
        # Above those of the questions of admins on connections.
        self._numbers = count(1 << 32)
        # Texts by what they answer, at most one of each robot and one of the meshes.
        self._kept: dict[tuple[str, str | None], str] = {
            (op.ShowShapes(None).op, None): json.dumps(
                own, ensure_ascii=False, separators=(",", ":")
            )
        }
        # Numbers of the questions of each connection that are not answered yet.
        self._waiting: dict[int, set[int]] = {}

    def closed(self, session: int) -> list[Effect]:
        """Forget a connection that ended, and withdraw what it asked."""
        self._rates.forget(session)
        waiting = self._waiting.pop(session, set())
        return [effect for job_id in sorted(waiting) for effect in self._pending.cancel(job_id)]

    @handles(op.ShowShapes)
    def _show(self, asked: op.ShowShapes, reply: ReplyTo[op.RobotShapes], now: int) -> list[Effect]:
        if asked.robot is not None and len(asked.robot) > LONGEST_NAME:
            text = f"robot has {len(asked.robot)} characters; accepted: at most {LONGEST_NAME}"
            return reply.refuse(Refusal(VerdictCode.BAD_ARGUMENT, text))
        return self._kept_or_asked(asked, asked.robot, reply, now)

    @handles(op.ListMeshes)
    def _list(self, asked: op.ListMeshes, reply: ReplyTo[op.RobotMeshes], now: int) -> list[Effect]:
        return self._kept_or_asked(asked, None, reply, now)

    @handles(op.ReadMesh)
    def _read(self, asked: op.ReadMesh, reply: ReplyTo[op.MeshChunk], now: int) -> list[Effect]:
        session = reply.session
        refusal = self._rates.begin_chunk(session, now)
        if refusal is not None:
            return reply.refuse(refusal)

        def answered(found: ShapesFound | Refusal) -> list[Effect]:
            self._rates.ended(session)
            return _told(found, reply)

        def measured(loads: Mapping[int, ConnectionLoad], at: int) -> list[Effect]:
            load = loads.get(session, ConnectionLoad())
            refusal = self._rates.unread_fault(session, load.unread)
            if refusal is not None:
                return reply.refuse(refusal)
            return self._ask(asked, session, answered)

        return self._pending.ask(LoadQuestion(next(self._numbers), (session,)), measured)

    def _kept_or_asked(
        self,
        asked: op.ShowShapes | op.ListMeshes,
        robot: str | None,
        reply: ReplyTo[Any],
        now: int,
    ) -> list[Effect]:
        refusal = self._rates.take_answer(reply.session, now)
        if refusal is not None:
            return reply.refuse(refusal)
        kept = self._kept.get((asked.op, robot))
        if kept is not None:
            return reply.answer_text(kept)

        def answered(found: ShapesFound | Refusal) -> list[Effect]:
            if isinstance(found, ShapesFound):
                self._kept[asked.op, robot] = found.body
            return _told(found, reply)

        return self._ask(asked, reply.session, answered)

    def _ask(
        self,
        asked: op.ShapeQuestion,
        session: int,
        then: Callable[[ShapesFound | Refusal], list[Effect]],
    ) -> list[Effect]:
        job = ShapesQuestion(self._new_job_id(), session, asked)
        self._waiting.setdefault(session, set()).add(job.job_id)

        def answered(planned: PlanAnswer, now: int) -> list[Effect]:
            self._waiting[session].discard(job.job_id)
            found = planned.result
            if isinstance(found, ShapesFound | Refusal):
                return then(found)
            return then(Refusal(VerdictCode.PLANNER_FAILED))

        return self._pending.ask(job, answered)


def _told(found: ShapesFound | Refusal, reply: ReplyTo[Any]) -> list[Effect]:
    return reply.refuse(found) if isinstance(found, Refusal) else reply.answer_text(found.body)
