"""A scene that takes several turns to build: what rules meanwhile, and who waits for it."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import expect, known, only
from rigs.cells.full_scenes import box, chain
from rigs.cells.scene_monitor_rig import BOX, EMPTY, MonitoredRig
from rigs.cells.server_rig import MS
from rigs.cells.surrounded_cell import SurroundedCell, robot
from rigs.motion.jog_pad import EmulatedPad
from rigs.peers.server_clients import Pendant

from openpendant.motion.errors import MeshFileError
from openpendant.motion.frames.frame_file import frames_to_json
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Scene, SceneObject, Sphere
from openpendant.motion.scene.scene_file import object_to_data, scene_to_data
from openpendant.server.events.effects import Effect
from openpendant.server.planning.jobs import PathFree
from openpendant.server.refusal import Refusal
from openpendant.server.scene.document_texts import document_of
from openpendant.server.scene.scene_monitor import DEADLINE_NS
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant import Activity, JogEnded, Management, OperatingMode, Verdict
from openpendant.simplemsg.verdicts import VerdictCode as V

HOME = robot().home_position
MANY = Scene(tuple(box(number) for number in range(200)))
NEW = SceneObject("new", Sphere(0.01), (2.0, 2.0, 0.0))
ADDED = object_to_data(NEW)
THERE = {"position": [1, 1, 1]}


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[SurroundedCell]:
    made = SurroundedCell(tmp_path)
    made.report()
    made.ask("scene.import", content=scene_to_data(MANY), expected_revision=0)
    yield made
    made.store.close()


def proves_ways(cell: SurroundedCell) -> bool:
    return cell.cell.motions.is_surely_free is not None


def reasons(cell: SurroundedCell) -> tuple[str, str]:
    """Return why no motion, and why no jog begins."""
    return cell.cell.awaited, cell.cell.unbuilt


def test_a_change_rules_and_is_answered_once_all_of_it_is_built(cell: SurroundedCell) -> None:
    before, told = cell.mathematics.built, len(cell.answers)
    cell.send("scene.move", name="box 5", pose=THERE, expected_revision=1)
    ticks = 0
    while len(cell.answers) == told:
        assert cell.mathematics.built is before
        assert cell.cell.motions.scene is before.scene
        cell.tick()
        ticks += 1
    assert ticks > 3
    assert cell.mathematics.scene.get("box 5").position == (1.0, 1.0, 1.0)
    assert cell.cell.motions.scene is cell.mathematics.scene
    cell.ask("scene.remove", name="box 3", expected_revision=2)
    assert len(cell.mathematics.built.collision.pairs) == len(before.collision.pairs) - 8


def test_the_same_changes_take_the_same_turns_each_time(tmp_path: Path) -> None:
    taken = []
    for number in range(2):
        folder = tmp_path / str(number)
        folder.mkdir()
        cell = SurroundedCell(folder)
        cell.report()
        changes: list[tuple[str, dict[str, Any]]] = [
            ("scene.import", {"content": scene_to_data(MANY)}),
            ("scene.add", {"object": ADDED}),
            ("scene.remove", {"name": "box 7"}),
        ]
        for revision, (op, fields) in enumerate(changes):
            cell.ask(op, expected_revision=revision, **fields)
            taken.append(len(cell.turns))
        cell.store.close()
    assert taken[:3] == taken[3:]
    assert min(taken) > 3


def test_a_small_change_is_in_force_and_answered_before_the_request_returns(
    tmp_path: Path,
) -> None:
    cell = SurroundedCell(tmp_path)
    cell.report()
    cell.send("scene.add", object=ADDED, expected_revision=0)
    assert cell.answers == [(True, {"revision": 1})]
    assert cell.mathematics.scene.names == ("new",)
    cell.store.close()


def test_another_change_is_refused_until_the_first_is_in_force_and_kept(
    cell: SurroundedCell,
) -> None:
    cell.send("scene.remove", name="box 3", expected_revision=1)
    code, text = cell.refused("scene.remove", name="box 4", expected_revision=1)
    assert code is V.STORE_BUSY
    assert "being put in force" in text
    cell.until(lambda: not cell.around.world.is_busy)
    cell.ask("scene.remove", name="box 4", expected_revision=2)


def test_no_motion_begins_until_what_was_moved_is_in_force(cell: SurroundedCell) -> None:
    cell.send("scene.move", name="box 3", pose=THERE, expected_revision=1)
    assert reasons(cell) == ("a change of the scene is being put in force", "")
    cell.until(lambda: not cell.around.world.is_busy)
    assert reasons(cell) == ("", "")


def test_what_is_added_counts_at_once_for_what_is_planned_and_no_way_is_proved_without_it(
    cell: SurroundedCell,
) -> None:
    cell.send("scene.add", object=ADDED, expected_revision=1)
    assert reasons(cell) == ("", "a change of the scene is being put in force")
    cell.until(lambda: known(cell.cell.motions.scene).names[-1] == "new")
    assert cell.mathematics.scene.names == MANY.names
    assert not proves_ways(cell)
    assert reasons(cell) == ("", "a change of the scene is being put in force")
    cell.until(lambda: not cell.around.world.is_busy)
    assert cell.mathematics.scene.names == (*MANY.names, "new")
    assert proves_ways(cell)
    assert reasons(cell) == ("", "")


def test_a_change_that_fails_half_way_leaves_everything_as_it_was(
    cell: SurroundedCell, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = cell.mathematics.built

    def fail(model: CollisionModel, body: object) -> None:
        raise MeshFileError("part.stl", "", "cannot be read")

    monkeypatch.setattr(CollisionModel, "_place", fail)
    cell.refused("scene.add", object=ADDED, expected_revision=1)
    assert len(cell.turns) > 1
    assert cell.mathematics.built is before
    assert cell.cell.motions.scene is before.scene
    assert proves_ways(cell)
    assert (cell.cell.awaited, cell.cell.unbuilt) == ("", "")
    monkeypatch.undo()
    cell.ask("scene.add", object=ADDED, expected_revision=1)


def test_what_a_program_takes_and_puts_down_waits_its_turn(cell: SurroundedCell) -> None:
    told: dict[str, Refusal | None] = {}
    world = cell.around.world
    here = {"position": cell.mathematics.flange(HOME).position.tolist()}
    cell.ask("scene.move", name="box 3", pose=here, expected_revision=1)
    cell.send("scene.add", object=ADDED, expected_revision=2)
    for name, change, taken in (
        ("carried", world.carry, "box 3"),
        ("put down", world.put_down, "box 3"),
        ("not held", world.put_down, "box 4"),
    ):

        def then(refusal: Refusal | None, now: int, name: str = name) -> list[Effect]:
            told[name] = refusal
            return []

        cell.perform(change(taken, HOME, cell.now, then))
    cell.until(lambda: "new" in cell.mathematics.scene.names)
    assert told == {}
    cell.until(lambda: bool(told))
    assert told == {"carried": None}
    assert cell.mathematics.scene.get("box 3").link == robot().tool_link
    cell.until(lambda: len(told) == 3)
    assert list(told) == ["carried", "put down", "not held"]
    assert told["put down"] is None
    assert known(told["not held"]).code is V.NOT_HELD
    assert cell.mathematics.scene.get("box 3").link is None


def test_a_stored_scene_is_in_force_before_anything_may_move(tmp_path: Path) -> None:
    first = SurroundedCell(tmp_path)
    first.report()
    first.ask("scene.import", content=scene_to_data(MANY), expected_revision=0)
    first.store.close()
    again = SurroundedCell(tmp_path)
    assert len(again.turns) > 3
    assert again.mathematics.scene == MANY
    assert again.cell.motions.scene == MANY
    assert again.cell.awaited == ""
    again.store.close()


def test_what_is_kept_and_told_is_what_json_makes_of_its_data(cell: SurroundedCell) -> None:
    cell.ask("scene.allow", first="box 1", second="box 2", expected_revision=1)
    cell.ask("scene.remove", name="box 7", expected_revision=2)
    scene = cell.mathematics.scene
    kept = document_of(DocumentKind.SCENE, cell.mathematics.frames, scene)
    assert kept == json.dumps(scene_to_data(scene), ensure_ascii=False)
    assert cell.ask("scene.show") == {"content": scene_to_data(scene), "revision": 3}
    tree = chain().add_tool("händ", Pose.from_values((0, 0, 0.1), (0, 0, 0, 1)))
    tree = tree.select_tool("händ")
    whole = json.loads(frames_to_json(tree))
    frames, tools = (
        document_of(kind, tree, scene) for kind in (DocumentKind.FRAMES, DocumentKind.TOOLS)
    )
    without_tools = whole | {"tools": [], "selected_tool": None}
    assert frames == json.dumps(without_tools, ensure_ascii=False)
    assert tools == json.dumps(whole | {"frames": []}, ensure_ascii=False)


def test_many_frames_are_told_as_few_are(cell: SurroundedCell) -> None:
    revision = 0
    for revision in range(70):
        fields = {"name": f"frame {revision}", "pose": THERE, "expected_revision": revision}
        cell.ask("frames.add", **fields)
    shown = cell.ask("frames.show")
    assert shown["content"] == json.loads(frames_to_json(cell.mathematics.frames))
    assert shown["names"] == list(cell.mathematics.frames.frames)
    assert (shown["frames_revision"], shown["tools_revision"]) == (revision + 1, 0)
    assert shown["problems"] == {}


# A robot that moves.


def surrounded(scene: Scene = MANY) -> EmulatedCell:
    """Return an emulated robot in a scene that takes several turns to build."""
    cell = EmulatedCell("ur5", has_surroundings=True)
    world = known(cell.core.environment).world
    done: list[object] = []

    def told(revision: object, now: int) -> list[Any]:
        done.append(revision)
        return []

    cell.perform(expect(list, world.change_scene(lambda _: scene, 0, "ann", cell.now, told)))
    while not done:
        cell.wait(10)
    assert done == [1]
    cell.wait(500)
    return cell


def add(pendant: Pendant, added: SceneObject = NEW) -> None:
    body = {"op": "scene.add", "object": object_to_data(added), "expected_revision": 1}
    pendant.send(Management(99, json.dumps(body).encode()))


def test_a_jog_ends_and_none_begins_until_what_was_added_is_in_force() -> None:
    cell = surrounded()
    world = known(cell.core.environment).world
    pad = EmulatedPad(cell, OperatingMode.MANUAL_HIGH)
    assert pad.press(0.3, 0.0, 0.0, 0.0, 0.0, 0.0) is V.ACCEPTED
    pad.hold(300)
    add(pad.pendant)
    assert "new" not in world.scene.names
    assert pad.press(0.3, 0.0, 0.0, 0.0, 0.0, 0.0) is V.CHANGE_WHILE_MOVING
    assert "no jog begins while" in pad.pendant.all(Verdict)[-1].text
    while "new" not in world.scene.names:
        assert pad.press(0.3, 0.0, 0.0, 0.0, 0.0, 0.0) is not V.ACCEPTED
        pad.hold(10)
    pad.hold(1_000)
    only(JogEnded, pad.pendant.all(JogEnded))
    assert pad.press(0.3, 0.0, 0.0, 0.0, 0.0, 0.0) is V.ACCEPTED


@pytest.mark.parametrize("seed", range(4))
def test_promise_17_a_ball_put_ahead_of_the_arm_is_never_touched_in_a_full_scene(
    seed: int,
) -> None:
    random = np.random.default_rng([17, seed])
    kinematics = Kinematics(robot())
    cell = surrounded(Scene(tuple(box(number, z=2.5) for number in range(240))))
    pendant = cell.holder()
    start = cell.position
    ahead = random.uniform(0.7, 1.2)
    place = kinematics.forward([start[0] + ahead, *start[1:]]).position
    ball = SceneObject("ball", Sphere(0.05), tuple(place.tolist()))
    alone = CollisionModel(kinematics, Scene((ball,)))
    pairs = [index for index, pair in enumerate(alone.pairs) if "ball" in pair]
    assert pendant.move(start[0] + 1.5, *start[1:], speed=0.3) is V.ACCEPTED
    cell.wait(int(random.integers(5, 40)) * 10)
    add(pendant, ball)
    for _ in range(1_000):
        cell.wait(10)
        assert float(alone.clearances(np.array(cell.position))[pairs].min()) > 0.0
        if cell.core.cell.activity is Activity.IDLE:
            break
    assert pendant.outcomes()[-1][1] is V.PATH_IN_COLLISION
    assert cell.controller.referee.total == 0


def test_promise_17_the_way_is_looked_at_before_the_model_is_built() -> None:
    cell = surrounded()
    pendant = cell.holder()
    assert pendant.move(cell.position[0] + 1.5, *cell.position[1:], speed=0.3) is V.ACCEPTED
    cell.wait(200)
    asked = cell.now
    add(pendant)
    world = known(cell.core.environment).world
    while known(cell.core.cell.motions.scene).names[-1] != "new":
        cell.wait(10)
    assert "new" not in world.scene.names
    assert cell.now - asked < DEADLINE_NS


def test_a_connection_that_ends_meanwhile_changes_nothing() -> None:
    cell = surrounded()
    pendant = cell.holder()
    add(pendant)
    world = known(cell.core.environment).world
    assert "new" not in world.scene.names
    pendant.close()
    while world.is_busy:
        cell.wait(10)
    assert world.scene.names[-1] == "new"
    assert world.revisions[DocumentKind.SCENE] == 2


# What is being added while it is not known yet whether that fits.


def is_held(moving: MonitoredRig) -> bool:
    return moving.is_held


def test_a_motion_whose_check_is_only_announced_is_held_at_the_deadline() -> None:
    moving = MonitoredRig()
    asked = moving.rig.now
    moving.rig.perform(moving.guard.announced(asked))
    moving.wait(40)
    assert not is_held(moving)
    moving.wait(20)
    assert is_held(moving)
    moving.rig.core.cell.motions.scene = BOX
    job = moving.job(moving.guard.changed(BOX, moving.rig.now, asked))
    assert job.scene is BOX
    moving.answer(job, PathFree())
    assert not is_held(moving)


def test_the_answer_to_the_check_of_before_does_not_free_what_is_announced() -> None:
    moving = MonitoredRig()
    first = moving.change()
    moving.rig.perform(moving.guard.announced(moving.rig.now))
    moving.answer(first, PathFree())
    moving.wait(100)
    assert is_held(moving)
    moving.answer(moving.job(moving.change_scene(EMPTY)), PathFree())
    assert not is_held(moving)


def test_the_time_for_the_check_runs_from_when_the_change_was_asked_for() -> None:
    moving = MonitoredRig()
    asked = moving.rig.now
    moving.wait(40)
    moving.rig.core.cell.motions.scene = BOX
    moving.job(moving.guard.changed(BOX, moving.rig.now, asked))
    moving.wait(20)
    assert is_held(moving)
    assert moving.rig.now - asked <= DEADLINE_NS + 10 * MS


def test_a_jog_ends_when_something_is_being_added() -> None:
    cell = surrounded()
    pad = EmulatedPad(cell, OperatingMode.MANUAL_HIGH)
    assert pad.press(0.3, 0.0, 0.0, 0.0, 0.0, 0.0) is V.ACCEPTED
    pad.hold(200)
    cell.perform(known(cell.core.environment).announced(cell.now))
    pad.hold(1_000)
    only(JogEnded, pad.pendant.all(JogEnded))
