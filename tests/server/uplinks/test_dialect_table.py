from __future__ import annotations

from collections.abc import Sequence

import pytest
from rigs.cells.server_rig import ServerRig, ready

from openpendant.motion.trajectory.trajectory import Row
from openpendant.server import uplinks
from openpendant.server.events.effects import Effect, SendStop, SendToController
from openpendant.server.settings.cell_settings import ControllerLink
from openpendant.server.uplinks.generic import GenericUplink
from openpendant.server.uplinks.uplink import ControllerDialect
from openpendant.server.watchdog.watchdog_process import stop_target
from openpendant.simplemsg import HeaderOnly, JointTrajPtFull, Message, MsgType, ReplyCode

TOY_STOP = JointTrajPtFull(7, -4, 0, 0.0, *((0.0,) * 10,) * 3)
GOAL = (0.5, 0.5)


class ToyUplink(GenericUplink):
    """Numbers its points from 1,000 for robot 7, and stops it by a message of its own."""

    def point(self, number: int, row: Row, step: float, now: int) -> Message:
        point = super().point(number, row, step, now)
        assert isinstance(point, JointTrajPtFull)
        point.robot_id = 7
        point.sequence += 1_000
        return point

    def stop(self, now: int, *, is_sent: bool) -> Message:
        super().stop(now, is_sent=is_sent)
        return TOY_STOP


def _toy_uplink(link: ControllerLink, velocity_limits: Sequence[float]) -> ToyUplink:
    return ToyUplink(link, velocity_limits)


TOY = ControllerDialect(
    _toy_uplink, stop=TOY_STOP, stopped=HeaderOnly(MsgType.PING, reply_code=ReplyCode.SUCCESS)
)


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> ServerRig:
    monkeypatch.setitem(uplinks.DIALECTS, "generic", TOY)
    return ready(plans_at_once=False)


def _performed(rig: ServerRig) -> list[Effect]:
    return [item for _, item in rig.log]


def test_points_and_stops_of_a_cell_are_the_dialects(rig: ServerRig) -> None:
    pendant = rig.holder()
    pendant.path((0.1, 0.1), GOAL)
    rig.plan()
    rig.wait(20)
    points = [item.message for item in _performed(rig) if isinstance(item, SendToController)]
    assert points
    assert all(isinstance(each, JointTrajPtFull) and each.robot_id == 7 for each in points)
    pendant.stop()
    (stop,) = [item.message for item in _performed(rig) if isinstance(item, SendStop)]
    assert stop is TOY_STOP


def test_the_last_stop_of_a_cell_that_failed_is_the_dialects(rig: ServerRig) -> None:
    stop = rig.core.fail("ValueError: boom", rig.now)[0]
    assert isinstance(stop, SendStop)
    assert stop.message is TOY_STOP


def test_the_watchdog_stops_with_the_bytes_of_the_dialect(rig: ServerRig) -> None:
    target = stop_target(rig.settings)
    msg_type = int(MsgType.JOINT_TRAJ_PT_FULL).to_bytes(4, "little")
    assert bytes.fromhex(target.stop)[4:8] == msg_type
    assert bytes.fromhex(target.answer)[:4] == int(MsgType.PING).to_bytes(4, "little")
