"""What is said in each of the recorded conversations, by its name.

Each is short, because its journal stays in the repository, and shows one way through the server
from end to end, with a refusal or an interruption on it.
"""

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from frozen.cell_to_record import HOST, ROBOT, Heard, RecordedCell

from openpendant import simplemsg as wire
from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.simplemsg import pendant as messages
from openpendant.tools.pendants.client import Aborted, PendantClient, PendantError, Pose, Refused

Vector = tuple[float, float, float]
Talk = Callable[[RecordedCell], Awaitable[None]]


@dataclass(frozen=True)
class Conversation:
    talk: Talk
    cells: int = 1
    tables: dict[str, Any] = field(default_factory=dict)


@contextlib.contextmanager
def expected(failure: type[PendantError]) -> Iterator[None]:
    """Go on behind what has to fail."""
    try:
        yield
    except failure:
        return
    raise AssertionError(f"no {failure.__name__}")


async def at_rest(pendant: PendantClient) -> None:
    await pendant.wait_until(lambda state: state.activity == messages.Activity.IDLE)


async def reset(pendant: PendantClient) -> None:
    for _ in range(20):
        with contextlib.suppress(Refused):
            await pendant.reset_stop()
            return
        await asyncio.sleep(0.1)
    raise AssertionError("the stop cannot be reset")


async def moved_joint(pendant: PendantClient, joint: int, by: float, speed: float = 0.5) -> Any:
    await pendant.next_state()
    goal = list(pendant.joints())
    goal[joint] += by
    return await pendant.move_joints(goal, speed=speed)


async def moved_tool(
    pendant: PendantClient, by: Vector, motion: messages.Motion, speed: float = 0.5
) -> Any:
    await pendant.next_state()
    here = pendant.tool_pose()
    x, y, z = here.position
    there = Pose((x + by[0], y + by[1], z + by[2]), here.orientation)
    return await pendant.move_to_pose(there, motion=motion, speed=speed)


@contextlib.asynccontextmanager
async def in_control(cell: RecordedCell, **options: Any) -> AsyncIterator[PendantClient]:
    async with await cell.pendant(**options) as pendant, pendant.control():
        yield pendant


@contextlib.asynccontextmanager
async def jogging(cell: RecordedCell, **options: Any) -> AsyncIterator[PendantClient]:
    """A pendant in control that may jog as long as its enabling device is held."""
    async with in_control(cell, **options) as pendant:
        await pendant.set_mode(messages.OperatingMode.MANUAL_HIGH)
        yield pendant


async def jogged(pendant: PendantClient, joints: Mapping[int, float], seconds: float = 0.2) -> None:
    async with pendant.enabling(), pendant.jog(joints, deadline=0.2) as press:
        await press.hold(seconds)
    await at_rest(pendant)


# Where a velocity would be zero but for rounding, machines differ: in these jogs no joint stands.
ALL_JOINTS = {0: 0.8, 1: -0.3, 2: 0.4, 3: -0.25, 4: 0.35, 5: 0.45}
ALL_AXES: dict[str, Any] = {"x": 0.3, "y": 0.4, "z": 0.5, "a": 0.1, "b": -0.15, "c": 0.2}


async def jog(cell: RecordedCell) -> None:
    """Joints and tool, steps, undone, and both ends of a press."""
    async with jogging(cell, state_rate=25.0) as pendant:
        async with pendant.enabling():
            async with pendant.jog(ALL_JOINTS, deadline=0.2) as press:
                await press.hold(0.3)
                await press.aim({0: -0.5, 3: 0.25})
                await press.hold(0.2)
            await at_rest(pendant)
            async with pendant.jog_tool(**ALL_AXES, deadline=0.2) as press:
                await press.hold(0.3)
            await at_rest(pendant)
            await (await pendant.step({1: -0.02})).done()
            await (await pendant.step_tool(x=0.005, frame="tool")).done()
            await (await pendant.undo_jog()).done()
            with expected(Refused):
                await pendant.step_tool(x=0.01, frame="nowhere")
        async with pendant.enabling() as device:
            with expected(Aborted):
                async with pendant.jog({2: 0.3}, deadline=0.2) as press:
                    await press.hold(0.2)
                    device.let_go()
                    await press.hold(0.3)
        await at_rest(pendant)
        await pendant.set_mode(messages.OperatingMode.AUTOMATIC)
        with expected(Refused):
            await jogged(pendant, {2: 0.3})


