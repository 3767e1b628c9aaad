"""How fast a joint may get before the ends of its range, and where it stands beyond them."""

import math

import pytest
from rigs.motion.jogged_robots import UR5_BENT, model

from openpendant.motion.jog.jog_commands import LONGEST_STEP
from openpendant.motion.jog.joint_braking import JointLimitBraking

UR5 = model("ur5")
SPEEDS = [0.5 * limit for limit in UR5.limits.velocity]
ENDS = JointLimitBraking(UR5, SPEEDS)


def test_far_from_all_ends_only_the_accelerations_bind() -> None:
    bounds = ENDS.bounds(0.01, UR5_BENT, [0.0] * UR5.dof)
    assert [bound[:2] for bound in bounds] == [(-math.inf, math.inf)] * UR5.dof
    gains = [0.01 * limit for limit in UR5.limits.acceleration]
    assert [bound[2] for bound in bounds] == pytest.approx(gains, rel=1e-5)


def test_only_the_joint_that_is_near_its_end_is_bound_and_only_towards_it() -> None:
    place = [*UR5_BENT[:2], UR5.upper[2] - 0.02, *UR5_BENT[3:]]
    bounds = ENDS.bounds(0.01, place, [0.0] * UR5.dof)
    least, most, _ = bounds[2]
    assert least == -math.inf
    assert 0.0 < most < SPEEDS[2]
    assert all(math.isinf(bound[1]) for bound in [*bounds[:2], *bounds[3:]])


@pytest.mark.parametrize("dt", [0.004, 0.01, LONGEST_STEP])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("speed", [0.3, 1.0, 1.5])
def test_a_joint_at_its_bound_rests_before_the_end(speed: float, side: float, dt: float) -> None:
    """However fast it comes: faster than is asked too, as after another override."""
    end = UR5.upper[0] if side > 0.0 else UR5.lower[0]
    place, velocity = list(UR5_BENT), [0.0] * UR5.dof
    velocity[0] = side * speed
    limit = UR5.limits.acceleration[0]
    place[0] = end - side * (speed * speed / (2.0 * 0.95 * limit) + speed * LONGEST_STEP)
    for _ in range(2000):
        least, most, gain = ENDS.bounds(dt, place, velocity)[0]
        after = min(most, velocity[0] + gain) if side > 0.0 else max(least, velocity[0] - gain)
        assert abs(after - velocity[0]) <= gain * (1.0 + 1e-9)
        place[0] += 0.5 * dt * (velocity[0] + after)
        velocity[0] = after
        assert side * (end - place[0]) >= 0.0
    assert velocity[0] == 0.0
    assert abs(end - place[0]) < 1e-3


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("rate", [0.3, -0.3])
def test_from_beyond_a_limit_no_way_is_free(side: float, rate: float) -> None:
    beyond = UR5.limits.upper[0] + 0.1 if side > 0.0 else UR5.limits.lower[0] - 0.1
    assert ENDS.free_distance([beyond, *UR5_BENT[1:]], [rate, 0.0, 0.0, 0.0, 0.0, 0.0]) == 0.0


def test_joints_that_stand_may_do_so_for_ever() -> None:
    assert ENDS.free_distance(UR5_BENT, [0.0] * 6) == math.inf


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_that_is_faster_than_is_asked_rests_before_the_end_too(side: float) -> None:
    """At 1.5 rad/s when 0.03 are asked: as after a smaller override."""
    slow = JointLimitBraking(UR5, [0.01 * limit for limit in UR5.limits.velocity])
    limit = UR5.limits.acceleration[0]
    end = UR5.upper[0] if side > 0.0 else UR5.lower[0]
    place, velocity = list(UR5_BENT), [side * 1.5, 0.0, 0.0, 0.0, 0.0, 0.0]
    place[0] = end - side * (1.5**2 / (2.0 * 0.95 * limit) + 1.5 * LONGEST_STEP)
    for _ in range(400):
        least, most, gain = slow.bounds(0.01, place, velocity)[0]
        wanted = min(max(side * 1.5, least), most)  # nobody brakes but for the end
        after = min(max(wanted, velocity[0] - gain), velocity[0] + gain)
        place[0] += 0.005 * (velocity[0] + after)
        velocity[0] = after
        assert side * (end - place[0]) >= 0.0
