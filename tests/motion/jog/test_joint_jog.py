"""Joint jogs: several joints, the ends of their ranges, stops, reduced speed.

What a jog knows of its line for many ticks is no more than each tick would tell.
"""

import math
from unittest.mock import patch

import numpy as np
import pytest
from rigs.motion.jog_referee import Referee, cause_of, joints_out, referee
from rigs.motion.jogged_robots import FAST, REDUCED, UR5_BENT, model, random_place, robot
from rigs.motion.loaded_robots import arm
from rigs.motion.refusals import Refusal, refusals

from openpendant.motion.errors import BadArgument, NotFinite, WrongJointCount
from openpendant.motion.jog import (
    LONGEST_STEP,
    JogCaps,
    Jogger,
    JogModel,
    JogSetpoint,
    JogSlowdown,
    JogTarget,
    JointJog,
    joint_jog,
)
from openpendant.motion.jog.collision_guard import SLOW, CollisionGuard
from openpendant.motion.jog.joint_braking import JointLimitBraking
from openpendant.motion.jog.joint_line import JogLine
from openpendant.motion.scene.collision import CollisionModel

ONE = (1.0, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_one_joint_moves_and_the_others_stand() -> None:
    watched = referee("ur5", UR5_BENT, REDUCED)
    step = watched.run(JointJog(ONE), 100)
    assert step.position[0] > UR5_BENT[0] + 0.1
    assert step.position[1:] == UR5_BENT[1:]


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
        assert (cause_of(step).joint, cause_of(step).limit) == (joint, limits.upper[joint])


@pytest.mark.parametrize("ticks", [46, 50, 58, 70])
def test_a_tool_that_the_stop_itself_makes_faster_keeps_to_reduced_speed(ticks: int) -> None:
    # The fourth joint swings the tool outwards while it brakes; found by the chains of presses.
    watched = referee("abb_irb120", [2.756, -0.5427, -1.327, -2.4827, -2.0776, 5.0408], REDUCED)
    watched.run(JointJog((0.0, 0.15, 0.0, 1.0, 0.0, -0.05)), ticks)
    watched.rest(None)
    assert watched.fastest_point > 0.2


def test_the_other_joints_go_on_when_one_is_held() -> None:
    limits = robot("ur5").limits
    watched = referee("ur5", [limits.upper[0] - 0.05, *UR5_BENT[1:]], FAST)
    step = watched.run(JointJog((1.0, 0.0, 0.0, 0.0, 0.0, 1.0)), 80)
    assert step.velocity[0] == 0.0
    assert step.velocity[5] > 0.9 * limits.velocity[5]
    assert step.reason is JogSlowdown.JOINT_LIMIT


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


def test_a_release_near_the_end_of_a_range_stays_inside() -> None:
    limits = robot("ur5").limits
    for left in np.linspace(0.02, 1.0, 12).tolist():
        watched = referee("ur5", [limits.upper[0] - 1.2, *UR5_BENT[1:]], FAST)
        watched.jogger.aim(JointJog((1.0, 1.0, 0.0, 0.0, 0.0, 0.0)))
        while watched.position[0] < limits.upper[0] - left:
            if watched.tick().at_rest:
                break
        watched.rest(None)


def test_from_beyond_a_limit_the_way_leads_back_only() -> None:
    limits = robot("ur5").limits
    start = [limits.upper[0] + 0.2, *UR5_BENT[1:]]
    watched = referee("ur5", start, FAST)
    held = watched.run(JointJog(ONE), 20)
    assert held.at_rest
    assert held.position == start
    assert held.reason is JogSlowdown.JOINT_LIMIT
    assert joints_out(held) == (-1.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert watched.run(JointJog(joints_out(held)), 100).position[0] < limits.upper[0]


@pytest.mark.parametrize("name", ["ur5", "abb_irb120", "fanuc_m410ib", "kuka_iiwa14"])
def test_promise_12_tool_and_elbow_keep_to_250_mm_a_second(name: str) -> None:
    random = np.random.default_rng(12)
    dof = robot(name).limits.dof
    for _ in range(2):
        watched = referee(name, random_place(name, random), REDUCED)
        for _ in range(2):
            watched.run(JointJog(tuple(random.uniform(-1.0, 1.0, dof))), 60)
        watched.rest(None)
        assert watched.fastest_point > 0.2


@refusals(
    ("one rate", lambda: referee().jogger.aim(JointJog((1.0,))), WrongJointCount, ""),
    ("three joints", lambda: referee(start=UR5_BENT[:3]), WrongJointCount, ""),
    ("NaN to begin at", lambda: referee(start=[math.nan, *UR5_BENT[1:]]), NotFinite, ""),
    ("a rate of NaN", lambda: JointJog((math.nan,)), NotFinite, ""),
    ("a rate above 1", lambda: JointJog((1.5,)), BadArgument, "-1 to 1"),
    ("no time", lambda: referee().jogger.step(0.0), BadArgument, "dt"),
    ("time back", lambda: referee().jogger.step(-0.01), BadArgument, "dt"),
    ("a long time", lambda: referee().jogger.step(0.03), BadArgument, "dt"),
    ("no number of time", lambda: referee().jogger.step(math.nan), BadArgument, "dt"),
    ("no override", lambda: JogCaps(override=0.0), BadArgument, ""),
    ("above all joints' speed", lambda: JogCaps(joint_fraction=1.1), BadArgument, ""),
    ("no end of tool speed", lambda: JogCaps(tool_speed=math.inf), BadArgument, ""),
)
def test_a_malformed_joint_jog_is_refused(refusal: Refusal) -> None:
    refusal.check()


ALL = JointJog((0.6, -0.4, 0.5, 0.3, -0.7, 1.0))
SLOWLY = JogCaps(override=0.1, joint_fraction=0.5)
ROBOTS = ["ur5", "abb_irb120", "abb_irb4400l30", "kuka_iiwa14", "mitsubishi_rh6frh5520"]


def with_bodies(name: str) -> JogModel:
    return JogModel(arm(name), None, CollisionModel(arm(name)))


def jogged(jogger: Jogger, targets: list[JogTarget | None], ticks: int) -> list[JogSetpoint]:
    steps = []
    for target in targets:
        jogger.aim(target)
        steps += [jogger.step(0.01) for _ in range(ticks)]
    return steps


@pytest.mark.parametrize("name", ["ur5", "abb_irb4400l30", "kuka_iiwa14"])
def test_promise_16_no_body_comes_near_within_a_clear_way(name: str) -> None:
    kinematics, random = arm(name), np.random.default_rng(5)
    collision = CollisionModel(kinematics)
    guard, ways = CollisionGuard(CollisionModel(kinematics)), 0
    place = np.array(kinematics.robot.home_position)
    for _ in range(150):
        place = place + random.uniform(-0.05, 0.05, len(place))
        place = np.clip(place, kinematics.lower, kinematics.upper)
        distances = guard.look(place.tolist())
        if distances is not None and min(distances.values()) < SLOW:
            continue
        rates = random.uniform(-1.0, 1.0, len(place))
        way = min(guard.clear_distance(guard.closing(rates.tolist())), 10.0)
        assert way >= 0.0
        # What the sweep of every pair bounds, watched or not, is not spent.
        most = collision.sweep @ np.abs(collision.model_rates(rates))
        assert (collision.clearances(place) - way * most).min() >= SLOW - 1e-9
        ways += way > 0.001
        for share in (-1.0, -0.5, 0.3, 0.7, 1.0):
            assert collision.clearances(place + share * way * rates).min() >= SLOW - 1e-9
    assert ways > 20


@pytest.mark.parametrize("name", ROBOTS)
def test_no_end_of_a_range_matters_within_a_free_way(name: str) -> None:
    random, limits = np.random.default_rng(6), robot(name).limits
    ways = 0
    for _ in range(200):
        speeds = (random.uniform(0.05, 1.0) * np.array(limits.velocity)).tolist()
        ends, place = JointLimitBraking(model(name), speeds), random_place(name, random)
        shares = random.uniform(-1.0, 1.0, limits.dof) * (random.random(limits.dof) < 0.7)
        velocity = (random.uniform(0.1, 1.0) * shares * speeds).tolist()
        way = min(ends.free_distance(place, velocity), 5.0)
        ways += way > 0.1
        for time in random.uniform(0.0, 1.0, 5) * way if way > 0.0 else []:
            now, after = random.uniform(0.0, 1.0, 2)
            there = [q + time * v for q, v in zip(place, velocity, strict=True)]
            bounds = ends.bounds(LONGEST_STEP, there, [now * v for v in velocity])
            for each, (least, most, _) in zip(velocity, bounds, strict=True):
                assert least - 1e-12 <= after * each <= most + 1e-12
    assert ways > 20


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("caps", [SLOWLY, REDUCED, FAST], ids=["slowly", "reduced", "fast"])
def test_set_points_are_those_of_looking_at_every_tick(
    name: str, caps: JogCaps, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same where nothing limits the speed, as fast within a hundredth where points do."""
    random = np.random.default_rng(7)
    home, dof = robot(name).home_position, robot(name).limits.dof
    targets = [JointJog(tuple(random.uniform(-0.5, 0.5, dof))), None]
    found = jogged(Jogger(with_bodies(name), home, caps), [*targets], 40)
    monkeypatch.setattr(joint_jog, "line_from", lambda *_: None)
    wanted = jogged(Jogger(with_bodies(name), home, caps), [*targets], 40)
    if all(step.cause is None for step in wanted):
        assert [step.cause for step in found] == [None] * len(wanted)
        places, expected = ([step.position for step in steps] for steps in (found, wanted))
        assert np.abs(np.array(places) - expected).max() < 1e-12
    tops = [np.abs([step.velocity for step in steps]).max(axis=0) for steps in (found, wanted)]
    assert tops[0] == pytest.approx(tops[1], rel=0.01, abs=1e-4)


def test_a_jog_goes_along_a_line_after_its_first_tick() -> None:
    jogger = Jogger(with_bodies("ur5"), UR5_BENT, SLOWLY)
    with patch.object(JogLine, "advance", autospec=True, side_effect=JogLine.advance) as advance:
        jogged(jogger, [ALL], 100)
    assert advance.call_count == 99


@pytest.mark.parametrize("after", [1, 2, 7, 30])
def test_a_key_or_an_override_acts_in_the_very_next_tick(after: int) -> None:
    caps = JogCaps(joint_fraction=0.1, tool_speed=1.0, reduced=False)
    jogger = Jogger(with_bodies("ur5"), UR5_BENT, caps)
    [*_, moving] = jogged(jogger, [ALL], 30 + after)
    gain = [0.01 * each for each in robot("ur5").limits.acceleration]
    least = max(abs(v) / g for v, g in zip(moving.velocity, gain, strict=True))
    jogger.limit(JogCaps(override=0.01, joint_fraction=0.1, tool_speed=1.0, reduced=False))
    slower = jogger.step(0.01)
    assert slower.velocity == pytest.approx([(1.0 - 1.0 / least) * v for v in moving.velocity])
    jogger.aim(JointJog((0.0, 0.0, 0.0, 0.0, 0.0, -1.0)))
    turned = jogger.step(0.01)
    assert all(abs(v) < abs(w) for v, w in zip(turned.velocity, slower.velocity, strict=True))
    jogger.aim(None)
    steps = [jogger.step(0.01) for _ in range(math.ceil(least))]
    assert steps[-1].at_rest


def test_the_same_press_goes_on_from_where_a_release_led() -> None:
    """A line ends with its press: what was known of it is not of the next."""
    watched = referee()
    for _ in range(3):
        watched.run(ALL, 20)
        before = watched.velocity
        released = watched.run(None, 1)
        assert all(abs(v) < abs(w) for v, w in zip(released.velocity, before, strict=True))
        watched.run(None, 2)


def _chain_of_presses(name: str, seed: list[int], presses: int, ticks: int) -> None:
    """Jog joints by random keys, override and releases, and judge every tick of it."""
    random = np.random.default_rng(seed)
    start, collision = random_place(name, random), CollisionModel(arm(name))
    while collision.clearances(np.array(start)).min() < SLOW:
        start = random_place(name, random)
    fraction = float(random.choice((0.1, 0.3, 1.0)))
    jogger = Jogger(with_bodies(name), start, JogCaps(joint_fraction=fraction))
    dt = float(random.choice((0.004, 0.01, LONGEST_STEP)))
    watched = Referee(robot(name), jogger, dt, collision=collision)
    for _ in range(presses):
        rates = random.uniform(-1.0, 1.0, len(start)) * (random.random(len(start)) < 0.6)
        watched.run(None if random.random() < 0.1 else JointJog(tuple(rates)), ticks)
        if random.random() < 0.3:
            override = float(random.uniform(0.05, 1.0))
            jogger.limit(JogCaps(override=override, joint_fraction=fraction))
    watched.rest(None)


@pytest.mark.parametrize("name", ROBOTS)
def test_promise_12_chains_of_joint_presses_keep_to_all_bounds(name: str) -> None:
    _chain_of_presses(name, [12], 6, 25)


@pytest.mark.soak
@pytest.mark.parametrize("name", [*ROBOTS, "abb_irb2400", "fanuc_m410ib", "motoman_gp7"])
@pytest.mark.parametrize("block", range(4))
def test_promise_12_many_chains_of_joint_presses_keep_to_all_bounds(name: str, block: int) -> None:
    for seed in range(25):
        _chain_of_presses(name, [block, seed], 12, 60)
