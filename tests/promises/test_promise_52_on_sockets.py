"""Promise 52 on real sockets: how many points still reach a controller that reports wrongly."""

import asyncio

import pytest
from promises.promise_table import figure
from rigs.peers.server_clients import joints
from rigs.processes.app_on_loop import app_on_loop, said, until

from openpendant.controller_emulator.core.controller import EmulatedController
from openpendant.controller_emulator.core.state_reports import StateReports
from openpendant.controller_emulator.interpolation.segment import State
from openpendant.motion.description.robot import serial_robot
from openpendant.simplemsg import JointTrajPt, JointTrajPtFull, Message, Received, Status
from openpendant.simplemsg.pendant import Activity, Authority, AuthorityAction
from openpendant.simplemsg.verdicts import VerdictCode as V

pytestmark = pytest.mark.realtime

MOST_POINTS = figure(52, "points").count


class WrongReports:
    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.is_wrong = False
        self.has_told = False
        self.came: list[Received] = []  # after the first wrong report
        compose, handle = StateReports.round, EmulatedController.handle

        def composed(
            reports: StateReports, state: State, status: Status, seconds: float
        ) -> list[Message]:
            position, *rest = state
            if self.is_wrong:
                self.has_told = True
                position = (position[0] + 0.3, *position[1:])
            return compose(reports, (position, *rest), status, seconds)  # type: ignore[arg-type]

        def handled(
            controller: EmulatedController, link: int, message: Received, now: int
        ) -> list[tuple[int, Message]]:
            if self.has_told:
                self.came.append(message)
            return handle(controller, link, message, now)

        monkeypatch.setattr(StateReports, "round", composed)
        monkeypatch.setattr(EmulatedController, "handle", handled)


async def test_promise_52_at_most_ten_points_follow_a_report_beyond_a_tolerance(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wrong = WrongReports(monkeypatch)
    async with app_on_loop() as served:
        cell = served.app.cells[0].core.cell
        goal = [value + 1.0 for value in serial_robot("ur5").home_position]
        move = joints(*goal, speed=0.2)
        await served.visitor(begin=said(Authority(1, AuthorityAction.REQUEST), move))
        await until(lambda: cell.activity is Activity.MOVING, 2.0)
        await asyncio.sleep(0.5)
        assert cell.activity is Activity.MOVING
        wrong.is_wrong = True
        await until(lambda: cell.stop is not None, 1.0)
        await asyncio.sleep(0.1)
    assert cell.stop is not None
    assert cell.stop.code is V.LEFT_THE_PATH
    stops = [isinstance(message, JointTrajPt) for message in wrong.came]
    assert any(stops)
    points = [message for message in wrong.came if isinstance(message, JointTrajPtFull)]
    assert len(points) <= MOST_POINTS
    # None at all behind the stop.
    assert not any(isinstance(m, JointTrajPtFull) for m in wrong.came[stops.index(True) :])
