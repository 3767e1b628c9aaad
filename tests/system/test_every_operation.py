import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter
from rigs.clock.busy_machine import PATIENCE, PATIENT

from openpendant.simplemsg.pendant import AccountRole, Activity, OperatingMode
from openpendant.simplemsg.pendant.management.declaration import PlacedPose
from openpendant.simplemsg.pendant.management.edits import Move
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import MotionHandle, PendantClient, Pose, Refused
from openpendant.tools.pendants.motions import quaternion_of, roll_pitch_yaw
from openpendant.tools.pendants.sync_client import SyncPendantClient
from openpendant.tools.reference.operations import published_operations

pytestmark = pytest.mark.realtime

CONFIG = f'{PATIENT}controller.signals = "openpendant"\n'
BOX = {"name": "box", "shape": {"type": "box", "size": [0.1, 0.1, 0.1]}, "position": [0, 2, 0]}
AHEAD: PlacedPose = {"position": (0.5, 0.0, 0.25)}
TURNS = ((0.0, 0.1, 0.0), (0.4, 0.0, 0.0), (0.0, 0.4, 0.0), (-0.4, 0.0, 0.4))
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
    await (await pendant.move_joints([first + by, *rest], speed=0.3)).done()
    await pendant.next_state()


def move(point: str) -> Move:
    return {"statement": "move", "way": "PTP", "point": point, "zone": 0.0}


async def the_cell(pendant: Pendant) -> None:
    assert (await pendant.snapshot())["robot"] == "ur5"
    assert (await pendant.cells())["cells"][0]["robot"] == "ur5"
    assert (await pendant.why(whose="mine"))["ready"]
    assert (await pendant.why(kind="jog"))["conditions"]
    for hold in await pendant.retreat():
        assert hold["ways"]


async def programs(pendant: Pendant) -> None:
    calls, name = pendant.programs, "taught"
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
    await (await calls.run(name, speed=0.5, revision=at)).done()
    text = (await calls.load(name))["body"]
    assert (await calls.check(text))["statements"] == 3
    assert await refused(calls.check("no program")) is V.PROGRAM_SYNTAX
    half = len(text) // 2
    first = await calls.save(name, text[:half], at, part=1, parts=2)
    assert first == {"part": 1, "parts": 2}
    at = (await calls.save(name, text[half:], at, part=2, parts=2))["revision"]
    at = (await calls.rename(name, "renamed", at))["revision"]
    assert [each["name"] for each in (await calls.list())["programs"]] == ["renamed"]
    assert (await calls.history("renamed"))["programs"][0]["revision"] == at
    await calls.delete("renamed", at)


async def recordings(pendant: Pendant) -> None:
    calls = pendant.recordings
    await calls.start("swing")
    assert (await calls.list())["recording"] is not None
    await go_aside(pendant, 0.2)
    assert (await calls.stop())["finished"]
    playback = await calls.play("swing", factor=2, tolerance=0.05)
    assert playback.account["approach"] > 0
    await playback.done()
    await calls.trim("swing", "part", ends=0.2)
    assert (await calls.describe("part"))["robot"] == "ur5"
    renamed = await calls.rename("part", "piece", (await calls.describe("part"))["revision"])
    await calls.delete("piece", renamed["revision"])
    assert await refused(calls.play("piece")) is V.NOT_FOUND
    assert (await calls.list())["total"] == 1


