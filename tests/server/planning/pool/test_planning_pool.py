from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from openpendant.motion.scene.scene import Scene
from openpendant.server.planning.jobs import JointPathJob, PlanAnswer, PlanTask, WayCheckJob
from openpendant.server.planning.pool import planning_pool
from openpendant.server.planning.pool.planning_pool import PlanningPool
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode as V


def path_job(number: int) -> JointPathJob:
    return JointPathJob(number, (0.0,), ((1.0,),), 0.5)


@dataclass
class FakeProcess:
    is_free: bool = True
    is_warm: bool = True
    is_down: bool = False
    given: list[PlanTask] = field(default_factory=list)

    is_dying: bool = False
    wasted_on: int | None = None
    withdrawn: list[tuple[int, int]] = field(default_factory=list)
    cuts: int = 0

    def give(self, task: PlanTask) -> bool:
        assert self.is_free
        self.is_free = False
        if not self.is_dying:
            self.given.append(task)
        return not self.is_dying

    def withdraw(self, cell: int, job_id: int) -> None:
        self.withdrawn.append((cell, job_id))

    def cut_short(self) -> None:
        self.cuts += 1


@dataclass
class Bench:
    pool: PlanningPool
    processes: list[FakeProcess]
    answers: list[PlanAnswer] = field(default_factory=list)

    def ask(self, number: int, robot: str = "ur5") -> None:
        self.pool.planner_of(robot).submit(path_job(number), self.answers.append)

    def ask_for(self, cell: int, *numbers: int) -> None:
        for number in numbers:
            self.pool.submit(PlanTask("ur5", path_job(number), self.answers.append, cell))

    def ask_to_look(self, cell: int, *numbers: int) -> None:
        for number in numbers:
            job = WayCheckJob(number, (0.0,), b"", Scene())
            self.pool.submit(PlanTask("ur5", job, self.answers.append, cell))

    def keep_busy(self) -> None:
        self.ask_for(0, 0, 0)

    def next_of_first(self, times: int) -> list[int]:
        before = len(self.processes[0].given)
        for _ in range(times):
            self.processes[0].is_free = True
            self.pool.hand_out()
        return [task.job.job_id for task in self.processes[0].given[before:]]

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
    assert bench.answers == [PlanAnswer(1, Refusal(V.PLANNER_FAILED), 0.0)]


def test_the_planners_of_two_cells_take_turns(bench: Bench) -> None:
    first, second = bench.pool.planner_of("ur5"), bench.pool.planner_of("ur5")
    bench.keep_busy()
    for number in (1, 2, 3):
        first.submit(path_job(number), bench.answers.append)
    second.submit(path_job(9), bench.answers.append)
    assert bench.next_of_first(4) == [1, 9, 2, 3]


def test_the_many_jobs_of_a_cell_delay_others_by_one_job_at_most(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_for(1, 11, 12, 13)
    bench.ask_for(2, 21, 22)
    bench.ask_for(3, 31)
    assert bench.next_of_first(6) == [11, 21, 31, 12, 22, 13]


def test_looks_along_the_way_of_a_robot_that_moves_go_before_all_turns(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_for(1, 11)
    bench.ask_for(2, 21)
    bench.ask_to_look(2, 22)
    bench.ask_to_look(3, 31)
    assert bench.next_of_first(4) == [22, 31, 11, 21]


def test_a_scene_that_changes_again_and_again_lets_others_plan(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_for(1, 11)
    bench.ask_for(2, 21)
    got = []
    for number in range(90, 94):
        bench.ask_to_look(3, number)
        got += bench.next_of_first(1)
        bench.pool.withdraw(3, number)
    assert got == [90, 11, 92, 21]


def test_a_withdrawn_job_that_waits_is_never_planned_and_never_answered(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_for(1, 11, 12)
    bench.ask_for(2, 11)
    bench.pool.withdraw(1, 11)
    assert bench.next_of_first(3) == [12, 11]
    assert bench.processes[0].given[-1].cell == 2
    assert bench.answers == []


def test_a_withdrawn_job_that_does_not_wait_is_looked_for_in_the_processes(bench: Bench) -> None:
    bench.ask_for(1, 11)
    bench.pool.withdraw(1, 11)
    assert [process.withdrawn for process in bench.processes] == [[(1, 11)]] * 2


def test_a_cell_whose_withdrawn_job_is_still_planned_gets_no_second_process_but_for_a_look(
    bench: Bench,
) -> None:
    bench.keep_busy()
    bench.processes[1].wasted_on = 1
    bench.ask_for(1, 11)
    bench.ask_for(2, 21)
    assert bench.next_of_first(2) == [21]
    bench.ask_to_look(1, 12)
    assert bench.processes[0].given[-1].job.job_id == 12


def test_processes_are_cut_short_only_where_jobs_wait(bench: Bench) -> None:
    bench.keep_busy()
    assert [process.cuts for process in bench.processes] == [0, 0]
    bench.ask_for(1, 11)
    assert [process.cuts for process in bench.processes] == [1, 1]


@pytest.mark.parametrize(("cells", "processes"), [(1, 1), (2, 2), (30, 2)])
def test_a_few_processes_serve_all_cells(
    monkeypatch: pytest.MonkeyPatch, cells: int, processes: int
) -> None:
    made: list[object] = []
    monkeypatch.setattr(planning_pool, "PlanningProcess", lambda *given: made.append(given))
    PlanningPool(["ur5"] * cells)
    assert [given[0] for given in made] == [["ur5"]] * processes  # type: ignore[index]
