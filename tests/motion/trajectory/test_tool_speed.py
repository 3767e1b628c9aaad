import json
import math

import numpy as np
import pytest
from rigs.motion.loaded_robots import arm

from openpendant.motion.errors import BadArgument, CertificateRefused, FrameUnknown
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.timing.parameterization import time_legs, time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointLine, JointSpline
from openpendant.motion.trajectory.point_speed import (
    REDUCED_SPEED,
    ToolSpeedLimit,
    elbow_link,
    link_point,
    reduced_speed,
    rotation_speed,
    tool_point,
)

ROBOTS = ("ur5", "abb_irb2400", "kuka_iiwa14", "rail_kr5_arc", "mitsubishi_rh6frh5520")


UR5 = arm("ur5")


def sweep(kinematics: Kinematics, count: int, seed: int = 3) -> JointSpline:
    random = np.random.default_rng(seed)
    middle, span = (kinematics.lower + kinematics.upper) / 2, kinematics.upper - kinematics.lower
    return JointSpline(middle + random.uniform(-0.2, 0.2, (count, kinematics.dof)) * span)


@pytest.mark.parametrize(
    ("name", "count"),
    [
        *((name, 2) for name in ROBOTS),
        ("abb_irb2400", 5),
        ("rail_kr5_arc", 3),
        *(
            pytest.param(name, count, marks=pytest.mark.soak)
            for name in ROBOTS
            for count in (4, 7, 20)
        ),
    ],
)
def test_tool_and_elbow_keep_250_mm_a_second_at_ten_times_density(name: str, count: int) -> None:
    kinematics = arm(name)
    points = reduced_speed(kinematics)

    path = sweep(kinematics, count)
    dense = time_path(path, kinematics.limits, tool_speed=points, sample_period=0.001)

    fastest = 0.0
    for point in points:
        ahead, behind = (
            point.position(dense.position + step * dense.velocity) for step in (1e-6, -1e-6)
        )
        speeds = np.linalg.norm(ahead - behind, axis=1) / 2e-6
        assert speeds.max() <= REDUCED_SPEED * (1.0 + 1e-6)
        fastest = max(fastest, float(speeds.max()))
    assert fastest > 0.95 * REDUCED_SPEED


def test_a_tool_that_turns_about_one_axis_takes_as_long_as_its_arc() -> None:
    start = np.array([0.0, -1.0, 1.0, 0.0, 1.0, 0.0])
    radius = math.hypot(*UR5.forward(start).position[:2])
    line = JointLine(start, start + np.eye(6)[0])
    slow = time_path(line, UR5.limits, tool_speed=reduced_speed(UR5))
    # Speeding up and slowing down add one ramp: the speed over the acceleration.
    rate = REDUCED_SPEED / radius
    ideal = 1.0 / rate + rate / UR5.limits.acceleration[0]
    assert slow.duration == pytest.approx(ideal, rel=0.02, abs=0.01)


def test_the_elbow_alone_may_set_the_pace() -> None:
    elbow = [point for point in reduced_speed(UR5) if point.name == "elbow"]
    path = sweep(UR5, 4)
    motion = time_path(path, UR5.limits, tool_speed=elbow)
    (found,) = certify(motion, UR5.limits, tool_speed=elbow).tool_speed
    assert 0.95 < found.ratio <= 1.0 + 1e-6


def test_the_speed_fraction_does_not_lower_the_tool_speed() -> None:
    path, points = sweep(UR5, 3), reduced_speed(UR5, 0.05)
    motions = (time_path(path, UR5.limits, speed=speed, tool_speed=points) for speed in (1.0, 0.5))
    full, half = (motion.duration for motion in motions)
    assert half == pytest.approx(full, rel=0.01)


def test_legs_keep_the_tool_speed_too() -> None:
    kinematics = arm("abb_irb2400")
    points = reduced_speed(kinematics)
    home = np.zeros(6)
    legs = [JointLine(home, home + 0.3), JointLine(home + 0.3, home)]
    whole = time_legs(legs, kinematics.limits, tool_speed=points)
    certify(whole, kinematics.limits, tool_speed=points)


