import asyncio
import logging
import pickle
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from rigs.processes.planning_children import (
    BUSY,
    ECHO,
    FLOOD,
    JOB,
    MUTE,
    WARM,
    Children,
    on_both_loops,
    run,
    running_pool,
    until,
)

from openpendant.motion.scene.scene import Scene
from openpendant.server.events.management_requests import parse
from openpendant.server.planning.jobs import (
    LENGTH,
    FreePath,
    JointPathJob,
    PlanAnswer,
    PlanJob,
    PlanTask,
    ReadBody,
    SearchProgress,
    SearchStage,
    WayCheckJob,
    is_search,
)
from openpendant.server.planning.pool import planning_pool, planning_process
from openpendant.server.planning.pool.planning_pool import PlanningPool
from openpendant.server.planning.pool.planning_process import PlanningProcess
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import EventLoop
from openpendant.simplemsg.verdicts import VerdictCode as V


@pytest.fixture
def children(monkeypatch: pytest.MonkeyPatch) -> Children:
    return Children(monkeypatch)


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

    @property
    def is_searching(self) -> bool:
        return not self.is_free and bool(self.given) and is_search(self.given[-1].job)

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

    def ask_to_search(self, cell: int, *numbers: int) -> None:
        for number in numbers:
            motion = FreePath((0.0,), (1.0,), "RRTConnect", 0, 5.0, 0.0, 0.5)
            job = PlanJob(number, (0.0,), motion)
            self.pool.submit(PlanTask("ur5", job, self.answers.append, cell))

    def ask_to_read(self, cell: int, *numbers: int) -> None:
        for number in numbers:
            job = ReadBody(number, number, b"{}", parse)
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
    assert (bench.given(), bench.answers) == ([[1], []], [])


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


