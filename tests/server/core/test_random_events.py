"""Random events to one cell: a stop leaves first, and after a fault of ours nothing but Close does.

The events are drawn with the messages of pendants and of a ROS-Industrial client, answers to what
was asked, and time that passes; what follows is not performed, so that the cell sees more disorder
than a network brings.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence

import pytest
from rigs.cells.server_rig import IDENTITY, LIMITS, MS, NoTool, ServerRig
from rigs.peers.server_clients import hello

from openpendant.server.core.cell_core import CellCore
from openpendant.server.events.effects import Ask, Backend, Close, Effect, SendStop
from openpendant.server.events.events import (
    TICK,
    Answered,
    ClientFailed,
    Closed,
    ControllerGarbled,
    ControllerReport,
    Event,
    Misdirected,
    Opened,
    PathChanged,
    Port,
    Received,
    Regranted,
    ShutDown,
    Skipped,
    StopReceived,
    WatchdogStopped,
)
from openpendant.server.planning.jobs import Job, JointPathJob
from openpendant.server.refusal import Refusal
from openpendant.server.settings.cell_settings import ControllerPath, make_settings
from openpendant.server.store.store_errors import NotFound
from openpendant.simplemsg import (
    Arrival,
    JointFeedback,
    JointTrajPt,
    Message,
    Ping,
    SpecialSequence,
    Status,
    accepted,
    joint_array,
)
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    JogBeat,
    JogSpace,
    JogStart,
    JointMove,
    Management,
    MotionControl,
    MotionControlAction,
    ProgramRun,
    ResetStop,
    RunKind,
    SetSpeed,
    SoftwareStop,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

SESSIONS = range(1, 6)
ROS = 5
NONE = joint_array(())
EVENTS = 60

_BODIES = (
    b'{"op": "programs.list"}',
    b'{"op": "frames.show"}',
    b'{"op": "jog.retreat"}',
    b'{"op": "programs.delete", "name": "a", "expected_revision": 1}',
    b"{",
)


def _message(chance: random.Random) -> Arrival:
    number = chance.randrange(1, 1_000_000)
    goal = joint_array([chance.uniform(-2.1, 2.1) for _ in LIMITS.names])
    rates = joint_array([chance.choice((-1.0, 0.0, 1.0)) for _ in LIMITS.names])
    makes: Sequence[Callable[[], Message]] = (
        lambda: hello("tester", chance.choice((0.0, 50.0))),
        Ping,
        AuthorityBeat,
        lambda: Authority(number, chance.choice(list(AuthorityAction))),
        lambda: JointMove(number, 1.0, len(LIMITS.names), goal),
        lambda: JogStart(number, number, 0, 100, JogSpace.JOINTS, "", len(LIMITS.names), rates),
        lambda: JogBeat(number, 1),
        lambda: SoftwareStop(number, "enough"),
        lambda: ResetStop(number),
        lambda: SetSpeed(number, chance.choice((0.0, 0.5, 1.0)), 0.0),
        lambda: MotionControl(number, chance.choice(list(MotionControlAction))),
        lambda: ProgramRun(number, RunKind.ALL, 0, 1, 0, 1.0, "a"),
        lambda: Management(number, chance.choice(_BODIES)),
    )
    return chance.choice(makes)()


class Disorder:
    """One cell, and events without sense or order.

    Attributes:
        core: the cell.
        stops: how often a stop left.
    """

    def __init__(self, seed: int) -> None:
        self.core = CellCore(make_settings({}, "test"), LIMITS, IDENTITY, NoTool())
        self.stops = 0
        self._chance = random.Random(seed)
        self._now = 1_000_000_000
        self._asked: list[Ask] = []
        for path in ControllerPath:
            self.handle(PathChanged(path, True))
        self.handle(self._feedback())
        self.handle(self._status())
        self.handle(Opened(1, Port.PENDANT, "127.0.0.1"))
        self.handle(Received(1, hello("tester", 0.0)))
        self.handle(Received(1, Authority(1, AuthorityAction.REQUEST)))

    def handle(self, event: Event) -> list[Effect]:
        is_repeated = self.core.cell.driving.activity is Activity.STOPPING and event is TICK
        out = self.core.handle(event, self._now)
        self._asked += [each for each in out if isinstance(each, Ask)]
        if any(isinstance(each, SendStop) for each in out):
            self.stops += 1
            # Said once more where the first one was not answered, it waits for its turn.
            assert isinstance(out[0], SendStop) or is_repeated, (event, out)
        return out

    def step(self) -> list[Effect]:
        # A freeze now and then.
        self._now += self._chance.choice((0, 1, 10, 10, 10, 500)) * MS
        return self.handle(self._event())

    def _event(self) -> Event:
        chance = self._chance
        session, path = chance.choice(SESSIONS), chance.choice(list(ControllerPath))
        port = Port.ROS_MOTION if session == ROS else Port.PENDANT
        makes: Sequence[Callable[[], Event]] = (
            lambda: TICK,
            lambda: TICK,
            self._feedback,
            self._status,
            self._reply,
            self._answer,
            lambda: Received(session, self._said(session)),
            lambda: Received(session, self._said(session)),
            lambda: Received(1, _message(chance)),
            lambda: Received(1, _message(chance)),
            lambda: self._stop(session),
            lambda: Opened(session, port, "127.0.0.1"),
            lambda: Closed(session),
            lambda: Misdirected(9, Refusal(V.UNKNOWN_CELL)),
            lambda: ClientFailed(session, "1-1"),
            lambda: Skipped((session, session)),
            lambda: Regranted(session),
            lambda: PathChanged(path, chance.random() < 0.7),
            lambda: ControllerGarbled(path, "no sense"),
            WatchdogStopped,
        )
        return chance.choice(makes)()

    def _said(self, session: int) -> Arrival:
        if session != ROS:
            return _message(self._chance)
        sequence = self._chance.choice((0, 1, 2, SpecialSequence.END, SpecialSequence.STOP))
        goal = joint_array([self._chance.uniform(-1.0, 1.0) for _ in LIMITS.names])
        return JointTrajPt(sequence=sequence, joints=goal, velocity=0.1, duration=1.0)

    def _stop(self, session: int) -> Event:
        if not self.core.may_stop(session):
            return TICK
        message: Message = SoftwareStop(1, "first")
        if session == ROS:
            message = JointTrajPt(
                sequence=SpecialSequence.STOP, joints=NONE, velocity=0.0, duration=0.0
            )
        return StopReceived(session, message)

    def _feedback(self) -> Event:
        at = joint_array([self._chance.choice((0.0, 0.0, 0.3)) for _ in LIMITS.names])
        message = JointFeedback(0, 15, self._now / 1e9, at, NONE, NONE)
        return ControllerReport(ControllerPath.STATE, message, 0)

    def _status(self) -> Event:
        moving = self._chance.randrange(2)
        error = self._chance.choice((0, 0, 0, 7))
        message = Status(
            drives_powered=1,
            e_stopped=0,
            error_code=error,
            in_error=int(error > 0),
            in_motion=moving,
            mode=2,
            motion_possible=1,
        )
        return ControllerReport(ControllerPath.STATE, message, 0)

    def _reply(self) -> Event:
        message = JointTrajPt(sequence=0, joints=NONE, velocity=0.1, duration=0.0)
        return ControllerReport(ControllerPath.MOTION, accepted(message), self._chance.randrange(3))

    def _answer(self) -> Event:
        asked = [each for each in self._asked if _answer_to(each) is not None]
        if not asked:
            return TICK
        ask = self._chance.choice(asked)
        return Answered(ask, _answer_to(ask))


def _answer_to(ask: Ask) -> object:
    if ask.backend is Backend.STORE:
        return NotFound("program", "a")
    question = ask.question
    if isinstance(question, JointPathJob):
        return ServerRig.plan_of(question)
    if isinstance(question, Job):
        return ServerRig.plan_of(question, Refusal(V.PLANNER_FAILED))
    return None


def _live(seed: int) -> int:
    cell = Disorder(seed)
    for _ in range(EVENTS):
        cell.step()
    out = cell.core.fail("ValueError: boom", 2_000_000_000)
    assert isinstance(out[0], SendStop)
    for _ in range(EVENTS // 4):
        assert all(isinstance(each, Close) for each in cell.step())
    assert cell.handle(ShutDown()) == []
    return cell.stops


def test_in_any_order_of_events_a_stop_leaves_first_and_a_failed_cell_only_closes() -> None:
    assert sum(map(_live, range(300))) > 300


@pytest.mark.soak
@pytest.mark.timeout(3_600)
def test_in_ten_thousand_orders_of_events_a_stop_leaves_first() -> None:
    assert sum(map(_live, range(300, 10_300))) > 10_000
