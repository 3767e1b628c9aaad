"""How fast a joint may get before the ends of its range."""

import math

import pytest
from rigs.motion.jogged_robots import UR5_BENT, model

from openpendant.motion.jog.jog_commands import LONGEST_STEP
from openpendant.motion.jog.joint_braking import JointLimitBraking

UR5 = model("ur5")
SPEEDS = [0.5 * limit for limit in UR5.limits.velocity]


def test_far_from_all_ends_only_the_accelerations_bind() -> None:
    bounds = JointLimitBraking(UR5, SPEEDS).bounds(0.01, UR5_BENT, [0.0] * UR5.dof)
    assert [bound[:2] for bound in bounds] == [(-math.inf, math.inf)] * UR5.dof
    gains = [0.01 * limit for limit in UR5.limits.acceleration]
    assert [bound[2] for bound in bounds] == pytest.approx(gains, rel=1e-5)


def test_only_the_joint_that_is_near_its_end_is_bound_and_only_towards_it() -> None:
    place = [*UR5_BENT[:2], UR5.upper[2] - 0.02, *UR5_BENT[3:]]
    bounds = JointLimitBraking(UR5, SPEEDS).bounds(0.01, place, [0.0] * UR5.dof)
    least, most, _ = bounds[2]
    assert least == -math.inf
    assert 0.0 < most < SPEEDS[2]
    assert all(math.isinf(bound[1]) for bound in [*bounds[:2], *bounds[3:]])


@pytest.mark.parametrize("dt", [0.004, 0.01, LONGEST_STEP])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("speed", [0.3, 1.0, 1.5])
def test_a_joint_at_its_greatest_bound_rests_before_the_end(
    speed: float, side: float, dt: float
) -> None:
    """However fast it comes: faster than is asked too, as after another override."""
    ends = JointLimitBraking(UR5, SPEEDS)
    end = UR5.upper[0] if side > 0.0 else UR5.lower[0]
    place, velocity = list(UR5_BENT), [0.0] * UR5.dof
    velocity[0] = side * speed
    limit = UR5.limits.acceleration[0]
    place[0] = end - side * (speed * speed / (2.0 * 0.95 * limit) + speed * LONGEST_STEP)
    for _ in range(2000):
        least, most, gain = ends.bounds(dt, place, velocity)[0]
        after = min(most, velocity[0] + gain) if side > 0.0 else max(least, velocity[0] - gain)
        assert abs(after - velocity[0]) <= gain * (1.0 + 1e-9)
        place[0] += 0.5 * dt * (velocity[0] + after)
        velocity[0] = after
        assert side * (end - place[0]) >= 0.0
    assert velocity[0] == 0.0
    assert abs(end - place[0]) < 1e-3
