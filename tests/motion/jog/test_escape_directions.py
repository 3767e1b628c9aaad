"""Promises 11 and 14: into limits and singularities, never beyond, and always out within 1 s.

What leads out of where a robot stands: keys of joints that were tried, and the way back.
"""

import numpy as np
import pytest
from promises.promise_table import figure
from rigs.data.example_counts import counts
from rigs.motion.jog_referee import referee
from rigs.motion.jogged_robots import (
    FAST,
    REDUCED,
    model,
    opposite,
    random_place,
    random_press,
    robot,
)
from rigs.motion.loaded_robots import SERIAL, load_robot
from rigs.motion.robot_families import FAMILIES, one_of_each_family

from openpendant.motion.description.robot import robot_names
from openpendant.motion.jog import (
    BASE_AXES,
    JogCause,
    Jogger,
    JogSlowdown,
    JogTarget,
    JointJog,
    ToolJog,
    find_escapes,
    jog_model,
    leads_out,
)
from openpendant.motion.jog.escape_directions import escape_keys
from openpendant.motion.paths.mechanism import SerialMechanism, mechanism

SPEEDS = {None, JogSlowdown.JOINT_SPEED, JogSlowdown.TOOL_SPEED, JogSlowdown.ELBOW_SPEED}

ONE_SECOND = round(100 * figure(14, "left").seconds)  # ticks


def jog_into(name: str, random: np.random.Generator) -> None:
    """Press one key until something holds the robot, then leave in every way that is suggested."""
    dof = robot(name).limits.dof
    target = random_press(dof, random, single=True)
    watched = referee(name, random_place(name, random), FAST)
    held = watched.rest(target, 6000)
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
    watched = referee(name, start, FAST)
    watched.jogger.aim(target)
    for _ in range(ONE_SECOND):
        step = watched.tick()
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
        watched = referee(name, random_place(name, random), caps, dt)
        for _ in range(6):
            target = None if random.random() < 0.15 else random_press(dof, random)
            watched.run(target, int(random.integers(1, round(1.0 / dt))))
        watched.rest(None)


LONGEST = 300  # ticks; the slowest joint takes two seconds for 0.6 rad


def is_singular(name: str, place: list[float]) -> bool:
    ways = find_escapes(model(name), place)
    return any(way.cause.reason is JogSlowdown.SINGULARITY for way in ways)


def leave(name: str, place: list[float]) -> int:
    """Hold the keys that are named until the robot is out; return how many they were."""
    ways = find_escapes(model(name), place)
    rates = next(way.rates for way in ways if way.cause.reason is JogSlowdown.SINGULARITY)
    assert rates is not None, place
    jogger = Jogger(model(name), place, FAST)
    jogger.aim(JointJog(rates))
    for _ in range(LONGEST):
        jogger.step(0.01)
        if not is_singular(name, jogger.position):
            return sum(rate != 0.0 for rate in rates)
    raise AssertionError(f"{name} at {place} is not led out by {rates}")


@pytest.mark.parametrize("count", counts(6, 50))
@pytest.mark.parametrize("name", one_of_each_family(SERIAL))
def test_the_named_keys_lead_out_of_several_singularities_at_once(name: str, count: int) -> None:
    """Some joints stand at zero, where wrists are straight, elbows stretched, and shoulders over.

    J23: the way out is checked, not only the fastest one for the first millimetre.
    """
    limits = robot(name).limits
    random = np.random.default_rng(23)
    left = 0
    for _ in range(count):
        zero = random.random(limits.dof) < 0.6
        place = np.where(zero, 0.0, random.uniform(limits.lower, limits.upper))
        place = np.clip(place, model(name).lower, model(name).upper)
        if is_singular(name, place.tolist()):
            leave(name, place.tolist())
            left += 1
    assert left


def test_an_arm_that_is_stretched_with_a_straight_wrist_needs_two_keys_at_once() -> None:
    assert leave("ur5", [0.0] * 6) == 2
    assert leave("ur5", [0.3, -1.2, 1.4, -1.0, 0.0, 0.4]) == 1


def test_no_keys_are_named_where_three_do_not_lead_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("openpendant.motion.jog.escape_directions.FREE_CONDITION", 1.0)
    assert escape_keys(model("ur5"), [0.0] * 6) is None


NONE = (0.0, 0.0, 0.0)
DEEP = [-1.56916, 2.292995, 2.386132, -2.532519, 0.430246, 0.872356]


@pytest.mark.parametrize(
    ("name", "place", "linear", "angular", "is_out"),
    [
        (
            *("abb_irb120", [-2.58224, -1.124909, -0.242095, -1.933377, 2.093394, 5.338864]),
            *((0.939, 0.515, 0.367), (-0.762, 0.0, 0.0), False),
        ),
        (
            *("abb_irb6650", [-1.901964, 2.409492, -0.032403, -4.101676, 0.411291, 1.143482]),
            *(NONE, (0.0, 0.0, 1.0), False),
        ),
        (
            *("kawasaki_ra10n", [-0.158702, 1.38181, 0.092026, -3.689012, -2.446144, 4.874959]),
            *(NONE, (0.0, -1.0, 0.0), False),
        ),
        (
            *("abb_irb120", [1.105472, 0.62326, -1.556257, -2.064685, -1.986123, 2.0756]),
            *((-1.0, 0.0, 0.0), NONE, True),
        ),
        ("fanuc_m10ia", DEEP, NONE, (0.0, 0.0, 1.0), True),
        ("fanuc_m10ia", DEEP, NONE, NONE, False),
    ],
    ids=[
        "a limit that either direction comes nearer to",
        "a condition number that falls, and soon rises again",
        "one that rises at the second step",
        "one that falls little and goes on falling",
        "a deep one that falls at once",
        "no direction at all",
    ],
)
def test_a_way_back_of_the_tool_is_told_only_if_it_leads_out(
    name: str,
    place: list[float],
    linear: tuple[float, float, float],
    angular: tuple[float, float, float],
    is_out: bool,
) -> None:
    assert leads_out(model(name), place, ToolJog(linear, angular, BASE_AXES)) is is_out


def test_nothing_is_left_to_work_out_for_who_asks_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """To recognise an arm's family takes longer than an event loop should."""
    fresh = mechanism(load_robot("ur5"))
    assert isinstance(fresh, SerialMechanism)
    built = jog_model(fresh)
    monkeypatch.delattr("openpendant.motion.kinematics.closed_form.closed_form_of")
    assert [way.singularity for way in find_escapes(built, [0.0] * 6)] == ["elbow"]
