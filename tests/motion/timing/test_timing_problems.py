"""The suite of `timing_problems.yaml`: each problem gets a certified motion or a proper refusal."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from openpendant.motion import errors
from openpendant.motion.description.limits import JointLimits
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import certify
from openpendant.motion.trajectory.joint_curves import JointSpline
from openpendant.motion.trajectory.trajectory import Trajectory

Array = NDArray[np.float64]

SUITE: dict[str, Any] = yaml.safe_load(
    Path(__file__).with_name("timing_problems.yaml").read_text("utf-8")
)
PROBLEMS: dict[str, dict[str, Any]] = {problem["name"]: problem for problem in SUITE["problems"]}
CERTIFIED = [name for name, problem in PROBLEMS.items() if problem["answer"] == "certified"]
REFUSED = [name for name in PROBLEMS if name not in CERTIFIED]


def limits_of(problem: dict[str, Any]) -> JointLimits:
    values = SUITE["limits"] | problem.get("limits", {})
    return JointLimits(
        names=("joint_1", "joint_2"),
        prismatic=(False, False),
        **{field: (float(value),) * 2 for field, value in values.items()},
    )


def waypoints_of(problem: dict[str, Any]) -> Array | list[list[float]]:
    random = np.random.default_rng(11)
    if "cloud" in problem:
        count, noise = problem["cloud"]["count"], problem["cloud"]["noise"]
        return random.normal(0.0, 1.0, (count, 2)) * float(noise)
    if "recorded" in problem:
        count, noise = problem["recorded"]["count"], problem["recorded"]["noise"]
        phase = np.linspace(0.0, 1.0, count)[:, np.newaxis] * random.uniform(3.0, 9.0, 2)
        sweep: Array = np.sin(phase + random.uniform(0.0, 6.0, 2))
        return sweep + random.normal(0.0, 1.0, (count, 2)) * float(noise)
    given: list[list[float]] = problem["waypoints"]
    return given


def answer(problem: dict[str, Any]) -> Trajectory:
    limits = limits_of(problem)
    return time_path(JointSpline(waypoints_of(problem), limits), limits)


@pytest.mark.parametrize("name", CERTIFIED)
def test_the_problem_gets_a_certified_motion(name: str) -> None:
    problem = PROBLEMS[name]
    waypoints = np.array(waypoints_of(problem))
    trajectory = answer(problem)
    certify(trajectory, limits_of(problem), start=waypoints[0])
    assert np.array_equal(trajectory.position[[0, -1]], waypoints[[0, -1]])
    assert trajectory.duration <= problem.get("most", 3600.0)


@pytest.mark.parametrize("name", REFUSED)
def test_the_problem_is_refused_in_words(name: str) -> None:
    problem = PROBLEMS[name]
    with pytest.raises(getattr(errors, problem["answer"]), match=problem["words"]):
        answer(problem)
