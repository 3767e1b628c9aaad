import asyncio
import io
import pickle
from collections import Counter
from collections.abc import Callable
from typing import Any

import pytest
from rigs.processes.planning_children import WARM, running_pool

from openpendant.server.planning.jobs import (
    JointPathJob,
    PlanTask,
    RecordingJob,
    read_question,
    split_question,
)
from openpendant.server.refusal import Refusal
from openpendant.server.store.recording_format import Extract
from openpendant.simplemsg.verdicts import VerdictCode as V

MIB = 1 << 20


def _job(pieces: tuple[bytes, ...]) -> RecordingJob:
    return RecordingJob(1, (0.0,) * 7, "arc", pieces, Extract(8, (1, 2, 3, 4, 5, 6, 7)), 0.01)


class Pickles:
    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.sizes: list[int] = []
        self._dumps = pickle.dumps
        monkeypatch.setattr(pickle, "dumps", self._count)

    def _count(self, *given: Any, **how: Any) -> bytes:
        data = self._dumps(*given, **how)
        self.sizes.append(len(data))
        return data


@pytest.mark.parametrize("pieces", [(), (bytes(64),), (bytes(64), b"\1" * 128, b"\2" * 64)])
def test_the_samples_arrive_as_they_were_sent(pieces: tuple[bytes, ...]) -> None:
    head, behind = split_question("ur5", _job(pieces))
    asked = read_question(io.BytesIO(b"".join([head, *behind]) + head))
    assert asked == ("ur5", _job((b"".join(pieces),)))


def test_questions_follow_each_other() -> None:
    other = JointPathJob(2, (0.0,), ((1.0,),), 0.5)
    parts = [split_question("ur5", each) for each in (other, _job((bytes(64),)), other)]
    pipe = io.BytesIO(b"".join(part for head, behind in parts for part in (head, *behind)))
    asked = [read_question(pipe) for _ in range(4)]
    assert asked == [("ur5", other), ("ur5", _job((bytes(64),))), ("ur5", other), None]


@pytest.mark.parametrize("missing", [1, 64, 70, 10_000])
def test_a_question_that_is_cut_off_is_none(missing: int) -> None:
    head, behind = split_question("ur5", _job((bytes(64),)))
    whole = b"".join([head, *behind])
    assert read_question(io.BytesIO(whole[: max(0, len(whole) - missing)])) is None


async def _ask(command: str, monkeypatch: pytest.MonkeyPatch, use: Callable[[Any], None]) -> Any:
    """Give a job of 60 MiB to a shell command in place of a planning process; return the answer."""
    start = asyncio.create_subprocess_exec

    async def start_another(*_: str, **pipes: int) -> asyncio.subprocess.Process:
        child = await start("sh", "-c", command, **pipes)  # type: ignore[arg-type]
        use(child.stdin)
        return child

    monkeypatch.setattr(asyncio, "create_subprocess_exec", start_another)
    answers: asyncio.Queue[Any] = asyncio.Queue()
    async with running_pool() as pool, asyncio.timeout(30):
        job = _job(tuple(bytes([number]) * MIB for number in range(60)))
        pool.submit(PlanTask("ur5", job, answers.put_nowait))
        return await answers.get()


@pytest.mark.realtime
def test_no_turn_of_the_loop_handles_more_than_a_piece(monkeypatch: pytest.MonkeyPatch) -> None:
    pickles = Pickles(monkeypatch)
    in_turn: Counter[int] = Counter()
    turn = 0

    def watch(stdin: Any) -> None:
        write = stdin.write

        def counted(data: bytes) -> None:
            in_turn[turn] += len(data)
            write(data)

        stdin.write = counted

    def count_turn() -> None:
        nonlocal turn
        turn += 1
        asyncio.get_running_loop().call_soon(count_turn)

    async def test() -> None:
        asyncio.get_running_loop().call_soon(count_turn)
        # Answers None by ending once it has read all, as a process that dies does.
        command = f"{WARM} head -c {60 * MIB} >/dev/null"
        answer = await _ask(command, monkeypatch, watch)
        assert answer.result == Refusal(V.PLANNER_FAILED)

    asyncio.run(test())
    assert sum(in_turn.values()) > 60 * MIB
    assert max(in_turn.values()) <= MIB + 4_096
    assert max(pickles.sizes) <= 4_096


@pytest.mark.realtime
def test_a_process_that_dies_over_a_long_question_fails_it(monkeypatch: pytest.MonkeyPatch) -> None:
    command = f"{WARM} head -c {3 * MIB} >/dev/null"
    answer = asyncio.run(_ask(command, monkeypatch, lambda stdin: None))
    assert answer.result == Refusal(V.PLANNER_FAILED)
