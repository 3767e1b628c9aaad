"""How long joints may go on before the end of a range matters, where that is none."""

from __future__ import annotations

import math

import pytest
from jogged_robots import UR5_BENT, model

from openpendant.motion.jog.range_ends import RangeEnds

UR5 = model("ur5")
ENDS = RangeEnds(UR5, [0.5 * limit for limit in UR5.limits.velocity])


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("rate", [0.3, -0.3])
def test_from_beyond_a_limit_no_way_is_free(side: float, rate: float) -> None:
    beyond = UR5.limits.upper[0] + 0.1 if side > 0.0 else UR5.limits.lower[0] - 0.1
    assert ENDS.free_way([beyond, *UR5_BENT[1:]], [rate, 0.0, 0.0, 0.0, 0.0, 0.0]) == 0.0


def test_joints_that_stand_may_do_so_for_ever() -> None:
    assert ENDS.free_way(UR5_BENT, [0.0] * 6) == math.inf
