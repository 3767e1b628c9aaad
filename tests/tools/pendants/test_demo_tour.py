"""The demonstration: its tour, its table of the newest state, and its report."""

import asyncio
import csv
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from rich.console import Console
from rigs.peers.scripted_pendant_server import DOF, state

from openpendant.simplemsg.pendant import Motion, OperatingMode, Outcome, OutcomeKind, State
from openpendant.simplemsg.pendant.management.cell import JointFacts
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools import demo_report
from openpendant.tools.pendants.client import MotionHandle, Pose, Refused
from openpendant.tools.pendants.demo_pendant import live_table
from openpendant.tools.pendants.demo_tour import Tour, TourReport, circle

Place = tuple[float, ...]
Allowed = Callable[[Place], bool]

LIMITS = (-1.0, 2.0)
START = Pose((0.5, 0.0, 0.4), (0.0, 0.0, 0.0, 1.0))


def facts(unit: Literal["rad", "m"], name: str) -> JointFacts:
    lower, upper = LIMITS if unit == "rad" else (0.0, 0.18)
    return JointFacts(
        name=name, unit=unit, lower=lower, upper=upper, velocity=1.0, acceleration=2.0
    )


JOINTS = [facts("rad", "base"), facts("rad", "arm"), facts("m", "lift")]


class SomeArm:
    """Does what its predicates allow, at once, and refuses the rest with one code."""

    def __init__(
        self,
        *,
        line: Allowed = lambda _: True,
        pose: Allowed = lambda _: True,
        joints: Allowed = lambda _: True,
        code: VerdictCode = VerdictCode.UNREACHABLE,
    ) -> None:
        self.line, self.pose, self.allowed, self.code = line, pose, joints, code
        self.at: Place = (0.0, 0.0, 0.0)
        self.asked: list[Place] = []
        self.paths: list[list[Place]] = []

    def joints(self) -> Place:
        return self.at

    def tool_pose(self) -> Pose:
        return START

    async def move_joints(self, joints: Sequence[float], *, speed: float) -> MotionHandle:
        self.at = tuple(joints) if self.allowed(tuple(joints)) else self.at
        return self._begun(self.at == tuple(joints), self.at)

    async def move_to_pose(self, pose: Pose, *, motion: Motion, speed: float) -> MotionHandle:
        assert motion is Motion.LIN
        return self._begun(pose == START or self.line(pose.position), pose.position)

    async def follow_poses(self, poses: Sequence[Pose], *, speed: float) -> MotionHandle:
        self.paths.append([pose.position for pose in poses])
        return self._begun(all(self.pose(pose.position) for pose in poses), poses[-1].position)

    async def follow_joints(
        self, waypoints: Sequence[Sequence[float]], *, speed: float
    ) -> MotionHandle:
        self.paths.append([tuple(point) for point in waypoints])
        return self._begun(True, tuple(waypoints[-1]))

    def _begun(self, allowed: bool, asked: Place) -> MotionHandle:
        if not allowed:
            raise Refused(self.code, "this arm cannot", -1, 0.0, 0.0)
        self.asked.append(asked)
        ended: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        ended.set_result(Outcome(1, OutcomeKind.COMPLETED, 0, -1, 0.0, 0.0, 0.01, 1.0, ""))
        return MotionHandle(1, ended)


def toured(arm: SomeArm, joints: Sequence[JointFacts] = JOINTS) -> TourReport:
    tour = Tour(arm, joints, "some arm")
    asyncio.run(tour.run())
    assert tour.doing == "done"
    return tour.report


def names(report: TourReport) -> list[str]:
    return [motion["name"] for motion in report.motions]


def never(_: Place) -> bool:
    return False


SINGLE = ["joint base", "joint arm", "joint lift", "back"]
LINE = ["straight line", "straight line back"]


def test_a_free_arm_does_it_all() -> None:
    arm = SomeArm()
    report = toured(arm)
    assert names(report) == [*SINGLE, *LINE, "path of 8 taught poses"]
    assert report.left_out == []
    assert arm.asked[4] == pytest.approx((0.5, 0.0, 0.32))


def test_an_arm_that_is_stretched_at_home_bends_before_it_draws_a_line() -> None:
    arm = SomeArm()
    arm.line = lambda _: arm.at[1] > 0.2
    report = toured(arm)
    assert names(report) == [*SINGLE, "bending the arm", *LINE, "path of 8 taught poses"]
    assert arm.at == pytest.approx((0.0, 0.3, 0.027))


def test_a_circle_is_drawn_in_the_plane_that_the_arm_can_reach() -> None:
    arm = SomeArm(pose=lambda at: abs(at[2] - 0.4) < 1e-9)
    assert toured(arm).poses == 8
    assert {round(z, 9) for _, _, z in arm.paths[-1]} == {0.4}


def test_an_arm_that_can_do_no_circle_runs_its_line_through_poses() -> None:
    arm = SomeArm(pose=lambda at: math.dist(at, START.position) in (0.0, pytest.approx(0.08)))
    report = toured(arm)
    assert names(report)[-1] == "path of 2 taught poses"
    assert report.left_out == ["a circle of the tool: none is in its reach"]
    assert arm.paths[-1] == [pytest.approx((0.5, 0.0, 0.32)), START.position]


def test_an_arm_that_can_do_no_line_runs_a_path_of_joint_positions_from_home() -> None:
    arm = SomeArm(line=never)
    report = toured(arm)
    assert names(report)[-2:] == ["back", "path of 8 taught joint positions"]
    assert report.left_out == ["a straight line of the tool: no such line is in its reach"]
    path = arm.paths[-1]
    assert path[-1] == pytest.approx((0.0, 0.0, 0.0))
    for index, (lower, upper) in enumerate([LIMITS, LIMITS, (0.0, 0.18)]):
        assert all(lower <= position[index] <= upper for position in path)


