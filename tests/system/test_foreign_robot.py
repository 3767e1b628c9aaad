import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rigs.data.foreign_robots import FEW_AXES, FOREIGN, Foreign
from rigs.motion.jog_referee import Referee

from openpendant.motion.cli.robots import main as robots
from openpendant.motion.description.robot import serial_robot
from openpendant.motion.jog import JogCaps, Jogger, JogSlowdown, JointJog, ToolJog, jog_model
from openpendant.motion.orientation import rotation_of_vector
from openpendant.motion.paths.mechanism import Mechanism, mechanism
from openpendant.motion.pose import Pose
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.tools.cli import main as openpendant

STEP = 1e-4
"""A step small enough that the tool goes straight [m]."""

EVERY = {**FOREIGN, **FEW_AXES}
TICKS = 40
"""How long a key is held: 0.4 s."""

Arm = tuple[Mechanism, Foreign]


def command(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    code = openpendant(arguments)
    told = capsys.readouterr()
    assert code == 0, told.err
    return told.out


@pytest.mark.parametrize("name", FOREIGN)
def test_a_urdf_alone_makes_a_robot_that_all_commands_take(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    foreign, file = FOREIGN[name], f"{name}.yaml"
    Path(f"{name}.urdf").write_text(foreign.urdf, "utf-8")
    told = command(capsys, "robots", "import", f"{name}.urdf", "--yes")
    assert f"wrote {file}: good" in told
    assert serial_robot(Path(file)).tool_link == foreign.tool

    joints = json.dumps(foreign.joints)
    pose = command(capsys, "robots", "fk", file, "--joints", joints)
    found = json.loads(command(capsys, "robots", "ik", file, "--pose", pose))
    assert found["position_error"] < 1e-5

    planned: dict[str, Any] = json.loads(
        command(capsys, "plan", "--robot", file, "--goal", joints, "--json", "-")
    )
    assert planned["position"][-1] == pytest.approx(foreign.joints)


@pytest.fixture(scope="module", params=EVERY)
def arm(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Arm:
    foreign, folder = EVERY[request.param], tmp_path_factory.mktemp("foreign")
    urdf, file = folder / "arm.urdf", folder / "arm.yaml"
    urdf.write_text(foreign.urdf, "utf-8")
    assert robots(["import", str(urdf), "--yes", "-o", str(file)]) == 0
    return mechanism(serial_robot(file)), foreign


def test_it_moves_from_point_to_point_in_lines_and_in_small_steps(arm: Arm) -> None:
    robot, foreign = arm
    joints = foreign.joints
    limits, home = robot.limits, robot.home_position
    there = time_path(robot.curve([home, joints]), limits)
    certify(there, limits, start=home)

    here = robot.forward(joints)
    target = Pose(here.position + np.array([0.0, 0.0, -0.05]), here.quaternion)
    line = time_path(robot.line(joints, target), limits)
    certify(line, limits, start=joints)
    assert robot.forward(line.final).position_distance(target) < 1e-4
    middle = robot.forward(line.position[len(line) // 2]).position
    assert middle[:2] == pytest.approx(here.position[:2], abs=1e-4)

    for direction in np.eye(3):
        stepped = Pose(here.position + STEP * direction, here.quaternion)
        found = robot.solve(stepped, joints).joint_position
        assert robot.forward(found).position_distance(stepped) < 1e-6
        assert float(np.abs(found - np.array(joints)).max()) < 100.0 * STEP


def test_each_joint_jogs_by_itself(arm: Arm) -> None:
    robot, foreign = arm
    model = jog_model(robot)
    for joint in range(robot.limits.dof):
        rates = [float(each == joint) for each in range(robot.limits.dof)]
        watched = Referee(robot, Jogger(model, foreign.joints, JogCaps()))
        step = watched.run(JointJog(tuple(rates)), TICKS)
        moved = np.array(step.position) - np.array(foreign.joints)
        assert moved[joint] > 0.01
        assert np.count_nonzero(moved) == 1


@pytest.mark.parametrize("key", "xyzABC")
def test_its_tool_jogs_along_and_about_the_axes_that_it_can_and_refuses_the_rest(
    arm: Arm, key: str
) -> None:
    robot, foreign = arm
    index = "xyzABC".index(key)
    axis = np.eye(3)[index % 3]
    jog = ToolJog(tuple(axis)) if index < 3 else ToolJog(angular=tuple(axis))
    watched = Referee(robot, Jogger(jog_model(robot), foreign.joints, JogCaps()))
    step = watched.run(jog, TICKS)
    if key not in foreign.keys:
        assert step.position == foreign.joints
        assert step.reason is JogSlowdown.DIRECTION
        assert step.retreat is None
        return
    began, now = robot.forward(foreign.joints), robot.forward(step.position)
    way, turn = now.position - began.position, began.rotation_distance(now)
    along = float(way @ axis) if index < 3 else 0.0
    about = turn if index >= 3 else 0.0
    assert along + about > 0.02
    assert way == pytest.approx(along * axis, abs=1e-5)
    expected = rotation_of_vector(about * axis) @ began.rotation
    assert now.rotation == pytest.approx(expected, abs=1e-5)
