"""When a latched stop may be reset, and what a reset demands of whoever wants to move."""

from __future__ import annotations

from jog_pad import JogPad
from server_rig import ready

from openpendant.simplemsg.verdicts import VerdictCode as V


def test_a_stop_is_not_reset_while_somebody_else_moves_the_robot() -> None:
    rig = ready()
    pendant = rig.holder()
    pendant.stop()
    rig.wait(200)
    assert not rig.core.cell.is_busy
    rig.controller.be_moved((0.1, 0.0), (0.2, 0.0))
    rig.wait(20)
    assert pendant.reset() is V.MOVING
    rig.controller.be_moved((0.2, 0.0))
    rig.wait(500)
    assert pendant.reset() is V.ACCEPTED


def test_an_enabling_device_that_was_pressed_before_the_reset_does_not_enable_after_it() -> None:
    rig = ready(modes={"initial": "manual_reduced"})
    pad = JogPad(rig)
    pad.pendant.stop()
    pad.let_go()
    pad.squeeze()
    assert pad.pendant.reset() is V.ACCEPTED
    assert pad.press(1.0, 0.0) is V.NOT_ENABLED
    pad.let_go()
    pad.squeeze()
    assert pad.press(1.0, 0.0) is V.ACCEPTED
