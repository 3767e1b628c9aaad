"""Imports whose content a planning process has read act as those that are read on the loop."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import expect, known
from rigs.cells.full_scenes import box
from rigs.cells.surrounded_cell import SurroundedCell

from openpendant.motion.scene.scene import Scene, SceneObject, Sphere
from openpendant.motion.scene.scene_file import scene_to_data
from openpendant.motion.scene.scene_transfer import SceneInTransfer
from openpendant.server.events.effects import Effect
from openpendant.server.refusal import Refusal
from openpendant.server.scene.planning_scene import PlanningScene
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode as V

Content = dict[str, Any]
SCHEMA = "openpendant-frames/1"
SCENE = "openpendant-scene/1"
UNIT = [0.0, 0.0, 0.0, 1.0]


def frame(name: str, parent: str = "base", **more: Any) -> Content:
    return {"name": name, "parent": parent, "xyz": [0.1, 0.2, 0.3], "quat": UNIT, **more}


def tool(name: str, **more: Any) -> Content:
    return {"name": name, "xyz": [0.0, 0.0, 0.1], "quat": UNIT, **more}


def many(at: int = -1, size: int = 150, **other: Any) -> list[Content]:
    """Return frames of which each hangs from the one before, and one of which is another."""
    frames = [frame(f"f{n}", f"f{n - 1}" if n else "base") for n in range(size)]
    return [each | other if n == at else each for n, each in enumerate(frames)]


def frames(*entries: Content, **more: Any) -> Content:
    return {"schema": SCHEMA, "frames": list(entries), **more}


def tools(*entries: Content, **more: Any) -> Content:
    return {"schema": SCHEMA, "tools": list(entries), **more}


def ball(name: str, **more: Any) -> Content:
    return {"name": name, "shape": {"type": "sphere", "radius": 0.1}, "position": [9, 9, 9], **more}


def balls(*entries: Content, **more: Any) -> Content:
    return {"schema": SCENE, "objects": list(entries), **more}


CASES: dict[str, tuple[str, Content]] = {
    "frames": ("frames", frames(*many())),
    "the same frames": ("frames", frames(*many())),
    "none": ("frames", frames()),
    "frames from others that come later": ("frames", frames(frame("a", "b"), frame("b"))),
    "a quaternion that is none": ("frames", frames(*many(70, quat=[0, 0, 0, 2]))),
    "a parent that is none before a quaternion": (
        "frames",
        frames(*many(70, parent="x")[:100], frame("y", quat=[0, 0, 0, 2])),
    ),
    "a quaternion before a parent that is none": (
        "frames",
        frames(*many(70, quat=[0, 0, 0, 2])[:100], frame("y", "x")),
    ),
    "too far away": ("frames", frames(*many(70, xyz=[0, 0, 1e7]))),
    "a name twice": ("frames", frames(*many(70, name="f3"))),
    "a name of the robot's": ("frames", frames(frame("flange"))),
    "no name": ("frames", frames(frame(" a"))),
    "from the selected tool": ("frames", frames(frame("a", "tool"))),
    "too many": ("frames", frames(*(frame(f"a{n}") for n in range(1_000)))),
    "more than any file": ("frames", frames(*(frame(f"a{n}") for n in range(1_001)))),
    "frames with a tool": ("frames", frames(frame("a"), tools=[tool("b")])),
    "of no schema": ("frames", {"frames": []}),
    "with a key too many": ("frames", frames(frame("a"), colour="red")),
    "tools": ("tools", tools(*(tool(f"t{n}") for n in range(150)), selected_tool="t7")),
    "frames beside a selected tool": ("frames", frames(*many()[:9])),
    "frames from a tool": ("frames", frames(frame("a", "t7"))),
    "tools without one that frames hang from": ("tools", tools(tool("other"))),
    "tools without the selected one": ("tools", tools(*(tool(f"t{n}") for n in range(9)))),
    "a tool that is selected and not there": ("tools", tools(tool("t7"), selected_tool="x")),
    "tools with a frame": ("tools", tools(tool("t7"), frames=[frame("b")])),
    "a scene": ("scene", balls(*(ball(f"b{n}") for n in range(200)), allowed=[["b1", "b2"]])),
    "the same scene": ("scene", balls(*(ball(f"b{n}") for n in range(200)), revision=9)),
    "an object twice": ("scene", balls(*(ball(f"b{n % 99}") for n in range(100)))),
    "an object of a link's name": ("scene", balls(ball("forearm_link"))),
    "more objects than are checked": ("scene", balls(*(ball(f"b{n}") for n in range(900)))),
    "held by no link": ("scene", balls(ball("b", link="x"))),
    "a mesh": ("scene", balls(ball("b", shape={"type": "mesh", "file": "/etc/passwd"}))),
    "a size that is none": ("scene", balls(ball("b", shape={"type": "sphere", "radius": -1}))),
    "allowed for nobody": ("scene", balls(ball("b"), allowed=[["x", "y"]])),
    "of no scene's schema": ("scene", frames()),
}


class Both:
    """One cell that reads on its loop, and one whose bodies are read elsewhere."""

    def __init__(self, folder: Path) -> None:
        self.cells: list[SurroundedCell] = []
        for apart in (False, True):
            (folder / str(apart)).mkdir()
            cell = SurroundedCell(folder / str(apart), reads_apart=apart)
            cell.report()
            self.cells.append(cell)

    def ask(self, op: str, **fields: Any) -> list[tuple[bool, Content]]:
        return [cell._answer(op, fields) for cell in self.cells]

    def revision(self, topic: str) -> int:
        return self.cells[0].around.world.revisions[DocumentKind(topic)]

    def kept(self) -> list[list[Any]]:
        return [[cell.ask("frames.show"), cell.ask("scene.show")] for cell in self.cells]


@pytest.fixture(scope="module")
def both(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Both]:
    made = Both(tmp_path_factory.mktemp("both"))
    yield made
    for cell in made.cells:
        cell.store.close()


def test_what_was_read_elsewhere_is_answered_and_kept_as_what_is_read_on_the_loop(
    both: Both,
) -> None:
    done = {}
    for name, (topic, content) in CASES.items():
        fields = {"content": content, "expected_revision": both.revision(topic)}
        on_loop, apart = both.ask(f"{topic}.import", **fields)
        assert apart == on_loop, name
        done[name] = on_loop[0]
        kept = both.kept()
        assert kept[0] == kept[1], name
    assert 8 <= sum(done.values()) <= len(CASES) - 20, done


@pytest.mark.parametrize("topic", ["frames", "tools", "scene"])
def test_a_revision_that_is_none_is_told_as_on_the_loop(both: Both, topic: str) -> None:
    for content in ({"schema": SCENE if topic == "scene" else SCHEMA}, {"schema": "none"}):
        on_loop, apart = both.ask(f"{topic}.import", content=content, expected_revision=99)
        assert apart == on_loop
        assert not apart[0]


def test_nothing_of_an_import_that_is_refused_half_way_is_in_force(tmp_path: Path) -> None:
    cell = SurroundedCell(tmp_path, reads_apart=True)
    cell.report()
    before = cell.mathematics.frames
    wrong = frames(*many(399, size=400, parent="x"))
    code, text = cell.refused("frames.import", content=wrong, expected_revision=0)
    assert code is V.BAD_FILE
    assert "frames[399]" in text
    assert len(cell.turns) > 1
    assert cell.mathematics.frames is before
    assert not cell.around.world.is_busy
    assert (cell.cell.awaited, cell.cell.unbuilt) == ("", "")
    cell.ask("frames.import", content=frames(*many()), expected_revision=0)
    cell.store.close()


ARRIVING: dict[str, Content] = {
    "frames": frames(*many()),
    "tools": tools(*(tool(f"t{n}") for n in range(150))),
    "scene": balls(*(ball(f"b{n}") for n in range(240))),
}
BEFORE: dict[str, Content] = {
    "frames": frames(frame("old")),
    "tools": tools(tool("old")),
    "scene": balls(ball("old")),
}
PLACED = {"position": [1.0, 1.0, 1.0]}
OTHER: dict[str, Content] = {
    "frames": {"pose": PLACED, "name": "new"},
    "tools": {"tcp": PLACED, "name": "new"},
    "scene": {"object": ball("new")},
}


@pytest.mark.parametrize("topic", ARRIVING)
def test_no_motion_and_no_other_change_begins_until_an_import_is_in_force(
    topic: str, tmp_path: Path
) -> None:
    cell = SurroundedCell(tmp_path, reads_apart=True)
    cell.report()
    cell.ask(f"{topic}.import", content=BEFORE[topic], expected_revision=0)
    cell.answers.clear()
    cell.send(f"{topic}.import", content=ARRIVING[topic], expected_revision=1)
    ticks = 0
    while not cell.answers:
        assert f"a change of the {topic} is being" in cell.cell.awaited
        assert cell.around.world.revisions[DocumentKind(topic)] == 1
        cell.send(f"{topic}.add", expected_revision=1, **OTHER[topic])
        assert cell.answers.pop()[1]["code"] == V.STORE_BUSY
        cell.tick()
        ticks += 1
    assert ticks > 1
    assert cell.answers == [(True, {"revision": 2})]
    assert cell.cell.awaited == ""
    cell.store.close()


# While a robot moves.

AROUND = Scene(tuple(box(number, z=2.5) for number in range(235)))
NEW = SceneObject("new", Sphere(0.01), (2.0, 2.0, 0.0))


class Importing:
    """A robot on its way among objects, to which a scene is imported."""

    def __init__(self) -> None:
        self.cell = EmulatedCell("ur5", has_surroundings=True)
        self.told: list[int | Refusal] = []
        self.put(AROUND, 0)
        while not self.told:
            self.cell.wait(10)
        assert self.told.pop() == 1
        self.cell.wait(500)
        self.pendant = self.cell.holder()
        start = self.cell.position
        assert self.pendant.move(start[0] + 1.5, *start[1:], speed=0.3) is V.ACCEPTED
        self.cell.wait(200)
        assert self.activity is Activity.MOVING

    @property
    def world(self) -> PlanningScene:
        return known(self.cell.core.environment).world

    @property
    def activity(self) -> Activity:
        return self.cell.core.cell.activity

    @property
    def is_held(self) -> bool:
        return known(self.cell.core.cell.motions.playing).is_held

    def put(self, scene: Scene, revision: int) -> None:
        def told(found: int | Refusal, now: int) -> list[Any]:
            self.told.append(found)
            return []

        # As it comes from another process: none of its objects are those of before.
        again = Scene(tuple(SceneObject(**_fields(each)) for each in scene.objects), scene.allowed)
        arriving, world = SceneInTransfer.of(again), self.world
        change = world.import_scene(arriving, revision, "ann", self.cell.now, told)
        self.cell.perform(expect(list, change))

    def until_told(self) -> int | Refusal:
        while not self.told:
            self.cell.wait(10)
        return self.told.pop()


def _fields(each: SceneObject) -> dict[str, Any]:
    return {name: getattr(each, name) for name in SceneObject.__dataclass_fields__}


def test_an_import_that_only_adds_is_in_force_while_the_robot_moves() -> None:
    moving = Importing()
    moving.put(AROUND.add(NEW), 1)
    assert moving.until_told() == 2
    assert moving.world.scene.names[-1] == "new"
    assert moving.activity is Activity.MOVING
    assert not moving.is_held


def test_promise_17_a_motion_is_unchecked_from_when_an_import_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    moving = Importing()
    monitor = known(moving.cell.core.environment).monitor
    asked, look, looked = moving.cell.now, monitor.changed, list[int | None]()

    def changed(scene: Scene, now: int, asked: int | None = None) -> list[Effect]:
        looked.append(asked)
        return look(scene, now, asked)

    monkeypatch.setattr(monitor, "changed", changed)
    moving.put(AROUND.add(NEW), 1)
    assert known(monitor._look).asked == asked
    while "new" not in known(moving.cell.core.cell.motions.scene).names:
        assert known(monitor._look).free_until <= known(monitor._look).rows.path_time
        moving.cell.wait(10)
    assert moving.cell.now > asked
    assert looked == [asked]


@pytest.mark.parametrize(
    "change",
    [
        lambda: AROUND.remove("box 3"),
        lambda: AROUND.allow("box 3", "box 4"),
        lambda: Scene(),
    ],
    ids=["one less", "a contact allowed", "none"],
)
def test_an_import_that_does_more_is_refused_while_the_robot_moves_which_goes_on(
    change: Callable[[], Scene],
) -> None:
    moving = Importing()
    moving.put(change(), 1)
    refused = expect(Refusal, moving.until_told())
    assert refused.code is V.CHANGE_WHILE_MOVING
    moving.cell.wait(200)
    assert moving.world.scene == AROUND
    assert moving.activity is Activity.MOVING
    assert not moving.is_held
    assert moving.cell.core.cell.motions.scene is moving.world.scene


def test_the_same_scene_again_leaves_a_motion_checked() -> None:
    moving = Importing()
    moving.put(AROUND, 1)
    assert moving.until_told() == 2
    moving.cell.wait(200)
    assert moving.activity is Activity.MOVING
    assert not moving.is_held
    assert known(moving.cell.core.environment).monitor._look is None


# What is loaded at the start.


def test_stored_frames_tools_and_scene_are_in_force_after_some_turns(tmp_path: Path) -> None:
    first = SurroundedCell(tmp_path)
    first.report()
    for topic, content in ARRIVING.items():
        first.ask(f"{topic}.import", content=content, expected_revision=0)
    first.store.close()
    again = SurroundedCell(tmp_path)
    assert len(again.turns) > 12
    assert again.mathematics.frames.frames.keys() == first.mathematics.frames.frames.keys()
    assert scene_to_data(again.mathematics.scene) == scene_to_data(first.mathematics.scene)
    assert again.around.world.problems == {}
    again.store.close()


@pytest.mark.parametrize("topic", ["frames", "tools", "scene"])
def test_a_stored_document_that_is_none_is_told_and_the_others_are_read(
    topic: str, tmp_path: Path
) -> None:
    first = SurroundedCell(tmp_path)
    first.report()
    first.ask("frames.import", content=frames(frame("a")), expected_revision=0)
    kind = DocumentKind(topic)
    revision = first.around.world.revisions[kind]
    first.store.save(kind, "cell", '{"schema": "none"}', expected_revision=revision, author="ann")
    first.store.close()
    again = SurroundedCell(tmp_path)
    assert list(again.around.world.problems) == [kind]
    assert again.around.world.problems[kind].code is V.BAD_FILE
    assert ("a" in again.mathematics.frames.frames) == (topic != "frames")
    again.store.close()
