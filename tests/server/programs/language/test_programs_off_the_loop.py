import asyncio
import gc
import pickle
import statistics
import time
from collections.abc import AsyncIterator, Iterator
from typing import Any

import pytest
import pytest_asyncio
from rigs.cells.expectations import expect
from rigs.data.journal_records import read_back
from rigs.data.large_programs import WorkCount, WorkingCell, count_work, large_body, large_text
from rigs.processes.planning_children import running_pool

from openpendant.motion.description.robot import serial_robot
from openpendant.server.journal.event_records import plan_from_json, plan_to_json
from openpendant.server.planning.jobs import JointPathJob, PlanAnswer, ProgramJob
from openpendant.server.planning.pool.planning_pool import CellPlanner, PlanningPool
from openpendant.server.programs.editing import program_tasks as tasks
from openpendant.server.programs.language.lexer import MOST_BYTES
from openpendant.server.programs.language.linking import link
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program import Program
from openpendant.server.programs.language.program_json import MOST_JSON_BYTES, program_to_json
from openpendant.server.programs.library.program_library import CHUNK
from openpendant.server.programs.library.program_loader import MOST_WAITING
from openpendant.server.refusal import Refusal
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant import MotionControlAction, RunKind
from openpendant.simplemsg.pendant.management.programs import MOST_STATEMENTS
from openpendant.simplemsg.pendant.management.statements import MOST_INSERTED, DeleteStatements
from openpendant.simplemsg.verdicts import VerdictCode as V

LARGEST = large_text()
SHORT_TEXT = large_text(60, 60)
WHOLE = parse(LARGEST)
BODY = program_to_json(WHOLE)
SHORT = program_to_json(parse(SHORT_TEXT))
A_MOVE = {"statement": "move", "way": "PTP", "point": "p0"}


class CountingCell(WorkingCell):
    count: WorkCount


@pytest.fixture
def cell() -> Iterator[CountingCell]:
    made = CountingCell()
    with pytest.MonkeyPatch.context() as patch:
        made.count = count_work(patch)
        yield made


def keep(cell: WorkingCell, name: str = "main", body: str = BODY) -> None:
    cell.store.save(DocumentKind.PROGRAM, name, body, expected_revision=0, author="test")


def edit(cell: WorkingCell, revision: int = 1, **change: object) -> dict[str, Any]:
    about = {"name": "main", "expected_revision": revision, "edit": change}
    return cell.ask(cell.user, "programs.edit", **about)


@pytest.mark.parametrize(("form", "body"), [("text", LARGEST), ("json", BODY)])
def test_an_upload_of_the_largest_program_is_read_elsewhere(
    cell: CountingCell, form: str, body: str
) -> None:
    assert cell.upload(body, form=form) == {"name": "main", "revision": 1}
    assert cell.count.taken() == (1, 0)
    assert cell.store.load(DocumentKind.PROGRAM, "main").body == BODY


def test_the_largest_program_is_printed_elsewhere_and_once_for_all_its_parts(
    cell: CountingCell,
) -> None:
    keep(cell)
    came = ""
    offset: int | None = 0
    while offset is not None:
        answer = cell.ask(cell.user, "programs.load", name="main", offset=offset)
        assert len(answer["body"]) <= CHUNK
        came, offset = came + answer["body"], answer["next"]
    assert cell.count.taken() == (0, 0)
    assert cell.done == 1
    assert parse(came) == WHOLE


def test_a_text_is_printed_again_after_a_change(cell: WorkingCell) -> None:
    keep(cell, body=large_body(300, 300))
    cell.ask(cell.user, "programs.load", name="main")
    edit(cell, edit="describe", comment="new")
    assert "# new" in cell.ask(cell.user, "programs.load", name="main")["body"]


@pytest.mark.parametrize(
    "change",
    [
        {"edit": "insert", "statements": [A_MOVE], "at": 7},
        {"edit": "delete", "first": 7},
        {"edit": "replace", "at": 7, "statement": A_MOVE},
        {"edit": "rename-point", "name": "p7", "new_name": "q"},
        {"edit": "touch-up", "name": "p7", "joints": [0.0] * 6},
    ],
)
def test_an_edit_of_the_largest_program_reads_what_it_brings_and_no_more(
    cell: CountingCell, change: dict[str, Any]
) -> None:
    keep(cell)
    answer = edit(cell, **change)
    if change["edit"] == "insert":
        assert (answer["code"], answer["limit"]) == (V.PROGRAM_TOO_LARGE, MOST_STATEMENTS)
    else:
        assert answer["revision"] == 2
    parts, parses = cell.count.taken()
    assert parts <= 1
    assert parses == 0