def test_reduced_speed_watches_the_named_tool_and_the_elbow() -> None:
    tool, elbow = reduced_speed(UR5, tool=(0.0, 0.0, 0.3))
    here = UR5.forward([0.1] * 6)
    joints = np.full((1, 6), 0.1)
    assert tool.position(joints)[0] == pytest.approx(here.position + here.rotation[:, 2] * 0.3)
    forearm = UR5.forward([0.1] * 6, link=UR5.robot.driven[2].child)
    assert elbow.position(joints)[0] == pytest.approx(forearm.position)


@pytest.mark.parametrize(
    ("name", "joint"),
    [
        ("ur5", 3),
        ("abb_irb2400", 3),
        ("puma560", 3),
        ("kuka_iiwa14", 4),
        ("rail_kr5_arc", 4),
        ("mitsubishi_rh6frh5520", 2),
    ],
)
def test_the_elbow_is_where_upper_arm_and_forearm_meet(name: str, joint: int) -> None:
    kinematics = arm(name)
    assert elbow_link(kinematics) == kinematics.robot.driven[joint - 1].child


@pytest.mark.parametrize(
    ("points", "words", "limit"),
    [
        (reduced_speed(UR5), r"the tool has .* m/s", 0.25),
        ([rotation_speed(UR5, 0.1)], r"tool's turn has .* rad/s", 0.1),
    ],
    ids=["of the tool", "of its turn"],
)
def test_the_certificate_names_what_is_too_fast(
    points: list[ToolSpeedLimit], words: str, limit: float
) -> None:
    trajectory = time_path(sweep(UR5, 3), UR5.limits)
    with pytest.raises(CertificateRefused, match=words) as refused:
        certify(trajectory, UR5.limits, tool_speed=points)
    assert (refused.value.check, refused.value.limit) == ("tool speed", limit)


def test_the_certificate_of_tool_speed_is_plain_data() -> None:
    points = reduced_speed(UR5)
    trajectory = time_path(sweep(UR5, 3), UR5.limits, tool_speed=points)
    data = json.loads(json.dumps(certify(trajectory, UR5.limits, tool_speed=points).as_dict()))
    assert [point["point"] for point in data["tool_speed"]] == ["tool", "elbow"]
    assert set(data["tool_speed"][0]) == {"point", "limit", "ratio", "time"}


@pytest.mark.parametrize("name", ["ur5", "kuka_iiwa14"])
def test_the_tool_turns_no_faster_than_its_limit_and_about_as_fast(name: str) -> None:
    kinematics = arm(name)
    limits = [rotation_speed(kinematics, 0.4), *reduced_speed(kinematics)]

    trajectory = time_path(sweep(kinematics, 4), kinematics.limits, tool_speed=limits)

    found = certify(trajectory, kinematics.limits, tool_speed=limits).tool_speed
    assert max(point.ratio for point in found) > 0.95
    rows = zip(trajectory.position, trajectory.velocity, strict=True)
    turns = [np.linalg.norm((kinematics.jacobian(q) @ rate)[3:]) for q, rate in rows]
    assert max(turns) <= 0.4 * (1.0 + 1e-6)


def test_a_turn_about_one_axis_takes_as_long_as_its_angle() -> None:
    start = np.array([0.0, -1.0, 1.0, 0.0, 1.0, 0.0])
    limit = rotation_speed(UR5, 0.5)
    slow = time_path(JointLine(start, start + np.eye(6)[5]), UR5.limits, tool_speed=[limit])
    ramp = 0.5 / UR5.limits.acceleration[5]
    assert slow.duration == pytest.approx(1.0 / 0.5 + ramp, rel=0.02)


@pytest.mark.parametrize("limit", [0.0, -1.0, math.nan, math.inf])
def test_a_limit_that_is_no_speed_is_refused(limit: float) -> None:
    with pytest.raises(BadArgument, match="speed limit of the tool"):
        reduced_speed(UR5, limit)


def test_a_turn_tool_or_link_that_is_none_is_refused() -> None:
    with pytest.raises(BadArgument, match="more than 0 rad/s"):
        rotation_speed(UR5, 0.0)
    with pytest.raises(BadArgument, match="tool"):
        tool_point(UR5, (0.0, math.nan, 0.0))
    with pytest.raises(FrameUnknown):
        link_point(UR5, "nowhere")
