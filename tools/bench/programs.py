"""Programs of the largest accepted size: calls on the event loop and tasks handed to planning.

CPU time of this process. The first rows are single calls on the event loop, the longest of each
kind, and have a bound; the others are done in the planning process.
"""

from __future__ import annotations

import pickle
import random
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, partial

from openpendant.server.planning.jobs import PlanAnswer, ProgramJob
from openpendant.server.programs.editing.program_tasks import (
    BodyEdited,
    BodyUnpacked,
    Done,
    EditBody,
    PrintBody,
    ReadSource,
    Task,
    UnpackBody,
    Unpacking,
    perform,
)
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program import MOST_POINTS
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.simplemsg.pendant.management.programs import MOST_STATEMENTS
from openpendant.simplemsg.pendant.management.statements import DeleteStatements

from .table import Benchmark, Bound, Judged, Sides

ON_THE_LOOP = Bound(2.0, aim=1.0, judged=Judged.VALUE)
REPETITIONS = 9


def benchmarks() -> list[Benchmark]:
    """Return the calls on the event loop, then the tasks of the planning process."""
    calls: dict[str, Callable[[], float]] = {
        "hand the text over": _hand_over,
        "take what was read": partial(_take, _read_task),
        "take what was unpacked": partial(_take, _unpack_task),
        "make an edit of the JSON": _splice,
        "longest step before a run": _longest_step,
    }
    tasks: dict[str, Callable[[], Task]] = {
        "parse": _read_task,
        "print": lambda: PrintBody(_body(), "main"),
        "edit": _edit_task,
        "unpack": _unpack_task,
    }
    return [
        *(_row(f"programs, loop: {name}", call, ON_THE_LOOP) for name, call in calls.items()),
        *(
            _row(f"programs, planning process: {name}", partial(_cost_of_task, task), None)
            for name, task in tasks.items()
        ),
    ]


def _row(name: str, sample: Callable[[], float], bound: Bound | None) -> Benchmark:
    @contextmanager
    def prepare() -> Iterator[Sides]:
        yield Sides(sample)

    return Benchmark(name, "ms CPU", prepare, bound, REPETITIONS)


@cache
def _text() -> str:
    """A program of as many points and statements as are accepted."""
    rng = random.Random(7)
    lines = ["openpendant-program/1", 'program "main" robot ur5']
    for number in range(MOST_POINTS):
        joints = " ".join(f"{rng.uniform(-180.0, 180.0):.4f}" for _ in range(6))
        place = " ".join(f"{rng.uniform(-800.0, 800.0):.3f}" for _ in range(3))
        lines += [f"point p{number}", f"  joints {joints} deg", f"  pose {place} mm quat 0 1 0 0"]
        lines += ["  config front up no-flip turns 0 0 0 0 0 0"]
    moves = (number % MOST_POINTS for number in range(MOST_STATEMENTS))
    lines += [f"move LIN p{number} speed 250 mm/s zone 10 mm" for number in moves]
    return "\n".join(lines) + "\n"


@cache
def _body() -> str:
    return program_to_json(parse(_text()))


def _read_task() -> Task:
    return ReadSource(_text(), "text", "main")


def _unpack_task() -> Task:
    return UnpackBody(_body(), "main")


def _edit_task() -> Task:
    return EditBody(_body(), "main", DeleteStatements(MOST_STATEMENTS // 2))


@cache
def _done(task: Task) -> Done:
    """Return what was done; a program that is not accepted is a fault of this benchmark."""
    done = perform(task)
    assert isinstance(done, Done)
    return done


def _cost(call: Callable[[], object]) -> float:
    """Return the CPU time of a call [ms]."""
    began = time.process_time()
    call()
    return (time.process_time() - began) * 1e3


def _cost_of_task(task: Callable[[], Task]) -> float:
    made = task()
    return _cost(lambda: perform(made))


def _hand_over() -> float:
    job = ProgramJob(1, _read_task())
    return _cost(lambda: pickle.dumps(("ur5", job)))


def _take(task: Callable[[], Task]) -> float:
    sent = pickle.dumps(PlanAnswer(1, _done(task()), 0.0), protocol=pickle.HIGHEST_PROTOCOL)
    return _cost(lambda: pickle.loads(sent))


def _splice() -> float:
    edited = _done(_edit_task())
    assert isinstance(edited, BodyEdited)
    return _cost(lambda: edited.splice.applied(_body()))


def _longest_step() -> float:
    unpacked = _done(_unpack_task())
    assert isinstance(unpacked, BodyUnpacked)
    unpacking = Unpacking(unpacked)
    longest, program = 0.0, None
    while program is None:
        began = time.process_time()
        program = unpacking.step()
        longest = max(longest, time.process_time() - began)
    return longest * 1e3