async def pose(cell: RecordedCell) -> None:
    """Single poses and paths, in joint space and straight, one that cannot be reached."""
    async with in_control(cell) as pendant:
        await (await moved_tool(pendant, (0.0, 0.0, -0.03), messages.Motion.LIN)).done()
        await (await moved_tool(pendant, (-0.02, 0.02, 0.0), messages.Motion.PTP)).done()
        with expected(Refused):
            await moved_tool(pendant, (9.0, 0.0, 0.0), messages.Motion.PTP)
        await pendant.next_state()
        here, joints = pendant.tool_pose(), pendant.joints()
        x, y, z = here.position
        poses = [Pose((x, y + 0.03, z), here.orientation), Pose((x, y, z), here.orientation)]
        await (await pendant.follow_poses(poses, speed=0.5)).done()
        aside = (joints[0] + 0.1, *joints[1:])
        await (await pendant.follow_joints([aside, joints], speed=0.5)).done()
        await pendant.set_speed(0.5)
        motion = await pendant.home(speed=1.0)
        await asyncio.sleep(0.15)
        await pendant.pause()
        await asyncio.sleep(0.2)
        await pendant.resume()
        await motion.done()


PROGRAM = """openpendant-program/1
program "{name}" robot ur5
point a joints 0 -1.5 1.5 -1.5 -1.5 0 rad
point b joints 0.08 -1.5 1.5 -1.5 -1.5 0 rad
point c joints 0.08 -1.45 1.5 -1.5 -1.5 0 rad
"""
MAIN = """# there and back
move PTP a speed 50 %
loop 2
  move LIN b speed 200 mm/s zone 5 mm
  move LIN c speed 200 mm/s
  set output 1 on
  call aside
end
if input 0 on
  wait 10 s
else
  wait 100 ms
end
set output 1 off
"""
BODY = 11
"""Line of the first statement in the canonical text of `ASIDE`."""
ASIDE = "move PTP b speed 60 %\nmove PTP a dwell 0.05 s\n"


async def program(cell: RecordedCell) -> None:
    """Saved, edited, taught, run with a breakpoint, paused, stepped and run to its end."""
    async with in_control(cell) as pendant:
        calls = pendant.programs
        await calls.save("aside", PROGRAM.format(name="aside") + ASIDE, 0)
        text = PROGRAM.format(name="main") + MAIN
        half = len(text) // 2
        await calls.save("main", text[:half], 0, part=1, parts=2)
        at = (await calls.save("main", text[half:], 0, part=2, parts=2))["revision"]
        with expected(Refused):
            await calls.check("no program")
        pause: Any = {"statement": "wait", "duration": 0.05}
        at = (await calls.edit("main", at, {"edit": "insert", "statements": [pause]}))["revision"]
        at = (await calls.undo("main", at))["revision"]
        assert (await calls.breakpoints("main", [2]))["statements"][0] == 2
        run = await calls.run("main", revision=at)
        await asyncio.sleep(3.0)
        assert not run.is_over
        await calls.breakpoints("main", [])
        await pendant.resume()
        await asyncio.sleep(0.3)
        await pendant.pause()
        await asyncio.sleep(0.4)
        await pendant.resume()
        await run.done()
        await (await calls.run("aside", run=messages.RunKind.STEP_FORWARD, line=BODY)).done()
        at = (await calls.touch_up("aside", 1, "b"))["revision"]
        await calls.rename("aside", "moved", at)
        with expected(PendantError):
            await (await calls.run("main")).done()
        await calls.delete("moved", 1)
        await calls.history("main")


