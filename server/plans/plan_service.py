"""Plans of a cell as pendants ask for them: made, looked at, dropped, executed as they were shown.

Owns who may do what with a plan, when a plan is looked at for what may have changed, and what is
told of it. Execution plays the samples that were shown: nothing is planned, timed or certified
again. Whether the robot may move is the interlocks', as for any motion; a refusal of theirs leaves
the plan ready.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import cast

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import Execute, PlanChanged, PlanStage, PlanState
from openpendant.simplemsg.pendant.management import plans as op
from openpendant.simplemsg.pendant.management.declaration import Done
from openpendant.simplemsg.pendant.management.plan_goals import PlanGoal
from openpendant.simplemsg.verdicts import VerdictCode

from ..access.token_bucket import SessionRates
from ..cell.execution.tracking import tracking_tolerances
from ..cell.interlocks import InterlockKind, check_interlocks, examine_motion, permission
from ..cell.robot_cell import RobotCell
from ..cell.robot_model import RobotModel
from ..control import MotionKind
from ..environment import CellEnvironment
from ..events.cell_events import (
    CellEvent,
    MotionEnded,
    MotionOwner,
    MotionRefused,
    MotionRequest,
    MotionStarted,
)
from ..events.effects import Effect
from ..events.management_requests import ReplyTo, handles
from ..events.pending import Pending
from ..events.replies import cut_at_word
from ..planning.jobs import (
    CertifiedTrajectory,
    JointVector,
    PlanAnswer,
    PlanFacts,
    SearchProgress,
    SearchStage,
)
from ..positions.position_book import PositionBook
from ..refusal import Refusal
from ..settings.cell_settings import ControllerLink
from ..store.documents import DocumentKind
from .plan_book import Plan, PlanBasis, PlanBook, moved
from .plan_requests import LONGEST_LABEL, GoalReader, request_fault
from .plan_space import PlanSpace
from .sample_text import sample_text

Notify = Callable[[Message], list[Effect]]
"""Sends a message to every connection of the cell that wants to be told of changes."""

Announce = Callable[[CellEvent, int], list[Effect]]
"""Tells the connection that asked for a motion what became of it."""

TEXT_BYTES = 96
"""Size of the text of a notice on the wire."""

SAMPLES_PER_SECOND = 20
"""Questions for samples that a connection may ask in a second."""

MOST_OPEN = 4
"""Questions for samples of a connection that may be open at a time."""

PROGRESS_NS = 200_000_000
"""Least time between two words on how far a plan has come [ns]."""

_STAGES = {
    SearchStage.SEARCHING: PlanStage.SEARCHING,
    SearchStage.SHORTENING: PlanStage.SHORTENING,
    SearchStage.CHECKING: PlanStage.CHECKING,
}


@dataclass(slots=True)
class _Making:
    """A plan that is being made.

    Attributes:
        told: when it was told last how far it has come [ns].
    """

    plan: Plan
    reply: ReplyTo[op.MadePlan]
    job_id: int
    told: int


class PlanService:
    """The plans of one cell.

    Attributes:
        live: plans that are made, kept or executed, by their numbers.
        untold: plans that ended since the last tick.
    """

    def __init__(
        self,
        cell: RobotCell,
        robot: RobotModel,
        link: ControllerLink,
        pending: Pending,
        environment: CellEnvironment | None,
        space: PlanSpace,
        positions: PositionBook,
        notify: Notify,
        announce: Announce,
    ) -> None:
        """Begin without plans; without an environment nothing is checked for contact."""
        self._cell = cell
        self._robot = robot
        self._link = link
        self._pending = pending
        self._environment = environment
        self._notify = notify
        self._announce = announce
        self._book = PlanBook(space)
        self.live = self._book.live
        self._goals = GoalReader(cell.limits, robot, environment, positions)
        self._making: dict[int, _Making] = {}  # by number of the plan
        self.untold: list[Plan] = []
        self._rate = SessionRates(SAMPLES_PER_SECOND, SAMPLES_PER_SECOND)
        self._open: dict[int, int] = {}  # questions for samples by connection

    # To make one.

    @handles(op.MakePlan)
    def _make(self, asked: op.MakePlan, reply: ReplyTo[op.MadePlan], now: int) -> list[Effect]:
        refusal = request_fault(asked) or self._book.room_fault(reply.session)
        if refusal is not None:
            return reply.refuse(refusal)
        is_of_here = asked.start is None
        start = self._stands_at(now) if asked.start is None else self._goals.joints(asked.start)
        if isinstance(start, Refusal):
            return reply.refuse(start)
        basis = self._basis()
        caps = [cap for cap in (basis.cap, asked.tool_speed) if cap is not None]
        basis = basis._replace(cap=min(caps, default=None))
        goal = cast(PlanGoal, asked.goal)
        found = self._goals.motion(goal, start, asked.speed, basis.cap)
        if isinstance(found, Refusal):
            return reply.refuse(found)
        maker, kind = (reply.session, reply.name), goal.kind
        plan = self._book.begin(maker, kind, asked.label, start, basis, now, is_of_here=is_of_here)
        job_id = self._cell.motions.new_job_id()
        self._making[plan.number] = _Making(plan, reply, job_id, now)
        job = replace(found, job_id=job_id, scene=basis.scene)
        planned = partial(self._planned, plan.number)
        return [*self._tell(plan), *self._pending.ask(job, planned)]

    def _stands_at(self, now: int) -> JointVector | Refusal:
        """Return where the robot stands, or why a plan cannot begin there."""
        cell = self._cell
        position = cell.feedback.position
        if position is None or not cell.feedback.is_fresh(now):
            return Refusal(VerdictCode.FEEDBACK_STALE)
        if cell.is_moving or not cell.feedback.is_standing:
            return Refusal(VerdictCode.MOVING)
        return tuple(position)

    def _planned(self, number: int, planned: PlanAnswer, now: int) -> list[Effect]:
        making = self._making.get(number)
        if making is None:
            return []
        if isinstance(planned.result, SearchProgress):
            return self._progress(making, planned.result, now)
        del self._making[number]
        plan, reply = making.plan, making.reply
        if isinstance(planned.result, Refusal):
            self._book.end(plan, PlanState.DROPPED, planned.result, now)
            return [*reply.refuse(planned.result), *self._tell(plan)]
        assert isinstance(planned.result, tuple)
        assert planned.facts is not None
        dropped = self._book.keep(
            plan, CertifiedTrajectory(*planned.result), planned.facts, planned.plan_time, now
        )
        if isinstance(dropped, Refusal):
            return [*reply.refuse(dropped), *self._tell(plan)]
        out = [effect for each in dropped for effect in self._tell(each)]
        return [*out, *reply.answer(self._made(plan, now)), *self._tell(plan)]

    def keep_preview(
        self, session: int, name: str, program: str, certified: CertifiedTrajectory, now: int
    ) -> tuple[int, list[Effect]] | Refusal:
        """Keep the motions of a program as a plan that is looked at and never executed.

        Returns:
            The number of the plan, and who is told of it; or why it is not kept.
        """
        refusal = self._book.room_fault(session)
        if refusal is not None:
            return refusal
        start = tuple(certified.trajectory.row(0).position)
        about = "program", program[:LONGEST_LABEL], start, self._basis(), now
        plan = self._book.begin((session, name), *about, is_of_here=False, is_preview=True)
        dropped = self._book.keep(plan, certified, None, 0.0, now)
        if isinstance(dropped, Refusal):
            return dropped
        told = [effect for each in (*dropped, plan) for effect in self._tell(each)]
        return plan.number, told

    def _progress(self, making: _Making, word: SearchProgress, now: int) -> list[Effect]:
        if now - making.told < PROGRESS_NS:
            return []
        making.told = now
        return self._notify(
            PlanChanged(
                *(making.plan.number, PlanState.PLANNING, VerdictCode.ACCEPTED),
                *(_STAGES[word.stage], word.fraction, word.stage.value),
            )
        )

    # To look at it.

    def _made(self, plan: Plan, now: int) -> op.MadePlan:
        facts, trajectory, basis = plan.facts, plan.trajectory, plan.basis
        assert facts is not None
        why = self._unexecutable(plan, plan.session, now)
        nearest = facts.nearest
        return {
            "plan": plan.number,
            "state": plan.state.name.lower(),
            "expires_in": plan.expires_in(now),
            "duration": plan.duration,
            "samples": plan.samples,
            "plan_time": plan.plan_time,
            "planner": facts.planner,
            "seed": facts.seed,
            "start": trajectory.position[0].tolist(),
            "end": list(trajectory.final),
            "end_pose": {
                "position": list(facts.end.position),
                "orientation": list(facts.end.orientation),
            },
            "based_on": {
                "scene": basis.scene_revision,
                "tools": basis.tools_revision,
                "frames": basis.frames_revision,
                "tool": basis.tool,
                "attached": list(basis.attached),
            },
            "certificate": _certificate(facts),
            "clearance": None
            if nearest is None
            else {
                "distance": nearest.distance,
                "first": nearest.first,
                "second": nearest.second,
                "at": nearest.at,
            },
            "executable": why is None,
            "why": why,
        }

    def _unexecutable(self, plan: Plan, session: int, now: int) -> op.Unexecutable | None:
        """Return what an execution by a connection would be refused for now."""
        own = self._never(plan) or self._changed(plan)
        if own is not None:
            return {"condition": "plan", "code": int(own.code), "text": own.sentence}
        for condition, refusal in examine_motion(self._cell, MotionKind.MOVE, session, now):
            if refusal is not None:
                name = InterlockKind(condition).name.lower()
                return {"condition": name, "code": int(refusal.code), "text": refusal.sentence}
        return None

    @handles(op.AskSamples)
    def _samples(
        self, asked: op.AskSamples, reply: ReplyTo[op.PlanSamples], now: int
    ) -> list[Effect]:
        session = reply.session
        plan = self._found(asked.plan, now)
        if isinstance(plan, Refusal):
            return reply.refuse(plan)
        if asked.first >= plan.samples:
            text = f"first: {asked.first}; the plan has {plan.samples} samples"
            about = float(asked.first), float(plan.samples)
            return reply.refuse(Refusal(VerdictCode.BAD_ARGUMENT, text, -1, *about))
        refusal = self._too_many_open(session) or self._rate.take(
            session, "questions for samples", now
        )
        if refusal is not None:
            return reply.refuse(refusal)
        place = self._robot.tool_pose if asked.with_tool else None
        about_rows = plan.trajectory, asked.first, asked.count, asked.every
        self._open[session] = self._open.get(session, 0) + 1

        def written(text: str, at: int) -> list[Effect]:
            if session in self._open:
                self._open[session] -= 1
            return reply.answer_text(text)

        return self._pending.run(sample_text(plan.number, *about_rows, place), written, now)

    def _too_many_open(self, session: int) -> Refusal | None:
        waiting = self._open.get(session, 0)
        if waiting < MOST_OPEN:
            return None
        text = f"{waiting} questions for samples are open; accepted: {MOST_OPEN}"
        return Refusal(VerdictCode.TOO_OFTEN, text, limit=float(MOST_OPEN))

    def _found(self, number: int, now: int) -> Plan | Refusal:
        """Return a plan that has samples, or why there is none."""
        plan = self._book.find(number, now)
        if isinstance(plan, Plan) and plan.state is PlanState.PLANNING:
            return Refusal(VerdictCode.PLANNING, f"plan {number} is still being made")
        return plan

    @handles(op.ShowPlans)
    def _show(self, asked: op.ShowPlans, reply: ReplyTo[op.PlanHeads], now: int) -> list[Effect]:
        return reply.answer({"plans": [_head(plan, now) for plan in self._book]})

    # To drop it.

    @handles(op.DropPlan)
    def _drop(self, asked: op.DropPlan, reply: ReplyTo[Done], now: int) -> list[Effect]:
        plan = self._book.find(asked.plan, now)
        if isinstance(plan, Refusal):
            return reply.refuse(plan)
        if plan.session != reply.session:
            refusal = permission(self._cell.authority, reply.session, now)
            if refusal is not None:
                text = f"plan {plan.number} was made by {plan.maker}; {refusal.sentence}"
                return reply.refuse(replace(refusal, text=text))
        if plan.state is PlanState.RUNNING:
            text = f"plan {plan.number} is being executed"
            return reply.refuse(Refusal(VerdictCode.MOVING, text))
        why = Refusal(VerdictCode.PLAN_STALE, f"dropped by {reply.name}")
        return [*self._dropped(plan, why, now), *reply.answer({})]

    def _dropped(self, plan: Plan, why: Refusal, now: int) -> list[Effect]:
        """Drop a plan that is not executed; one that is being made is made no further."""
        out: list[Effect] = []
        making = self._making.pop(plan.number, None)
        if making is not None:
            out += self._pending.cancel(making.job_id)
            out += making.reply.refuse(why)
        self._book.end(plan, PlanState.DROPPED, why, now)
        return out + self._tell(plan)

    def closed(self, session: int, now: int) -> list[Effect]:
        """Drop the plans of a connection that ended; one that runs is whose who executes it."""
        self._rate.forget(session)
        self._open.pop(session, None)
        why = Refusal(VerdictCode.PLAN_STALE, "the connection that had it made ended")
        left = [plan for plan in self._book.of(session) if plan.state is not PlanState.RUNNING]
        return [effect for plan in left for effect in self._dropped(plan, why, now)]

    # To execute it.

    def execute(self, session: int, asked: Execute, now: int) -> Refusal | list[Effect]:
        """Execute a plan as it was shown, where everything is what it was planned from."""
        # First, so that whoever may not move the robot makes no plan stale by asking.
        not_in_control = permission(self._cell.authority, session, now)
        if not_in_control is not None:
            return not_in_control
        plan = self._found(asked.plan, now)
        if isinstance(plan, Refusal):
            return plan
        if plan.state is PlanState.RUNNING:
            ago = (now - plan.since) / 1e9
            text = f"plan {plan.number} is being executed, since {ago:.1f} s"
            return Refusal(VerdictCode.PLAN_STALE, text, value=ago)
        stale = self._judged(plan, now)
        if stale is not None:
            # Whoever wants notices is told with the next tick, which finds it stale as well.
            return stale
        refusal = (
            self._never(plan)
            or check_interlocks(self._cell, session, now)
            or self._override_fault(asked.override_is_one)
            or self._unbuilt()
        )
        if refusal is not None:
            return refusal
        assert plan.certified is not None
        self._cell.authority.beat(session, now)
        self._book.run(plan, session, now)
        request = MotionRequest(session, asked.request_id, owner=MotionOwner.PLAN)
        return self._cell.motions.execute(
            request, plan.certified, plan.plan_time, plan.basis.cap, now
        )

    def _judged(self, plan: Plan, now: int) -> Refusal | None:
        """Return why a plan that is ready may be executed by nobody any more; it ends then."""
        if plan.expires_in(now) <= 0.0:
            self._book.end(plan, PlanState.EXPIRED, None, now)
        elif (changed := self._changed(plan)) is not None:
            self._book.end(plan, PlanState.STALE, changed, now)
        else:
            return None
        self.untold.append(plan)
        found = self._book.find(plan.number, now)
        assert isinstance(found, Refusal)
        return found

    def _changed(self, plan: Plan) -> Refusal | None:
        """Return what a plan was made from and is not so any more; None where all is."""
        if plan.is_preview:
            return None
        changed = plan.basis.changed(self._basis())
        if changed:
            return Refusal(VerdictCode.PLAN_STALE, changed)
        here = self._cell.feedback.position
        if not plan.is_of_here or here is None:
            return None
        return moved(plan.start, here, self._cell.limits, self._noise())

    def _noise(self) -> float:
        says_emulated = self._cell.feedback.says_emulated
        limits = self._cell.limits
        return tracking_tolerances(self._link, limits, says_emulated=says_emulated).noise

    def _basis(self) -> PlanBasis:
        cell, environment = self._cell, self._environment
        scene, cap = cell.motions.scene, cell.modes.tool_speed_cap(cell.feedback.mode)
        if environment is None:
            return PlanBasis(scene, 0, 0, 0, None, cap)
        world = environment.world
        revisions = world.revisions
        return PlanBasis(
            scene,
            revisions[DocumentKind.SCENE],
            revisions[DocumentKind.TOOLS],
            revisions[DocumentKind.FRAMES],
            world.frames.selected_tool,
            cap,
        )

    @staticmethod
    def _never(plan: Plan) -> Refusal | None:
        """Return why a plan is only looked at."""
        if plan.is_preview:
            text = f"plan {plan.number} shows a program; accepted: to run the program"
            return Refusal(VerdictCode.NOT_STANDING, text)
        if not plan.is_of_here:
            text = f"plan {plan.number} was made from elsewhere than where the robot stood"
            return Refusal(VerdictCode.NOT_STANDING, text)
        return None

    def _override_fault(self, override_is_one: int) -> Refusal | None:
        if override_is_one not in (0, 1):
            text = f"override_is_one {override_is_one}; accepted: 0, 1"
            return Refusal(VerdictCode.BAD_ARGUMENT, text, value=override_is_one, limit=1.0)
        override = self._cell.modes.override
        if not override_is_one or override == 1.0:
            return None
        text = f"the speed override is {override:g}; asked for: 1"
        return Refusal(VerdictCode.BAD_ARGUMENT, text, value=override, limit=1.0)

    def _unbuilt(self) -> Refusal | None:
        """Return what is being added to the scene, which the plan would not know of."""
        if not self._cell.unbuilt:
            return None
        text = f"no plan is executed while {self._cell.unbuilt}"
        return Refusal(VerdictCode.CHANGE_WHILE_MOVING, text)

    def on_cell_event(self, event: CellEvent, now: int) -> list[Effect]:
        """Take note of what became of a plan that is executed, and tell whoever asked for it."""
        out = self._announce(event, now)
        plan = self._book.running
        if plan is None:
            return out
        match event:
            case MotionStarted():
                return out + self._tell(plan)
            case MotionEnded(refusal=why):
                self._book.end(plan, PlanState.DONE, why, now)
            case MotionRefused(refusal=refused):
                # Not even its first sample left: it failed the last look at each set-point.
                self._book.end(plan, PlanState.STALE, refused, now)
        return out + self._tell(plan)

    # Time.

    def tick(self, now: int) -> list[Effect]:
        """Look at the plans that are ready, and tell what became of those that are no more."""
        for plan in self._book.ready:
            self._judged(plan, now)
        untold, self.untold = self.untold, []
        return [effect for plan in untold for effect in self._tell(plan)]

    def _tell(self, plan: Plan) -> list[Effect]:
        why = plan.why
        in_full = self._cell.joint_names.in_full
        return self._notify(
            PlanChanged(
                plan.number,
                plan.state,
                _code(plan),
                PlanStage.NONE,
                0.0,
                "" if why is None else cut_at_word(in_full(why.sentence), TEXT_BYTES),
            )
        )


def _code(plan: Plan) -> VerdictCode:
    if plan.why is not None:
        return plan.why.code
    return VerdictCode.PLAN_STALE if plan.state is PlanState.EXPIRED else VerdictCode.ACCEPTED


def _certificate(facts: PlanFacts) -> op.PlanCertificate:
    worst: list[op.Worst] = [
        {"joint": each.name, "quantity": each.quantity, "ratio": each.ratio, "at": each.at}
        for each in facts.worst
    ]
    return {"valid": True, "margin": facts.margin, "worst": worst}


def _head(plan: Plan, now: int) -> op.PlanHead:
    return {
        "plan": plan.number,
        "state": plan.state.name.lower(),
        "kind": plan.kind,
        "label": plan.label,
        "maker": plan.maker,
        "duration": plan.duration,
        "samples": plan.samples,
        "expires_in": plan.expires_in(now),
        "code": int(_code(plan)),
        "text": "" if plan.why is None else plan.why.sentence,
    }
