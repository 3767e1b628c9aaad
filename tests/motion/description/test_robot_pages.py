"""The specification page of each robot: RoboAnalyzer's table, DH frames, base frames, homes."""

import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from rigs.motion.loaded_robots import SERIAL, chain_values, load_robot, serial_robot
from rigs.motion.robot_families import one_of_each_family

from openpendant.motion.cli.robots import main
from openpendant.motion.description.robot import SerialRobot
from openpendant.motion.errors import BadArgument, WrongJointCount
from openpendant.motion.kinematics.dh import (
    dh_forward,
    dh_frames,
    vrm_angles,
    vrm_difference,
    vrm_forward,
    vrm_of,
)
from openpendant.motion.kinematics.pinocchio_model import model_map
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.robot_report.robot_check import check_robot, reach
from openpendant.motion.robot_report.robot_report import dh_frames_at_home, moving_at_home

Capture = pytest.CaptureFixture[str]

IN_THE_MODULE = tuple(name for name in SERIAL if serial_robot(name).vrm is not None)
COUPLED = tuple(name for name in SERIAL if serial_robot(name).coupling.state_factor)

# The tables whose published dimensions are not ours; the robot files' notes say which.
DIFFERENT = {"abb_irb1410", "abb_irb4400l30", "puma560", "fanuc_m410ib"}


