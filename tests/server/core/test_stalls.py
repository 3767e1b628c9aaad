"""Server or emulator is not run for a time amid a motion (promise 55), exactly, on one clock."""

import asyncio
from collections import deque
from collections.abc import Callable
from random import Random
from typing import cast

import numpy as np
import pytest
from promises.promise_table import figure
from rigs.cells.expectations import expect, only
from rigs.cells.lagging_robot import TICK, LaggingRobot, TrackedDrive
from rigs.cells.program_cell import ProgramCell
from rigs.cells.robot_cell_situations import at_a_pad, codes
from rigs.cells.server_rig import MS
from rigs.cells.stalling_cell import StallingCell, Who
from rigs.clock.virtual_clock import VirtualLoop
from rigs.motion.jog_pad import EmulatedPad
from rigs.motion.simple_jogger import SimpleJogger
from rigs.peers.server_clients import Pendant
from rigs.processes.app_on_loop import app_on_loop, said, until

from openpendant.motion.description.limits import JointLimits
from openpendant.motion.jog import JogCaps, Jogger, JointJog
from openpendant.server.cell.execution.setpoint_sources import JogRows, Press
from openpendant.server.cell.execution.tracking import EMULATED
from openpendant.server.cell.execution.trajectory_execution import ActiveMotion
from openpendant.server.control import MotionKind
from openpendant.server.events.cell_events import MotionRequest
from openpendant.server.events.effects import SendStop
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerLink, ControllerPath, JogSettings
from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import Activity
from openpendant.simplemsg.verdicts import CATALOGUE
from openpendant.simplemsg.verdicts import VerdictCode as V


def joint_move(cell: StallingCell, pendant: Pendant) -> None:
    at = cell.position
    assert pendant.move(at[0] + 0.6, *at[1:], speed=0.4) is V.ACCEPTED


def planned_path(cell: StallingCell, pendant: Pendant) -> None:
    at = cell.position
    path = ((at[0] + 0.3, at[1] - 0.2, *at[2:]), (at[0] + 0.5, *at[1:]))
    assert pendant.path(*path, speed=0.3) is V.ACCEPTED


STALL = round(figure(55, "stall").ms)


def moving(
    motion: Callable[[StallingCell, Pendant], None] = joint_move,
) -> tuple[StallingCell, Pendant]:
    cell = StallingCell()
    pendant = cell.holder()
    motion(cell, pendant)
    return cell, pendant


def finished(cell: StallingCell, pendant: Pendant) -> list[V]:
    for _ in range(400):
        if cell.core.cell.activity is Activity.IDLE:
            break
        cell.wait(50)
    return codes(pendant)


@pytest.mark.parametrize("who", ["server", "emulator"])
@pytest.mark.parametrize("motion", [joint_move, planned_path])
@pytest.mark.parametrize("after", [50, 60, 300, 555, 900])
def test_promise_55_a_stall_of_200_ms_ends_no_planned_motion(
    who: Who, motion: Callable[[StallingCell, Pendant], None], after: int
) -> None:
    cell, pendant = moving(motion)
    cell.wait(after)
    cell.stall(who, STALL)
    assert finished(cell, pendant) == [V.ACCEPTED]
    assert cell.core.cell.stop is None
    events, counts = cell.controller.referee.events, cell.controller.referee.counts
    assert not events["under-runs"]
    assert not counts


def test_promise_55_planned_motions_leave_so_far_ahead_unless_told_otherwise() -> None:
    assert round(ControllerLink().planned_lead * 1e3) == figure(55, "lead").ms


@pytest.mark.parametrize("who", ["server", "emulator"])
def test_promise_55_nor_do_many_of_them_one_after_the_other(who: Who) -> None:
    cell, pendant = moving()
    for _ in range(8):
        cell.wait(100)
        cell.stall(who, STALL)
    assert finished(cell, pendant) == [V.ACCEPTED]
    assert not cell.controller.referee.events["under-runs"]


@pytest.mark.parametrize("who", ["server", "emulator"])
def test_the_robot_is_never_seen_to_jump(who: Who) -> None:
    cell, _ = moving()
    cell.wait(500)
    before = cell.position[0]
    cell.stall(who, STALL)
    # 0.4 of the speed limit of a UR5's first joint, 3.15 rad/s, for 0.2 s.
    assert 0.0 <= cell.position[0] - before <= 0.4 * cell.limits.velocity[0] * 0.2 + 1e-6


def test_promise_26_a_real_controller_is_stopped_for_within_such_a_stall() -> None:
    cell, pendant = moving()
    cell.core.cell.feedback.says_emulated = False
    cell.wait(300)
    cell.stall("server", STALL)
    assert codes(pendant) == [V.SERVER_LATE]
    assert cell.core.cell.stop is not None


