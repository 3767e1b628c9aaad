"""Every public call of the client library, against the server and the emulator as processes.

What each test used of the library is noted, and the last one demands that nothing was left out.
"""

import asyncio
import math
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from itertools import count
from typing import Any, ClassVar

import pytest
from rigs.clock.busy_machine import PATIENCE

from openpendant.motion.description.robot import serial_robot
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.pendants.client import Aborted, Motion, PendantClient, Pose, Refused, RunKind
from openpendant.tools.pendants.roboanalyzer import RoboAnalyzerClient

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio(loop_scope="module")]

on_a_loop_of_its_own = pytest.mark.asyncio(loop_scope="function")

SECRET = "a long enough password"

NOT_OFFERED = messages.Capability.PREPARE
"""What this server has not, or this controller does not need."""

CELL = {"has_store": True, "server": ("--signals", "openpendant")}

HOME = serial_robot("ur5").home_position

AHEAD = 0.06
"""How far before its limit a jog begins [rad]."""

NUMBERS = count(1)
"""For what is kept under a name, so that a test can begin anew."""

DEADLINE = 0.25
"""The longest that a jog may go on without a beat [s]."""


class Noting:
    used: ClassVar[set[str]]

    def __getattribute__(self, name: str) -> Any:
        if not name.startswith("_"):
            type(self).used.add(name)
        return super().__getattribute__(name)


class Pendant(Noting, PendantClient):
    used: ClassVar[set[str]] = set()


class RoboAnalyzer(Noting, RoboAnalyzerClient):
    used: ClassVar[set[str]] = set()


def public(kind: type) -> set[str]:
    of_the_class = {"connect", "lobby"}
    return {name for name in dir(kind) if not name.startswith("_")} - of_the_class


@pytest.fixture
def port(cell_of_the_file: Any) -> int:
    return int(cell_of_the_file.ports["pendant"])


async def connected(port: int, **options: Any) -> Pendant:
    pendant = await Pendant.connect("127.0.0.1", port, state_rate=100.0, **options)
    await pendant.wait_until(lambda state: state.motion_possible == 1, within=PATIENCE)
    return pendant


@asynccontextmanager
async def in_control(port: int) -> AsyncIterator[Pendant]:
    """A pendant in control of a robot at home, as no test before has left it."""
    async with await connected(port) as pendant, pendant.control():
        assert pendant.state is not None
        if pendant.state.stop != messages.StopKind.NONE:  # of an attempt before
            await pendant.reset_stop()
        # The one before may have ended while the robot still braked.
        await pendant.wait_until(lambda state: state.activity == messages.Activity.IDLE)
        await pendant.set_mode(messages.OperatingMode.AUTOMATIC)
        await pendant.set_speed(1.0)
        if (await pendant.snapshot())["tool"] is not None:
            revision = (await pendant.manage({"op": "frames.show"}))["tools_revision"]
            flange = {"op": "tools.select", "name": None, "expected_revision": revision}
            await pendant.manage(flange)
        await pendant.next_state()
        if pendant.joints() != pytest.approx(HOME, abs=1e-4):
            await (await pendant.home(speed=1.0)).done()
            await pendant.next_state()
        yield pendant


async def snapshot_where(pendant: Pendant, holds: Callable[[Any], object]) -> Any:
    """Ask until something holds: signals are read 20 times a second."""
    async with asyncio.timeout(PATIENCE):
        while not holds(shot := await pendant.snapshot()):
            await pendant.next_state()
    return shot


def shifted(pose: Pose, **by: float) -> Pose:
    x, y, z = (value + by.get(axis, 0.0) for axis, value in zip("xyz", pose.position, strict=True))
    return Pose((x, y, z), pose.orientation, pose.frame)


