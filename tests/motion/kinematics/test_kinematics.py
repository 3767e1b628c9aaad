import math
from collections.abc import Sequence
from functools import partial

import numpy as np
import pytest
from rigs.data.example_counts import counts
from rigs.motion.loaded_robots import SERIAL, arm, chain_values, serial_robot
from rigs.motion.nearness import assert_near, assert_same_pose

from openpendant.motion.description.robot import SerialRobot
from openpendant.motion.description.schema import DhTable
from openpendant.motion.errors import FrameUnknown, NotFinite, WrongJointCount
from openpendant.motion.kinematics.dh import dh_forward
from openpendant.motion.kinematics.pinocchio_model import model_map
from openpendant.motion.kinematics.revolutions import SNAP, JointRanges
from openpendant.motion.kinematics.serial import Kinematics, rotation_vector
from openpendant.motion.pose import Array, Pose

SAMPLES = 25


def positions(robot: SerialRobot, count: int = SAMPLES) -> Array:
    random = np.random.default_rng(20240)
    return random.uniform(robot.limits.lower, robot.limits.upper, (count, robot.dof))


def matrix(xyz: Sequence[float], rpy: Sequence[float]) -> Array:
    (sr, sp, sy), (cr, cp, cy) = np.sin(rpy), np.cos(rpy)
    result = np.eye(4)
    result[:3, :3] = (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )
    result[:3, 3] = xyz
    return result


def by_table(table: DhTable, values: Sequence[float]) -> Array:
    result = matrix(table.base.xyz, table.base.rpy)
    for row, value in zip(table.rows, values, strict=True):
        theta, d = row.theta_offset, row.d
        if row.variable == "theta":
            theta += value
        else:
            d += value
        turned = matrix((0, 0, d), (0, 0, theta)) @ matrix((row.a, 0, 0), (row.alpha, 0, 0))
        result = result @ turned
    return result @ matrix(table.tool.xyz, table.tool.rpy)


@pytest.mark.parametrize("count", counts(8, 250))
@pytest.mark.parametrize("name", SERIAL)
def test_forward_kinematics_agrees_with_the_files_dh_table(robot: SerialRobot, count: int) -> None:
    assert robot.dh is not None
    for position in positions(robot, count):
        values = chain_values(robot, position)
        expected = by_table(robot.dh, values)
        assert_near(arm(robot.name).forward(position, "root").to_matrix(), expected, 1e-09)
        assert_near(dh_forward(robot.dh, values).to_matrix(), expected, 1e-12)


@pytest.mark.parametrize("name", SERIAL)
def test_the_base_frame_is_where_the_file_says(robot: SerialRobot, kinematics: Kinematics) -> None:
    base = Pose.from_rpy(robot.base_frame.xyz, robot.base_frame.rpy)
    assert robot.base_frame.parent == robot.root_link
    for position in positions(robot, 3):
        in_base, in_root = (kinematics.forward(position, frame) for frame in ("base", "root"))
        assert_same_pose(base.compose(in_base), in_root)
        assert kinematics.to_base(in_root, "root").position_distance(in_base) < 1e-12


@pytest.mark.parametrize("count", counts(2, 50))
@pytest.mark.parametrize("frame", ["base", "root"])
@pytest.mark.parametrize("name", SERIAL)
def test_the_jacobian_agrees_with_finite_differences(
    robot: SerialRobot, kinematics: Kinematics, frame: str, count: int
) -> None:
    step = 1e-6
    for position in positions(robot, count):
        jacobian = kinematics.jacobian(position, frame)
        assert jacobian.shape == (6, robot.dof)
        for joint in range(robot.dof):
            before, after = position.copy(), position.copy()
            before[joint] -= step
            after[joint] += step
            start, end = kinematics.forward(before, frame), kinematics.forward(after, frame)
            turn = rotation_vector(end.rotation @ start.rotation.T)
            rate = np.concatenate((end.position - start.position, turn)) / (2.0 * step)
            assert_near(jacobian[:, joint], rate, 1e-07)


