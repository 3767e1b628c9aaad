import asyncio
import json
from collections.abc import Callable, Iterable
from contextlib import closing
from pathlib import Path

import pytest
from rigs.cells.expectations import only
from rigs.cells.journalled_cell import journalled_cell
from rigs.cells.robot_cell_situations import GOAL, planning
from rigs.cells.scene_monitor_rig import BOX, EMPTY, MonitoredRig
from rigs.cells.server_rig import ServerRig
from rigs.clock.virtual_clock import VirtualLoop
from rigs.peers.server_clients import Pendant

from openpendant.server.events.effects import Ask, Backend, Cancel, Effect
from openpendant.server.events.pending import Pending, Steps, Turn
from openpendant.server.planning.jobs import (
    Job,
    JointPathJob,
    PathFree,
    PlanAnswer,
    PlanJob,
    ProgramJob,
    SearchProgress,
    SearchStage,
)
from openpendant.server.programs.editing.program_tasks import PrintBody
from openpendant.server.refusal import Refusal
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.requests import Answer, ListHeadings, Load, Request
from openpendant.server.store.store_errors import NotFound
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.packets.rerun import main
from openpendant.tools.pendants.client import Refused

LOAD = Load(DocumentKind.PROGRAM, "a")
MISSING = NotFound("program", "a")


class Book:
    def __init__(self) -> None:
        self.pending = Pending()
        self.told: list[tuple[object, int]] = []

    def take(self, answer: object, now: int) -> list[Effect]:
        self.told.append((answer, now))
        return []

    def ask(self, question: Request | Job) -> Ask:
        return only(Ask, self.pending.ask(question, self.take))


@pytest.fixture
def book() -> Book:
    return Book()


def test_each_answer_goes_to_who_waits_for_it_and_only_once(book: Book) -> None:
    first, second = book.ask(LOAD), book.ask(ListHeadings())
    assert (first.id, second.id) == (1, 2)
    book.pending.resume(second, (), 7)
    assert book.told == [((), 7)]
    assert book.pending.find(Backend.STORE, 1) is first
    assert book.pending.find(Backend.STORE, 2) is None
    book.pending.resume(second, (), 8)
    assert book.told == [((), 7)]


def test_a_job_and_a_request_of_one_number_are_two_questions(book: Book) -> None:
    planner, store = book.ask(ProgramJob(1, PrintBody("{}", "a"))), book.ask(LOAD)
    assert (planner.backend, store.backend) == (Backend.PLANNER, Backend.STORE)
    book.pending.resume(store, MISSING, 1)
    assert book.told == [(MISSING, 1)]
    assert book.pending.find(Backend.PLANNER, 1) is planner


def test_a_job_is_cancelled_once_and_its_answer_ignored(book: Book) -> None:
    ask = book.ask(ProgramJob(5, PrintBody("{}", "a")))
    assert book.pending.cancel(5) == [Cancel(5)]
    assert book.pending.cancel(5) == []
    planned = PlanAnswer(5, Refusal(V.PLANNER_FAILED), 0.0)
    assert book.pending.resume(ask, planned, 1) == []
    assert book.told == []


def two_answers() -> Steps[tuple[Answer, Answer]]:
    first = yield LOAD
    second = yield ListHeadings()
    return first, second


def test_work_of_several_steps_is_sent_each_answer_and_ends_once(book: Book) -> None:
    first = only(Ask, book.pending.run(two_answers(), book.take, 1))
    second = only(Ask, book.pending.resume(first, MISSING, 2))
    assert (first.question, second.question) == (LOAD, ListHeadings())
    assert book.pending.resume(second, (), 3) == []
    assert book.told == [((MISSING, ()), 3)]


def test_work_that_was_dropped_asks_for_no_more_and_tells_nobody(book: Book) -> None:
    steps = two_answers()
    first = only(Ask, book.pending.run(steps, book.take, 1))
    book.pending.drop(steps)
    assert book.pending.resume(first, MISSING, 2) == []
    assert book.told == []


def test_a_word_on_a_plan_is_no_answer_yet(book: Book) -> None:
    asked = book.ask(PlanJob(7, (0.0,), JointPathJob(0, (0.0,), ((1.0,),), 0.5)))
    word = PlanAnswer(7, SearchProgress(SearchStage.CHECKING, 0.5), 0.1)
    last = PlanAnswer(7, Refusal(V.NO_PATH_FOUND), 0.2)
    for at, answer in enumerate((word, word, last, word)):
        book.pending.resume(asked, answer, at)
    assert book.told == [(word, 0), (word, 1), (last, 2)]


