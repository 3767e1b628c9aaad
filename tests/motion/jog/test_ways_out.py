"""What leads out of where a robot stands: keys of joints that were tried, and the way back."""

import numpy as np
import pytest
from rigs.motion.jogged_robots import FAST, model, robot
from rigs.motion.loaded_robots import load_robot
from rigs.motion.robot_families import FAMILIES

from openpendant.motion.description.robot import robot_names
from openpendant.motion.jog import (
    BASE_AXES,
    Jogger,
    JogSlowdown,
    JointJog,
    ToolJog,
    find_escapes,
    jog_model,
    leads_out,
)
from openpendant.motion.jog.escape_directions import escape_keys
from openpendant.motion.paths.mechanism import SerialMechanism, mechanism

LONGEST = 300  # ticks; the slowest joint takes two seconds for 0.6 rad
SERIAL = [name for name in robot_names() if isinstance(robot(name), SerialMechanism)]


def is_singular(name: str, place: list[float]) -> bool:
    return any(
        way.cause.reason is JogSlowdown.SINGULARITY for way in find_escapes(model(name), place)
    )


def leave(name: str, place: list[float]) -> int:
    """Hold the keys that are named until the robot is out; return how many they were."""
    rates = next(
        way.rates
        for way in find_escapes(model(name), place)
        if way.cause.reason is JogSlowdown.SINGULARITY
    )
    assert rates is not None, place
    jogger = Jogger(model(name), place, FAST)
    jogger.aim(JointJog(rates))
    for _ in range(LONGEST):
        jogger.step(0.01)
        if not is_singular(name, jogger.position):
            return sum(rate != 0.0 for rate in rates)
    raise AssertionError(f"{name} at {place} is not led out by {rates}")


def leave_several_singularities(name: str, places: int) -> None:
    """Some joints stand at zero, where wrists are straight, elbows stretched, and shoulders over.

    J23: the way out is checked, not only the fastest one for the first millimetre.
    """
    limits = robot(name).limits
    random = np.random.default_rng(23)
    left = 0
    for _ in range(places):
        zero = random.random(limits.dof) < 0.6
        place = np.where(zero, 0.0, random.uniform(limits.lower, limits.upper))
        place = np.clip(place, model(name).lower, model(name).upper)
        if is_singular(name, place.tolist()):
            leave(name, place.tolist())
            left += 1
    assert left


@pytest.mark.parametrize("name", [name for name in SERIAL if name in FAMILIES])
def test_the_named_keys_lead_out_of_several_singularities_at_once(name: str) -> None:
    leave_several_singularities(name, 6)


@pytest.mark.soak
@pytest.mark.parametrize("name", SERIAL)
def test_the_named_keys_lead_out_of_every_singularity_in_fifty_places(name: str) -> None:
    leave_several_singularities(name, 50)


def test_an_arm_that_is_stretched_with_a_straight_wrist_needs_two_keys_at_once() -> None:
    assert leave("ur5", [0.0] * 6) == 2
    assert leave("ur5", [0.3, -1.2, 1.4, -1.0, 0.0, 0.4]) == 1


def test_no_keys_are_named_where_three_do_not_lead_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("openpendant.motion.jog.escape_directions.FREE_CONDITION", 1.0)
    assert escape_keys(model("ur5"), [0.0] * 6) is None


@pytest.mark.parametrize(
    ("name", "place", "linear", "angular", "is_out"),
    [
        pytest.param(
            "abb_irb120",
            [-2.58224, -1.124909, -0.242095, -1.933377, 2.093394, 5.338864],
            (0.939, 0.515, 0.367),
            (-0.762, 0.0, 0.0),
            False,
            id="a limit that either direction comes nearer to",
        ),
        pytest.param(
            "abb_irb6650",
            [-1.901964, 2.409492, -0.032403, -4.101676, 0.411291, 1.143482],
            (0.0, 0.0, 0.0),
            (0.0, 0.0, 1.0),
            False,
            id="a condition number that falls, and soon rises again",
        ),
        pytest.param(
            "kawasaki_ra10n",
            [-0.158702, 1.38181, 0.092026, -3.689012, -2.446144, 4.874959],
            (0.0, 0.0, 0.0),
            (0.0, -1.0, 0.0),
            False,
            id="one that rises at the second step",
        ),
        pytest.param(
            "abb_irb120",
            [1.105472, 0.62326, -1.556257, -2.064685, -1.986123, 2.0756],
            (-1.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
            True,
            id="one that falls little and goes on falling",
        ),
        pytest.param(
            "fanuc_m10ia",
            [-1.56916, 2.292995, 2.386132, -2.532519, 0.430246, 0.872356],
            (0.0, 0.0, 0.0),
            (0.0, 0.0, 1.0),
            True,
            id="a deep one that falls at once",
        ),
        pytest.param(
            "fanuc_m10ia",
            [-1.56916, 2.292995, 2.386132, -2.532519, 0.430246, 0.872356],
            (0.0, 0.0, 0.0),
            (0.0, 0.0, 0.0),
            False,
            id="no direction at all",
        ),
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


def test_nothing_is_left_to_be_worked_out_by_whoever_asks_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """To recognise an arm's family takes longer than an event loop should."""
    fresh = mechanism(load_robot("ur5"))
    assert isinstance(fresh, SerialMechanism)
    built = jog_model(fresh)
    monkeypatch.delattr("openpendant.motion.kinematics.closed_form.closed_form_of")
    assert [way.singularity for way in find_escapes(built, [0.0] * 6)] == ["elbow"]