def test_a_joint_that_may_not_move_one_way_goes_the_other_or_is_left_out() -> None:
    report = toured(SomeArm(joints=lambda at: at[0] <= 0.0 and at[1] == 0.0))
    assert names(report)[:3] == ["joint base", "joint lift", "back"]
    assert report.left_out == ["joint arm alone: neither way is free from home"]


def test_a_refusal_that_is_not_of_the_robots_geometry_ends_the_tour() -> None:
    with pytest.raises(Refused, match="AUTHORITY_LOST"):
        toured(SomeArm(line=never, code=VerdictCode.AUTHORITY_LOST))


def test_the_circle_passes_the_start_and_keeps_its_radius() -> None:
    poses = circle(START, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0), 0.05)
    assert poses[-1].position == pytest.approx(START.position)
    centre = (0.5, 0.0, 0.35)
    assert [math.dist(pose.position, centre) for pose in poses] == pytest.approx([0.05] * 8)


SHOWN = [
    JointFacts(
        name=f"joint_{number}", unit="rad", lower=-1.0, upper=1.0, velocity=1.0, acceleration=2.0
    )
    for number in range(1, DOF + 1)
]


def page(newest: State | None) -> str:
    screen = StringIO()
    Console(file=screen, width=80).print(live_table(newest, SHOWN, "moving"))
    return screen.getvalue()


def test_a_joint_that_hardly_moves_backwards_shows_no_signed_zero() -> None:
    creeping = replace(
        state(1),
        positions=(-1e-9,) * 10,
        velocities=(-1e-9,) * 10,
        tool_position=(-1e-9,) * 3,
        tool_orientation=(-1e-9, 0.0, 0.0, 1.0),
    )
    shown = page(creeping)
    assert "0.00°/s" in shown
    assert "-0.0" not in shown


def test_positions_are_shown_in_degrees_and_millimetres() -> None:
    shown = page(state(1))
    assert "7.16°" in shown
    assert "500.0    250.0    750.0 mm" in shown


def test_before_the_first_state_the_table_has_its_title_only() -> None:
    assert "moving" in page(None)
    assert "joint_1" not in page(None)


def test_an_activity_of_a_newer_server_is_shown_as_unknown() -> None:
    rows = page(replace(state(1, mode=OperatingMode.AUTOMATIC), activity=99)).splitlines()
    (row,) = (each for each in rows if "│ mode " in each)
    assert row.split() == ["│", "mode", "│", "automatic", "│", "unknown", "│"]


PERIOD = 0.01
DURATION = 2.0


def swing(times: np.ndarray, begin: float) -> demo_report.Samples:
    """One joint that goes from 0 to 1 and comes to rest, from `begin` on."""
    u = np.clip((times - begin) / DURATION, 0.0, 1.0)[:, np.newaxis]
    inside = (u > 0) & (u < 1)
    return demo_report.Samples(
        times,
        u**2 * (3 - 2 * u),
        np.where(inside, 6 * u * (1 - u) / DURATION, 0.0),
        np.where(inside, (6 - 12 * u) / DURATION**2, 0.0),
    )


PLANNED = swing(np.arange(0.0, DURATION + PERIOD / 2, PERIOD), 0.0)
LOG = np.arange(-0.5, 3.0, PERIOD) + 0.0037


@pytest.mark.parametrize("delay", [0.0, 0.0021, 0.0173, 0.05])
def test_the_start_delay_is_found_and_does_not_count_as_an_error(delay: float) -> None:
    found, error = demo_report.tracking(PLANNED, swing(LOG, delay), until=float("inf"))
    assert found == pytest.approx(delay, abs=1e-5)
    assert error < 1e-6


def test_a_robot_that_leaves_its_path_is_seen() -> None:
    executed = swing(LOG, 0.0)
    executed.position[120] += 0.02
    _, error = demo_report.tracking(PLANNED, executed, until=float("inf"))
    assert error == pytest.approx(0.02, rel=0.5)


def test_what_belongs_to_the_next_motion_is_not_compared() -> None:
    executed = swing(LOG, 0.0)
    executed.position[LOG > DURATION + 0.02] += 0.5
    _, error = demo_report.tracking(PLANNED, executed, until=DURATION + 0.02)
    assert error < 1e-6


@pytest.fixture
def result() -> demo_report.DemoResult:
    motion = demo_report.TourMotion("swing", PLANNED, 0.004, 0.93, 0.002, 1e-6)
    return demo_report.DemoResult("robot", ("joint",), (motion,), swing(LOG, 0.002), 0, 8)


def test_the_table_holds_plan_and_execution(result: demo_report.DemoResult, tmp_path: Path) -> None:
    with demo_report.write_csv(result, tmp_path / "demo.csv").open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    kinds = [row["kind"] for row in rows]
    assert kinds.count("planned") == len(PLANNED.times)
    assert kinds.count("executed") == len(LOG)
    last = [row for row in rows if row["kind"] == "planned"][-1]
    assert float(last["joint.position"]) == 1.0
    assert float(last["time"]) == pytest.approx(DURATION + 0.002)


def test_the_plot_is_a_picture(result: demo_report.DemoResult, tmp_path: Path) -> None:
    plot = demo_report.write_plot(result, tmp_path / "demo.png")
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert plot.stat().st_size > 10_000


def test_the_summary_names_every_figure(result: demo_report.DemoResult) -> None:
    text = result.text()
    for part in ("plan time", "motion time", "tracking error", "limit ratio", "0 violations"):
        assert part in text
