"""Answers of tens of megabytes: their arrays come a piece at a time, and are not copied again."""

import asyncio
import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs.processes.planning_children import WARM, running_pool

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.ptp import plan_joint_move
from openpendant.server.journal.event_records import plan_to_json
from openpendant.server.planning.jobs import (
    LENGTH,
    JointPathJob,
    PlanAnswer,
    PlanTask,
    SplitAnswer,
    split_answer,
)
from openpendant.server.refusal import Refusal
from openpendant.simplemsg.verdicts import VerdictCode as V

NAMES = ("times", "position", "velocity", "acceleration", "waypoint_times")
LIMITS = JointLimits(("a", "b"), (-9.0, -9.0), (9.0, 9.0), (1.0, 1.0), (4.0, 4.0), (False, False))


def planned(speed: float = 0.01) -> PlanAnswer:
    """Return the answer to a move of some ten thousand samples."""
    trajectory = plan_joint_move((0.0, 0.0), (1.0, -2.0), LIMITS, speed=speed)
    return PlanAnswer(1, (trajectory, certify(trajectory, LIMITS)), 0.5)


def assert_same(found: Any, wanted: PlanAnswer) -> None:
    assert isinstance(found, PlanAnswer)
    assert isinstance(found.result, tuple)
    assert isinstance(wanted.result, tuple)
    for name in NAMES:
        array = getattr(found.result[0], name)
        np.testing.assert_array_equal(array, getattr(wanted.result[0], name))
        assert not array.flags.writeable
    assert found.result[1] == wanted.result[1]


def test_an_answer_is_split_from_its_arrays_and_joined_without_a_copy() -> None:
    wanted = planned()
    head, *arrays = split_answer(wanted)
    assert len(head) < 2_000
    assert sum(map(len, arrays)) > 1_000_000
    split = pickle.loads(head[LENGTH.size :])
    assert isinstance(split, SplitAnswer)
    assert split.sizes == tuple(map(len, arrays))
    came = [np.frombuffer(array, dtype=np.uint8).copy() for array in arrays]
    found = split.joined(came)
    assert_same(found, wanted)
    assert isinstance(found.result, tuple)
    assert any(np.shares_memory(found.result[0].position, array) for array in came)


@pytest.mark.parametrize("name", NAMES)
def test_a_journal_takes_the_samples_as_they_came_and_copies_none(name: str) -> None:
    head, *arrays = split_answer(planned(0.001))
    came = [np.frombuffer(array, dtype=np.uint8).copy() for array in arrays]
    noted = plan_to_json(pickle.loads(head[LENGTH.size :]).joined(came))["samples"][name]
    if name == "waypoint_times":
        assert isinstance(noted, str)  # it has two
    else:
        assert any(np.shares_memory(np.asarray(noted.content), array) for array in came)


@pytest.mark.parametrize("planned", [None, PlanAnswer(1, Refusal(V.NO_MOTION), 0.1)])
def test_an_answer_without_arrays_is_one_pickle(planned: PlanAnswer | None) -> None:
    (head,) = split_answer(planned)
    assert pickle.loads(head[LENGTH.size :]) == planned


async def _answer() -> Any:
    """Return what a pool makes of an answer of a shell command in place of its process."""
    answers: asyncio.Queue[Any] = asyncio.Queue()
    async with running_pool() as pool, asyncio.timeout(30):
        job = JointPathJob(1, (0.0, 0.0), ((1.0, -2.0),), 0.01)
        pool.submit(PlanTask("ur5", job, answers.put_nowait))
        return await answers.get()


def _in_place_of_a_process(command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    start = asyncio.create_subprocess_exec

    async def start_another(*_: str, **pipes: int) -> asyncio.subprocess.Process:
        return await start("sh", "-c", command, **pipes)  # type: ignore[arg-type]

    monkeypatch.setattr(asyncio, "create_subprocess_exec", start_another)


@pytest.mark.realtime
def test_its_arrays_are_read_behind_it_in_pieces(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "answer"
    _in_place_of_a_process(f"{WARM} head -c 50 >/dev/null; cat {file}; exec sleep 9", monkeypatch)
    sizes: list[int] = []
    read = asyncio.StreamReader.read

    async def counted(self: asyncio.StreamReader, n: int = -1) -> bytes:
        data = await read(self, n)
        sizes.append(len(data))
        return data

    monkeypatch.setattr(asyncio.StreamReader, "read", counted)
    wanted = planned()
    file.write_bytes(b"".join(split_answer(wanted)))
    assert_same(asyncio.run(_answer()), wanted)
    # The rest of the pipe is thrown away by reads, too, behind them.
    assert sum(sizes) == sum(map(len, split_answer(wanted)[1:]))
    assert max(sizes) <= 1 << 18


@pytest.mark.realtime
@pytest.mark.parametrize("missing", [1, 100_000])
def test_one_whose_arrays_are_cut_off_is_none(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, missing: int
) -> None:
    file = tmp_path / "answer"
    file.write_bytes(b"".join(split_answer(planned()))[:-missing])
    _in_place_of_a_process(f"{WARM} head -c 50 >/dev/null; cat {file}", monkeypatch)
    answer = asyncio.run(_answer())
    assert answer.result == Refusal(V.PLANNER_FAILED)
