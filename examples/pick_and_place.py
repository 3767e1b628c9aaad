"""Pick a workpiece, carry it past a wall by a plan, place it; then miss it where it was moved.

python examples/pick_and_place.py [PORT [SEED]]

The robot is a Kawasaki RA10N: emulate and serve `--robot kawasaki_ra10n`.
"""

import asyncio
import math
import sys

from openpendant.simplemsg.pendant.management.declaration import PlacedPose
from openpendant.simplemsg.pendant.management.plans import FreeGoal, Goal, MadePlan
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import (
    Aborted,
    OperatingMode,
    PendantClient,
    PendantError,
    Refused,
)

PORT = int(sys.argv[1]) if len(sys.argv) > 1 else 11010
SEED = int(sys.argv[2]) if len(sys.argv) > 2 else 1  # another seed, another way past the wall
ROBOT = "kawasaki_ra10n"

TCP: PlacedPose = {"position": (0.0, 0.0, 0.12)}  # of the gripper, in the flange [m]
HAND_DOWN = (1.0, 0.0, 0.0, 0.0)
HERE, THERE = (-0.2, 0.75, 0.15), (0.2, 0.75, 0.15)  # the workpiece's centre [m]
GRASP = 0.14  # above that centre, 10 mm below the workpiece's top [m]
LIFT = 0.06  # m
ASIDE = 0.06  # m

WALL = {
    "name": "wall",
    "shape": {"type": "box", "size": [0.06, 0.7, 0.26]},
    "position": [0.0, 0.85, 0.13],
}
WORKPIECE = {
    "name": "workpiece",
    "shape": {"type": "box", "size": [0.06, 0.06, 0.3]},
    "position": HERE,
}

PICK = """openpendant-program/1
program "pick" robot {robot} tool gripper
point above joints {above} rad
point part joints {part} rad
move PTP above
move LIN part
attach workpiece
move LIN above
"""


def grasping(centre: tuple[float, float, float], lift: float = 0.0) -> PlacedPose:
    """Return the pose of the gripper that has the workpiece's centre at a place, or above it."""
    x, y, z = centre
    return {"position": (x, y, z + GRASP + lift), "orientation": HAND_DOWN}


async def set_up(pendant: PendantClient) -> None:
    """Select a gripper; put wall and workpiece in place, instead of those of an earlier run."""
    frames = await pendant.frames.show()
    has_gripper = "gripper" in str(frames["content"]["tools"])
    change = pendant.tools.move if has_gripper else pendant.tools.add
    changed = await change("gripper", TCP, frames["tools_revision"])
    await pendant.tools.select("gripper", changed["revision"])
    scene = await pendant.scene.show()
    revision = scene["revision"]
    for kept in scene["content"]["objects"]:
        if kept["name"] in ("wall", "workpiece"):
            revision = (await pendant.scene.remove(kept["name"], revision))["revision"]
    for new in (WALL, WORKPIECE):
        revision = (await pendant.scene.add(new, revision))["revision"]


async def teach(pendant: PendantClient, centre: tuple[float, float, float]) -> None:
    """Save a program that takes the workpiece from a place."""
    above = (await pendant.kinematics.ik(grasping(centre, LIFT)))["solutions"][0]["joints"]
    part = (await pendant.kinematics.ik(grasping(centre), seed=above))["solutions"][0]["joints"]
    points = {"above": above, "part": part}
    written = {name: " ".join(f"{q:.12f}" for q in joints) for name, joints in points.items()}
    kept = (await pendant.programs.list())["programs"]
    revision = next((each["revision"] for each in kept if each["name"] == "pick"), 0)
    await pendant.programs.save("pick", PICK.format(robot=ROBOT, **written), revision)


async def go(pendant: PendantClient, goal: Goal) -> MadePlan:
    """Make a plan and execute it; return what was told of it."""
    plan = await pendant.plans.make(goal, speed=1.0)
    await (await pendant.execute(plan["plan"])).done()
    return plan


async def carry(pendant: PendantClient) -> None:
    """Carry the workpiece to above its new place: straight on if that is possible."""
    above = grasping(THERE, LIFT)
    try:
        await go(pendant, {"kind": "ptp", "pose": above})
    except Refused as refused:
        print(f"straight on: {refused}")
        around: FreeGoal = {"kind": "free", "pose": above, "planner": "RRTConnect", "seed": SEED}
        near = (await go(pendant, around))["clearance"]
        assert near is not None  # there is a wall
        distance = f"{1e3 * near['distance']:.1f} mm"
        print(f"around: {near['first']} and {near['second']} come as near as {distance}")


async def centre_now(pendant: PendantClient) -> list[float]:
    """Return where the scene has the workpiece."""
    objects = (await pendant.scene.show())["content"]["objects"]
    (found,) = (list(each["position"]) for each in objects if each["name"] == "workpiece")
    return found


async def pick_and_place(pendant: PendantClient) -> None:
    """Bring the workpiece from here to there."""
    await go(pendant, {"kind": "ptp", "pose": grasping(HERE, LIFT)})
    await teach(pendant, HERE)
    await (await pendant.run_program("pick")).done()
    await carry(pendant)
    await go(pendant, {"kind": "lin", "pose": grasping(THERE)})
    await pendant.scene.detach("workpiece", (await pendant.scene.show())["revision"])
    await go(pendant, {"kind": "lin", "pose": grasping(THERE, LIFT)})
    off = math.dist(await centre_now(pendant), THERE)
    print(f"placed {1e3 * off:.3f} mm beside its place")


async def miss(pendant: PendantClient) -> None:
    """Take it from where it was put, though somebody has moved it: in a dry run, then really."""
    x, y, z = THERE
    moved: PlacedPose = {"position": (x + ASIDE, y, z)}
    await pendant.scene.move("workpiece", moved, (await pendant.scene.show())["revision"])
    await teach(pendant, THERE)
    (attach,) = (await pendant.programs.dry_run("pick"))["scene"]
    print(f"dry run, line {attach['line']}: {VerdictCode(attach['code']).name}: {attach['text']}")
    lines: list[int] = []
    pendant.on_program = lambda report: lines.append(report.line)
    try:
        await (await pendant.run_program("pick")).done()
    except Aborted as aborted:
        print(f"run, line {lines[-1]}: {aborted}")


async def main() -> None:
    """Do both, where the robot is the one that this is written for."""
    async with await PendantClient.connect("127.0.0.1", PORT, client="picker") as pendant:
        async with pendant.control():
            if pendant.hello.robot != ROBOT:
                sys.exit(f"this is for a {ROBOT}, and the server has a {pendant.hello.robot}")
            await pendant.set_mode(OperatingMode.AUTOMATIC)
            await set_up(pendant)
            await pick_and_place(pendant)
            await miss(pendant)


try:
    asyncio.run(main())
except PendantError as error:
    sys.exit(error.explained)