def test_a_queue_that_the_server_left_dry_names_the_server() -> None:
    """Shorter than the watchdog waits for an emulated robot, longer than its points last."""
    cell, pendant = moving()
    cell.wait(300)
    cell.stall("server", 330)
    cell.wait(50)
    assert codes(pendant) == [V.SERVER_LATE]
    assert (cell.controller.referee.events["under-runs"], cell.core.cell.stop) == (1, None)
    assert "log" in CATALOGUE[V.SERVER_LATE].remedy


def test_an_under_run_while_the_server_ticked_is_the_controllers() -> None:
    """Its answers stay away: nobody may send more."""
    cell, pendant = moving()
    cell.wait(300)
    cell._awaited[ControllerPath.MOTION] = 0
    held: list[tuple[int, Message]] = []
    hear = cell._from_controller
    cell._from_controller = lambda outgoing: held.extend(outgoing)  # type: ignore[method-assign]
    cell.wait(400)
    cell._from_controller = hear  # type: ignore[method-assign]
    cell.wait(50)
    assert codes(pendant) == [V.CONTROLLER_STOPPED]


FREEZE_NS = 100 * MS
"""Late for the watchdog, and the last report of the controller is still fresh enough to start."""


def test_promise_26_a_plan_that_is_served_first_after_a_freeze_begins_no_motion() -> None:
    rig, pad = at_a_pad(plans_at_once=False)
    pad.pendant.path((0.5, 0.5), (1.0, 0.0))
    rig.now += FREEZE_NS
    assert isinstance(rig.plan()[0], SendStop)
    rig.wait(500)
    assert rig.points == []
    assert pad.pendant.verdicts()[-1][1] is V.SERVER_LATE


def test_promise_26_a_program_that_is_loaded_first_after_a_freeze_begins_no_motion() -> None:
    cell = ProgramCell(main="move PTP b\n")
    cell.core.cell.feedback.says_emulated = False
    cell.wait(10)
    cell.held = deque()
    cell.run()
    cell.now += FREEZE_NS
    before = len(cell.sent)
    cell.answer_all()
    assert cell.core.cell.stop is not None
    assert all(getattr(message, "sequence", None) == -4 for message in cell.sent[before:])
    assert cell.user.verdicts()[-1][1] is not V.ACCEPTED


HELLO_DEADLINE = 2.0
LATE_NS = 300_000_000
_SAME_TURN = 5e-10
"""A timer that is due so much earlier runs in the same turn of the loop, before the other [s]."""


@pytest.mark.virtual_clock
async def test_what_arrives_in_the_turn_of_a_late_tick_is_read_before_it() -> None:
    async with app_on_loop() as served:
        stranger = await served.visitor()
        await asyncio.sleep(HELLO_DEADLINE - 0.2)
        assert served.connections == 1
        loop = expect(VirtualLoop, asyncio.get_running_loop())

        def stand_still() -> None:
            stranger.send(said())
            loop._virtual.now_ns += LATE_NS

        loop.call_at(served.app._next_tick - _SAME_TURN, stand_still)
        await asyncio.sleep(1.0)
        assert served.connections == 1


@pytest.mark.virtual_clock
async def test_what_does_not_arrive_is_judged_by_the_late_tick() -> None:
    async with app_on_loop() as served:
        await served.visitor()
        await asyncio.sleep(HELLO_DEADLINE - 0.2)
        loop = expect(VirtualLoop, asyncio.get_running_loop())
        loop._virtual.now_ns += LATE_NS
        took = await until(lambda: served.connections == 0, 0.05)
        assert took <= 0.02


BEAT = 50
"""Between two beats [ms]; each stall lasts a whole number of them."""

ROUND = 0.015
"""Between two looks of the server, and of the controller, the robot goes on [s]."""


class HeldJog(EmulatedPad):
    """A key of the first joint, held however either end stalls."""

    def __init__(self, lead: float) -> None:
        self.stalling = StallingCell(jog={"lead": lead})
        super().__init__(self.stalling)
        self.most_ahead = 0.0
        self.hold_key()

    def hold_key(self) -> None:
        self.let_go()
        self.squeeze()
        self.cell.wait(50)
        assert self.press(0.15, 0.0, 0.0, 0.0, 0.0, 0.0, deadline=0.25) is V.ACCEPTED

    def keep(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, BEAT):
            self.hold(BEAT)
            self.most_ahead = max(self.most_ahead, self.ahead)

    def stall(self, who: Who, milliseconds: int) -> None:
        self.stalling.stall(who, milliseconds, (BEAT, self.touch))
        self.most_ahead = max(self.most_ahead, self.ahead)

    def touch(self) -> None:
        self.squeeze()
        self.beat()

    @property
    def ahead(self) -> float:
        """Return how much the controller has in stock, by where the robot is [s]."""
        # Of a second: far more than is ever ahead.
        newest = self.sent[-100:]
        times, places = zip(*((each.time, each.positions[0]) for each in newest), strict=True)
        return float(times[-1] - np.interp(self.cell.position[0], places, times))

    @property
    def is_held(self) -> bool:
        return self.cell.core.cell.activity is Activity.JOGGING