def test_undo_and_redo_of_the_largest_program_read_nothing(cell: CountingCell) -> None:
    keep(cell)
    edit(cell, edit="delete", first=7)
    after = cell.store.load(DocumentKind.PROGRAM, "main").body
    cell.count.taken()
    for revision, op, body in ((2, "undo", BODY), (3, "redo", after)):
        cell.ask(cell.user, f"programs.{op}", name="main", expected_revision=revision)
        assert cell.store.load(DocumentKind.PROGRAM, "main").body == body
    assert cell.count.taken() == (0, 0)
    nothing = cell.ask(cell.user, "programs.redo", name="main", expected_revision=4)
    assert nothing["code"] == V.NOTHING_TO_UNDO


def test_a_point_taught_in_a_long_program_is_read_alone(cell: CountingCell) -> None:
    keep(cell, body=large_body(1_000, 1_000))
    cell.count.taken()
    about = {"name": "main", "point": "here", "move": A_MOVE | {"point": "here"}}
    taught = cell.ask(cell.user, "programs.record", **about, expected_revision=1)
    touched = cell.ask(cell.user, "programs.touch_up", name="main", expected_revision=2, point="p7")
    assert (taught["revision"], touched["revision"]) == (2, 3)
    assert cell.count.taken()[0] <= 10


def test_a_long_program_to_run_is_read_some_at_each_tick(cell: CountingCell) -> None:
    keep(cell)
    assert cell.run() is None
    cell.work()
    most, ticks = cell.count.taken()[0], 0
    while not cell.user.verdicts() or cell.user.verdicts()[-1][0] != cell.user.last_request:
        cell.pass_time(10)
        most, ticks = max(most, cell.count.taken()[0]), ticks + 1
    assert cell.user.verdicts()[-1][1] is V.ACCEPTED
    assert most < 2 * tasks.PACK
    assert ticks == pytest.approx(len(LARGEST.splitlines()) / tasks.PACK, abs=5)


