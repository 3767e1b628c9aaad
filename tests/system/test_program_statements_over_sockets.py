from typing import Any

import pytest

from openpendant.simplemsg.pendant import ProgramState, SetInputs
from openpendant.tools.pendants.client import PendantClient

pytestmark = pytest.mark.realtime

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
TABLE_X = 0.1
LIFT = 0.03
SHIFT = 0.02
PROGRAM = """openpendant-program/1
program "cycle" robot ur5 tool gripper frame table
point down
  joints {joints} rad
  pose {x} {y} {z} m quat {quat}
point up
  joints {joints} rad
  pose {x} {y} {above} m quat {quat}

move LIN up speed 200 mm/s
attach part
wait input 1 on timeout 20 s
if input 2 on
  set output 3 on
else
  set output 4 on
end
move LIN down speed 200 mm/s
detach part
move LIN up speed 200 mm/s
"""


async def prepare(pendant: PendantClient) -> tuple[float, ...]:
    placed = {"position": (0.0, 0.0, 0.1), "orientation": UPRIGHT}
    made = await pendant.manage(
        {
            "op": "tools.add",
            "name": "gripper",
            "tcp": placed,
            "grasp": {"reach": 0.05},
            "expected_revision": 0,
        }
    )
    selected = {"op": "tools.select", "name": "gripper", "expected_revision": made["revision"]}
    await pendant.manage(selected)
    table = {"position": (TABLE_X, 0.0, 0.0), "orientation": UPRIGHT}
    await pendant.manage(
        {"op": "frames.add", "name": "table", "pose": table, "expected_revision": 0}
    )
    await pendant.next_state()
    pose = pendant.tool_pose()
    part = {"name": "part", "shape": {"type": "sphere", "radius": 0.01}, "position": pose.position}
    await pendant.manage({"op": "scene.add", "object": part, "expected_revision": 0})
    x, y, z = pose.position
    text = PROGRAM.format(
        joints=" ".join(map(repr, pendant.joints())),
        quat=" ".join(map(repr, pose.orientation)),
        **{"x": x - TABLE_X, "y": y, "z": z, "above": z + LIFT},
    )
    await pendant.manage(
        {"op": "programs.save", "name": "cycle", "body": text, "expected_revision": 0}
    )
    return pose.position


async def carried_by(pendant: PendantClient) -> str | None:
    (part,) = (await pendant.manage({"op": "scene.show"}))["content"]["objects"]
    link: str | None = part.get("link")
    return link


async def test_a_program_carries_waits_branches_and_follows_its_frame(
    start_cell: Any, tmp_path: Any
) -> None:
    cell = await start_cell(
        server=("--store", str(tmp_path / "store.db"), "--signals", "openpendant")
    )
    pendant = await cell.ready_pendant()
    async with pendant.control():
        x, y, z = await prepare(pendant)
        found = await pendant.manage({"op": "programs.dry_run", "name": "cycle"})
        assert found["refused"] == 0, found
        told = [(each["line"], each["does"], each["object"]) for each in found["scene"]]
        assert [(does, name) for _, does, name in told] == [("attach", "part"), ("detach", "part")]
        assert await carried_by(pendant) is None

        moved = {"position": (TABLE_X + SHIFT, 0.0, 0.0), "orientation": UPRIGHT}
        await pendant.manage(
            {"op": "frames.move", "name": "table", "pose": moved, "expected_revision": 1}
        )
        run = await pendant.run_program("cycle")
        waits = await pendant.wait_until(lambda state: state.program_line > told[0][0])
        assert waits.program_state == ProgramState.RUNNING
        assert await carried_by(pendant) is not None
        assert pendant.tool_pose().position == pytest.approx((x + SHIFT, y, z + LIFT), abs=1e-3)

        for number in (2, 1):
            await cell.tell_controller(SetInputs(0, 1 << number, 1 << number))
        await run.done()
        signals = await pendant.manage({"op": "signals.read"})
        assert [n for n, value in enumerate(signals["outputs"]) if value] == [3]
        assert await carried_by(pendant) is None
        await pendant.next_state()
        assert pendant.tool_pose().position == pytest.approx((x + SHIFT, y, z + LIFT), abs=1e-3)
    assert (await cell.end())["violations"] == 0
