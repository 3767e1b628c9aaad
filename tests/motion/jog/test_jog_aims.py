"""Changes of aim while a robot moves, releases, and what is told of them."""

import math
from itertools import pairwise

import numpy as np
import pytest
from rigs.data.example_counts import counts
from rigs.motion.jog_referee import Referee
from rigs.motion.jogged_robots import (
    FAST,
    REDUCED,
    UR5_BENT,
    model,
    random_place,
    random_press,
    robot,
)

from openpendant.motion.jog import JogCaps, Jogger, JogSlowdown, JointJog, ToolJog

ALONG_X, ALONG_Y = ToolJog((1.0, 0.0, 0.0)), ToolJog((0.0, 1.0, 0.0))
TURNING = JointJog((0.0, 0.0, 0.0, 0.0, 0.0, 1.0))


def referee(caps: JogCaps = REDUCED) -> Referee:
    return Referee(robot("ur5"), Jogger(model("ur5"), UR5_BENT, caps), reduced=caps.reduced)


def tool_speeds(watched: Referee) -> list[float]:
    places = [robot("ur5").forward(step.position).position for step in watched.steps]
    return [math.dist(a, b) / watched.dt for a, b in pairwise(places)]


def test_another_direction_is_bent_into_without_a_stop() -> None:
    watched = referee()
    watched.run(ALONG_X, 50)
    watched.run(ALONG_Y, 60)
    assert min(tool_speeds(watched)[40:]) > 0.1
    velocity = np.subtract(
        robot("ur5").forward(watched.steps[-1].position).position,
        robot("ur5").forward(watched.steps[-2].position).position,
    )
    assert velocity[1] / 0.01 == pytest.approx(0.25, rel=0.01)
    assert abs(velocity[0]) < 1e-6
    assert not watched.faults


def test_a_second_key_joins_without_a_stop() -> None:
    watched = referee()
    watched.run(ALONG_X, 50)
    watched.run(ToolJog((1.0, 0.0, 0.0), (0.0, 0.0, 0.5)), 60)
    assert min(tool_speeds(watched)[40:]) > 0.2
    assert not watched.faults


def test_a_reversal_comes_to_rest_first_and_keeps_the_line() -> None:
    watched = referee()
    watched.run(ALONG_X, 50)
    watched.run(ToolJog((-1.0, 0.0, 0.0)), 100)
    assert any(step.at_rest for step in watched.steps[51:])
    back = robot("ur5").forward(watched.position).position
    began = robot("ur5").forward(UR5_BENT).position
    assert np.abs(back - began)[1:].max() < 1e-5
    assert not watched.faults


@pytest.mark.parametrize("order", [(TURNING, ALONG_X), (ALONG_X, TURNING)])
def test_between_joints_and_tool_the_robot_rests(order: tuple[JointJog, ToolJog]) -> None:
    watched = referee()
    watched.run(order[0], 50)
    watched.run(order[1], 80)
    assert any(step.at_rest for step in watched.steps[51:])
    assert not watched.steps[-1].at_rest
    assert not watched.faults


def test_a_release_on_a_line_stays_on_it_and_stops_within_5_cm() -> None:
    watched = referee()
    moving = watched.run(ALONG_X, 50)
    rest = watched.rest(None)
    places = [robot("ur5").forward(q).position for q in (moving.position, rest.position)]
    assert np.abs((places[1] - places[0])[1:]).max() < 1e-5
    assert 0.0 < math.dist(*places) < 0.05
    assert not watched.faults


def test_less_override_brakes_on_the_line() -> None:
    watched = referee()
    watched.run(ALONG_X, 50)
    watched.jogger.limit(JogCaps(override=0.2))
    watched.run(ALONG_X, 40)
    speeds = tool_speeds(watched)
    assert speeds[-1] == pytest.approx(0.05, rel=1e-3)
    assert min(speeds[50:]) > 0.045
    assert not watched.faults


def test_reduced_speed_holds_from_the_stop_that_its_choice_makes() -> None:
    watched = referee(FAST)
    watched.run(ALONG_X, 40)
    watched.jogger.limit(JogCaps(tool_speed=1.0, rotation_speed=1.0))
    watched.run(ALONG_X, 60)
    watched.reduced = True
    watched.run(ALONG_X, 40)
    assert not watched.steps[-1].at_rest
    assert not watched.faults


def test_nothing_asked_is_rest() -> None:
    watched = referee()
    for target in (None, JointJog((0.0,) * 6), ToolJog()):
        step = watched.run(target, 3)
        assert step.at_rest
        assert step.cause is None
        assert step.position == UR5_BENT


def test_the_same_presses_give_the_same_set_points() -> None:
    runs = []
    for _ in range(2):
        watched = referee()
        for target in (ALONG_X, ALONG_Y, TURNING, None):
            watched.run(target, 25)
        runs.append([step.position for step in watched.steps])
    assert runs[0] == runs[1]


def test_a_rate_that_the_joints_cannot_keep_is_told_with_the_joint() -> None:
    start = [*robot("kuka_kr5_arc").home_position[:4], 0.25, 0.3]
    caps = JogCaps(tool_speed=5.0, rotation_speed=20.0, reduced=False)
    watched = Referee(
        robot("kuka_kr5_arc"), Jogger(model("kuka_kr5_arc"), start, caps), reduced=False
    )
    watched.run(ToolJog(angular=(0.0, 0.0, 1.0), axes=None), 80)
    told = [step.cause for step in watched.steps if step.reason is JogSlowdown.JOINT_SPEED]
    assert told
    assert told[0] is not None
    assert told[0].joint == 5
    assert told[0].value > told[0].limit
    assert not watched.faults


@pytest.mark.parametrize("count", counts(4, 80))
@pytest.mark.parametrize("name", ["abb_irb2400", "kuka_iiwa14", "fanuc_m410ib", "motoman_gp7"])
def test_promises_11_and_15_hold_whatever_is_asked_when(name: str, count: int) -> None:
    random = np.random.default_rng(11)
    dof = robot(name).limits.dof
    for number in range(count):
        caps = REDUCED if number % 2 else FAST
        dt = (0.004, 0.01, 0.02)[number % 3]
        jogger = Jogger(model(name), random_place(name, random), caps)
        watched = Referee(robot(name), jogger, dt, caps.reduced)
        for _ in range(8):
            target = None if random.random() < 0.15 else random_press(dof, random)
            watched.run(target, int(random.integers(1, 25)))
        watched.rest(None)
        assert not watched.faults
