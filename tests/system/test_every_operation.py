import asyncio
import json
from collections.abc import AsyncIterator, Awaitable, Callable
from itertools import count
from typing import Any

import pytest
import pytest_asyncio
from pydantic import TypeAdapter
from rigs.clock.busy_machine import PATIENCE

from openpendant.simplemsg.pendant import AccountRole, Activity, OperatingMode
from openpendant.simplemsg.pendant.management.declaration import PlacedPose
from openpendant.simplemsg.pendant.management.edits import Move
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import MotionHandle, PendantClient, Pose, Refused
from openpendant.tools.pendants.motions import quaternion_of, roll_pitch_yaw
from openpendant.tools.pendants.sync_client import SyncPendantClient
from openpendant.tools.reference.operations import published_operations

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio(loop_scope="module")]

CELL = {"has_store": True, "server": ("--signals", "openpendant")}
NUMBERS = count(1)
"""For what is kept under a name, so that a test can begin anew."""
BOX = {"shape": {"type": "box", "size": [0.1, 0.1, 0.1]}, "position": [0, 2, 0]}
AHEAD: PlacedPose = {"position": (0.5, 0.0, 0.25)}
SECRET = "a long enough password"
TURNS = ((0.0, 0.1, 0.0), (0.2, 0.0, 0.0), (0.0, 0.2, 0.0), (-0.2, 0.0, 0.2))
ABOVE: PlacedPose = {"position": (0.0, 0.0, 0.125), "orientation": (0.0, 0.0, 0.0, 1.0)}


class Pendant(PendantClient):
    """A client that holds every reply against what is published of it.

    Attributes:
        asked: the operations that were answered.
    """

    def __init__(self) -> None:
        super().__init__()
        self.asked: set[str] = set()

    async def manage(self, request: dict[str, Any]) -> dict[str, Any]:
        return self._as_published(request, await super().manage(request))

    async def _manage_motion(self, request: dict[str, Any]) -> tuple[dict[str, Any], MotionHandle]:
        reply, motion = await super()._manage_motion(request)
        return self._as_published(request, reply), motion

    def _as_published(self, request: dict[str, Any], reply: dict[str, Any]) -> dict[str, Any]:
        operation = published_operations()[request["op"]]
        body = json.dumps(reply)
        for kind in (operation.reply, operation.returned):
            TypeAdapter(kind).validate_json(body, strict=True)
        self.asked.add(operation.name)
        return reply


async def refused(asked: Any) -> V | int:
    with pytest.raises(Refused) as told:
        await asked
    return told.value.code


async def go_aside(pendant: Pendant, by: float) -> None:
    await pendant.next_state()
    first, *rest = pendant.joints()
    await (await pendant.move_joints([first + by, *rest], speed=1.0)).done()
    await pendant.next_state()


def move(point: str) -> Move:
    return {"statement": "move", "way": "PTP", "point": point, "zone": 0.0}


async def the_cell(pendant: Pendant) -> None:
    assert (await pendant.snapshot())["robot"] == "ur5"
    assert (await pendant.cells())["cells"][0]["robot"] == "ur5"
    assert (await pendant.why(whose="mine"))["ready"]
    assert (await pendant.why(kind="jog"))["conditions"]
    codes = await pendant.catalogue("codes")
    assert (codes["version"], codes["offset"], codes["entries"][0]["name"]) == (3, 0, "ACCEPTED")
    told = await pendant.controller.describe()
    assert (told["dialect"], told["says_emulated"], told["emulated"]) == ("generic", True, False)
    for hold in await pendant.retreat():
        assert hold["ways"]


