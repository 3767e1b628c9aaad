"""Book of a cell's plans: the states of each, what makes it stale, and how many there may be.

Owns the life of a plan, from PLANNING to one of the states that it never leaves (DONE, STALE,
EXPIRED, DROPPED), and the bounds. What it does not own: how a plan is made, whether the robot may
move, and the motion that executes it.

A plan is stale once anything that it was made from is not what it was: the joints, the scene, the
tools, the frames, which tool is selected, what is carried, the cap of the tool speed. The scene is
compared as the object that plans are made in, so that a change counts from when plans are made
around it, and what a program takes or puts down counts, too; the revisions tell what the store
acknowledged. The samples of a plan that ended are dropped at once; that it ended, and why, is kept
for the last ones.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.scene.scene import Scene
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.simplemsg.pendant import PlanState
from openpendant.simplemsg.verdicts import VerdictCode

from ..planning.jobs import CertifiedTrajectory, JointVector, PlanFacts
from ..refusal import Refusal
from .plan_space import PlanSpace, too_many

KEPT_NS = 60_000_000_000
"""How long a plan that is ready is kept [ns]."""

MOST_OF_CONNECTION = 4
"""Plans that are kept for one connection; one more may be made meanwhile."""

MOST_OF_CELL = 8
"""Plans that are kept in one cell."""

MOST_REMEMBERED = 32
"""Plans that ended and of which it is known why."""

START_TURN = 1e-3
"""How far a turning joint may have moved since the plan was made [rad]."""

START_SHIFT = 1e-4
"""How far a sliding joint may have moved [m]."""

_LIVE = frozenset({PlanState.PLANNING, PlanState.READY, PlanState.RUNNING})


class PlanBasis(NamedTuple):
    """What a plan is made from, but for the joints.

    Attributes:
        scene: the scene that plans are made in; None where nothing is checked.
        scene_revision: of the scene that is stored.
        tool: name of the selected tool; None for the bare flange.
        cap: greatest speed of tool and elbow in force [m/s]; None for no cap.
    """

    scene: Scene | None
    scene_revision: int
    tools_revision: int
    frames_revision: int
    tool: str | None
    cap: float | None

    @property
    def attached(self) -> tuple[str, ...]:
        """Names of the objects that the robot carries."""
        objects = () if self.scene is None else self.scene.objects
        return tuple(each.name for each in objects if each.link is not None)

    def changed(self, now: PlanBasis) -> str:
        """Return what of it is not what it was, in words; empty for nothing."""
        if now.tool != self.tool:
            return f"the selected tool is {_named(now.tool)}, it was {_named(self.tool)}"
        if now.scene is not self.scene:
            return "what is carried changed" if now.attached != self.attached else "scene changed"
        if now.scene_revision != self.scene_revision:
            return f"scene changed to revision {now.scene_revision}"
        if now.tools_revision != self.tools_revision:
            return f"tools changed to revision {now.tools_revision}"
        if now.frames_revision != self.frames_revision:
            return f"frames changed to revision {now.frames_revision}"
        planned, rules = (math.inf if cap is None else cap for cap in (self.cap, now.cap))
        if rules < planned:
            was = "none" if self.cap is None else f"{self.cap:g} m/s"
            return f"the cap of the tool speed is {rules:g} m/s, it was {was}"
        return ""


def _named(tool: str | None) -> str:
    return "none" if tool is None else repr(tool)


def moved(
    start: Sequence[float], here: Sequence[float], limits: JointLimits, noise: float
) -> Refusal | None:
    """Return which joint does not stand where a plan starts; None where all do.

    Args:
        start: (n,) first sample of the plan, controller side [rad or m].
        here: (n,) as reported.
        noise: of a reported position [rad or m].
    """
    for joint, (planned, actual) in enumerate(zip(start, here, strict=True)):
        most = (START_SHIFT if limits.prismatic[joint] else START_TURN) + noise
        if not abs(actual - planned) <= most:
            name, unit = limits.names[joint], limits.unit(joint)
            text = f"{name} stands at {actual:.6f} {unit}, the plan starts at {planned:.6f} {unit}"
            return Refusal(VerdictCode.PLAN_STALE, text, joint, actual, planned)
    return None


@dataclass(slots=True, eq=False)
class Plan:
    """A plan.

    Attributes:
        session: connection that had it made.
        maker: its name.
        kind: of its goal.
        start: (n,) joints where it begins.
        basis: what it was made from; its cap is the lowest of those that it was planned under.
        is_of_here: it begins where the robot stood.
        is_preview: it shows a program and is never executed.
        since: when its state began [ns].
        why: why it ended, with the words that every further question is answered with.
        runner: connection that executes it.
    """

    number: int
    session: int
    maker: str
    kind: str
    label: str
    start: JointVector
    basis: PlanBasis
    since: int
    is_of_here: bool = True
    is_preview: bool = False
    state: PlanState = field(default=PlanState.PLANNING, init=False)
    why: Refusal | None = field(default=None, init=False)
    certified: CertifiedTrajectory | None = field(default=None, init=False)
    facts: PlanFacts | None = field(default=None, init=False)
    plan_time: float = field(default=0.0, init=False)
    duration: float = field(default=0.0, init=False)
    samples: int = field(default=0, init=False)
    size: int = field(default=0, init=False)
    runner: int = field(default=0, init=False)

    @property
    def is_live(self) -> bool:
        """True while it is made, kept or executed."""
        return self.state in _LIVE

    @property
    def trajectory(self) -> Trajectory:
        """The samples of a plan that is kept or executed."""
        assert self.certified is not None
        return self.certified.trajectory.trajectory()

    def expires_in(self, now: int) -> float:
        """Return how long it is still kept [s]; 0 where it is not ready."""
        if self.state is not PlanState.READY:
            return 0.0
        return max(self.since + KEPT_NS - now, 0) / 1e9


def size_of(trajectory: Trajectory) -> int:
    """Return the size of the arrays of a motion [bytes]."""
    arrays = [
        *(trajectory.times, trajectory.position, trajectory.velocity, trajectory.acceleration),
        trajectory.waypoint_times,
    ]
    if trajectory.fine is not None:
        arrays += [trajectory.fine.position, trajectory.fine.velocity]
    return sum(each.nbytes for each in arrays)


class PlanBook:
    """The plans of one cell.

    Attributes:
        running: the plan that is executed; None for none.
        live: plans that are made, kept or executed, by their numbers.
    """

    def __init__(self, space: PlanSpace) -> None:
        """Begin without plans.

        Args:
            space: room for the plans of all cells.
        """
        self.running: Plan | None = None
        self._space = space
        self.live: dict[int, Plan] = {}
        self._ended: dict[int, Plan] = {}

    def __iter__(self) -> Iterator[Plan]:
        """Return the plans that are known, those that ended first."""
        return iter([*self._ended.values(), *self.live.values()])

    @property
    def ready(self) -> list[Plan]:
        """Plans that could be executed."""
        return [plan for plan in self.live.values() if plan.state is PlanState.READY]

    def of(self, session: int) -> list[Plan]:
        """Return the plans that a connection had made and that have not ended."""
        return [plan for plan in self.live.values() if plan.session == session]

    def find(self, number: int, now: int) -> Plan | Refusal:
        """Return a plan that has not ended; else why there is none."""
        plan = self.live.get(number)
        if plan is not None:
            return plan
        ended = self._ended.get(number)
        if ended is None:
            return Refusal(VerdictCode.PLAN_UNKNOWN, f"no plan {number} is known in this cell")
        ago = (now - ended.since) / 1e9
        why = "" if ended.why is None else f": {ended.why.sentence}"
        text = f"plan {number} {_ENDS[ended.state]} {ago:.1f} s ago{why}"
        return Refusal(VerdictCode.PLAN_STALE, text, value=ago)

    # Room.

    def room_fault(self, session: int) -> Refusal | None:
        """Return why a connection may have no plan made now."""
        for plan in self.of(session):
            if plan.state is PlanState.PLANNING:
                text = f"plan {plan.number} of this connection is still being made"
                return Refusal(VerdictCode.PLANNING, text)
        if self._oldest_ready(session) is not None:
            return None  # its place is taken, where one is needed
        making = sum(plan.state is PlanState.PLANNING for plan in self.live.values())
        return self._fault(session, making) or self._space.fault(1, 0)

    def _fault(self, session: int, making: int) -> Refusal | None:
        """Return why one more plan of a connection cannot be kept, beside those being made."""
        kept = [plan for plan in self.live.values() if plan.state is not PlanState.PLANNING]
        own, here = sum(plan.session == session for plan in kept), len(kept) + making
        if own >= MOST_OF_CONNECTION:
            text = f"{own} plans of this connection are kept; accepted: {MOST_OF_CONNECTION}"
            return too_many(text, own, MOST_OF_CONNECTION)
        if here >= MOST_OF_CELL:
            text = f"{here} plans of the cell are kept or made; accepted: {MOST_OF_CELL}"
            return too_many(text, here, MOST_OF_CELL)
        return None

    def _oldest_ready(self, session: int) -> Plan | None:
        ready = (plan for plan in self.of(session) if plan.state is PlanState.READY)
        return min(ready, key=lambda plan: plan.since, default=None)

    # The life of a plan.

    def begin(
        self,
        maker: tuple[int, str],
        kind: str,
        label: str,
        start: JointVector,
        basis: PlanBasis,
        now: int,
        *,
        is_of_here: bool = True,
        is_preview: bool = False,
    ) -> Plan:
        """Return a plan that is being made from now on, where `room_fault` found none.

        Args:
            maker: the connection that has it made, and its name; the rest as of `Plan`.
        """
        number = self._space.begin()
        about = number, *maker, kind, label, start, basis, now, is_of_here, is_preview
        plan = self.live[number] = Plan(*about)
        return plan

    def keep(
        self,
        plan: Plan,
        certified: CertifiedTrajectory,
        facts: PlanFacts | None,
        plan_time: float,
        now: int,
    ) -> list[Plan] | Refusal:
        """Keep a plan that was made; the preview of a program has no facts.

        Where there is no room for it, the oldest ready plans of the same connection are dropped,
        never another's.

        Returns:
            The plans that were dropped, or why it is not kept; then it is dropped itself.
        """
        size, dropped = size_of(certified.trajectory.trajectory()), list[Plan]()
        while (fault := self._fault(plan.session, 0) or self._space.fault(0, size)) is not None:
            oldest = self._oldest_ready(plan.session)
            if oldest is None:
                self.end(plan, PlanState.DROPPED, fault, now)
                return fault
            text = f"plan {plan.number} of the same connection took its place"
            why = Refusal(VerdictCode.TOO_MANY_PLANS, text)
            self.end(oldest, PlanState.DROPPED, why, now)
            dropped.append(oldest)
        self._space.keep(size)
        plan.size, plan.certified, plan.facts, plan.plan_time = size, certified, facts, plan_time
        plan.duration, plan.samples = certified.trajectory.duration, len(certified.trajectory)
        plan.state, plan.since = PlanState.READY, now
        return dropped

    def run(self, plan: Plan, session: int, now: int) -> None:
        """Take note that a connection executes a plan, which is never executed again."""
        assert plan.state is PlanState.READY
        assert self.running is None
        plan.state, plan.since, plan.runner = PlanState.RUNNING, now, session
        self.running = plan

    def end(self, plan: Plan, state: PlanState, why: Refusal | None, now: int) -> None:
        """End a plan for good, and forget its samples."""
        assert plan.is_live
        assert state not in _LIVE
        if plan is self.running:
            self.running = None
        del self.live[plan.number]
        self._space.end(plan.size)
        plan.state, plan.why, plan.since = state, why, now
        plan.certified = plan.facts = None
        self._ended[plan.number] = plan
        if len(self._ended) > MOST_REMEMBERED:
            del self._ended[next(iter(self._ended))]


_ENDS = {
    PlanState.DONE: "was executed",
    PlanState.STALE: "became stale",
    PlanState.EXPIRED: "expired",
    PlanState.DROPPED: "was dropped",
}
