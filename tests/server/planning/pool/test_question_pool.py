"""The line of questions on kinematics, and the process that answers them."""

import asyncio
import json
import logging
import os
import signal
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.motion.loaded_robots import serial_robot
from rigs.processes.planning_children import (
    BUSY,
    ECHO,
    MUTE,
    WARM,
    Children,
    on_both_loops,
    run,
    running_pool,
    until,
)

from openpendant.server.planning.jobs import (
    JointPathJob,
    KinematicsFound,
    KinematicsQuestion,
    PlanAnswer,
    PlanTask,
)
from openpendant.server.planning.pool import question_pool
from openpendant.server.planning.pool.planning_pool import PlanningPool
from openpendant.server.planning.pool.planning_process import NICENESS, give_way
from openpendant.server.planning.pool.question_pool import QuestionLine, QuestionPool
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import EventLoop
from openpendant.simplemsg.pendant.management.kinematics import (
    ForwardKinematics,
    InverseKinematics,
    Question,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

FK = ForwardKinematics()
IK = InverseKinematics(pose={"position": (-0.4, -0.2, 0.5)}, tool="flange")
HOME = serial_robot("ur5").home_position


class Answers(list[PlanAnswer]):
    """What was answered, in order."""

    def codes(self) -> dict[int, V | None]:
        return {
            each.job_id: each.result.code if isinstance(each.result, Refusal) else None
            for each in self
        }


def question(
    answers: Answers, number: int, session: int, asked: Question = FK, cell: int = 1
) -> PlanTask:
    job = KinematicsQuestion(number, session, asked, HOME)
    return PlanTask("ur5", job, answers.append, cell)


def order_of(line: QuestionLine) -> list[int]:
    """Take all questions; return their numbers in the order in which they went."""
    taken = []
    while (task := line.first()) is not None:
        line.take(task)
        taken.append(task.job.job_id)
    return taken


def test_connections_take_turns_and_each_connections_questions_keep_their_order() -> None:
    line, answers = QuestionLine(), Answers()
    for number, session in enumerate([1, 1, 1, 1, 2, 3, 2]):
        line.put(question(answers, number, session))
    assert order_of(line) == [0, 4, 5, 1, 6, 2, 3]


@given(st.lists(st.integers(0, 5), max_size=40))
def test_promise_40_a_connection_waits_for_no_more_than_one_question_of_each_other(
    sessions: list[int],
) -> None:
    line = QuestionLine()
    for number, session in enumerate(sessions):
        line.put(question(Answers(), number, session))
    line.put(question(Answers(), 1_000, 99))
    assert order_of(line).index(1_000) <= len({*sessions})


def test_of_one_connections_inverse_kinematics_only_the_newest_waits_in_its_place() -> None:
    line, answers = QuestionLine(), Answers()
    older = question(answers, 1, 7, IK)
    assert line.put(older) is None
    assert line.put(question(answers, 2, 7)) is None
    assert line.put(question(answers, 3, 8, IK)) is None
    assert line.put(question(answers, 4, 7, IK)) is older
    assert order_of(line) == [4, 3, 2]


def test_a_question_that_was_taken_is_not_superseded() -> None:
    line, answers = QuestionLine(), Answers()
    taken = question(answers, 1, 7, IK)
    line.put(taken)
    line.take(taken)
    assert line.put(question(answers, 2, 7, IK)) is None


def test_a_question_that_is_put_back_goes_before_all_others() -> None:
    line, answers = QuestionLine(), Answers()
    for number, session in ((1, 1), (2, 2)):
        line.put(question(answers, number, session))
    line.put_back(question(answers, 3, 2))
    assert order_of(line) == [3, 1, 2]


def test_a_question_is_withdrawn_by_its_cell_and_number() -> None:
    line, answers = QuestionLine(), Answers()
    line.put(question(answers, 1, 7, cell=1))
    line.put(question(answers, 1, 8, cell=2))
    assert not line.withdraw(1, 2)
    assert line.withdraw(2, 1)
    assert not line.withdraw(2, 1)
    assert order_of(line) == [1]


# With a process.


@asynccontextmanager
async def running() -> AsyncIterator[QuestionPool]:
    pool = QuestionPool(["ur5"])
    keeper = asyncio.create_task(pool.keep_up())
    try:
        yield pool
        assert not keeper.done()
    finally:
        keeper.cancel()
        await asyncio.gather(keeper, return_exceptions=True)


@pytest.fixture
def children(monkeypatch: pytest.MonkeyPatch) -> Children:
    return Children(monkeypatch)


@pytest.mark.realtime
@on_both_loops
def test_the_process_is_started_by_the_first_question(children: Children, loop: EventLoop) -> None:
    async def test() -> None:
        answers = Answers()
        async with running() as pool:
            await asyncio.sleep(0.05)
            assert children.started == []
            pool.submit(question(answers, 1, 7))
            await until(lambda: len(children.started) == 1)

    children.command = MUTE
    assert run(loop, test()) == []


@pytest.mark.realtime
@on_both_loops
def test_an_older_question_that_waits_is_answered_superseded_in_a_later_turn(
    children: Children, loop: EventLoop
) -> None:
    async def test() -> None:
        answers = Answers()
        async with running() as pool:
            pool.submit(question(answers, 1, 7, IK))
            await until(lambda: len(children.started) == 1)
            await asyncio.sleep(0.05)  # until it has the first in hand
            for number in (2, 3, 4):
                pool.submit(question(answers, number, 7, IK))
            pool.submit(question(answers, 5, 8, IK))
            assert answers == []
            await asyncio.sleep(0)
            assert answers.codes() == {2: V.SUPERSEDED, 3: V.SUPERSEDED}

    children.command = BUSY
    assert run(loop, test()) == []


@pytest.mark.realtime
@on_both_loops
def test_what_the_process_had_in_hand_is_asked_once_more_and_then_refused(
    children: Children, loop: EventLoop, caplog: pytest.LogCaptureFixture
) -> None:
    async def test() -> None:
        answers = Answers()
        async with running() as pool:
            pool.submit(question(answers, 1, 7))
            pool.submit(question(answers, 2, 8))
            await until(lambda: len(children.started) == 3)
            assert answers.codes() == {1: V.PLANNER_FAILED}
            await until(lambda: len(children.started) == 5)
            await asyncio.sleep(0)
            assert answers.codes() == {1: V.PLANNER_FAILED, 2: V.PLANNER_FAILED}

    # It is warm, takes a question and dies of it.
    children.command = f"{WARM} head -c 1 >/dev/null"
    caplog.set_level(logging.CRITICAL)
    assert run(loop, test()) == []


@pytest.mark.realtime
@on_both_loops
def test_where_no_process_can_be_started_every_question_is_refused(
    children: Children, loop: EventLoop
) -> None:
    async def test() -> None:
        answers = Answers()
        async with running() as pool:
            for number in (1, 2):
                pool.submit(question(answers, number, number))
            async with asyncio.timeout(5):
                await until(lambda: len(answers) == 2)
        assert answers.codes() == dict.fromkeys((1, 2), V.PLANNER_FAILED)

    children.command = "exit 1"
    assert run(loop, test()) == []


@pytest.mark.realtime
@on_both_loops
def test_a_process_that_does_not_answer_is_replaced(
    children: Children, loop: EventLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def test() -> None:
        answers = Answers()
        async with running() as pool:
            pool.submit(question(answers, 1, 7))
            async with asyncio.timeout(10):
                await until(lambda: len(answers) == 1)
        assert answers.codes() == {1: V.PLANNER_FAILED}
        assert len(children.started) >= 2

    children.command = MUTE
    monkeypatch.setattr(question_pool, "_LONGEST_ANSWER", 0.1)
    assert run(loop, test()) == []


@pytest.mark.realtime
def test_questions_never_wait_among_the_plans(children: Children) -> None:
    async def test() -> None:
        answers = Answers()
        pool = PlanningPool(["ur5"])
        keeper = asyncio.create_task(pool.keep_up())
        try:
            planner = pool.planner_of("ur5")
            planner.submit(JointPathJob(1, HOME, (HOME,), 0.5), answers.append)
            await until(lambda: len(children.started) == 1)
            children.command = ECHO
            planner.submit(question(answers, 2, 7).job, answers.append)
            await until(lambda: len(children.started) == 2)
            planner.withdraw(2)
            planner.withdraw(1)
        finally:
            keeper.cancel()
            await asyncio.gather(keeper, return_exceptions=True)
        assert answers == []

    children.command = BUSY
    assert run("asyncio", test()) == []


@pytest.mark.realtime
def test_whoever_waits_for_an_answer_waits_for_no_plan_and_for_no_ordinary_program(
    children: Children,
) -> None:
    async def test() -> None:
        answers = Answers()
        async with running() as pool, running_pool():
            pool.submit(question(answers, 1, 7))
            await until(lambda: len(children.arguments) == 2)

    assert run("asyncio", test()) == []
    niceness = {int(arguments[3]) for arguments in children.arguments}
    assert niceness == {0, NICENESS}


class Priorities:
    """The system's priorities, of one process that was started by a server."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, inherited: int) -> None:
        self.niceness = inherited
        monkeypatch.setattr(os, "getpriority", lambda *_: self.niceness)
        monkeypatch.setattr(os, "setpriority", self._set)

    def _set(self, _which: int, _process: int, niceness: int) -> None:
        assert niceness >= self.niceness, "only an administrator may"
        self.niceness = niceness


@pytest.mark.parametrize(
    ("server", "asked", "becomes"),
    [
        pytest.param(-10, 10, 10, id="a plan"),
        pytest.param(-10, 0, 0, id="a question"),
        pytest.param(0, 0, 5, id="a question, and the server may not run first"),
        pytest.param(12, 10, 17, id="a plan, and the server is to run last"),
    ],
)
def test_a_process_is_as_nice_as_asked_and_nicer_than_the_server(
    monkeypatch: pytest.MonkeyPatch, server: int, asked: int, becomes: int
) -> None:
    system = Priorities(monkeypatch, server)
    give_way(asked)
    assert system.niceness == becomes


@pytest.mark.soak
def test_a_real_process_answers_and_after_its_death_another_does() -> None:
    async def test() -> None:
        answers = Answers()
        async with running() as pool:
            pool.submit(question(answers, 1, 7))
            pool.submit(question(answers, 2, 8, IK))
            async with asyncio.timeout(25):
                await until(lambda: len(answers) == 2)
                process = pool._process._process
                assert process is not None
                os.kill(process.pid, signal.SIGKILL)
                pool.submit(question(answers, 3, 7))
                await until(lambda: len(answers) == 3)
        assert answers.codes() == dict.fromkeys((1, 2, 3))
        found = answers[1].result
        assert isinstance(found, KinematicsFound)
        assert json.loads(found.body)["total"] == 1

    with asyncio.Runner() as runner:
        runner.run(test())
