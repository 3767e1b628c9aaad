"""Journals of imports that took many turns, and of the jobs that name what was imported."""

import json
import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from frozen import cell_to_record
from frozen.cell_to_record import Lines, RecordedCell, recorded_cell
from frozen.conversations import expected, in_control, moved_joint
from frozen.questions import JOBS
from rigs.cells.full_scenes import chain, full
from rigs.clock.virtual_clock import VirtualLoop

from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.scene.scene import Scene
from openpendant.server.journal.event_records import question_to_record
from openpendant.server.planning import jobs
from openpendant.server.planning.worker.job_planner import answer
from openpendant.simplemsg.journal import LateText, spelled
from openpendant.tools.packets.journals.reenactment import rerun
from openpendant.tools.pendants.client import Refused

SCHEMA = "openpendant-frames/1"
PLACED = {"xyz": [0.1, 0.2, 0.3], "quat": [0.0, 0.0, 0.0, 1.0]}


def frames(count: int, last: str = "base") -> dict[str, Any]:
    made = [{"name": f"f{n}", "parent": "base", **PLACED} for n in range(count)]
    return {"schema": SCHEMA, "frames": [*made, {"name": "last", "parent": last, **PLACED}]}


def tools(count: int) -> dict[str, Any]:
    made = [{"name": f"t{n}", **PLACED} for n in range(count)]
    return {"schema": SCHEMA, "tools": made, "selected_tool": "t3"}


def balls(count: int, height: float = 9.0) -> dict[str, Any]:
    shape = {"type": "sphere", "radius": 0.1}
    made = [{"name": f"b{n}", "shape": shape, "position": [9, 9, height]} for n in range(count)]
    return {"schema": "openpendant-scene/1", "objects": made}


async def imports(cell: RecordedCell) -> None:
    """Everything is imported at rest, and a scene while the robot moves, as it may be or not."""
    async with in_control(cell) as pendant:

        async def take(op: str, content: dict[str, Any], revision: int) -> None:
            request = {"op": op, "content": content, "expected_revision": revision}
            await pendant.manage(request)

        await take("frames.import", frames(300), 0)
        await take("tools.import", tools(300), 0)
        await take("scene.import", balls(190), 0)
        with expected(Refused):
            await take("frames.import", frames(300, "nowhere"), 1)
        motion = await moved_joint(pendant, 0, 0.3, 0.3)
        await take("scene.import", balls(200), 1)
        with expected(Refused):
            await take("scene.import", balls(200, 8.0), 2)
        await motion.done()


def behind_a_pipe(robot: str, job: jobs.Job) -> jobs.PlanAnswer:
    found: jobs.PlanAnswer = pickle.loads(pickle.dumps(answer(robot, job)))
    return found


@pytest.mark.virtual_clock
def test_a_run_with_the_largest_imports_runs_again_with_identical_bytes(
    tmp_path: Path, virtual_loop: VirtualLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    # It is run again in one process, where nothing is pickled.
    monkeypatch.setattr(cell_to_record, "answer", behind_a_pipe)
    kept = {"server": Lines(), "emulator": Lines()}

    async def live() -> None:
        async with recorded_cell(tmp_path, kept) as cell:
            await imports(cell)

    virtual_loop.run_until_complete(live())
    file = tmp_path / "server.journal"
    file.write_bytes(kept["server"].content)
    lines = [json.loads(line) for line in file.read_text("ascii").splitlines()]
    assert sum(line.get("kind") == "BodyRead" for line in lines) == 6
    outcome = rerun(file)
    assert (outcome.difference, outcome.is_cut) == (None, False)


LARGE: dict[str, tuple[Scene | None, FrameTree | None]] = {
    "the fullest scene": (full(), None),
    "one object": (Scene(full().objects[:1]), None),
    "the most frames": (None, chain()),
    "both": (full(), chain()),
    "neither": (None, None),
}


@pytest.mark.parametrize("scene_and_frames", LARGE.values(), ids=LARGE)
def test_a_journal_has_the_words_of_a_job_however_large(
    scene_and_frames: tuple[Scene | None, FrameTree | None],
) -> None:
    scene, tree = scene_and_frames
    for job in JOBS:
        large = {"scene": scene, "frames": tree}
        filled = replace(
            job, **{name: each for name, each in large.items() if each and hasattr(job, name)}
        )
        record = question_to_record(filled)
        assert bytes(record) == repr(filled).encode()
        if isinstance(record, LateText):
            assert spelled(record) == f'"{bytes(record).hex()}"'


@pytest.mark.parametrize("value", [full(), chain()], ids=["scene", "frames"])
def test_a_large_text_is_left_to_the_journals_writer_and_made_in_pieces(
    value: Scene | FrameTree,
) -> None:
    name = "scene" if isinstance(value, Scene) else "frames"
    (job, *_) = [each for each in JOBS if hasattr(each, name)]
    record = question_to_record(replace(job, **{name: value}))
    assert isinstance(record, LateText)
    text = bytes(record)
    assert 0.5 * len(text) < len(record) < 2 * len(text)
    pieces = list(record.make())
    assert max(map(len, pieces)) < len(text) / 40


def test_the_text_of_what_never_changes_is_made_once() -> None:
    for value in (full(), chain()):
        first = list(value.text_pieces())
        again = list(value.text_pieces())
        assert all(one is other for one, other in zip(first, again, strict=True))


def test_a_text_that_nobody_read_to_its_end_is_whole_the_next_time() -> None:
    scene = full()
    next(scene.text_pieces())
    assert repr(scene).endswith(f"revision={scene.revision})")
