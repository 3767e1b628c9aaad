"""Promises 11 and 14: into limits and singularities, never beyond, and always out within 1 s."""

import numpy as np
import pytest
from promises.promise_table import figure
from rigs.motion.jog_referee import Referee
from rigs.motion.jogged_robots import (
    FAST,
    REDUCED,
    model,
    opposite,
    random_place,
    random_press,
    robot,
)
from rigs.motion.robot_families import FAMILIES

from openpendant.motion.description.robot import robot_names
from openpendant.motion.jog import JogCause, Jogger, JogSlowdown, JogTarget, JointJog

SPEEDS = {None, JogSlowdown.JOINT_SPEED, JogSlowdown.TOOL_SPEED, JogSlowdown.ELBOW_SPEED}

ONE_SECOND = round(100 * figure(14, "left").seconds)  # ticks


def jog_into(name: str, random: np.random.Generator) -> None:
    """Press one key until something holds the robot, then leave in every way that is suggested."""
    dof = robot(name).limits.dof
    target = random_press(dof, random, single=True)
    jogger = Jogger(model(name), random_place(name, random), FAST)
    watched = Referee(robot(name), jogger, reduced=False)
    held = watched.rest(target, 6000)
    assert not watched.faults
    assert held.cause is not None
    if held.cause.reason is JogSlowdown.DIRECTION:
        return
    assert held.retreat is not None
    ways: list[JogTarget] = []
    if held.retreat.joints is not None:
        ways.append(JointJog(held.retreat.joints))
    if held.retreat.reverse:
        ways.append(opposite(target))
    assert ways, held
    free = [is_free(name, held.position, way, held.cause) for way in ways]
    # What is suggested by joints always leads out; the way back may meet something else.
    assert free[0], (name, held)


def is_free(name: str, start: list[float], target: JogTarget, cause: JogCause) -> bool:
    """Return whether a press moves freely, or well away from a joint's limit, within a second."""
    jogger = Jogger(model(name), start, FAST)
    watched = Referee(robot(name), jogger, reduced=False)
    jogger.aim(target)
    for _ in range(ONE_SECOND):
        step = watched.tick()
        assert not watched.faults
        if not step.at_rest and step.reason in SPEEDS:
            return True
        if cause.joint >= 0:
            way = abs(step.position[cause.joint] - start[cause.joint])
            if way > 0.3 * model(name).margin[cause.joint]:
                return True
    return False


@pytest.mark.parametrize("name", robot_names())
def test_a_jog_into_anything_is_held_inside_and_left_within_a_second(name: str) -> None:
    random = np.random.default_rng([14, robot_names().index(name)])
    for _ in range(5 if name in FAMILIES else 1):
        jog_into(name, random)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("name", robot_names())
def test_ten_thousand_jogs_are_held_inside_and_left_within_a_second(name: str, seed: int) -> None:
    random = np.random.default_rng([14, seed])
    for _ in range(42):
        jog_into(name, random)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("name", robot_names())
def test_random_chains_of_presses_keep_every_limit(name: str, seed: int) -> None:
    random = np.random.default_rng([11, seed])
    dof = robot(name).limits.dof
    for number in range(40):
        caps = REDUCED if number % 2 else FAST
        dt = (0.004, 0.01, 0.02)[number % 3]
        jogger = Jogger(model(name), random_place(name, random), caps)
        watched = Referee(robot(name), jogger, dt, caps.reduced)
        for _ in range(6):
            target = None if random.random() < 0.15 else random_press(dof, random)
            watched.run(target, int(random.integers(1, round(1.0 / dt))))
        watched.rest(None)
        assert not watched.faults
