"""The demonstration's tour, with robots that can do all, some or nothing of what it likes."""

import asyncio
import math
from collections.abc import Callable, Sequence
from typing import Literal

import pytest

from openpendant.simplemsg.pendant import Motion, Outcome, OutcomeKind
from openpendant.simplemsg.pendant.management.cell import JointFacts
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import MotionHandle, Pose, Refused
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