async def programs(pendant: Pendant) -> None:
    calls, name, renamed = pendant.programs, f"taught {next(NUMBERS)}", f"new {next(NUMBERS)}"
    at = (await calls.create(name))["revision"]
    at = (await calls.record(name, at, "p1", move=move("p1")))["revision"]
    await go_aside(pendant, 0.1)
    at = (await calls.record(name, at, "p2", move=move("p2"), comment="aside"))["revision"]
    at = (await calls.touch_up(name, at, "p2"))["revision"]
    pause: Any = {"statement": "wait", "duration": 0.0}
    at = (await calls.edit(name, at, {"edit": "insert", "statements": [pause]}))["revision"]
    at = (await calls.undo(name, at))["revision"]
    at = (await calls.redo(name, at))["revision"]
    assert await refused(calls.undo(name, at - 1)) is V.REVISION_CONFLICT
    assert (await calls.breakpoints(name, [1]))["statements"] == [1]
    assert (await calls.breakpoints(name, []))["statements"] == []
    trial = await calls.dry_run(name)
    assert (trial["revision"], trial["refused"], trial["complete"]) == (at, 0, True)
    assert not (await calls.dry_run_progress())["running"]
    assert await refused(calls.run(name, revision=at - 1)) is V.REVISION_CONFLICT
    await (await calls.run(name, speed=1.0, revision=at)).done()
    text = (await calls.load(name))["body"]
    assert (await calls.check(text))["statements"] == 3
    assert await refused(calls.check("no program")) is V.PROGRAM_SYNTAX
    half = len(text) // 2
    first = await calls.save(name, text[:half], at, part=1, parts=2)
    assert first == {"part": 1, "parts": 2}
    at = (await calls.save(name, text[half:], at, part=2, parts=2))["revision"]
    before = [each["name"] for each in (await calls.list())["programs"]]
    at = (await calls.rename(name, renamed, at))["revision"]
    after = [each["name"] for each in (await calls.list())["programs"]]
    assert set(after) == {*before, renamed} - {name}
    assert (await calls.history(renamed))["programs"][0]["revision"] == at
    await calls.delete(renamed, at)


async def recordings(pendant: Pendant) -> None:
    calls, swing = pendant.recordings, f"swing {next(NUMBERS)}"
    before = await calls.list()
    if before["recording"] is not None:  # of an attempt before
        await calls.stop()
    await calls.start(swing)
    assert (await calls.list())["recording"] is not None
    await go_aside(pendant, 0.1)
    assert (await calls.stop())["finished"]
    playback = await calls.play(swing, factor=2, tolerance=0.05)
    assert playback.account["approach"] > 0
    await playback.done()
    await calls.trim(swing, "part", ends=0.2)
    assert (await calls.describe("part"))["robot"] == "ur5"
    renamed = await calls.rename("part", "piece", (await calls.describe("part"))["revision"])
    await calls.delete("piece", renamed["revision"])
    assert await refused(calls.play("piece")) is V.NOT_FOUND
    assert (await calls.list())["total"] == before["total"] + 1


