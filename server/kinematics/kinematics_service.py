"""Kinematics service: questions of pendants on forward kinematics, Jacobian and inverse kinematics.

Owns what is checked before a question goes to the process that answers it, and how much each counts
in the rate. Anybody who may look on may ask, whether the robot moves or not. No kinematics here:
nothing of a question is computed on the event loop (promise 40).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from openpendant.motion.errors import BadArgument
from openpendant.motion.frames.frame_tree import BASE, FLANGE, ROOT
from openpendant.simplemsg.pendant.management import kinematics as op
from openpendant.simplemsg.verdicts import VerdictCode

from ..cell.robot_cell import RobotCell
from ..events.effects import Effect
from ..events.management_requests import ReplyTo, handles
from ..events.pending import Pending
from ..planning.jobs import KinematicsFound, KinematicsQuestion, PlanAnswer
from ..refusal import Refusal
from ..scene.robot_environment import RobotEnvironment
from .question_rates import QuestionRates

NORM_TOLERANCE = 1e-3
"""Greatest deviation of a quaternion's norm from 1: that of rounding to three decimals."""

_OF_ALL_BRANCHES = 2
_OF_A_SELF_MOTION = 5
"""Weights in the rate: a family of answers takes longest to search."""

_JOINTS_OF_A_POSE = 6
_NO_ROTATION = (0.0, 0.0, 0.0, 1.0)
_OWN_FRAMES = (BASE, ROOT)


class KinematicsService:
    """The questions of one cell's pendants."""

    def __init__(
        self, cell: RobotCell, view: RobotEnvironment, pending: Pending, rates: QuestionRates
    ) -> None:
        """Join what it asks.

        Args:
            rates: of all cells of the server.
        """
        self._cell = cell
        self._view = view
        self._pending = pending
        self._rates = rates
        # Numbers of the questions of each connection that are not answered yet.
        self._waiting: dict[int, set[int]] = {}

    def closed(self, session: int) -> list[Effect]:
        """Forget a connection that ended, and withdraw what it asked."""
        self._rates.forget(session)
        waiting = self._waiting.pop(session, set())
        return [effect for job_id in sorted(waiting) for effect in self._pending.cancel(job_id)]

    @handles(op.ForwardKinematics)
    def _forward(
        self, asked: op.ForwardKinematics, reply: ReplyTo[op.ForwardAnswer], now: int
    ) -> list[Effect]:
        named = asked.frame not in _OWN_FRAMES
        return self._ask(asked, asked.joints, reply, now, names_frame=named)

    @handles(op.ToolJacobian)
    def _jacobian(
        self, asked: op.ToolJacobian, reply: ReplyTo[op.JacobianAnswer], now: int
    ) -> list[Effect]:
        return self._ask(asked, asked.joints, reply, now)

    @handles(op.InverseKinematics)
    def _inverse(
        self, asked: op.InverseKinematics, reply: ReplyTo[op.InverseAnswer], now: int
    ) -> list[Effect]:
        named = asked.frame not in _OWN_FRAMES
        return self._ask(asked, asked.seed, reply, now, names_frame=named)

    def _ask(
        self,
        asked: op.Question,
        joints: Sequence[float] | None,
        reply: ReplyTo[Any],
        now: int,
        *,
        names_frame: bool = False,
    ) -> list[Effect]:
        """Have a question answered, or refuse it at once.

        Args:
            joints: what it is about; None for the position reported now.
            names_frame: it names a frame that is not the robot's own.
        """
        refusal = self._rates.take(reply.session, self._weight(asked), now)
        if refusal is not None:
            return reply.refuse(refusal)
        if joints is None:
            if not self._cell.feedback.is_fresh(now):
                return reply.refuse(Refusal(VerdictCode.FEEDBACK_STALE))
            joints = self._cell.feedback.standing_at
        self._cell.limits.check_finite(joints, "the joint position")
        wants_scene = False
        if isinstance(asked, op.InverseKinematics):
            _check_norm(asked.pose.get("orientation", _NO_ROTATION))
            wants_scene = asked.scene
        names_tool = asked.tool not in (None, FLANGE)
        job = KinematicsQuestion(
            self._cell.motions.new_job_id(),
            reply.session,
            asked,
            tuple(joints),
            self._view.frames if names_frame or names_tool else None,
            self._view.tool_in_flange,
            self._view.scene if wants_scene else None,
        )
        self._waiting.setdefault(reply.session, set()).add(job.job_id)

        def answered(planned: PlanAnswer, at: int) -> list[Effect]:
            self._waiting[reply.session].discard(job.job_id)
            found = planned.result
            if isinstance(found, KinematicsFound):
                return reply.answer_text(found.body)
            failed = Refusal(VerdictCode.PLANNER_FAILED)
            return reply.refuse(found if isinstance(found, Refusal) else failed)

        return self._pending.ask(job, answered)

    def _weight(self, asked: op.Question) -> int:
        """Return how many questions one counts as."""
        if not isinstance(asked, op.InverseKinematics) or asked.branches == "nearest":
            return 1
        has_self_motion = self._cell.limits.dof > _JOINTS_OF_A_POSE
        return _OF_A_SELF_MOTION if has_self_motion else _OF_ALL_BRANCHES


def _check_norm(quaternion: Sequence[float]) -> None:
    norm = math.hypot(*quaternion)
    if not abs(norm - 1.0) <= NORM_TOLERANCE:
        accepted = f"four numbers of norm 1 within {NORM_TOLERANCE:g}; this one is {norm:.6g}"
        raise BadArgument("orientation", list(quaternion), accepted)