async def recording(cell: RecordedCell) -> None:
    """A motion is recorded, played, trimmed, renamed and deleted."""
    async with in_control(cell) as pendant:
        calls = pendant.recordings
        await calls.start("swing")
        await (await moved_joint(pendant, 0, 0.1, speed=0.6)).done()
        await calls.stop()
        await (await calls.play("swing", factor=2.0, tolerance=0.01)).done()
        await calls.trim("swing", "part", ends=0.2)
        with expected(Refused):
            await calls.play("nothing")
        at = (await calls.describe("part"))["revision"]
        at = (await calls.rename("part", "piece", at))["revision"]
        await calls.delete("piece", at)
        await calls.list()
        # A second one, which a stop ends.
        await calls.start("cut off")
        motion = await moved_joint(pendant, 0, 0.2)
        await asyncio.sleep(0.2)
        await pendant.stop("enough")
        with expected(Aborted):
            await motion.done()
        await calls.stop()
        await reset(pendant)


async def dry_run(cell: RecordedCell) -> None:
    """A program is tried without moving: one that can be run, and one that cannot."""
    async with await cell.pendant() as pendant:
        calls = pendant.programs
        await calls.save("aside", PROGRAM.format(name="aside") + ASIDE, 0)
        await calls.save("main", PROGRAM.format(name="main") + MAIN, 0)
        assert (await calls.dry_run("main"))["complete"]
        far = "point far joints 0 -1.5 -1.5 1.5 1.5 0 rad\n"
        text = PROGRAM.format(name="far") + far + "move PTP a\nmove LIN far\ncall nothing\n"
        await calls.save("far", text, 0)
        with expected(Refused):
            await calls.dry_run("far")
        text = text.replace("call nothing\n", "")
        await calls.save("far", text, 1)
        assert (await calls.dry_run("far"))["refused"]
        await calls.dry_run_progress()


async def stop_while_jogging(cell: RecordedCell) -> None:
    """Another pendant stops a jog, then a person at the controller does."""
    async with jogging(cell) as pendant, await cell.pendant("another") as other:
        with expected(Aborted):
            async with pendant.enabling(), pendant.jog(ALL_JOINTS, deadline=0.2) as press:
                await press.hold(0.3)
                await other.stop("somebody is in there")
                await press.hold(0.3)
        await at_rest(pendant)
        with expected(Refused):
            await jogged(pendant, {0: 0.1})
        await other.manage({"op": "why"})
        await reset(pendant)
        with expected(Aborted):
            async with pendant.enabling(), pendant.jog_tool(**ALL_AXES, deadline=0.2) as press:
                await press.hold(0.3)
                cell.services[0].operate(messages.OperatorAction.EMERGENCY_STOP)
                await press.hold(0.3)
        await at_rest(pendant)
        cell.services[0].operate(messages.OperatorAction.RESET)
        await reset(pendant)
        await jogged(pendant, {0: -0.5})


async def freeze(cell: RecordedCell) -> None:
    """The server is held up, and notices this and that first; once its watchdog has stopped."""
    async with in_control(cell) as pendant:
        for first in (Heard.CONTROLLER, Heard.TICK):
            motion = await moved_joint(pendant, 0, 0.4)
            await asyncio.sleep(0.2)
            await cell.hold_up_server(0.505, first)
            with expected(Aborted):
                await motion.done()
            await reset(pendant)
        # Between a question and its answer.
        asked = asyncio.create_task(moved_tool(pendant, (0.0, 0.0, -0.03), messages.Motion.LIN))
        await pendant.next_state()
        await asyncio.sleep(0.02)
        await cell.hold_up_server(0.505, Heard.ANSWERS)
        with expected(PendantError):
            await (await asked).done()
        await reset(pendant)
        await pendant.set_mode(messages.OperatingMode.MANUAL_HIGH)
        with expected(Aborted):
            async with pendant.enabling(), pendant.jog({0: -0.5}, deadline=0.2) as press:
                await press.hold(0.2)
                await cell.hold_up_server(0.505, Heard.CLIENTS)
                await press.hold(0.3)
        await reset(pendant)
        with expected(Aborted):
            async with pendant.enabling(), pendant.jog({0: -0.5}, deadline=0.2) as press:
                await press.hold(0.2)
                cell.watchdog.stopped = 1
                await press.hold(0.3)
        await reset(pendant)
        # While it stands nothing is stopped.
        await cell.hold_up_server(0.505, Heard.TICK)
        await asyncio.sleep(0.2)
        await jogged(pendant, {0: -0.2})


