from __future__ import annotations

from rigs.cells.server_rig import ready
from rigs.motion.jog_pad import JogPad

from openpendant.simplemsg.pendant import Activity, MotionControlAction
from openpendant.simplemsg.verdicts import VerdictCode as V


def test_who_lets_go_while_the_robot_still_brakes_for_a_pause_stops_it() -> None:
    rig = ready(modes={"initial": "manual_high"})
    pad = JogPad(rig)
    pad.squeeze()
    assert pad.pendant.move(1.5, 0.0) is V.ACCEPTED
    pad.hold(600)
    assert pad.control(MotionControlAction.PAUSE) is V.ACCEPTED
    pad.hold(30)
    assert rig.activity() is Activity.PAUSING
    pad.let_go()
    rig.wait(10)
    assert len(rig.stops) == 1
    assert pad.pendant.outcomes()[-1][1] is V.ENABLING_LOST
