"""Joint jogs: several joints, the ends of their ranges, stops, reduced speed."""

import math

import numpy as np
import pytest
from rigs.motion.jog_referee import Referee
from rigs.motion.jogged_robots import FAST, REDUCED, UR5_BENT, model, random_place, robot

from openpendant.motion.errors import BadArgument, NotFinite, WrongJointCount
from openpendant.motion.jog import LONGEST_STEP, JogCaps, Jogger, JogSlowdown, JointJog

ONE = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def referee(name: str, start: list[float], caps: JogCaps, dt: float = 0.01) -> Referee:
    return Referee(robot(name), Jogger(model(name), start, caps), dt, caps.reduced)


def test_one_joint_moves_and_the_others_stand() -> None:
    watched = referee("ur5", UR5_BENT, REDUCED)
    step = watched.run(JointJog(ONE), 100)
    assert step.position[0] > UR5_BENT[0] + 0.1
    assert step.position[1:] == UR5_BENT[1:]
    assert not watched.faults


def test_joints_reach_their_own_speeds_together() -> None:
    caps = JogCaps(override=0.5, joint_fraction=0.2, tool_speed=10.0, reduced=False)
    step = referee("ur5", UR5_BENT, caps).run(JointJog((1.0, -1.0, 0.5, 0.0, 0.0, -0.25)), 60)
    top = 0.1 * math.pi
    assert step.velocity == pytest.approx([top, -top, 0.5 * top, 0.0, 0.0, -0.25 * top], rel=1e-6)
    assert step.cause is None
    assert step.scale == 1.0


@pytest.mark.parametrize("name", ["ur5", "mitsubishi_rh6frh5520", "motoman_gp7"])
@pytest.mark.parametrize("dt", [0.01, LONGEST_STEP])
def test_a_joint_rests_just_before_the_end_of_its_range(name: str, dt: float) -> None:
    limits = robot(name).limits
    for joint in range(limits.dof):
        start = list(robot(name).home_position)
        rates = tuple(float(each == joint) for each in range(limits.dof))
        caps = JogCaps(joint_fraction=1.0, tool_speed=100.0, reduced=False)
        watched = referee(name, start, caps, dt)
        step = watched.rest(JointJog(rates), 8000)
        margin = model(name).margin[joint]
        assert 0.0 < limits.upper[joint] - step.position[joint] <= 0.011 * margin
        assert step.reason is JogSlowdown.JOINT_LIMIT
        assert step.cause is not None
        assert (step.cause.joint, step.cause.limit) == (joint, limits.upper[joint])
        assert not watched.faults


@pytest.mark.parametrize("ticks", [46, 50, 58, 70])
def test_a_tool_that_the_stop_itself_makes_faster_keeps_to_reduced_speed(ticks: int) -> None:
    # The fourth joint swings the tool outwards while it brakes; found by the chains of presses.
    watched = referee("abb_irb120", [2.756, -0.5427, -1.327, -2.4827, -2.0776, 5.0408], REDUCED)
    watched.run(JointJog((0.0, 0.15, 0.0, 1.0, 0.0, -0.05)), ticks)
    watched.rest(None)
    assert not watched.faults
    assert watched.fastest_point > 0.2


def test_the_other_joints_go_on_when_one_is_held() -> None:
    limits = robot("ur5").limits
    watched = referee("ur5", [limits.upper[0] - 0.05, *UR5_BENT[1:]], FAST)
    step = watched.run(JointJog((1.0, 0.0, 0.0, 0.0, 0.0, 1.0)), 80)
    assert step.velocity[0] == 0.0
    assert step.velocity[5] > 0.9 * limits.velocity[5]
    assert step.reason is JogSlowdown.JOINT_LIMIT
    assert not watched.faults