async def link_loss(cell: RecordedCell) -> None:
    """The controller is gone in a motion, then a pendant in a jog, then one in a motion."""
    async with in_control(cell) as pendant:
        motion = await moved_joint(pendant, 0, 0.4)
        await asyncio.sleep(0.3)
        cell.services[0].close_links()
        with expected(Aborted):
            await motion.done()
        await at_rest(pendant)
        await pendant.wait_until(lambda state: state.motion_possible == 1, within=9.0)
        await pendant.set_mode(messages.OperatingMode.MANUAL_HIGH)
        with expected(PendantError):
            async with pendant.enabling(), pendant.jog({0: 0.5}, deadline=0.2) as press:
                await press.hold(0.2)
                pendant.abort()
                await press.hold(0.2)
    await asyncio.sleep(0.5)
    async with await cell.pendant("second") as second:
        await second.take_control()
        await reset(second)
        await second.set_mode(messages.OperatingMode.AUTOMATIC)
        await moved_joint(second, 1, -0.2)
        await asyncio.sleep(0.2)
        second.abort()
    await asyncio.sleep(0.5)


class RosClient:
    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer
        self._wire = wire.Connection(wire.Role.CLIENT, wire.STANDARD, wire.ByteOrder.LITTLE)

    async def point(
        self, sequence: int, joints: Sequence[float] = (), duration: float = 0.2
    ) -> int:
        message = wire.JointTrajPt(
            sequence, wire.joint_array(joints), 0.2, duration, comm_type=wire.CommType.REQUEST
        )
        self._writer.write(self._wire.send(message))
        while True:
            for reply in self._wire.receive(await self._reader.read(4_096)):
                assert isinstance(reply, wire.Message)
                return int(reply.reply_code)

    def close(self) -> None:
        self._writer.close()


async def ros_streaming(cell: RecordedCell) -> None:
    """Trajectories of a ROS-Industrial client: one to its end, one stopped, one refused."""
    motion, state = cell.ros_ports
    async with await cell.pendant() as pendant:
        listener = await asyncio.open_connection(HOST, state)
        client = RosClient(*await asyncio.open_connection(HOST, motion))
        await pendant.next_state()
        home = pendant.joints()

        async def stream(by: float, points: int) -> None:
            for number in range(points):
                goal = (home[0] + by * number / (points - 1), *home[1:])
                assert await client.point(number, goal) == 1

        await stream(0.04, 3)
        await asyncio.sleep(1.2)
        home = pendant.joints()
        await stream(0.2, 5)
        await asyncio.sleep(0.6)
        with expected(Refused):
            await pendant.take_control()
        assert await client.point(-4) == 1
        await asyncio.sleep(0.4)
        await client.point(0, (9.0, *home[1:]))
        await client.point(1, (9.0, *home[1:]))
        await asyncio.sleep(0.4)
        client.close()
        await asyncio.sleep(0.2)
        listener[1].close()


SECRET = "a long enough password"


async def login_and_accounts(cell: RecordedCell) -> None:
    """From a single user to accounts of two roles and a guest, and back out."""
    async with await cell.pendant("first") as ada:
        await ada.add_account("ada", messages.AccountRole.ADMIN, SECRET)
        with expected(Refused):
            await ada.manage({"op": "users.list"})
        await ada.login("ada", password=SECRET)
        with expected(Refused):
            await ada.add_account("bob", messages.AccountRole.OPERATOR, "short")
        await ada.add_account("bob", messages.AccountRole.OPERATOR, SECRET)
        bob = await cell.pendant("second", user="bob", password=SECRET)
        with expected(Refused):
            await bob.programs.create("not his")
        with expected(Refused):
            await cell.pendant("third", user="bob", password="a wrong password")
        await bob.take_control()
        await (await moved_joint(bob, 0, 0.02)).done()
        await ada.users.set_role("bob", "viewer")
        await asyncio.sleep(0.05)
        with expected(PendantError):
            await moved_joint(bob, 0, 0.02)
        await ada.set_password("bob", SECRET + "!")
        await asyncio.sleep(0.05)
        await bob.close()
        code = await ada.issue_pairing_code()
        guest = await cell.pendant("fourth", user="Mia", pairing=code)
        await guest.access.whoami()
        await ada.access.sessions()
        await ada.users.disable("bob")
        await ada.users.list()
        await ada.end_pairing()
        await asyncio.sleep(0.05)
        await guest.close()
        await ada.users.remove("bob")
        with expected(Refused):
            await ada.users.remove("nobody")
        await ada.access.logout()