async def test_looking_on_hellos_states_snapshots_and_news(port: int) -> None:
    async with in_control(port):
        pass  # nothing is left of a test before
    async with await connected(port, client="onlooker") as pendant:
        assert pendant.hello.cell == "cell"
        assert pendant.is_open
        assert 0.1 < await pendant.declare(enabling_deadline=0.2, language="en") <= 1.0
        assert pendant.ramp_time == pytest.approx(0.77)
        for capability in messages.Capability:
            assert pendant.offers(capability) is (capability not in NOT_OFFERED), capability
        assert (await pendant.catalogue("codes"))["entries"]
        assert (await pendant.controller.describe())["jog"] == "continuous"
        shot = await snapshot_where(pendant, lambda shot: shot["signals"]["inputs"])
        assert (shot["operating_mode"], shot["tool"], shot["recording"]) == (
            "automatic",
            None,
            None,
        )
        assert shot["signals"]["offered"]
        (served,) = (await pendant.cells())["cells"]
        assert (served["cell"], served["robot"], served["emulated"]) == ("cell", "ur5", False)
        (seen,) = (await Pendant.lobby("127.0.0.1", port))["cells"]
        assert (seen["cell"], seen["login_needed"]) == ("cell", False)
        assert (await pendant.why())["broken"] == "authority"
        assert len(shot["signals"]["inputs"]) == 16
        cells = await pendant.manage({"op": "cells"})
        assert [each["robot"] for each in cells["cells"]] == [pendant.hello.robot]

        await pendant.subscribe(20.0)
        first = await pendant.next_state()
        async for state in pendant.states():
            if state.sequence > first.sequence + 3:
                break
        await pendant.subscribe(100.0)
        assert len(pendant.joints()) == 6
        assert math.dist(pendant.tool_pose().position, (0, 0, 0)) > 0.1
        with pytest.raises(TimeoutError):
            await pendant.wait_until(lambda state: state.sequence < 0, within=0.05)

        told: list[Any] = []
        for name in ("on_state", "on_authority", "on_wanted", "on_stop", "on_mode", "on_program"):
            setattr(pendant, name, told.append)
        pendant.on_document = pendant.on_controller = pendant.on_plan = told.append
        await pendant.take_control()
        async with await connected(port, client="another") as other:
            with pytest.raises(Refused) as refused:
                await other.take_control()
            assert refused.value.code == V.HELD_BY_OTHER
        with pytest.raises(Refused) as refused:
            await pendant.prepare()
        assert refused.value.code == V.BAD_ARGUMENT
        await pendant.set_mode(messages.OperatingMode.MANUAL_HIGH)
        await pendant.stop("a look at the news")
        await pendant.wait_until(lambda state: state.stop == messages.StopKind.SOFTWARE)
        await pendant.reset_stop()
        await pendant.release_control()
        assert not pendant.in_control
        kinds = {type(each).__name__ for each in told}
        assert kinds >= {
            "State",
            "AuthorityChanged",
            "AuthorityWanted",
            "StopChanged",
            "ModeChanged",
        }


async def test_each_motion_arrives_where_it_was_asked_to(port: int) -> None:
    async with in_control(port) as pendant:
        home = pendant.joints()
        target = [home[0] + 0.1, *home[1:]]
        await (await pendant.move_joints(target, speed=1.0)).done()
        await pendant.next_state()
        assert pendant.joints() == pytest.approx(target, abs=1e-5)

        lower = shifted(pendant.tool_pose(), z=-0.02)
        await (await pendant.move_to_pose(lower, motion=Motion.LIN, speed=1.0)).done()
        await pendant.next_state()
        assert pendant.tool_pose().position == pytest.approx(lower.position, abs=2e-4)

        await (await pendant.follow_joints([target, home], speed=1.0)).done()
        await pendant.next_state()
        assert pendant.joints() == pytest.approx(home, abs=1e-4)

        corners = [shifted(pendant.tool_pose(), y=0.02), shifted(pendant.tool_pose(), z=-0.02)]
        assert (await (await pendant.follow_poses(corners, speed=1.0)).done()).motion_time > 0
        await pendant.next_state()
        assert pendant.tool_pose().position == pytest.approx(corners[1].position, abs=2e-4)

        await (await pendant.home("home", speed=1.0)).done()
        await pendant.next_state()
        assert pendant.joints() == pytest.approx(home, abs=1e-4)

        made = await pendant.plans.make({"kind": "ptp", "joints": target}, speed=1.0)
        await (await pendant.execute(made["plan"])).done()
        await pendant.next_state()
        assert pendant.joints() == pytest.approx(target, abs=1e-5)

        long = await pendant.move_joints([home[0] + 1.0, *home[1:]], speed=0.2)
        await pendant.wait_until(lambda state: state.activity == messages.Activity.MOVING)
        await pendant.set_speed(0.5)
        await pendant.pause()
        await pendant.wait_until(lambda state: not any(state.velocities), within=PATIENCE)
        await pendant.resume()
        await pendant.wait_until(lambda state: state.activity == messages.Activity.MOVING)
        await pendant.program_stop()
        with pytest.raises(Aborted) as aborted:
            await long.done()
        assert aborted.value.code == V.PROGRAM_STOPPED