async def frames(pendant: Pendant) -> None:
    calls = pendant.frames
    shown = await calls.show()
    at = (await calls.add("table", AHEAD, shown["frames_revision"]))["revision"]
    at = (await calls.move("table", ABOVE, at))["revision"]
    at = (await calls.rename("table", "bench", at))["revision"]
    found = await calls.transform("bench", "base", pose=AHEAD)
    assert found["pose"]["position"] == pytest.approx([0.5, 0.0, 0.375])
    taught = await calls.teach([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
    at = (await calls.add("taught", taught["pose"], at, parent="bench"))["revision"]
    content = (await calls.show())["content"]
    at = (await calls.remove("taught", at))["revision"]
    await calls.import_({**content, "tools": [], "selected_tool": None}, at)


async def tools(pendant: Pendant) -> None:
    calls = pendant.tools
    at = (await pendant.frames.show())["tools_revision"]
    at = (await calls.add("torch", ABOVE, at))["revision"]
    at = (await calls.move("torch", {"position": (0.0, 0.0, 0.25)}, at))["revision"]
    at = (await calls.select("torch", at))["revision"]
    at = (await calls.select(None, at))["revision"]
    content = (await pendant.frames.show())["content"]
    at = (await calls.remove("torch", at))["revision"]
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
    calls = pendant.scene
    at = (await calls.show())["revision"]
    at = (await calls.add(BOX, at))["revision"]
    assert (await calls.nearest())["distance"] is not None
    at = (await calls.move("box", {"position": (0.0, 1.5, 0.0)}, at))["revision"]
    at = (await calls.attach("box", at))["revision"]
    at = (await calls.detach("box", at))["revision"]
    at = (await calls.add({**BOX, "name": "lid"}, at))["revision"]
    at = (await calls.allow("box", "lid", at))["revision"]
    at = (await calls.forbid("box", "lid", at))["revision"]
    content = (await calls.show())["content"]
    at = (await calls.remove("lid", at))["revision"]
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


async def accounts(pendant: Pendant) -> None:
    calls = pendant.users
    secret = "a long enough password"
    await pendant.add_account("ada", AccountRole.ADMIN, secret)
    await pendant.login("ada", password=secret)
    await pendant.add_account("bob", AccountRole.OPERATOR, secret)
    assert (await pendant.access.whoami())["role"] == "admin"
    assert (await pendant.access.sessions())["sessions"]
    await calls.set_role("bob", "programmer")
    await calls.disable("bob")
    found = (await calls.list())["users"]
    assert found[1] == {"name": "bob", "role": "programmer", "disabled": True}
    await calls.enable("bob")
    await calls.remove("bob")
    await pendant.access.logout()


def blocking(port: int) -> None:
    with SyncPendantClient.connect("127.0.0.1", port) as pendant, pendant.control():
        pendant.set_mode(OperatingMode.AUTOMATIC)
        at = pendant.programs.create("waits")["revision"]
        pause: Any = {"statement": "wait", "duration": 0.0}
        pendant.programs.edit("waits", at, {"edit": "insert", "statements": [pause]})
        pendant.programs.run("waits").done()
        playback = pendant.recordings.play("swing", tolerance=0.05)
        assert playback.account["total"] >= playback.account["possible"]
        playback.done(within=PATIENCE)
        assert playback.is_over
        assert pendant.why()["cell"] == pendant.hello.cell
        with pytest.raises(Refused, match="NOT_FOUND"):
            pendant.programs.load("nothing")


async def test_every_operation_is_answered_as_it_is_published(
    start_cell: Any, tmp_path: Path
) -> None:
    config = tmp_path / "cell.toml"
    config.write_text(CONFIG, encoding="utf-8")
    cell = await start_cell(server=("--config", str(config), "--store", str(tmp_path / "store.db")))
    port = cell.ports["pendant"]
    async with await Pendant.connect("127.0.0.1", port) as pendant:
        await pendant.wait_until(lambda state: state.motion_possible == 1, within=PATIENCE)
        async with pendant.control():
            await pendant.set_mode(OperatingMode.AUTOMATIC)
            for part in (the_cell, programs, recordings, frames, tools, scene, devices):
                await part(pendant)
            await pendant.wait_until(lambda state: state.activity == Activity.IDLE)
        await asyncio.to_thread(blocking, port)
        await accounts(pendant)
    assert pendant.asked == set(published_operations())
    assert (await cell.end())["violations"] == 0