async def scene_change_while_moving(cell: RecordedCell) -> None:
    """Frames, tool and scene are changed; an object is put in the way of a motion."""
    async with in_control(cell) as pendant:
        shown = await pendant.frames.show()
        at = shown["frames_revision"]
        await pendant.frames.add("table", {"position": (0.4, 0.1, 0.2)}, at)
        at = shown["tools_revision"]
        at = (await pendant.tools.add("torch", {"position": (0.0, 0.0, 0.1)}, at))["revision"]
        await pendant.tools.select("torch", at)
        await pendant.next_state()
        goal = list(pendant.joints())
        goal[0] += 1.0
        there = Kinematics(serial_robot(ROBOT)).forward(goal).position.tolist()
        shape = {"type": "sphere", "radius": 0.05}
        ball: Any = {"name": "ball", "shape": shape, "position": there}
        motion = await pendant.move_joints(goal, speed=0.3)
        await asyncio.sleep(0.2)
        at = (await pendant.scene.show())["revision"]
        at = (await pendant.scene.add(ball, at))["revision"]
        with expected(Aborted):
            await motion.done()
        await at_rest(pendant)
        with expected(Refused):
            await pendant.move_joints(goal, speed=0.3)
        at = (await pendant.scene.move("ball", {"position": (0.0, 2.0, 0.0)}, at))["revision"]
        for link in ("wrist_1_link", "wrist_2_link", "wrist_3_link"):
            at = (await pendant.scene.allow("ball", link, at))["revision"]
        motion = await moved_tool(pendant, (0.01, 0.02, -0.03), messages.Motion.LIN)
        with expected(Refused):
            await pendant.scene.attach("ball", at)
        await motion.done()
        with expected(Refused):
            await pendant.scene.attach("ball", at)
        await pendant.next_state()
        here = pendant.tool_pose().position
        at = (await pendant.scene.move("ball", {"position": here}, at))["revision"]
        await pendant.scene.attach("ball", at)
        await pendant.signals.set(2, True)
        await pendant.scene.nearest()
        await pendant.trace.show()


async def shutdown(cell: RecordedCell) -> None:
    """A server of two cells ends while one robot moves and the other is jogged."""
    left = await cell.pendant("left", cell="cell1")
    right = await cell.pendant("right", cell="cell2")
    for pendant in (left, right):
        await pendant.wait_until(lambda state: state.motion_possible == 1)
        await pendant.take_control()
    await moved_joint(left, 0, 0.5)
    await right.set_mode(messages.OperatingMode.MANUAL_HIGH)
    cell.afterwards(_held(right))
    cell.afterwards(_closed(left, right))
    await asyncio.sleep(0.3)


async def _held(pendant: PendantClient) -> None:
    with contextlib.suppress(PendantError):
        async with pendant.enabling(), pendant.jog({0: 0.5}, deadline=0.2) as press:
            await press.hold(5.0)


async def _closed(*pendants: PendantClient) -> None:
    await asyncio.sleep(3.0)
    for pendant in pendants:
        await pendant.close()


CONVERSATIONS = {
    "jog": Conversation(jog),
    "pose": Conversation(pose),
    "program": Conversation(program),
    "recording": Conversation(recording),
    "dry-run": Conversation(dry_run),
    "stop-while-jogging": Conversation(stop_while_jogging),
    "freeze": Conversation(freeze),
    "link-loss": Conversation(link_loss),
    "ros-streaming": Conversation(ros_streaming),
    "login-and-accounts": Conversation(login_and_accounts),
    "scene-change-while-moving": Conversation(scene_change_while_moving),
    "shutdown": Conversation(shutdown, cells=2),
}