def long_work(name: str, turns: int, done: list[str]) -> Steps[str]:
    yield Turn.FIRST
    for _ in range(turns):
        done.append(name)
        yield Turn.NEXT
    done.append(name)
    return name


def test_one_task_has_a_turn_in_each_tick_and_keeps_it_to_its_end(book: Book) -> None:
    done: list[str] = []
    dropped = long_work("c", 2, done)
    for steps in (long_work("a", 2, done), long_work("b", 1, done), dropped):
        book.pending.run(steps, book.take, 0)
    assert done == ["a"]
    book.pending.drop(dropped)
    seen = []
    for now in range(1, 6):
        book.pending.tick(now)
        seen.append("".join(done))
    assert seen == ["aa", "aaa", "aaab", "aaabb", "aaabb"]
    assert book.told == [("a", 2), ("b", 4)]


def withdrawn(out: Iterable[Effect]) -> list[int]:
    return [each.id for each in out if isinstance(each, Cancel)]


def withdrawn_of(rig: ServerRig) -> list[int]:
    return withdrawn(item for _, item in rig.log)


@pytest.mark.parametrize("end", [Pendant.release, Pendant.stop], ids=["release", "software stop"])
def test_a_motion_that_ends_in_planning_withdraws_its_job(end: Callable[[Pendant], object]) -> None:
    rig, pendant = planning()
    end(pendant)
    assert withdrawn_of(rig) == [rig.jobs[0].job_id]


def test_however_often_a_motion_is_asked_for_and_dropped_one_job_is_waited_for() -> None:
    rig, pendant = planning()
    for _ in range(20):
        pendant.release()
        pendant.take()
        pendant.path((0.1, 0.1), GOAL)
    asked = [job.job_id for job in rig.jobs]
    assert len(asked) == 21
    assert withdrawn_of(rig) == asked[:-1]


def test_a_motion_that_moves_or_was_refused_withdraws_nothing() -> None:
    rig, pendant = planning()
    rig.plan()
    rig.wait(50)
    pendant.stop()
    assert withdrawn_of(rig) == []


def test_a_look_is_withdrawn_when_the_scene_changes_again() -> None:
    moving = MonitoredRig()
    first = moving.change()
    again = moving.change_scene(EMPTY)
    assert withdrawn(again) == [first.job_id]
    assert isinstance(again[-1], Ask)


def test_a_look_is_withdrawn_when_the_motion_has_ended() -> None:
    moving = MonitoredRig()
    job = moving.change()
    moving.pendant.stop()
    assert withdrawn(moving.guard.tick(moving.rig.now)) == [job.job_id]
    assert moving.guard.tick(moving.rig.now) == []


def test_a_look_that_was_answered_is_not_withdrawn() -> None:
    moving = MonitoredRig()
    moving.answer(moving.change(), PathFree())
    assert withdrawn(moving.change_scene(BOX)) == []


async def _ask_and_drop(folder: Path) -> None:
    async with journalled_cell(folder / "emulator", folder / "server") as cell:
        pendant = await cell.pendant()
        async with pendant, pendant.control():
            home = list(pendant.joints())
            path = [[home[0] + 0.3, *home[1:]], home]
            for _ in range(3):
                asking = asyncio.ensure_future(pendant.follow_joints(path, speed=0.5))
                await asyncio.sleep(0.01)
                await pendant.program_stop()
                with pytest.raises(Refused):
                    await asking
            await (await pendant.follow_joints(path, speed=0.5)).done()


def test_a_server_that_withdrew_jobs_runs_again_from_its_journal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with closing(VirtualLoop()) as loop:
        loop.run_until_complete(_ask_and_drop(tmp_path))
    file = tmp_path / "server"
    events = [json.loads(line) for line in file.read_text().splitlines()]
    answers = [event for event in events if event.get("on") == "planned"]
    asked = [event for event in events if event.get("out") == "planner"]
    assert (len(asked), len(answers)) == (4, 1)
    assert main([str(file), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["identical"]


def test_work_that_can_wait_goes_on_behind_whoever_asks_for_a_turn(book: Book) -> None:
    done: list[str] = []

    def patient() -> Steps[str]:
        for number in range(2):
            yield Turn.LAST
            done.append(f"patient {number}")
        return ""

    def urgent() -> Steps[str]:
        for number in range(2):
            yield Turn.NEXT
            done.append(f"urgent {number}")
        return ""

    def polite() -> Steps[str]:
        yield Turn.FIRST
        done.append("polite")
        return ""

    for steps in (patient(), polite(), urgent()):
        book.pending.run(steps, book.take, 0)
    for now in range(6):
        book.pending.tick(now)
    assert done == ["urgent 0", "urgent 1", "patient 0", "polite", "patient 1"]