JOGS: list[tuple[str, Callable[[Pendant], Any], Callable[[list[float], list[float]], bool]]] = [
    (
        "one joint",
        lambda p: p.jog({0: 0.5}, deadline=DEADLINE),
        lambda joints, tool: joints[0] > 0.01,
    ),
    (
        "two keys at once",
        lambda p: p.jog({0: -0.5, 5: 0.5}, deadline=DEADLINE),
        lambda joints, tool: joints[0] < -0.01 and joints[5] > 0.01,
    ),
    *(
        (
            f"{axis} of base",
            lambda p, a=axis: p.jog_tool(**{a: 0.5}, deadline=DEADLINE),
            lambda j, t, n=n: t[n] > 0.005,
        )
        for n, axis in enumerate("xyz")
    ),
    (
        "tool frame",
        lambda p: p.jog_tool(z=-0.5, frame="tool", deadline=DEADLINE),
        lambda j, t: max(map(abs, t)) > 5e-3,
    ),
    (
        "user frame",
        lambda p: p.jog_tool(x=0.5, frame="table", deadline=DEADLINE),
        lambda j, t: t[1] > 5e-3,
    ),
    *(
        (
            f"turn {axis}",
            lambda p, a=axis: p.jog_tool(**{a: 0.5}, deadline=DEADLINE),
            lambda j, t: max(map(abs, j)) > 0.01 and max(map(abs, t)) < 2e-3,
        )
        for axis in "abc"
    ),
]


async def jogged(pendant: Pendant, press: Callable[[Pendant], Any]) -> tuple[list[float], ...]:
    joints, tool = pendant.joints(), pendant.tool_pose().position
    async with pendant.enabling(), press(pendant) as jog:
        await jog.hold(0.15)
    await pendant.next_state()
    assert jog.account.reason == messages.JogEnd.RELEASED
    assert jog.account.stop_time > 0.0
    now = pendant.joints(), pendant.tool_pose().position
    ways = (
        [b - a for a, b in zip(before, after, strict=True)]
        for before, after in zip((joints, tool), now, strict=True)
    )
    return list(joints), *ways


@pytest.mark.parametrize("jogs", [JOGS[:5], JOGS[5:]], ids=["joints-base", "frames-turns"])
async def test_each_way_to_jog_moves_the_robot_so_and_no_other(port: int, jogs: Any) -> None:
    """Features J01, J06 to J13, J15 to J17."""
    async with in_control(port) as pendant:
        turned = (0.0, 0.0, math.sin(math.pi / 4), math.cos(math.pi / 4))
        table = {"position": (0.1, 0.0, 0.0), "orientation": turned}
        shown = await pendant.manage({"op": "frames.show"})
        if shown["frames_revision"] == 0:  # the first to come here
            await pendant.manage(
                {"op": "frames.add", "name": "table", "pose": table, "expected_revision": 0}
            )
        await pendant.set_mode(messages.OperatingMode.MANUAL_REDUCED)
        for name, press, moved in jogs:
            _, *ways = await jogged(pendant, press)
            assert moved(*ways), (name, ways)


async def test_a_jog_that_a_device_feeds_moves_as_long_as_it_is_fed(port: int) -> None:
    async with in_control(port) as pendant:
        await pendant.set_mode(messages.OperatingMode.MANUAL_REDUCED)
        before = pendant.joints()
        async with pendant.fed_enabling(), pendant.fed_jog((0.5,) + (0.0,) * 5) as jog:
            for _ in range(5):
                jog.beat()
                await pendant.next_state()
        await pendant.next_state()
        assert jog.account is not None
        assert jog.account.reason == messages.JogEnd.RELEASED
        assert pendant.joints()[0] > before[0]
        assert pendant.joints()[1:] == pytest.approx(before[1:], abs=1e-3)