def stalls(jog: HeldJog, who: Who, lengths: list[int], between: int) -> None:
    jog.keep(300)
    for length in lengths:
        jog.stall(who, length)
        jog.keep(between)


@pytest.mark.parametrize("lead", [0.05, 0.1])
def test_twenty_stalls_of_an_emulator_end_no_jog(lead: float) -> None:
    chance = Random(55)
    jog = HeldJog(lead)
    stalls(jog, "emulator", [chance.choice((100, 150, 200)) for _ in range(20)], 300)
    assert (jog.is_held, codes(jog.pendant)) == (True, [])
    events = jog.cell.controller.referee.events
    assert (events["stalls"], events["under-runs"]) == (20, 0)


@pytest.mark.parametrize(("lead", "unseen"), [(0.05, 0.05), (0.1, 0.025)])
def test_and_the_controller_has_no_more_in_stock_than_the_lead(lead: float, unseen: float) -> None:
    """More only until it is seen that it stood still: 2.5 reports, or up to 100 ms in all."""
    jog = HeldJog(lead)
    stalls(jog, "emulator", [150] * 6, 300)
    assert jog.most_ahead <= lead + unseen + EMULATED["lag"] + ROUND
    assert lead - 0.02 <= jog.ahead <= lead + EMULATED["lag"] + ROUND


def test_twenty_stalls_of_the_server_within_the_lead_end_no_jog() -> None:
    jog = HeldJog(0.1)
    stalls(jog, "server", [50] * 20, 300)
    assert (jog.is_held, codes(jog.pendant)) == (True, [])


@pytest.mark.parametrize(("lead", "away"), [(0.05, 100), (0.1, 150), (0.1, 200)])
def test_a_longer_one_ends_it_names_the_server_and_latches_nothing(lead: float, away: int) -> None:
    """A jog has no more under way than its lead, so that the robot runs out of points."""
    jog = HeldJog(lead)
    jog.keep(300)
    jog.stall("server", away)
    jog.keep(300)
    assert (codes(jog.pendant), jog.cell.core.cell.stop) == ([V.SERVER_LATE], None)
    jog.hold_key()
    jog.keep(300)
    assert jog.is_held


def test_a_robot_that_stands_more_than_half_of_the_time_does_not_follow() -> None:
    jog = HeldJog(0.05)
    stalls(jog, "emulator", [round(figure(55, "stall").ms)] * 6, 50)
    assert codes(jog.pendant) == [V.NOT_FOLLOWING]
    assert jog.cell.now % (10 * MS) == 0


LIMITS = JointLimits(
    names=("first", "second"),
    lower=(-6.0, -6.0),
    upper=(6.0, 6.0),
    velocity=(1.0, 1.0),
    acceleration=(5.0, 5.0),
    prismatic=(False, False),
)
LINK = ControllerLink()
LEAD = JogSettings().lead
HOLD_NS = 60_000_000_000


class StandingRobot(LaggingRobot):
    stands_from: int | None = None

    def advance(self, now: int) -> None:
        super().advance(now if self.stands_from is None else min(now, self.stands_from))


def held_jog(lag: float) -> tuple[TrackedDrive, StandingRobot]:
    start = (0.0, 0.0)
    robot = StandingRobot(LIMITS, start, [lag, lag / 2], 0)
    drive = TrackedDrive(LIMITS, LINK, robot, chance=Random(1), is_prompt=True)
    press, target = Press(1, 1, HOLD_NS, drive.now), JointJog((0.5, 0.3))
    jogger = SimpleJogger(LIMITS, start, JogCaps(1.0, 1.0, 10.0, 1.0, False))
    jogger.aim(target)
    rows = JogRows(cast(Jogger, jogger), start, target, press)
    motion = ActiveMotion(MotionRequest(1, 1), MotionKind.JOG, 1)
    drive.perform(drive.driving.drive(motion, rows, LEAD, drive.now))
    return drive, robot


@pytest.mark.parametrize("lag", [0.0, 0.03, 0.05, LINK.lag])
def test_a_robot_that_lags_as_declared_is_jogged_at_the_usual_lead(lag: float) -> None:
    drive, robot = held_jog(lag)
    drive.run(3_000)
    assert drive.driving.is_driving
    assert robot.stock(drive.now) <= round(LEAD * 1e9) + TICK
    assert drive.ended == drive.alarms == []
    assert robot.waited == 0


def test_one_that_stands_does_not_follow_after_half_a_second() -> None:
    drive, robot = held_jog(0.0)
    drive.run(1_000)
    robot.stands_from = drive.now
    drive.run(490)
    assert drive.ended == []
    drive.run(30)
    assert only(Refusal, drive.ended).code is V.NOT_FOLLOWING
    assert robot.stock(drive.now) <= round((LEAD + LINK.lag) * 1e9) + TICK
