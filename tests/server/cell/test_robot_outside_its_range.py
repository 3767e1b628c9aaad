from __future__ import annotations

import pytest
from rigs.cells.server_rig import ServerRig, ready
from rigs.motion.jog_pad import JogPad

from openpendant.server.cell.interlocks import outside_limits
from openpendant.simplemsg.verdicts import VerdictCode as V


def standing(position: tuple[float, float], **modes: str) -> ServerRig:
    rig = ready(modes=modes)
    rig.controller.be_moved(position)
    rig.wait(20)
    return rig


@pytest.mark.parametrize("position", [(2.01, 0.0), (-2.01, 0.0), (0.0, 2.01), (0.0, -2.01)])
def test_each_end_of_each_joints_range_is_looked_at(position: tuple[float, float]) -> None:
    rig = standing(position)
    assert rig.holder().move(0.0, 0.0) is V.OUTSIDE_LIMITS
    refusal = outside_limits(rig.core.cell)
    assert refusal is not None
    joint = 0 if position[0] else 1
    assert (refusal.joint, refusal.limit) == (joint, 2.0 if position[joint] > 0 else -2.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_joint_that_rests_a_hair_beyond_its_range_is_not_outside(side: float) -> None:
    rig = standing((side * 2.0009, 0.0))
    assert outside_limits(rig.core.cell) is None


def test_where_a_controllers_own_selector_rules_only_a_jog_leads_out() -> None:
    rig = standing((2.05, 0.0), selector="controller")
    pad = JogPad(rig)
    assert pad.pendant.move(0.0, 0.0) is V.OUTSIDE_LIMITS
    assert pad.press(-1.0, 0.0) is V.ACCEPTED
