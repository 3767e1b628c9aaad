"""The ends of ranges where joints stand beyond them, and where they come faster than is asked."""

import math

import pytest
from rigs.motion.jogged_robots import UR5_BENT, model

from openpendant.motion.jog.jog_commands import LONGEST_STEP
from openpendant.motion.jog.joint_braking import JointLimitBraking

UR5 = model("ur5")
ENDS = JointLimitBraking(UR5, [0.5 * limit for limit in UR5.limits.velocity])


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
