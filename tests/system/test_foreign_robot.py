"""Robots that no catalogue holds, used through the command by someone who has only a URDF."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from foreign_robots import FOREIGN

from openpendant.motion.certificate import certify
from openpendant.motion.mechanism import Mechanism, mechanism
from openpendant.motion.pose import Pose
from openpendant.motion.robot import serial_robot
from openpendant.motion.timing import time_path

pytestmark = pytest.mark.realtime

STEP = 1e-4
"""A jog step small enough that the tool goes straight [m]."""


def command(folder: Path, *arguments: str) -> str:
    run = subprocess.run(
        [sys.executable, "-m", "openpendant.tools", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return run.stdout


@pytest.mark.parametrize("name", FOREIGN)
def test_a_urdf_alone_makes_a_robot_that_all_commands_take(name: str, tmp_path: Path) -> None:
    foreign = FOREIGN[name]
    (tmp_path / f"{name}.urdf").write_text(foreign.urdf, "utf-8")
    told = command(tmp_path, "robots", "import", f"{name}.urdf", "--yes")
    assert f"wrote {name}.yaml: good" in told
    file = f"{name}.yaml"
    assert serial_robot(tmp_path / file).tool_link == foreign.tool

    joints = json.dumps(foreign.joints)
    pose = command(tmp_path, "robots", "fk", file, "--joints", joints)
    found = json.loads(command(tmp_path, "robots", "ik", file, "--pose", pose))
    assert found["position_error"] < 1e-5

    planned: dict[str, Any] = json.loads(
        command(tmp_path, "plan", "--robot", file, "--goal", joints, "--json", "-")
    )
    assert planned["position"][-1] == pytest.approx(foreign.joints)


@pytest.fixture(params=FOREIGN)
def arm(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Mechanism, list[float]]:
    foreign = FOREIGN[request.param]
    (tmp_path / "arm.urdf").write_text(foreign.urdf, "utf-8")
    command(tmp_path, "robots", "import", "arm.urdf", "--yes", "-o", "arm.yaml")
    return mechanism(serial_robot(tmp_path / "arm.yaml")), foreign.joints


def test_it_moves_from_point_to_point_in_lines_and_by_jog_steps(
    arm: tuple[Mechanism, list[float]],
) -> None:
    robot, joints = arm
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
