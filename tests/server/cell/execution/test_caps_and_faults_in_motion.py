from __future__ import annotations

import pytest
from rigs.cells.server_rig import ServerRig, ready
from rigs.motion.jog_pad import JogPad

from openpendant.motion.trajectory.trajectory import Row
from openpendant.simplemsg import JointTrajPtFull
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import VerdictCode as V


def cruising() -> tuple[ServerRig, JogPad]:
    """Return a motion that was planned under a cap of 2 m/s and runs at full speed."""
    rig = ready(modes={"initial": "manual_high"}, controller={"lead": 0.09})
    pad = JogPad(rig)
    pad.squeeze()
    assert pad.speed(1.0, 2.0) is V.ACCEPTED
    assert pad.pendant.path((0.0, 0.5), (1.9, 1.9)) is V.ACCEPTED
    pad.hold(400)
    assert newest_speed(rig) == pytest.approx(2.0, rel=0.05)
    return rig, pad


def newest_speed(rig: ServerRig) -> float:
    point = rig.points[-1]
    assert isinstance(point, JointTrajPtFull)
    return max(abs(velocity) for velocity in point.velocities)


def test_a_lower_cap_slows_the_motion_in_proportion_and_a_higher_one_does_not_speed_it_up() -> None:
    rig, pad = cruising()
    assert pad.speed(1.0, 1.0) is V.ACCEPTED
    pad.hold(280)
    assert newest_speed(rig) == pytest.approx(1.0, rel=0.05)
    assert pad.speed(1.0, 4.0) is V.ACCEPTED
    pad.hold(100)
    assert 1.0 < newest_speed(rig) <= 2.0 * (1 + 1e-9)
    assert rig.activity() is Activity.MOVING


def test_a_fault_of_the_controller_that_is_gone_before_the_next_tick_ends_the_motion() -> None:
    rig, pad = cruising()
    rig.controller.e_stopped = True
    rig.report()
    assert len(rig.stops) == 1
    rig.controller.e_stopped = False
    rig.report()
    pad.hold(50)
    assert pad.pendant.outcomes()[-1][1] is V.CONTROLLER_STOPPED


def test_a_set_point_that_fails_the_last_look_does_not_leave_and_latches_a_protective_stop(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rig, pad = cruising()
    rows = rig.core.cell.motions.playing
    assert rows is not None
    take = rows.take

    def jump() -> Row:
        row = take()
        return row._replace(position=[value - 0.3 for value in row.position])

    monkeypatch.setattr(rows, "take", jump)
    sent = len(rig.points)
    pad.hold(20)
    assert len(rig.points) == sent
    stop = rig.core.cell.stop
    assert stop is not None
    assert stop.is_protective
    assert rig.stops
    assert pad.pendant.outcomes()[-1][1] is V.CERTIFICATE_REFUSED
