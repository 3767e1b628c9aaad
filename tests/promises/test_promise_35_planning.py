"""Promise 35: planning answers soon, in a process that is warm and idle."""

import time
from collections.abc import Callable

import numpy as np
import pytest
from promises.promise_figures import SLACK
from promises.promise_table import Figure, figure
from rigs.data.example_counts import counts

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.scene.scene import Box, Scene, SceneObject
from openpendant.server.planning.jobs import FreePath, JointPathJob, PlanJob, PoseGoal, PoseJob
from openpendant.server.planning.worker.job_planner import answer
from openpendant.simplemsg.pendant import Motion

pytestmark = pytest.mark.realtime

UR5 = Kinematics(serial_robot("ur5"))
HOME = serial_robot("ur5").home_position
MIDDLE = UR5.forward((HOME[0] + 0.6, *HOME[1:])).position.tolist()
PILLAR = Scene((SceneObject("pillar", Box((0.12, 0.12, 0.12)), tuple(MIDDLE)),))
BESIDE = Scene((SceneObject("box", Box((0.1, 0.1, 0.1)), (2.0, 2.0, 2.0)),))


def turn(number: int) -> float:
    """Return a turn that is another each time, to both sides, and never none."""
    return (1 if number % 2 else -1) * (0.1 + 0.2 * (number % 97) / 97)


def ptp(number: int) -> PlanJob:
    goal = tuple(value + turn(number) for value in HOME)
    return PlanJob(number, HOME, JointPathJob(0, HOME, (goal,), 0.5, 0.25), None, BESIDE)


def lin(number: int) -> PlanJob:
    here = UR5.forward(HOME)
    x, y, z = here.position.tolist()
    goal = PoseGoal((x, y, z - 0.02 - 0.001 * (number % 50)), tuple(here.quaternion.tolist()))
    motion = PoseJob(0, HOME, (goal,), "base", Motion.LIN, 0.5, 0.25)
    return PlanJob(number, HOME, motion, None, BESIDE)


def free(number: int) -> PlanJob:
    goal = (HOME[0] + 1.2, *HOME[1:])
    motion = FreePath(HOME, goal, "RRTConnect", number, 5.0, 0.005, 0.5)
    return PlanJob(number, HOME, motion, None, PILLAR)


def took(job: Callable[[int], PlanJob], trials: int) -> list[float]:
    """Return how long each plan took [ms]; the first warms up."""
    times = []
    for number in range(trials + 1):
        began = time.perf_counter()
        assert isinstance(answer("ur5", job(number)).result, tuple)
        times.append(1e3 * (time.perf_counter() - began))
    return times[1:]


def slack_of(promised: Figure, trials: int) -> float:
    return promised.ms * (1.0 if trials >= promised.trials else SLACK)


@pytest.mark.parametrize("trials", counts(20, 1_000))
@pytest.mark.parametrize("kind", [ptp, lin])
def test_promise_35_a_plan_in_a_straight_line_is_there_soon(
    kind: Callable[[int], PlanJob], trials: int
) -> None:
    promised = figure(35, "straight")
    assert np.percentile(took(kind, trials), 99) <= slack_of(promised, trials)


@pytest.mark.parametrize("trials", counts(20, 1_000))
def test_promise_35_so_is_one_around_a_pillar(trials: int) -> None:
    times = took(free, trials)
    assert np.median(times) <= slack_of(figure(35, "median"), trials)
    assert np.percentile(times, 99) <= slack_of(figure(35, "free"), trials)