async def frames(pendant: Pendant) -> None:
    calls, number = pendant.frames, next(NUMBERS)
    table, bench, taught_frame = f"table {number}", f"bench {number}", f"taught {number}"
    shown = await calls.show()
    at = (await calls.add(table, AHEAD, shown["frames_revision"]))["revision"]
    at = (await calls.move(table, ABOVE, at))["revision"]
    at = (await calls.rename(table, bench, at))["revision"]
    found = await calls.transform(bench, "base", pose=AHEAD)
    assert found["pose"]["position"] == pytest.approx([0.5, 0.0, 0.375])
    taught = await calls.teach([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    at = (await calls.add(taught_frame, taught["pose"], at, parent=bench))["revision"]
    content = (await calls.show())["content"]
    at = (await calls.remove(taught_frame, at))["revision"]
    await calls.import_({**content, "tools": [], "selected_tool": None}, at)


async def positions(pendant: Pendant) -> None:
    calls, number = pendant.positions, next(NUMBERS)
    park, rest = f"park {number}", f"rest {number}"
    listed = await calls.list()
    home = next(each for each in listed["positions"] if each["name"] == "home")
    saved = await calls.save(park, listed["revision"], joints=home["joints"])
    assert saved["warning"] is None
    at = (await calls.rename(park, rest, saved["revision"]))["revision"]
    assert rest in [each["name"] for each in (await calls.list())["positions"]]
    await (await pendant.home(rest, speed=0.5)).done()
    await calls.delete(rest, at)
    assert await refused(pendant.home(rest)) is V.UNKNOWN_POSITION


async def tools(pendant: Pendant) -> None:
    calls, torch = pendant.tools, f"torch {next(NUMBERS)}"
    at = (await pendant.frames.show())["tools_revision"]
    at = (await calls.add(torch, ABOVE, at))["revision"]
    at = (await calls.move(torch, {"position": (0.0, 0.0, 0.25)}, at))["revision"]
    at = (await calls.select(torch, at))["revision"]
    at = (await calls.select(None, at))["revision"]
    content = (await pendant.frames.show())["content"]
    at = (await calls.remove(torch, at))["revision"]
    await calls.import_({**content, "frames": []}, at)
    found = await calls.calibrate([await turned(pendant, *angles) for angles in TURNS])
    assert found["position"] == pytest.approx([0.0, 0.0, 0.0], abs=1e-3)


async def turned(pendant: Pendant, *angles: float) -> tuple[float, ...]:
    here = pendant.tool_pose()
    now = roll_pitch_yaw(here.orientation)
    turn = quaternion_of(*(old + new for old, new in zip(now, angles, strict=True)))
    await (await pendant.move_to_pose(Pose(here.position, turn), speed=1.0)).done()
    await pendant.next_state()
    return pendant.joints()


async def scene(pendant: Pendant) -> None:
    calls, number = pendant.scene, next(NUMBERS)
    box, lid = f"box {number}", f"lid {number}"
    at = (await calls.show())["revision"]
    at = (await calls.add({**BOX, "name": box}, at))["revision"]
    assert (await calls.nearest())["distance"] is not None
    await pendant.next_state()
    at = (await calls.move(box, {"position": pendant.tool_pose().position}, at))["revision"]
    taken = await calls.attach(box, at)
    assert taken["distance"] == 0.0
    at = (await calls.detach(box, taken["revision"]))["revision"]
    at = (await calls.move(box, {"position": (0.0, 1.5, 0.0)}, at))["revision"]
    at = (await calls.add({**BOX, "name": lid}, at))["revision"]
    at = (await calls.allow(box, lid, at))["revision"]
    at = (await calls.forbid(box, lid, at))["revision"]
    content = (await calls.show())["content"]
    at = (await calls.remove(lid, at))["revision"]
    await calls.import_(content, at)


async def devices(pendant: Pendant) -> None:
    await pendant.signals.set(2, True)
    assert (await pendant.signals.read())["outputs"][2]
    assert await refused(pendant.signals.set(9_999, True)) is V.NO_SIGNAL
    assert (await pendant.robots.list())["loaded"] == "ur5"
    assert (await pendant.robots.load("ur5"))["loaded"] == "ur5"
    assert (await pendant.robots.describe())["facts"]["name"] == "ur5"
    assert (await pendant.trace.show())["total"] > 0
    await pendant.trace.clear()


async def kinematics(pendant: Pendant) -> None:
    calls = pendant.kinematics
    at = await calls.fk(all_links=True)
    assert len(pendant.joints()) == len((await calls.jacobian())["jacobian"][0])
    pose: PlacedPose = {"position": at["position"], "orientation": at["orientation"]}
    found = await calls.ik(pose, branches="all", scene=True)
    assert found["total"] == len(found["solutions"])
    assert await refused(calls.fk(frame="nowhere")) is V.UNKNOWN_FRAME


async def plans(pendant: Pendant) -> None:
    calls = pendant.plans
    joints = [pendant.joints()[0] + 0.2, *pendant.joints()[1:]]
    made = await calls.make({"kind": "ptp", "joints": joints}, label="aside")
    shown = await calls.samples(made["plan"], count=2, with_tool=True)
    assert (len(shown["rows"]), shown["total"]) == (2, made["samples"])
    assert [head["label"] for head in (await calls.show())["plans"]] == ["aside"]
    await calls.drop(made["plan"])
    assert await refused(calls.drop(made["plan"])) is V.PLAN_STALE


async def shapes(pendant: Pendant) -> None:
    calls = pendant.shapes
    assert (await calls.show())["robot"] == "ur5"
    assert await calls.meshes() == []
    assert await refused(calls.mesh("0" * 64)) is V.UNKNOWN_MESH


async def access(pendant: Pendant, port: int) -> None:
    calls = pendant.access
    assert (await calls.whoami())["role"] == "admin"
    assert (await calls.sessions())["sessions"]
    assert "tls" in await calls.exposure()
    async with await PendantClient.connect("127.0.0.1", port) as other:
        listed = (await calls.connections())["connections"]
        assert other.hello.session in [each["session"] for each in listed]
        await calls.close(other.hello.session)
    await calls.bar("192.0.2.66", minutes=5)
    await calls.unbar("192.0.2.66")
    await calls.logout()


async def users(pendant: Pendant, _: int) -> None:
    calls, bob = pendant.users, f"bob {next(NUMBERS)}"
    await pendant.add_account(bob, AccountRole.OPERATOR, SECRET)
    await calls.set_role(bob, "programmer")
    await calls.disable(bob)
    found = (await calls.list())["users"]
    assert {"name": bob, "role": "programmer", "disabled": True} in found
    await calls.enable(bob)
    await calls.remove(bob)


PARTS = {
    ("cells", "snapshot", "why", "jog", "catalogue", "controller"): the_cell,
    ("programs",): programs,
    ("recordings",): recordings,
    ("frames",): frames,
    ("positions",): positions,
    ("tools",): tools,
    ("scene",): scene,
    ("signals", "robots", "trace"): devices,
    ("kinematics",): kinematics,
    ("plans",): plans,
    ("shapes",): shapes,
}
ACCOUNTS: dict[tuple[str, ...], Callable[[Pendant, int], Awaitable[None]]] = {
    ("access",): access,
    ("users",): users,
}


def operations_of(*groups: str) -> set[str]:
    return {name for name in published_operations() if name.partition(".")[0] in groups}


@pytest.mark.usefixtures("programs_imported")
async def test_every_operation_is_asked_for_below() -> None:
    groups = [group for part in (*PARTS, *ACCOUNTS) for group in part]
    assert operations_of(*groups) == set(published_operations())


@pytest.mark.parametrize("groups", PARTS, ids="+".join)
async def test_every_operation_is_answered_as_it_is_published(
    groups: tuple[str, ...], cell_of_the_file: Any
) -> None:
    async with await Pendant.connect("127.0.0.1", cell_of_the_file.ports["pendant"]) as pendant:
        await pendant.wait_until(lambda state: state.motion_possible == 1, within=PATIENCE)
        async with pendant.control():
            await pendant.set_mode(OperatingMode.AUTOMATIC)
            await PARTS[groups](pendant)
            await pendant.wait_until(lambda state: state.activity == Activity.IDLE)
    # Nobody imported a mesh with this robot: what is asked of one is refused.
    assert pendant.asked >= operations_of(*groups) - {"shapes.mesh"}


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def open_port(start_cell_of_the_file: Any) -> AsyncIterator[int]:
    """The pendant port of a cell of its own."""
    cell = await start_cell_of_the_file(**CELL)
    yield cell.ports["pendant"]
    assert (await cell.end())["violations"] == 0


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def guarded_port(open_port: int) -> int:
    """The same, with the account of an admin."""
    async with await PendantClient.connect("127.0.0.1", open_port) as pendant:
        await pendant.add_account("ada", AccountRole.ADMIN, SECRET)
    return open_port


async def test_without_accounts_whoever_comes_is_told_what_it_may(open_port: int) -> None:
    async with await Pendant.connect("127.0.0.1", open_port) as pendant:
        told = await pendant.access.whoami()
    assert (told["role"], told["basis"]) == ("admin", "single user")


@pytest.mark.parametrize("groups", ACCOUNTS, ids="+".join)
async def test_every_operation_on_accounts_is_answered_as_it_is_published(
    groups: tuple[str, ...], guarded_port: int
) -> None:
    async with await Pendant.connect("127.0.0.1", guarded_port) as pendant:
        await pendant.login("ada", password=SECRET)
        await ACCOUNTS[groups](pendant, guarded_port)
    assert pendant.asked >= operations_of(*groups)


def blocking(port: int) -> None:
    waits, swing = f"waits {next(NUMBERS)}", f"swing {next(NUMBERS)}"
    with SyncPendantClient.connect("127.0.0.1", port) as pendant, pendant.control():
        pendant.set_mode(OperatingMode.AUTOMATIC)
        at = pendant.programs.create(waits)["revision"]
        pause: Any = {"statement": "wait", "duration": 0.0}
        pendant.programs.edit(waits, at, {"edit": "insert", "statements": [pause]})
        pendant.programs.run(waits).done()
        pendant.recordings.start(swing)
        first, *rest = pendant.joints()
        pendant.move_joints([first + 0.1, *rest], speed=1.0).done()
        pendant.recordings.stop()
        playback = pendant.recordings.play(swing, tolerance=0.05)
        assert playback.account["total"] >= playback.account["possible"]
        playback.done(within=PATIENCE)
        assert playback.is_over
        assert pendant.why()["cell"] == pendant.hello.cell
        with pytest.raises(Refused, match="NOT_FOUND"):
            pendant.programs.load("nothing")


async def test_calls_that_block_are_answered_the_same(cell_of_the_file: Any) -> None:
    async with await Pendant.connect("127.0.0.1", cell_of_the_file.ports["pendant"]) as pendant:
        await pendant.wait_until(lambda state: state.motion_possible == 1, within=PATIENCE)
    await asyncio.to_thread(blocking, cell_of_the_file.ports["pendant"])