async def test_a_jog_is_undone_and_a_step_is_as_long_as_it_is_asked_for(port: int) -> None:
    """Feature J32."""
    async with in_control(port) as pendant:
        await pendant.set_mode(messages.OperatingMode.MANUAL_REDUCED)
        joints, *_ = await jogged(pendant, lambda p: p.jog({0: 0.5}, deadline=DEADLINE))
        async with pendant.enabling():
            last = pendant.joints()
            await (await pendant.undo_jog()).done()
            await pendant.next_state()
            assert pendant.joints() == pytest.approx(joints, abs=2e-3)
            assert pendant.joints() != pytest.approx(last, abs=5e-3)
            await (await pendant.step({1: math.radians(0.5)})).done()
            await pendant.next_state()
            assert pendant.joints()[1] - joints[1] == pytest.approx(math.radians(0.5), abs=2e-3)
            before = pendant.tool_pose()
            await (await pendant.step_tool(z=0.005, frame="base")).done()
            await pendant.next_state()
            assert pendant.tool_pose().position == pytest.approx(
                shifted(before, z=0.005).position, abs=2e-4
            )


async def test_programs_recordings_signals_and_tools_by_management(port: int) -> None:
    async with in_control(port) as pendant:
        if (await pendant.snapshot())["recording"] is not None:  # of an attempt before
            await pendant.manage({"op": "recordings.stop"})
        number = next(NUMBERS)
        swing, main = f"swing {number}", f"main {number}"
        await pendant.manage({"op": "recordings.start", "name": swing})
        recording = (await pendant.snapshot())["recording"]
        assert recording is not None
        assert recording["name"] == swing
        revision = (await pendant.manage({"op": "programs.create", "name": main}))["revision"]
        for name, by in (("a", 0.0), ("b", 0.2)):
            await (
                await pendant.move_joints(
                    [pendant.joints()[0] + by + 0.01, *pendant.joints()[1:]], speed=0.5
                )
            ).done()
            await pendant.next_state()
            move = {"way": "PTP", "point": name, "speed": {"kind": "fraction", "value": 0.5}}
            asked = {"op": "programs.record", "name": main, "point": name, "move": move}
            told = await pendant.manage({**asked, "expected_revision": revision})
            revision = told["revision"]
        await pendant.manage({"op": "recordings.stop"})
        run = await pendant.run_program(main, run=RunKind.ALL, revision=revision)
        shot = await pendant.snapshot()
        assert shot["program"] is not None
        assert (shot["program"]["name"], shot["program"]["revision"]) == (main, revision)
        await run.done()

        await pendant.manage({"op": "signals.set", "output": 2, "value": True})
        await snapshot_where(pendant, lambda shot: shot["signals"]["outputs"][2])
        tcp = {"position": (0.0, 0.0, 0.15)}
        add = {"op": "tools.add", "name": "torch", "tcp": tcp, "expected_revision": 0}
        await pendant.manage(add)
        before = pendant.tool_pose().position
        await pendant.manage({"op": "tools.select", "name": "torch", "expected_revision": 1})
        await pendant.next_state()
        assert math.dist(before, pendant.tool_pose().position) == pytest.approx(0.15, abs=1e-4)
        assert (await pendant.snapshot())["tool"] == "torch"


async def test_the_calls_of_joints_move_the_robot_as_they_say(port: int) -> None:
    def calls() -> None:
        with RoboAnalyzer("127.0.0.1", port, speed=1.0) as robot:
            (name,) = robot.ShowAvailableRobots()
            robot.LoadRobot(name)
            display = robot.DisplayRobot()
            assert (display.name, len(display.joints)) == (name, 6)
            robot.SetHomePosition()
            home = robot.UpdateRobot()

            robot.IncrementJointAngle(1, 5.0)
            assert robot.UpdateRobot().joints[0] - home.joints[0] == pytest.approx(5.0, abs=0.01)
            robot.IncrementJointAngles([-5.0, 0.0, 0.0, 0.0, 0.0, 2.0])
            assert robot.UpdateRobot().joints[5] - home.joints[5] == pytest.approx(2.0, abs=0.01)
            robot.UpdateJointAngles(home.joints)
            assert robot.UpdateRobot().joints == pytest.approx(home.joints, abs=0.01)

    async with in_control(port):
        pass  # nothing is left of a test before
    await asyncio.to_thread(calls)