@pytest.mark.parametrize("name", ["ur5", "abb_irb2400", "fanuc_m410ib"])
def test_one_pass_gives_the_same_as_separate_calls_and_owns_its_arrays(
    robot: SerialRobot, kinematics: Kinematics
) -> None:
    first, second = positions(robot, 2)
    rotation, translation, jacobian = kinematics.linearise(first)
    kinematics.linearise(second)
    pose = kinematics.forward(first)
    assert_near(translation, pose.position, 1e-15)
    assert_near(rotation, pose.rotation, 1e-14)
    assert_near(jacobian, kinematics.jacobian(first), 1e-15)
    placed_rotation, placed_translation = kinematics.place(first)
    np.testing.assert_array_equal(placed_rotation, rotation)
    np.testing.assert_array_equal(placed_translation, translation)


def test_a_coupled_joint_3_follows_joint_2_on_the_chains_side() -> None:
    gain, offset = model_map(serial_robot("fanuc_m10ia"))
    expected = np.eye(6)
    expected[2, 1] = 1.0
    np.testing.assert_array_equal(gain, expected)
    assert not offset.any()


def test_the_levelling_rods_hold_the_palletisers_wrist_level() -> None:
    kinematics = arm("fanuc_m410ib")
    for position in positions(kinematics.robot):
        down = kinematics.forward(position).rotation[:, 2]
        assert_near(down, [0.0, 0.0, -1.0], 1e-12)


def test_only_whole_gains_let_a_joint_turn_round() -> None:
    assert arm("ur5").turning.all()
    assert arm("rail_kr5_arc").turning.tolist() == [False, *[True] * 6]
    palletiser = serial_robot("fanuc_m410ib")
    assert Kinematics(palletiser).turning.all()
    facts = palletiser.model_dump(by_alias=True)
    for term in facts["joints"][3]["dependent"]["terms"]:
        term["gain"] /= 2.0
    geared = Kinematics(SerialRobot.model_validate(facts))
    # Half a turn of the wrist by joint 2 itself, and half back by joint 3, which is coupled to it.
    assert geared.turning.tolist() == [True, True, False, True]


def test_a_link_other_than_the_tool_can_be_asked_for() -> None:
    kinematics = arm("ur5")
    robot, home = kinematics.robot, kinematics.robot.home_position
    root = kinematics.forward(home, "root", link=robot.root_link)
    assert root.position_distance(Pose.identity()) == 0.0
    tool = kinematics.forward(home, link=robot.tool_link)
    assert tool.position_distance(kinematics.forward(home)) == 0.0


@pytest.mark.parametrize("name", ["ur5", "abb_irb2400", "rail_kr5_arc"])
def test_many_places_are_those_of_single_calls(kinematics: Kinematics) -> None:
    joints = np.random.default_rng(3).uniform(-1.0, 1.0, (5, kinematics.dof))
    for link in (None, kinematics.robot.links[3]):
        places = kinematics.places(joints, link)
        for row, pose in enumerate(kinematics.forward(each, link=link) for each in joints):
            assert_near(places.rotation[row], pose.rotation, 1e-14)
            assert_near(places.position[row], pose.position, 1e-14)
    with pytest.raises(FrameUnknown):
        kinematics.places(joints, "nowhere")


def test_unknown_frames_and_links_are_refused_with_the_known_ones() -> None:
    kinematics, robot = arm("ur5"), serial_robot("ur5")
    with pytest.raises(FrameUnknown) as refused:
        kinematics.forward(robot.home_position, "world")
    assert refused.value.known == ("base", "root")
    with pytest.raises(FrameUnknown) as refused:
        kinematics.forward(robot.home_position, link="tool9")
    assert refused.value.known == robot.links
    with pytest.raises(FrameUnknown):
        kinematics.jacobian(robot.home_position, "world")


