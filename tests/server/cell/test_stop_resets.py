from __future__ import annotations

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.server_rig import ready
from rigs.motion.jog_pad import JogPad

from openpendant.motion.description.robot import serial_robot
from openpendant.simplemsg.pendant import Activity, State, Verdict
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


def test_while_the_state_says_stopping_a_reset_is_refused_and_from_idle_on_it_is_not() -> None:
    """So a pendant that stops and resets at once waits for a state."""
    cell = EmulatedCell()
    pendant = cell.pendant("hand", state_rate=100.0)
    pendant.take()
    assert pendant.move(*serial_robot("ur5").home_position[:5], 0.5) is V.ACCEPTED
    cell.wait(500)
    pendant.stop()
    seen = []
    for _ in range(100):
        cell.wait(10)
        seen.append((Activity(pendant.all(State)[-1].activity), pendant.reset()))
        if seen[-1][1] is V.ACCEPTED:
            break
    *before, last = seen
    assert set(before) == {(Activity.STOPPING, V.MOVING)}
    assert last == (Activity.IDLE, V.ACCEPTED)


@pytest.mark.parametrize(
    ("reason", "text"), [("tea", "software stop by pad: tea"), ("", "software stop by pad")]
)
def test_a_motion_that_is_refused_names_who_stopped_and_why_where_that_was_given(
    reason: str, text: str
) -> None:
    pad = JogPad(ready(modes={"initial": "manual_reduced"}))
    pad.squeeze()
    pad.pendant.stop(reason)
    assert pad.press(1.0, 0.0) is V.STOP_LATCHED
    assert pad.pendant.all(Verdict)[-1].text == text