def test_a_joint_slows_within_its_margin_only() -> None:
    limits = robot("ur5").limits
    caps = JogCaps(joint_fraction=0.1, tool_speed=10.0, reduced=False)
    watched = referee("ur5", [limits.upper[0] - 0.5, *UR5_BENT[1:]], caps)
    watched.rest(JointJog(ONE))
    full = 0.1 * limits.velocity[0]
    for step in watched.steps[20:]:
        left = limits.upper[0] - step.position[0]
        if left > 0.11:
            assert step.velocity[0] == pytest.approx(full)
        elif left < 0.09:
            assert step.velocity[0] <= full * math.sqrt(left / 0.1) * 1.01


def test_a_release_keeps_the_direction_in_the_least_time() -> None:
    watched = referee("ur5", UR5_BENT, FAST)
    moving = watched.run(JointJog((0.2, -0.5, 0.1, 0.0, 0.9, 0.3)), 40)
    began = len(watched.steps)
    watched.rest(None)
    limits = robot("ur5").limits
    least = max(abs(v) / a for v, a in zip(moving.velocity, limits.acceleration, strict=True))
    assert len(watched.steps) - began == math.ceil(least / 0.01 - 1e-6)
    for step in watched.steps[began:-1]:
        shares = [v / m for v, m in zip(step.velocity, moving.velocity, strict=True) if m]
        assert max(shares) - min(shares) < 1e-9
    assert not watched.faults


def test_a_release_near_the_end_of_a_range_stays_inside() -> None:
    limits = robot("ur5").limits
    for left in np.linspace(0.02, 1.0, 12).tolist():
        watched = referee("ur5", [limits.upper[0] - 1.2, *UR5_BENT[1:]], FAST)
        watched.jogger.aim(JointJog((1.0, 1.0, 0.0, 0.0, 0.0, 0.0)))
        while watched.position[0] < limits.upper[0] - left and not watched.faults:
            if watched.tick().at_rest:
                break
        watched.rest(None)
        assert not watched.faults


def test_from_beyond_a_limit_the_way_leads_back_only() -> None:
    limits = robot("ur5").limits
    start = [limits.upper[0] + 0.2, *UR5_BENT[1:]]
    watched = referee("ur5", start, FAST)
    held = watched.run(JointJog(ONE), 20)
    assert held.at_rest
    assert held.position == start
    assert held.reason is JogSlowdown.JOINT_LIMIT
    assert held.retreat is not None
    assert held.retreat.joints == (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert watched.run(JointJog(held.retreat.joints), 100).position[0] < limits.upper[0]
    assert not watched.faults


@pytest.mark.parametrize("name", ["ur5", "abb_irb120", "fanuc_m410ib", "kuka_iiwa14"])
def test_promise_12_tool_and_elbow_keep_to_250_mm_a_second(name: str) -> None:
    random = np.random.default_rng(12)
    dof = robot(name).limits.dof
    for _ in range(2):
        watched = referee(name, random_place(name, random), REDUCED)
        for _ in range(2):
            watched.run(JointJog(tuple(random.uniform(-1.0, 1.0, dof))), 60)
        watched.rest(None)
        assert not watched.faults
        assert watched.fastest_point > 0.2


def test_what_is_malformed_is_refused() -> None:
    jogger = Jogger(model("ur5"), UR5_BENT, REDUCED)
    with pytest.raises(WrongJointCount):
        jogger.aim(JointJog((1.0,)))
    with pytest.raises(WrongJointCount):
        Jogger(model("ur5"), UR5_BENT[:3], REDUCED)
    with pytest.raises(NotFinite):
        Jogger(model("ur5"), [math.nan, *UR5_BENT[1:]], REDUCED)
    with pytest.raises(NotFinite):
        JointJog((math.nan,))
    with pytest.raises(BadArgument, match="-1 to 1"):
        JointJog((1.5,))
    for dt in (0.0, -0.01, 0.03, math.nan):
        with pytest.raises(BadArgument, match="dt"):
            jogger.step(dt)
    for caps in ({"override": 0.0}, {"joint_fraction": 1.1}, {"tool_speed": math.inf}):
        with pytest.raises(BadArgument):
            JogCaps(**caps)  # type: ignore[arg-type]  # a mapping of floats for floats