def test_a_motion_waits_for_one_body_at_most_and_a_body_for_one_plan(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_to_read(1, *range(100, 130))
    assert bench.next_of_first(1) == [100]
    bench.ask_for(1, 11, 12)
    bench.ask_for(2, 21)
    assert bench.next_of_first(7) == [11, 101, 21, 102, 12, 103, 104]


def test_a_plan_that_comes_while_a_body_is_read_goes_next(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_to_read(1, 100, 101)
    bench.ask_for(2, 21)
    assert bench.next_of_first(4) == [21, 100, 101]
    bench.ask_to_read(1, 102, 103)
    assert bench.given()[0][-1] == 102
    bench.ask_for(2, 22)
    assert bench.next_of_first(2) == [22, 103]


def test_the_bodies_of_cells_take_turns_and_so_do_connections(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_to_read(1, 100, 101, 102)
    bench.ask_to_read(2, 200)
    assert bench.next_of_first(4) == [100, 200, 101, 102]


def test_a_plan_around_obstacles_goes_behind_all_else(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_to_search(1, 100, 101)
    bench.ask_for(2, 21, 22)
    bench.ask_to_read(3, 31)
    bench.ask_to_search(2, 200)
    assert bench.next_of_first(6) == [21, 31, 22, 100, 200, 101]


def test_plans_around_obstacles_leave_a_process_to_motions(bench: Bench) -> None:
    bench.ask_to_search(1, 100)
    bench.ask_to_search(2, 200)
    assert sorted(bench.given()) == [[], [100]]
    bench.ask_for(3, 31)
    assert sorted(bench.given()) == [[31], [100]]


def test_one_that_waits_is_withdrawn_and_fails_with_the_others(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_to_search(1, 100, 101)
    bench.pool.withdraw(1, 100)
    bench.processes[0].is_down = bench.processes[1].is_down = True
    bench.pool.hand_out()
    assert [each.job_id for each in bench.answers] == [101]


def test_a_look_goes_before_bodies(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_to_read(1, 100, 101)
    bench.ask_to_look(1, 11)
    assert bench.next_of_first(3) == [11, 100, 101]


def test_a_body_that_waits_is_withdrawn_and_fails_with_the_others(bench: Bench) -> None:
    bench.keep_busy()
    bench.ask_to_read(1, 100, 101)
    bench.ask_for(1, 11)
    bench.pool.withdraw(1, 100)
    bench.processes[0].is_down = bench.processes[1].is_down = True
    bench.pool.hand_out()
    assert sorted(each.job_id for each in bench.answers) == [11, 101]


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
    assert (bench.processes[0].given[-1].cell, bench.answers) == (2, [])


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


PLANNED = ("ur5", JOB, 0)
FAILED = Refusal(V.PLANNER_FAILED)

Ask = Callable[[int], Awaitable[list[Any]]]

turns_after_the_death = pytest.mark.parametrize("turns", range(6))


def test_a_process_that_cannot_be_started_is_logged_and_tried_again(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    attempts = 0

    async def refuse(*_: Any, **__: Any) -> None:
        nonlocal attempts
        attempts += 1
        if attempts == 3:
            raise asyncio.CancelledError
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(asyncio, "create_subprocess_exec", refuse)
    monkeypatch.setattr(planning_process, "_RESTART_PAUSE", 0.001)
    with caplog.at_level(logging.ERROR), pytest.raises(asyncio.CancelledError):
        asyncio.run(PlanningProcess(["ur5"], lambda: None).keep_up())
    assert [record.levelname for record in caplog.records] == ["ERROR", "ERROR"]
    assert "temporarily unavailable" in caplog.text


@asynccontextmanager
async def planning(processes: int) -> AsyncIterator[Ask]:
    answers: asyncio.Queue[Any] = asyncio.Queue()

    async def ask(jobs: int) -> list[Any]:
        for _ in range(jobs):
            pool.submit(PlanTask("ur5", JOB, answers.put_nowait))
        return [await answers.get() for _ in range(jobs)]

    async with running_pool(processes) as pool:
        yield ask


async def turn(times: int) -> None:
    for _ in range(times):
        await asyncio.sleep(0)


def outlast(seconds: float) -> None:
    time.sleep(2 * seconds)


@pytest.mark.realtime
@pytest.mark.parametrize("processes", [1, 2])
@turns_after_the_death
@on_both_loops
def test_a_job_given_to_a_process_just_killed_is_answered_and_planning_goes_on(
    loop: EventLoop, turns: int, processes: int, children: Children
) -> None:
    async def test() -> None:
        async with planning(processes) as ask:
            await ask(2 * processes)
            children.kill()
            await turn(turns)
            for answer in await ask(2 * processes):
                assert answer == PLANNED or answer.result == FAILED
            assert await ask(1) == [PLANNED]

    assert run(loop, test()) == []


@pytest.mark.realtime
@on_both_loops
def test_a_job_that_cannot_be_written_waits_for_the_next_process(
    loop: EventLoop, children: Children, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_: bytes) -> None:
        raise RuntimeError("the handler is closed")

    async def test() -> None:
        async with planning(1) as ask:
            await ask(1)
            monkeypatch.setattr(children.started[0].stdin, "write", refuse)
            assert await ask(1) == [PLANNED]
            assert len(children.started) == 2

    assert run(loop, test()) == []


@pytest.mark.realtime
@turns_after_the_death
@on_both_loops
def test_a_process_that_dies_just_before_it_took_too_long_is_no_fault(
    loop: EventLoop, turns: int, children: Children, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planning_process, "_LONGEST_PLAN", 0.01)
    children.command = MUTE

    async def test() -> None:
        async with planning(1) as ask:
            asked = asyncio.ensure_future(ask(1))
            await until(lambda: bool(children.started))
            children.kill()
            await turn(turns)
            outlast(0.01)
            assert [answer.result for answer in await asked] == [FAILED]

    assert run(loop, test()) == []


@pytest.mark.realtime
@pytest.mark.parametrize("turns", range(6))
@on_both_loops
def test_a_child_that_is_still_being_started_at_the_end_is_ended(
    loop: EventLoop, turns: int, children: Children
) -> None:
    async def test() -> None:
        keeper = asyncio.create_task(PlanningProcess(["ur5"], lambda: None).keep_up())
        await turn(turns)
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)
        assert [child.returncode for child in children.started] == [0] * (turns > 0)

    assert run(loop, test()) == []


@pytest.mark.realtime
@turns_after_the_death
@on_both_loops
def test_a_server_that_goes_down_as_its_planner_dies_starts_no_other(
    loop: EventLoop, turns: int, children: Children
) -> None:
    """A cancellation that was lost left the server waiting for the new one without end."""

    async def test() -> None:
        planner = PlanningProcess(["ur5"], lambda: None)
        keeper = asyncio.create_task(planner.keep_up())
        await until(lambda: planner.is_warm)
        children.kill()
        await until(lambda: children.started[0].returncode is not None)
        await turn(turns)
        keeper.cancel()
        done, _ = await asyncio.wait([keeper], timeout=5)
        assert done

    assert run(loop, test()) == []


@pytest.mark.realtime
@on_both_loops
def test_an_answer_that_nobody_reads_holds_up_no_end(loop: EventLoop, children: Children) -> None:
    children.command = FLOOD

    async def test() -> None:
        planner = PlanningProcess(["ur5"], lambda: None)
        keeper = asyncio.create_task(planner.keep_up())
        await asyncio.sleep(0.3)  # more has come by then than the loop reads ahead
        keeper.cancel()
        done, _ = await asyncio.wait([keeper], timeout=5)
        assert done

    assert run(loop, test()) == []


@asynccontextmanager
async def busy_process(children: Children) -> AsyncIterator[tuple[PlanningPool, list[Any]]]:
    """A pool whose only process is busy with a job of cell 1, and what is delivered.

    Any process after that echoes what it is sent.
    """
    children.command = BUSY
    answers: list[Any] = []
    async with running_pool() as pool:
        pool.submit(PlanTask("ur5", JOB, answers.append, 1))
        # Warm, or else nothing is cut short.
        await until(lambda: pool._processes[0].is_warm)
        children.command = ECHO
        yield pool, answers


@pytest.mark.realtime
@pytest.mark.parametrize("is_first", [True, False])
@on_both_loops
def test_a_process_busy_with_a_withdrawn_job_is_replaced_where_another_cell_waits(
    loop: EventLoop, is_first: bool, children: Children, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planning_process, "_LONGEST_WASTE", 0.01)

    async def test() -> None:
        async with busy_process(children) as (pool, answers):
            if is_first:
                pool.submit(PlanTask("ur5", JOB, answers.append, 2))
            pool.withdraw(1, JOB.job_id)
            if not is_first:
                await asyncio.sleep(0.05)
                assert len(children.started) == 1, "nobody waited"
                pool.submit(PlanTask("ur5", JOB, answers.append, 2))
            await until(lambda: bool(answers))
            assert [(robot, job) for robot, job, _ in answers] == [("ur5", JOB)]
            assert len(children.started) == 2

    assert run(loop, test()) == []


@pytest.mark.realtime
@pytest.mark.parametrize("job_id", [JOB.job_id, 4711])
def test_a_process_keeps_on_at_a_job_that_somebody_waits_for(
    job_id: int, children: Children, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(planning_process, "_LONGEST_WASTE", 0.0)

    async def test() -> None:
        async with busy_process(children) as (pool, answers):
            pool.submit(PlanTask("ur5", JOB, answers.append, 2))
            pool.withdraw(3, job_id)
            pool.withdraw(1, 4711)
            await asyncio.sleep(0.05)
            assert len(children.started) == 1
            assert answers == []

    assert run("asyncio", test()) == []


@pytest.mark.realtime
def test_the_answer_to_a_withdrawn_job_is_not_delivered_and_its_process_goes_on(
    children: Children,
) -> None:
    async def test() -> None:
        dropped: list[Any] = []
        answers: asyncio.Queue[Any] = asyncio.Queue()
        async with running_pool() as pool:
            await until(lambda: pool._processes[0].is_warm)
            pool.submit(PlanTask("ur5", JOB, dropped.append, 1))
            pool.withdraw(1, JOB.job_id)
            pool.submit(PlanTask("ur5", JOB, answers.put_nowait, 2))
            await answers.get()
            assert dropped == []
            assert len(children.started) == 1

    assert run("asyncio", test()) == []


@pytest.mark.realtime
def test_words_on_a_search_are_delivered_and_its_answer_ends_it(
    children: Children, tmp_path: Path
) -> None:
    word = PlanAnswer(1, SearchProgress(SearchStage.SEARCHING, 0.25), 0.1)
    last = PlanAnswer(1, Refusal(V.NO_PATH_FOUND), 0.5)
    said = tmp_path / "said"
    said.write_bytes(
        b"".join(LENGTH.pack(len(data)) + data for data in map(pickle.dumps, (word, last)))
    )
    children.command = f"{WARM} head -c 1 >/dev/null; cat {said}; exec cat"

    async def test() -> None:
        answers: list[Any] = []
        async with running_pool() as pool:
            pool.submit(PlanTask("ur5", JOB, answers.append, 1))
            await until(lambda: len(answers) == 2)
            assert answers == [word, last]
            assert pool._processes[0].is_free

    assert run("asyncio", test()) == []
