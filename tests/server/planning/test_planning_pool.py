"""The planning pool: one job to a process at a time, and none is lost with another's."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass, field

import pytest

from openpendant.server.planning import pool as planning_pool
from openpendant.server.planning.jobs import Job, JointPathJob, Planned
from openpendant.server.planning.pool import PlanningPool
from openpendant.server.planning.process import Task
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode


@dataclass
class FakeProcess:
    """A planning process that finishes when the test says so."""

    is_free: bool = True
    is_warm: bool = True
    is_down: bool = False
    given: list[Task] = field(default_factory=list)

    is_dying: bool = False

    def give(self, task: Task) -> bool:
        assert self.is_free
        self.is_free = False
        if not self.is_dying:
            self.given.append(task)
        return not self.is_dying


@dataclass
class Bench:
    """A pool of two such processes, and what was delivered."""

    pool: PlanningPool
    processes: list[FakeProcess]
    answers: list[Planned] = field(default_factory=list)

    def ask(self, number: int, robot: str = "ur5") -> None:
        job = JointPathJob(number, (0.0,), ((1.0,),), 0.5)
        self.pool.planner_of(robot).submit(job, self.answers.append)

    def given(self) -> list[list[int]]:
        return [[task.job.job_id for task in process.given] for process in self.processes]


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Bench:
    made: list[FakeProcess] = []

    def make(*_: object) -> FakeProcess:
        made.append(FakeProcess())
        return made[-1]

    monkeypatch.setattr(planning_pool, "PlanningProcess", make)
    return Bench(PlanningPool(["ur5", "kr6", "ur5"]), made)


def test_a_job_waits_while_all_processes_are_busy(bench: Bench) -> None:
    for number in (1, 2, 3):
        bench.ask(number)
    assert bench.given() == [[2], [1]]
    bench.processes[0].is_free = True
    bench.pool.hand_out()
    assert bench.given() == [[2, 3], [1]]


def test_a_job_that_a_process_did_not_take_goes_to_another_or_waits(bench: Bench) -> None:
    for process in bench.processes:
        process.is_dying = True
    bench.ask(1)
    assert bench.given() == [[], []]
    bench.processes[0].is_free, bench.processes[0].is_dying = True, False
    bench.pool.hand_out()
    assert bench.given() == [[1], []]
    assert bench.answers == []


def test_a_warm_process_is_preferred(bench: Bench) -> None:
    bench.processes[1].is_warm = False
    bench.ask(1)
    assert bench.given() == [[1], []]


def test_a_job_names_its_robot(bench: Bench) -> None:
    bench.ask(1, "kr6")
    assert bench.processes[1].given[0].robot == "kr6"


def test_waiting_jobs_fail_only_where_no_process_is_left(bench: Bench) -> None:
    for process in bench.processes:
        process.is_free = False
    bench.ask(1)
    bench.processes[0].is_down = True
    bench.pool.hand_out()
    assert bench.answers == []
    bench.processes[1].is_down = True
    bench.pool.hand_out()
    assert bench.answers == [Planned(1, Refusal(VerdictCode.PLANNER_FAILED), 0.0)]


@pytest.mark.parametrize(("cells", "processes"), [(1, 1), (2, 2), (30, 2)])
def test_a_few_processes_serve_all_cells(
    monkeypatch: pytest.MonkeyPatch, cells: int, processes: int
) -> None:
    made: list[object] = []
    monkeypatch.setattr(planning_pool, "PlanningProcess", lambda *given: made.append(given))
    PlanningPool(["ur5"] * cells)
    assert [given[0] for given in made] == [["ur5"]] * processes  # type: ignore[index]


@pytest.mark.realtime
def test_one_process_plans_for_several_robots() -> None:
    async def plans() -> list[Planned]:
        pool = PlanningPool(["ur5", "abb_irb120"])
        keeper = asyncio.create_task(pool.keep_up())
        answers: asyncio.Queue[Planned] = asyncio.Queue()
        start = (0.0, -1.0, 1.0, 0.1, 0.2, 0.3)
        job: Job = JointPathJob(1, start, (tuple(value + 0.1 for value in start),), 0.5)
        for robot in ("ur5", "abb_irb120"):
            pool.planner_of(robot).submit(job, answers.put_nowait)
        try:
            async with asyncio.timeout(60):
                return [await answers.get(), await answers.get()]
        finally:
            keeper.cancel()
            await asyncio.gather(keeper, return_exceptions=True)

    first, second = asyncio.run(plans())
    assert isinstance(first.result, tuple)
    assert isinstance(second.result, tuple)
    assert first.result[0].duration != second.result[0].duration