def shown(capsys: Capture, *argv: str) -> Any:
    assert main(["show", *argv, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_the_module_has_seventeen_of_our_robots() -> None:
    assert len(IN_THE_MODULE) == 17


@pytest.mark.parametrize("name", IN_THE_MODULE)
def test_the_module_and_we_put_the_tool_at_the_same_place(name: str) -> None:
    found, stated = vrm_difference(serial_robot(name)), vrm_of(serial_robot(name)).fk_difference
    assert found.rotation < 1e-9
    assert found.position <= stated.position_m + 1e-9
    if name in DIFFERENT:
        assert found.position > 0.8 * stated.position_m
    else:
        assert stated.position_m == 0.0


@pytest.mark.parametrize("name", one_of_each_family(IN_THE_MODULE))
def test_show_vrm_prints_the_modules_own_rows_and_angles(capsys: Capture, name: str) -> None:
    assert main(["show", name, "--vrm"]) == 0
    page = capsys.readouterr().out
    robot = serial_robot(name)
    vrm = vrm_of(robot)
    assert vrm.name in page
    assert "apart at most" in page
    data = shown(capsys, name, "--vrm")["vrm"]
    moving = moving_at_home(robot)
    assert data["angles_at_home"] == [
        sign * value + offset
        for sign, value, offset in zip(vrm.map.sign, moving, vrm.map.offset, strict=True)
    ]
    for angle in data["angles_at_home"]:
        assert f"{math.degrees(angle):.2f}°" in page
    assert data["position_difference"] <= vrm.fk_difference.position_m + 1e-9


@pytest.mark.parametrize("name", IN_THE_MODULE)
def test_the_modules_home_has_the_modules_home_angles(name: str) -> None:
    vrm = vrm_of(serial_robot(name))
    at_home = vrm_angles(vrm, vrm.home_joints)
    turns = [(a - row.theta_home) / math.tau for a, row in zip(at_home, vrm.rows, strict=True)]
    assert turns == pytest.approx([round(turn) for turn in turns], abs=1e-6)


def test_a_robot_outside_the_module_has_no_such_rows(capsys: Capture) -> None:
    with pytest.raises(BadArgument, match="Virtual Robot Module"):
        vrm_of(serial_robot("ur5"))
    with pytest.raises(WrongJointCount):
        vrm_forward(vrm_of(serial_robot("puma560")), [0.0])
    for robot, option in (("ur5", "--vrm"), ("stewart_classroom", "--frames")):
        for form in ([], ["--json"]):
            assert main(["show", robot, option, *form]) != 0
            assert len(capsys.readouterr().err.splitlines()) == 1


@pytest.mark.parametrize("name", SERIAL)
def test_dh_frames_run_from_the_first_axis_to_the_tool(robot: SerialRobot) -> None:
    assert robot.dh is not None
    frames, moving = dh_frames_at_home(robot), moving_at_home(robot)
    assert len(frames) == len(robot.moving) + 1
    tool = frames[-1].compose(Pose.from_rpy(robot.dh.tool.xyz, robot.dh.tool.rpy))
    by_joints = Kinematics(robot).forward(robot.home_position, "root")
    assert tool.position_distance(by_joints) < 1e-9
    assert dh_forward(robot.dh, moving).position_distance(tool) < 1e-12


@pytest.mark.parametrize("name", one_of_each_family(SERIAL))
def test_show_frames_prints_the_dh_frames_at_home(capsys: Capture, name: str) -> None:
    frames = dh_frames_at_home(serial_robot(name))
    assert main(["show", name, "--frames"]) == 0
    page = capsys.readouterr().out
    assert "DH frames at home" in page
    assert "rad apart at most" in page
    for frame, data in zip(frames, shown(capsys, name, "--frames")["dh_frames"], strict=True):
        assert data["xyz"] == frame.position.tolist()


@pytest.mark.parametrize("name", SERIAL)
def test_each_dh_frame_has_its_z_along_the_next_joints_axis(robot: SerialRobot) -> None:
    assert robot.dh is not None
    kinematics = Kinematics(robot)
    frames = dh_frames(robot.dh, moving_at_home(robot))
    for joint, frame in zip(robot.moving, frames[:-1], strict=True):
        parent = kinematics.forward(robot.home_position, "root", joint.parent)
        place = parent.compose(Pose.from_rpy(joint.origin.xyz, joint.origin.rpy))
        axis = place.rotation @ np.array(joint.axis) / math.hypot(*joint.axis)
        assert frame.rotation[:, 2] == pytest.approx(axis, abs=1e-6)
        if not joint.prismatic:
            off = np.cross(frame.position - place.position, axis)
            assert float(np.linalg.norm(off)) < 1e-6


BASE_HEIGHTS = {"fanuc_m10ia", "fanuc_r1000ia", "fanuc_r2000ia", "fanuc_s430i", "motoman_gp7"}


@pytest.mark.parametrize("name", SERIAL)
def test_the_base_frame_is_the_one_its_maker_uses(name: str, robot: SerialRobot) -> None:
    _, _, z = robot.base_frame.xyz
    second = Kinematics(robot).forward(np.zeros(robot.dof), "root", robot.driven[1].parent)
    place = second.compose(Pose.from_rpy(robot.driven[1].origin.xyz, robot.driven[1].origin.rpy))
    # FANUC and Yaskawa count from the height of axis 2, Universal Robots turns by half a turn.
    assert z == pytest.approx(place.position[2] if name in BASE_HEIGHTS else 0.0)
    assert robot.base_frame.rpy == pytest.approx((0, 0, math.pi if name == "ur5" else 0))


@pytest.mark.parametrize("name", SERIAL)
def test_the_tool_is_clear_of_the_floor_at_home(name: str, kinematics: Kinematics) -> None:
    tool = kinematics.forward(kinematics.robot.home_position, "root").position
    assert tool[2] > 0.05
    assert math.hypot(tool[0], tool[1]) > 0.15 or name == "puma560"  # which stands upright


@pytest.mark.parametrize("name", [n for n in SERIAL if serial_robot(n).specs.reach_m])
def test_an_arm_reaches_as_far_as_its_specification_says(robot: SerialRobot) -> None:
    stated = robot.specs.reach_m
    assert stated is not None
    assert reach(Kinematics(robot)).nearest_to(stated) == pytest.approx(stated, rel=0.09)


@pytest.mark.parametrize("name", [*COUPLED, "ur5"])
def test_rates_and_accelerations_follow_the_coupling_of_positions(robot: SerialRobot) -> None:
    gain, _ = model_map(robot)
    random = np.random.default_rng(5)
    start, swing, pace = random.uniform(-0.3, 0.3, (3, robot.dof))

    def chain(t: float) -> np.ndarray:
        return np.array(chain_values(robot, (start + swing * np.sin(3.0 * pace * t)).tolist()))

    t, h = 0.7, 1e-3
    rate = swing * 3.0 * pace * np.cos(3.0 * pace * t)
    acceleration = -swing * (3.0 * pace) ** 2 * np.sin(3.0 * pace * t)
    before, here, after = (chain(t + s) for s in (-h, 0.0, h))
    assert (after - before) / (2 * h) == pytest.approx(gain @ rate, abs=1e-6)
    assert (after - 2 * here + before) / h**2 == pytest.approx(gain @ acceleration, abs=1e-6)
    driven = [robot.moving.index(joint) for joint in robot.driven]
    for derivative in (rate, acceleration):
        assert robot.to_model(derivative.tolist()) == pytest.approx((gain @ derivative)[driven])
        back = robot.to_controller(robot.to_model(derivative.tolist()))
        assert back == pytest.approx(derivative)


def spoiled(tmp_path: Path, name: str, **changes: Any) -> Path:
    content = load_robot(name).model_dump(mode="json", by_alias=True)
    path = tmp_path / f"{name}.yaml"
    path.write_text(yaml.safe_dump({**content, **changes}))
    return path


def test_check_finds_a_reach_that_is_not_the_arms(tmp_path: Path) -> None:
    report = check_robot(spoiled(tmp_path, "ur5", specs={"reach_m": 0.5}))
    assert any("reach: " in each and "accepted: 20% off" in each for each in report.problems)


def test_check_finds_links_that_touch_at_home(tmp_path: Path) -> None:
    folded = [0.0, -1.5, 2.9, 0.0, 0.0, 0.0]
    report = check_robot(spoiled(tmp_path, "ur5", home=folded))
    assert any("touch at home" in each for each in report.problems)


def test_check_finds_a_module_table_that_differs_more_than_it_says(tmp_path: Path) -> None:
    vrm = vrm_of(serial_robot("puma560")).model_dump(mode="json")
    vrm["fk_difference"]["position_m"] = 0.001
    report = check_robot(spoiled(tmp_path, "puma560", vrm=vrm))
    assert any(each.startswith("vrm: ") for each in report.problems)


def test_check_tells_what_it_compared() -> None:
    report = check_robot("fanuc_m410ib")
    told = " | ".join(report.remarks)
    for part in ("dh: ", "vrm: ", "reach: ", "self-collision: none at home", "home: ",
                 "joint_3-wrist follows from -0.61", "accelerations of 4 of 4"):  # fmt: skip
        assert part in told


def test_check_tells_of_a_follower_whose_own_limits_are_not_kept(tmp_path: Path) -> None:
    joints = load_robot("fanuc_m410ib").model_dump(mode="json", by_alias=True)["joints"]
    follower = next(each for each in joints if each.get("dependent"))
    follower["velocity"] = 0.25
    path = spoiled(tmp_path, "fanuc_m410ib", joints=joints)
    (told,) = (each for each in check_robot(path).remarks if f"{follower['name']} follows" in each)
    assert "rad and 0.25 rad/s, not watched" in told


def test_check_tells_a_share_of_less_than_one_per_cent() -> None:
    (told,) = (each for each in check_robot("ur5").remarks if "self-collision" in each)
    assert re.search(r"in \d+\.\d% of 200 random positions", told)
