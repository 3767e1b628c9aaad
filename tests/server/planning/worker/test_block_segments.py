from __future__ import annotations

import math

import numpy as np
import pytest

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.paths.paths import plan_path
from openpendant.motion.paths.segments import Circ, Lin, Ptp, Spline, ThroughPoint
from openpendant.motion.pose import Pose
from openpendant.server.planning.worker.block_planning import segments_of
from openpendant.server.programs.interpreter.motion_blocks import BlockMove, MotionBlock
from openpendant.server.programs.language.point_poses import pose_of
from openpendant.simplemsg.pendant.management.points import JointVector, PointPose, TeachPoint
from openpendant.simplemsg.pendant.management.statements import Move, Way

LEVEL = (0.0, 0.0, 0.0, 1.0)
IN_BASE = TeachPoint("a", (0.1,) * 6, PointPose((0.4, 0.0, 0.3), LEVEL, "base", "flange"))
ON_TABLE = TeachPoint("b", (0.2,) * 6, PointPose((0.1, 0.0, 0.0), LEVEL, "table", "flange"))
BARE = TeachPoint("c", (0.3,) * 6)
TABLE = Pose.from_values((1.0, 0.0, 0.0), LEVEL)


def to_base(pose: PointPose) -> Pose:
    there = pose_of(pose)
    return TABLE.compose(there) if pose.frame == "table" else there


def forward(joints: JointVector) -> Pose:
    return Pose.from_values((joints[0], 0.0, 0.0), LEVEL)


def block(way: Way, target: TeachPoint, *via: TeachPoint, zone: float = 0.0) -> MotionBlock:
    move = Move(way, target.name, tuple(point.name for point in via), zone=zone)
    return MotionBlock((BlockMove("p", 0, move, target, via),))


def test_a_point_of_the_robots_own_frame_goes_to_its_joints() -> None:
    (segment,) = segments_of(block(Way.PTP, IN_BASE, zone=0.2), to_base, forward)
    assert isinstance(segment, Ptp)
    assert (segment.target, segment.zone) == ((0.1,) * 6, 0.2)


def test_a_point_of_a_users_frame_goes_where_the_frame_is_now() -> None:
    (segment,) = segments_of(block(Way.LIN, ON_TABLE), to_base, forward)
    assert isinstance(segment, Lin)
    assert isinstance(segment.target, Pose)
    assert segment.target.position.tolist() == [1.1, 0.0, 0.0]


@pytest.mark.parametrize(("via", "x"), [(BARE, 0.3), (ON_TABLE, 1.1)])
def test_a_circle_goes_through_the_place_of_its_via_point(via: TeachPoint, x: float) -> None:
    (segment,) = segments_of(block(Way.CIRC, IN_BASE, via), to_base, forward)
    assert isinstance(segment, Circ)
    assert isinstance(segment.way, ThroughPoint)
    assert np.asarray(segment.way.via).tolist() == [x, 0.0, 0.0]


def test_a_spline_goes_through_all_its_points() -> None:
    (segment,) = segments_of(block(Way.SPLINE, IN_BASE, BARE, IN_BASE), to_base, forward)
    assert isinstance(segment, Spline)
    assert list(segment.targets) == [(0.3,) * 6, (0.1,) * 6, (0.1,) * 6]


def test_the_planner_takes_a_block_with_zones_as_one_path() -> None:
    kinematics = Kinematics(serial_robot("ur5"))
    start = (0.0, -math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2, 0.0)
    points = [TeachPoint(name, (angle, *start[1:])) for name, angle in [("a", 0.3), ("b", 0.6)]]
    moves = tuple(
        BlockMove("p", index, Move(Way.LIN, point.name, zone=zone), point)
        for index, (point, zone) in enumerate(zip(points, (0.02, 0.0), strict=True))
    )
    segments = segments_of(MotionBlock(moves), to_base, kinematics.forward)
    (path,) = plan_path(kinematics, start, segments)
    end = path.evaluate(np.array([path.length]))[0]
    assert end.ravel() == pytest.approx(points[1].joints, abs=1e-6)