@pytest.mark.parametrize(
    "joints", [(), (0.0,) * 5, (0.0,) * 7, (0.0, 0.0, math.nan, 0.0, 0.0, 0.0)]
)
def test_malformed_joint_values_are_refused(joints: tuple[float, ...]) -> None:
    table = serial_robot("ur5").dh
    assert table is not None
    ur5, kind = arm("ur5"), NotFinite if len(joints) == 6 else WrongJointCount
    for ask in (ur5.forward, ur5.jacobian, partial(dh_forward, table)):
        with pytest.raises(kind) as refused:
            ask(joints)
        assert getattr(refused.value, "index", 2) == 2


def test_the_limits_of_the_kinematics_are_those_of_the_robot() -> None:
    kinematics, robot = arm("abb_irb2400"), serial_robot("abb_irb2400")
    assert kinematics.limits == robot.limits
    assert tuple(kinematics.lower) == robot.limits.lower
    with pytest.raises(ValueError, match="read-only"):
        kinematics.lower[0] = 0.0


@pytest.mark.parametrize("count", counts(4, 250))
@pytest.mark.parametrize("name", SERIAL)
def test_a_tools_motion_is_that_of_its_poses(kinematics: Kinematics, count: int) -> None:
    tcp = Pose.from_rpy((0.02, -0.05, 0.15), (2.9, 0.1, -1.4))
    for pose in (Pose.identity(), Pose.from_rpy((0.0, 0.0, 0.1), (0.0, 0.0, 0.0)), tcp):
        tool = kinematics.tool_frame(pose)
        is_flange = pose.rotation_distance(Pose.identity()) == 0.0 and not pose.position.any()
        assert (tool.placement is None) == is_flange
        for position in positions(kinematics.robot, count):
            velocity = 0.1 + 0.2 * np.abs(np.sin(position))
            (place, turn), speed = kinematics.tool_motion(position, velocity, tool)
            expected = kinematics.forward(position).compose(pose)
            assert np.abs(expected.position - place).max() < 1e-12
            assert np.abs(expected.quaternion - turn).max() < 1e-7
            assert np.linalg.norm(turn) == pytest.approx(1.0, abs=1e-14)
            ahead, behind = (
                kinematics.forward(position + step * velocity).compose(pose).position
                for step in (1e-6, -1e-6)
            )
            assert speed == pytest.approx(np.linalg.norm(ahead - behind) / 2e-6, abs=1e-7)


# Ranges of less than a turn, of exactly one, of several; coupled joints; a linear axis.
TURNING = ("puma560", "kuka_kr5_arc", "ur5", "fanuc_m10ia", "rail_kr5_arc")


@pytest.mark.parametrize("name", TURNING)
def test_the_nearest_turn_is_the_nearest_of_every_turn(kinematics: Kinematics) -> None:
    ranges, random = JointRanges(kinematics), np.random.default_rng(3)
    lower, upper = kinematics.lower, kinematics.upper
    for _ in range(200):
        seed = random.uniform(lower, upper).tolist()
        turns = 2.0 * math.pi * random.integers(-2, 3, kinematics.dof) * kinematics.turning
        position = (random.uniform(1.1 * lower, 1.1 * upper) + turns).tolist()
        nearest = ranges.nearest(position, seed)
        distances = [ranges.distance(each, seed) for each in ranges.every(position)]
        assert (nearest is None) == (not distances)
        if nearest is not None:
            assert nearest[0] == pytest.approx(min(distances))
            kinematics.limits.check_position(nearest[1])


@pytest.mark.parametrize("noise", [-0.5 * SNAP, 0.0, 0.5 * SNAP])
@pytest.mark.parametrize("turn", [-1, 0, 1])
def test_an_answer_on_a_bound_stays_there_in_spite_of_noise(noise: float, turn: int) -> None:
    kinematics = arm("ur5")
    ranges, seed = JointRanges(kinematics), kinematics.upper.tolist()
    position = [value + noise + turn * 2.0 * math.pi for value in seed]
    nearest = ranges.nearest(position, seed)
    assert nearest is not None
    assert_near(nearest[1], seed, SNAP)
    kinematics.limits.check_position(nearest[1])