def test_a_long_program_is_put_together_a_step_before_it_is_handed_over(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Both take as long as a step that reads, so each has a tick of its own."""
    made: list[Program] = []
    whole = parse(SHORT_TEXT)
    unpacked = expect(tasks.BodyUnpacked, tasks.perform(tasks.UnpackBody(SHORT, "main")))
    monkeypatch.setattr(Program, "__post_init__", lambda program: made.append(program))
    unpacking = tasks.Unpacking(unpacked)
    counts = []
    while (found := unpacking.step()) is None:
        counts.append(len(made))
    assert found == whole
    assert counts[-2:] == [0, len(made)]


def test_a_program_stop_while_a_long_program_is_loaded_ends_it(cell: WorkingCell) -> None:
    keep(cell)
    cell.run(kind=RunKind.STEP_FORWARD)
    cell.pass_time(50)
    assert cell.core.pendants.programs.executor.is_under_way
    request = cell.user.last_request
    assert cell.control(MotionControlAction.PROGRAM_STOP) is V.ACCEPTED
    cell.work()
    cell.pass_time(2_000)
    assert (request, V.PROGRAM_STOPPED) in cell.user.verdicts()
    assert cell.motions == []


def test_programs_that_are_too_long_together_are_refused(cell: WorkingCell) -> None:
    keep(cell, body=program_to_json(parse(large_text(10, 10) + "call second\ncall third\n")))
    for name in ("second", "third"):
        keep(cell, name, BODY.replace('"main"', f'"{name}"', 1))
    cell.run()
    for _ in range(200):
        cell.work()
        cell.pass_time(10)
    assert cell.user.verdicts()[-1][1] is V.PROGRAM_TOO_LARGE


def test_of_two_edits_of_a_long_program_at_once_the_later_is_refused(cell: WorkingCell) -> None:
    keep(cell)
    other = cell.pendant("other")
    for pendant, word in ((cell.user, "mine"), (other, "theirs")):
        change = {"edit": "describe", "comment": word}
        cell.begin(pendant, "programs.edit", name="main", expected_revision=1, edit=change)
    cell.work()
    assert cell.user.answers()[-1]["revision"] == 2
    refused = other.answers()[-1]
    assert (refused["code"], refused["value"], refused["limit"]) == (V.REVISION_CONFLICT, 2, 1)
    assert '"comment":"mine"' in cell.store.load(DocumentKind.PROGRAM, "main").body[:200]


def test_a_planning_process_that_dies_is_told_and_changes_nothing(cell: WorkingCell) -> None:
    keep(cell)
    change = {"edit": "delete", "first": 0}
    cell.begin(cell.user, "programs.edit", name="main", expected_revision=1, edit=change)
    job = cell.jobs.pop()
    cell.planned(job, PlanAnswer(job.job_id, Refusal(V.PLANNER_FAILED), 0.0))
    assert cell.user.answers()[-1]["code"] == V.PLANNER_FAILED
    assert edit(cell, edit="delete", first=0)["revision"] == 2


def test_only_so_many_tasks_wait_for_the_planning_process(cell: WorkingCell) -> None:
    keep(cell, body=large_body(100, 100))
    for _ in range(MOST_WAITING):
        cell.begin(cell.user, "programs.load", name="main")
    refused = cell.send(cell.user, "programs.load", name="main")
    assert [each["limit"] for each in refused] == [MOST_WAITING]
    cell.work()
    assert len(cell.user.answers()) == MOST_WAITING + 1


def test_a_long_text_with_a_fault_is_refused_with_line_and_column(cell: WorkingCell) -> None:
    refused = cell.upload(large_text(900, 900) + "move PTX p1\n")
    assert (refused["code"], refused["line"], refused["column"]) == (V.PROGRAM_SYNTAX, 1_803, 6)


def test_a_task_of_a_short_program_is_done_at_once(cell: WorkingCell) -> None:
    keep(cell, body=large_body(10, 10))
    edit(cell, edit="delete", first=0)
    assert cell.jobs == []


@pytest.mark.parametrize("kind", [tasks.PrintBody, tasks.TakeHead, tasks.UnpackBody])
def test_the_program_does_not_go_into_the_journal_with_the_job(
    kind: type[tasks.PrintBody | tasks.TakeHead | tasks.UnpackBody],
) -> None:
    assert "p7" not in repr(ProgramJob(1, kind(BODY, "main")))
    assert "p7" not in repr(ProgramJob(1, tasks.ReadSource(LARGEST, "text", "main")))


@pytest.mark.parametrize(
    "task",
    [
        tasks.ReadSource(large_text(60, 60), "text", "main"),
        tasks.ReadSource("no program", "text", "main"),
        tasks.PrintBody(SHORT, "main"),
        tasks.EditBody(SHORT, "main", DeleteStatements(0)),
        tasks.EditBody(SHORT, "main", DeleteStatements(900)),
        tasks.CompareBodies(SHORT, "main", SHORT),
        tasks.TakeHead(SHORT, "main", "p7"),
        tasks.UnpackBody(SHORT, "main"),
    ],
)
def test_what_was_done_to_a_program_comes_back_from_a_journal(task: tasks.Task) -> None:
    planned = PlanAnswer(3, tasks.perform(task), 0.5)
    record = read_back(plan_to_json(planned))
    assert plan_from_json(3, record, serial_robot("ur5").limits, ()) == planned


def test_breakpoints_of_a_long_program_are_found_elsewhere(cell: CountingCell) -> None:
    keep(cell)
    cell.ask(cell.user, "programs.breakpoints", name="main", statements=[0, 7])
    cell.store.save(DocumentKind.PROGRAM, "main", BODY, expected_revision=1, author="test")
    cell.count.taken()
    cell.begin(cell.user, "programs.load", name="main", format="json")
    assert cell.count.taken() == (0, 0)
    cell.work()
    assert cell.user.answers()[-1]["breakpoints"] == [0, 7]


def test_programs_of_a_dry_run_travel_as_json_and_are_read_once(cell: CountingCell) -> None:
    main = parse(SHORT_TEXT)
    linked = link(main, lambda name: None, {"main": program_to_json(main)})
    cell.count.taken()
    sent = pickle.dumps(linked)
    assert cell.count.taken() == (0, 0)
    again = pickle.loads(sent)
    assert again == linked
    assert pickle.loads(sent) is again


def test_an_edit_that_brings_too_many_statements_is_refused(cell: WorkingCell) -> None:
    keep(cell)
    many = [{"statement": "end"}] * (MOST_INSERTED + 1)
    assert edit(cell, edit="insert", statements=many)["code"] == V.BAD_ARGUMENT
    assert cell.jobs == []


@pytest.mark.parametrize(("form", "most"), [("text", MOST_BYTES), ("json", MOST_JSON_BYTES)])
def test_an_upload_is_refused_once_it_is_too_long(cell: WorkingCell, form: str, most: int) -> None:
    refused = cell.upload(" " * (most + 1), form=form)
    assert (refused["code"], refused["limit"]) == (V.PROGRAM_TOO_LARGE, most)
    assert cell.jobs == []


MOST_CPU = 0.010
"""CPU time of this thread between two turns: a tick, where a millisecond or two is usual [s]."""

MOST_CPU_AT_FIRST = 0.020
"""The same while the first programs pass, which pay for what is done once only [s]."""

ROUNDS = 3
"""What else the machine does makes one or another dearer, and not most of them."""

TASKS: list[tasks.Task] = [
    tasks.ReadSource(LARGEST, "text", "main"),
    tasks.PrintBody(BODY, "main"),
    tasks.UnpackBody(BODY, "main"),
]

Rounds = list[tuple[list[object], float]]
"""Of each round the results, and the most CPU time between two looks at the clock [s]."""


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def pool() -> AsyncIterator[PlanningPool]:
    """One process, which has planned nothing yet."""
    async with running_pool() as made:
        yield made


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def rounds(pool: PlanningPool) -> Rounds:
    return [await _round(pool.planner_of("ur5")) for _ in range(ROUNDS)]


@pytest.mark.realtime
@pytest.mark.asyncio(loop_scope="module")
async def test_one_process_plans_for_several_robots(pool: PlanningPool) -> None:
    first, second = [(await _plan(pool, robot)).result for robot in ("ur5", "abb_irb120")]
    assert isinstance(first, tuple)
    assert isinstance(second, tuple)
    assert first[0].duration != second[0].duration


@pytest.mark.realtime
@pytest.mark.asyncio(loop_scope="module")
@pytest.mark.parametrize("number", range(len(TASKS)))
async def test_the_largest_program_comes_back_as_it_would_here(number: int, rounds: Rounds) -> None:
    expected = tasks.perform(TASKS[number])
    assert [results[number] for results, _ in rounds] == [expected] * ROUNDS


@pytest.mark.realtime
@pytest.mark.asyncio(loop_scope="module")
async def test_no_turn_of_the_loop_is_spent_on_the_largest_program(rounds: Rounds) -> None:
    dearest = [longest for _, longest in rounds]
    assert dearest[0] < MOST_CPU_AT_FIRST, dearest
    assert statistics.median(dearest) < MOST_CPU, dearest


async def _plan(pool: PlanningPool, robot: str) -> PlanAnswer:
    answers: asyncio.Queue[PlanAnswer] = asyncio.Queue()
    start = (0.0, -1.0, 1.0, 0.1, 0.2, 0.3)
    job = JointPathJob(1, start, (tuple(value + 0.1 for value in start),), 0.5)
    pool.planner_of(robot).submit(job, answers.put_nowait)
    async with asyncio.timeout(60):
        return await answers.get()


async def _round(planner: CellPlanner) -> tuple[list[object], float]:
    answers: list[PlanAnswer] = []
    gc.freeze()  # a collection would count as a turn
    longest, before = 0.0, time.thread_time()
    for number, task in enumerate(TASKS):
        planner.submit(ProgramJob(number, task), answers.append)
    while len(answers) < len(TASKS):
        await asyncio.sleep(0.001)
        now = time.thread_time()
        longest, before = max(longest, now - before), now
    return [answer.result for answer in answers], longest
