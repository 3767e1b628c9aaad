"""Forward kinematics of every serial robot against a product of exponentials.

Computed here from the robot files as they are read, with matrices alone: T = exp([S1] q1) ...
exp([Sn] qn) M (Lynch and Park, Modern Robotics, section 4.1). No model of the project takes part.
"""

import json
import math
from importlib.resources import files
from typing import Any, TypeAlias

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from openpendant.motion.cli.robots import main

Matrix: TypeAlias = NDArray[np.float64]

ROBOTS = files("openpendant.motion") / "robots"
SERIAL = sorted(
    file.name.removesuffix(".yaml")
    for file in ROBOTS.iterdir()
    if "\nkind: serial\n" in file.read_text("utf-8")
)


def facts_of(name: str) -> dict[str, Any]:
    facts: dict[str, Any] = yaml.safe_load((ROBOTS / f"{name}.yaml").read_text("utf-8"))
    assert (facts["name"], facts["kind"]) == (name, "serial")
    return facts


def about(axis: Matrix, angle: float) -> Matrix:
    """Return the rotation about a unit axis, by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: Matrix = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return turned


def placed(at: dict[str, Any]) -> Matrix:
    """Return the matrix of `xyz` and `rpy`: R = Rz Ry Rx."""
    roll, pitch, yaw = at["rpy"]
    x, y, z = np.eye(3)
    matrix = np.eye(4)
    matrix[:3, :3] = about(z, yaw) @ about(y, pitch) @ about(x, roll)
    matrix[:3, 3] = at["xyz"]
    return matrix


def exponential(axis: Matrix, point: Matrix, value: float, slides: bool) -> Matrix:
    """Return the motion of one joint, whose axis stands there at zero."""
    moved = np.eye(4)
    if slides:
        moved[:3, 3] = value * axis
    else:
        moved[:3, :3] = about(axis, value)
        moved[:3, 3] = point - moved[:3, :3] @ point
    return moved


def by_exponentials(facts: dict[str, Any], values: list[float]) -> Matrix:
    """Return the tool in base at the file's joint values of the driven joints."""
    moving = [joint for joint in facts["joints"] if joint["type"] != "fixed"]
    driven = [joint["name"] for joint in moving if "dependent" not in joint]
    known = dict(zip(driven, values, strict=True))
    at_zero, product = np.eye(4), np.eye(4)
    for joint in facts["joints"]:
        at_zero = at_zero @ placed(joint["origin"])
        if joint["type"] == "fixed":
            continue
        axis = at_zero[:3, :3] @ np.array(joint["axis"])
        rule = joint.get("dependent")
        value = known[joint["name"]] if rule is None else rule.get("offset", 0.0)
        for term in () if rule is None else rule["terms"]:
            value += term["gain"] * known[term["joint"]]
        slides = joint["type"] == "prismatic"
        unit = axis / np.linalg.norm(axis)
        product = product @ exponential(unit, at_zero[:3, 3], value, slides)
    in_root: Matrix = product @ at_zero
    found: Matrix = np.linalg.inv(placed(facts["base_frame"])) @ in_root
    return found


def positions(facts: dict[str, Any]) -> list[list[float]]:
    """Return home, zero and some positions anywhere."""
    count = len(facts["home"])
    random = np.random.default_rng(7)
    return [facts["home"], [0.0] * count, *random.uniform(-1.5, 1.5, (4, count)).tolist()]


def test_there_are_23_serial_robots() -> None:
    assert len(SERIAL) == 23


@pytest.mark.parametrize("name", SERIAL)
def test_robots_fk_is_a_product_of_exponentials_in_matrix_and_rpy(
    capsys: pytest.CaptureFixture[str], name: str
) -> None:
    facts = facts_of(name)
    for values in positions(facts):
        assert main(["fk", name, "--joints", json.dumps(values)]) == 0
        told = json.loads(capsys.readouterr().out)
        expected = by_exponentials(facts, values)
        assert np.array(told["matrix"]) == pytest.approx(expected, abs=1e-9)
        again = placed({"xyz": told["xyz"], "rpy": told["rpy"]})
        assert again == pytest.approx(expected, abs=1e-9)
        roll, pitch, yaw = told["rpy"]
        assert -math.pi < roll <= math.pi
        assert -math.pi / 2.0 <= pitch <= math.pi / 2.0
        assert -math.pi < yaw <= math.pi
        assert told["rpy_unique"] or roll == 0.0
