"""Random orders of plans, executions, changes and stops: a stale plan never moves anything."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.expectations import known
from rigs.cells.planning_pendants import PlansCell
from rigs.data.example_counts import few
from rigs.peers.server_clients import Pendant

from openpendant.server.planning.jobs import Job, JointVector, PlanAnswer, PlanJob
from openpendant.server.plans.plan_book import MOST_OF_CELL, Plan, PlanBasis
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant import Activity, AuthorityBeat, PlanState
from openpendant.simplemsg.verdicts import VerdictCode as V


def step(what: str, *choices: Any) -> st.SearchStrategy[tuple[str, Any]]:
    return st.tuples(st.just(what), st.sampled_from(choices or (None,)))


PLANNING = [step("make", 0.05, -0.05, 0.3), step("execute", 0, 0, 1, 2), step("wait", 10, 50, 700)]
CHANGES = [step("scene"), step("tool"), step("mode", 1, 4), step("drop", 0, 1)]
STOPS = [step("stop"), step("reset"), step("reset")]
PEOPLE = [step("turn to", 0, 1), step("hand over"), step("leave")]

_PLANNED: dict[Any, PlanAnswer] = {}


class QuickCell(PlansCell):
    """A cell whose planning process remembers what it planned, for other cells too."""

    def work_out(self, job: Job) -> PlanAnswer:
        if not isinstance(job, PlanJob):
            return super().work_out(job)
        key = job.start, repr(job.motion)
        if key not in _PLANNED:
            _PLANNED[key] = super().work_out(job)
        return replace(_PLANNED[key], job_id=job.job_id)


class Orders:
    """One cell, two pendants, and what always holds of their plans."""

    def __init__(self) -> None:
        self.cell = cell = QuickCell()
        self.peers = [cell.operator, cell.other("guest")]
        self.who = 0
        self.made: list[int] = []
        self.changes = 0

    @property
    def peer(self) -> Pendant:
        return self.peers[self.who]

    @property
    def plans(self) -> list[Plan]:
        return list(self.cell.core.pendants.plans._book)

    def step(self, what: str, choice: Any) -> None:
        cell = self.cell
        match what:
            case "make":
                made = cell.make(self.peer, goal={"kind": "ptp", "joints": cell.turned(choice)})
                if "plan" in made:
                    self.made.append(made["plan"])
            case "execute" if self.made:
                self.execute(self.made[-1 - choice % len(self.made)])
            case "drop" if self.made:
                self.peer.ask("plans.drop", plan=self.made[-1 - choice % len(self.made)])
            case "scene":
                self.changes += 1
                cell.add_box(f"b{self.changes}", (3.0, 3.0, float(self.changes)))
            case "tool":
                self.changes += 1
                revision = cell.operator.ask("frames.show")["tools_revision"]
                name, tcp = f"t{self.changes}", {"position": [0.0, 0.0, 0.1]}
                cell.operator.ask("tools.add", name=name, tcp=tcp, expected_revision=revision)
            case "mode":
                self.peer.mode(choice)
            case "stop":
                self.peer.stop()
            case "reset":
                self.peer.reset()
            case "wait":
                for peer in self.peers:
                    peer.send(AuthorityBeat())
                cell.wait(choice)
            case "turn to":
                self.who = choice
            case "hand over":
                self.peer.release()
                self.who = 1 - self.who
                self.peer.take()
            case "leave":
                self.peers[1].close()
                self.peers[1] = cell.other("guest")

    def execute(self, number: int) -> None:
        cell = self.cell
        plan = next((each for each in self.plans if each.number == number), None)
        before = None if plan is None else (plan.state, plan.basis, plan.start)
        was_idle, sent = cell.core.cell.activity is Activity.IDLE, len(cell.sent)
        code = cell.execute(number, self.peer)
        if code is V.ACCEPTED:
            assert before is not None
            state, basis, start = before
            assert state is PlanState.READY
            assert was_idle
            self.assert_current(basis, start)
        elif was_idle:
            assert len(cell.sent) == sent
            assert cell.core.cell.activity is Activity.IDLE

    def assert_current(self, basis: PlanBasis, start: JointVector) -> None:
        """What a plan was made from is what there is."""
        around = known(self.cell.core.environment)
        assert basis.scene == around.world.scene
        assert basis.tools_revision == around.world.revisions[DocumentKind.TOOLS]
        assert start == pytest.approx(self.cell.position, abs=1e-3)
        modes = self.cell.core.cell.modes
        cap = modes.tool_speed_cap(self.cell.core.cell.feedback.mode)
        assert cap is None or (basis.cap is not None and basis.cap <= cap)

    def check(self) -> None:
        running = [each for each in self.plans if each.state is PlanState.RUNNING]
        assert len(running) <= 1
        if running:
            work = known(self.cell.core.cell.driving.work)
            assert work.request.session == running[0].runner
        assert sum(each.is_live for each in self.plans) <= MOST_OF_CELL + 1


def assert_in_order(steps: list[tuple[str, Any]]) -> None:
    orders = Orders()
    for each in steps:
        orders.step(*each)
        orders.check()
    assert orders.cell.controller.referee.total == 0


def some(
    *kinds: list[st.SearchStrategy[tuple[str, Any]]],
) -> st.SearchStrategy[list[tuple[str, Any]]]:
    alphabet = st.one_of(*PLANNING, *PLANNING, *(each for kind in kinds for each in kind))
    return st.lists(alphabet, min_size=5, max_size=8)


@few(100, soak=3_400)
@given(some(CHANGES))
def test_promise_34_only_ready_plans_are_executed_whatever_changes(steps: Any) -> None:
    assert_in_order(steps)


@few(100, soak=3_300)
@given(some(STOPS))
def test_promise_34_only_ready_plans_are_executed_whoever_stops(steps: Any) -> None:
    assert_in_order(steps)


@few(100, soak=3_300)
@given(some(CHANGES, STOPS, PEOPLE))
def test_promise_34_only_ready_plans_are_executed_whoever_comes_and_goes(steps: Any) -> None:
    assert_in_order(steps)
