"""The page's plans, scene, numbers and tour: their tests in Node."""

import json
import random
from pathlib import Path
from typing import Any

import pytest
from rigs.processes.node_tests import run_node_test

from openpendant.motion.description.robot import SerialRobot, load_robot, robot_names
from openpendant.motion.robot_report.robot_report import robot_data
from openpendant.motion.robot_report.shapes_report import shapes_report


@pytest.mark.parametrize("name", ["planning", "scene", "tour"])
def test_their_tests_in_node_pass(name: str) -> None:
    run_node_test(name)


def _case(name: str) -> dict[str, Any] | None:
    robot = load_robot(name)
    if not isinstance(robot, SerialRobot) or robot.dh is None:
        return None
    limits = zip(robot.limits.lower, robot.limits.upper, strict=True)
    dice = random.Random(f"dh {name}")
    return {
        "name": name,
        "shapes": shapes_report(robot),
        "facts": robot_data(robot)["facts"],
        "joints": [dice.uniform(max(low, -3.0), min(high, 3.0)) for low, high in limits],
    }


def test_a_page_puts_dh_frames_where_the_chain_has_the_tool(tmp_path: Path) -> None:
    cases = [case for case in map(_case, robot_names()) if case is not None]
    assert len(cases) >= 15
    path = tmp_path / "cases.json"
    path.write_text(json.dumps(cases), "utf-8")
    run_node_test("numbers", DH_CASES=str(path))