async def test_the_calls_of_the_tool_move_the_robot_as_they_say(port: int) -> None:
    def calls() -> None:
        with RoboAnalyzer("127.0.0.1", port, speed=1.0) as robot:
            for axis in "xyz":
                before = robot.UpdateRobot()
                getattr(robot, f"Increment{axis.upper()}")(-20.0)
                after = robot.UpdateRobot()
                for other in "xyz":
                    expected = -20.0 if other == axis else 0.0
                    gone = getattr(after, other) - getattr(before, other)
                    assert gone == pytest.approx(expected, abs=0.3), (axis, other)
            for angle in "abc":
                before = robot.UpdateRobot()
                getattr(robot, f"Increment{angle.upper()}")(4.0)
                after = robot.UpdateRobot()
                turned = getattr(after, angle) - getattr(before, angle)
                assert math.remainder(turned - 4.0, 360.0) == pytest.approx(0.0, abs=0.1), angle
                assert (after.x, after.y, after.z) == pytest.approx(
                    (before.x, before.y, before.z), abs=0.3
                )
            robot.ClearTrace()

    async with in_control(port):
        pass  # nothing is left of a test before
    await asyncio.to_thread(calls)
    async with await connected(port) as pendant:
        trace = await pendant.manage({"op": "trace.show"})
        assert trace["total"] <= 1


@on_a_loop_of_its_own
async def test_a_jog_into_a_limit_says_why_and_which_way_leads_out(start_cell: Any) -> None:
    """Features J20, J21, J23: scaled before the limit, the reason and the joint in the state."""
    limit = 2 * math.pi
    _, *others = HOME
    cell = await start_cell(start=str([limit - AHEAD, *others]))
    async with await connected(cell.ports["pendant"]) as pendant, pendant.control():
        await pendant.set_mode(messages.OperatingMode.MANUAL_REDUCED)
        seen: list[messages.State] = []
        pendant.on_state = seen.append
        async with pendant.enabling(), pendant.jog({0: 1.0}, deadline=DEADLINE) as jog:
            await jog.hold(0.4)
        assert max(state.positions[0] for state in seen) < limit
        slowed = [state for state in seen if state.jog_reason == messages.JogReason.JOINT_LIMIT]
        assert {state.jog_joint for state in slowed} == {0}
        assert min(state.jog_scale for state in slowed) < 0.5
        await pendant.wait_until(lambda state: state.activity == messages.Activity.IDLE)
        (hold,) = await pendant.retreat()
        assert hold["text"].startswith("Base stands at ")
        (way,) = hold["ways"]
        assert way["press"] == "Base towards -"
        async with pendant.enabling(), pendant.jog_out(way, deadline=DEADLINE) as back:
            await back.hold(0.4)
        await pendant.wait_until(lambda state: state.activity == messages.Activity.IDLE)
        assert pendant.joints()[0] < limit - AHEAD
        assert await pendant.retreat() == []


@on_a_loop_of_its_own
async def test_an_admin_lets_a_class_in(start_cell: Any) -> None:
    port = (await start_cell(**CELL)).ports["pendant"]
    async with await connected(port) as admin:
        with pytest.raises(Refused):
            await admin.set_password("nobody", SECRET)
        code = await admin.issue_pairing_code()
        async with await connected(port, user="anna", pairing=code) as guest:
            assert guest.hello.session != admin.hello.session
        await admin.end_pairing()
        with pytest.raises(Refused):
            await admin.login("anna", pairing=code)
        await admin.add_account("berta", messages.AccountRole.ADMIN, SECRET)
    late = await connected(port)
    late.abort()
    await late.close()


@on_a_loop_of_its_own  # so that it stays behind the one that is on such a loop
async def test_nothing_of_the_library_was_left_out() -> None:
    assert public(PendantClient) - Pendant.used == set()
    assert public(RoboAnalyzerClient) - RoboAnalyzer.used == set()
