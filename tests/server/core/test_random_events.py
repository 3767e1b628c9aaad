"""Random events to one cell: a stop leaves first, and after a fault of ours nothing but Close does.

The events are drawn with the messages of pendants and of a ROS-Industrial client, answers to what
was asked, and time that passes; what follows is not performed, so that the cell sees more disorder
than a network brings.
"""

import random
from collections.abc import Callable, Sequence

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from rigs.cells.controller_reports import status
from rigs.cells.expectations import known
from rigs.cells.server_rig import IDENTITY, LIMITS, MS, NoTool, ServerRig
from rigs.data.example_counts import examples
from rigs.peers.scripted_controller import Fault
from rigs.peers.server_clients import Pendant, RosClient, hello

from openpendant.server.core.cell_core import CellCore
from openpendant.server.events.effects import (
    Ask,
    Backend,
    Close,
    Effect,
    SendStop,
    SendToController,
)
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
    ControllerMode,
    JointFeedback,
    JointTrajPt,
    JointTrajPtFull,
    Message,
    Ping,
    SpecialSequence,
    accepted,
    joint_array,
)
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    AuthorityChanged,
    JogBeat,
    JogSpace,
    JogStart,
    JointMove,
    Management,
    MotionControl,
    MotionControlAction,
    Outcome,
    OutcomeKind,
    ProgramRun,
    ResetStop,
    RunKind,
    SetSpeed,
    SoftwareStop,
    Verdict,
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
        message = status(moving=self._chance.randrange(2), error=self._chance.choice((0, 0, 0, 7)))
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


COORDINATE = st.sampled_from([-2.5, -2.0, -0.7, 0.0, 0.1, 1.3, 2.0])
WHO = st.integers(0, 2)
DEEDS: tuple[Callable[[Pendant], object], ...] = (
    *(Pendant.take, Pendant.stop, Pendant.reset),
    lambda pendant: pendant.send(AuthorityBeat()),
)


class WatchedRig(ServerRig):
    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        stopped = False
        for item in outgoing:
            stopped |= isinstance(item, SendStop)
            if isinstance(item, SendToController):
                assert not stopped, "a point left behind a stop"
                self._check(item.message)
        return super().perform(outgoing)

    def _check(self, point: object) -> None:
        assert isinstance(point, JointTrajPtFull)
        cell = self.core.cell
        assert cell.stop is None, "a point left while the stop is latched"
        assert cell.authority.is_held_by(known(cell.driving.request).session)
        LIMITS.check_position(point.positions[:2])
        assert all(abs(value) <= 2.0 * (1 + 1e-6) for value in point.velocities[:2])
        assert all(abs(value) <= 4.0 * (1 + 1e-3) for value in point.accelerations[:2])
        own = [p for p in self.points if p.sequence == point.sequence - 1]
        assert point.sequence == 0 or own, "a sample was left out"


class AnyOrder(RuleBasedStateMachine):
    def __init__(self) -> None:
        super().__init__()
        self.rig = WatchedRig(plans_at_once=False)
        self.rig.connect_controller()
        self.witness = self.rig.pendant("witness")
        self.pendants: list[Pendant | None] = [self.rig.pendant(f"p{i}") for i in range(3)]
        self.everybody: list[Pendant] = [p for p in self.pendants if p is not None]
        self.client: RosClient | None = None
        self.sequence = 0

    def pendant(self, who: int) -> Pendant:
        pendant = self.pendants[who]
        if pendant is None:
            pendant = self.pendants[who] = self.rig.pendant(f"again {who}")
            self.everybody.append(pendant)
        return pendant

    @rule(who=WHO, does=st.sampled_from(DEEDS))
    def do(self, who: int, does: Callable[[Pendant], object]) -> None:
        does(self.pendant(who))

    @rule(who=WHO)
    def release(self, who: int) -> None:
        pendant = self.pendant(who)
        before = self.rig.core.cell.authority.holder
        if pendant.release() is not V.ACCEPTED:
            assert self.rig.core.cell.authority.holder == before

    @rule(who=WHO)
    def close(self, who: int) -> None:
        pendant = self.pendants[who]
        if pendant is not None:
            self.pendants[who] = None
            before = self.rig.core.cell.authority.holder
            pendant.close()
            if before is not None and before.session != pendant.session:
                assert self.rig.core.cell.authority.holder == before

    @rule(who=WHO, one=COORDINATE, two=COORDINATE)
    def move(self, who: int, one: float, two: float) -> None:
        self.pendant(who).move(one, two)

    @rule(who=WHO, one=COORDINATE, two=COORDINATE)
    def path(self, who: int, one: float, two: float) -> None:
        self.pendant(who).path((0.1, 0.0), (one, two))

    @rule(who=WHO, planned=st.booleans(), ticks=st.integers(0, 30))
    def set_off(self, who: int, planned: bool, ticks: int) -> None:
        self.mend()
        pendant = self.pendant(who)
        pendant.take()
        pendant.reset()
        here = self.rig.controller.position
        goal = (here[0] + (0.8 if here[0] < 1 else -0.8), 0.0)
        if planned:
            pendant.path((here[0], 0.1), goal)
        else:
            pendant.move(*goal)
        self.rig.wait(10 * ticks)

    @precondition(lambda self: self.rig.jobs)
    @rule()
    def plan(self) -> None:
        self.rig.plan()

    @rule(one=COORDINATE, begins=st.booleans())
    def ros_point(self, one: float, begins: bool) -> None:
        if self.client is None:
            self.client = self.rig.ros()
        self.sequence = 0 if begins else self.sequence + 1
        self.client.point(self.sequence, one, 0.0)

    @precondition(lambda self: self.client is not None)
    @rule()
    def ros_stop(self) -> None:
        known(self.client).stop()

    @precondition(lambda self: self.client is not None)
    @rule()
    def ros_close(self) -> None:
        known(self.client).close()
        self.client = None

    @rule(ticks=st.sampled_from([1, 3, 15, 40, 200]))
    def time(self, ticks: int) -> None:
        self.rig.wait(10 * ticks)

    @rule(fault=st.sampled_from(Fault), index=st.sampled_from([0, 1, 7, 40]))
    def fault(self, fault: Fault, index: int) -> None:
        self.rig.controller.faults = {index: fault}

    @rule(path=st.sampled_from(ControllerPath), up=st.booleans())
    def link(self, path: ControllerPath, up: bool) -> None:
        self.rig.path(path, up)

    @rule()
    def mend(self) -> None:
        controller = self.rig.controller
        controller.faults = {}
        controller.reports, controller.coasts, controller.e_stopped = True, False, False
        controller.mode = ControllerMode.AUTO
        for path in ControllerPath:
            self.rig.path(path, True)
        self.rig.wait(20)

    @rule(reports=st.booleans(), coasts=st.booleans(), e_stopped=st.booleans())
    def spoil(self, reports: bool, coasts: bool, e_stopped: bool) -> None:
        controller = self.rig.controller
        controller.reports, controller.coasts, controller.e_stopped = reports, coasts, e_stopped

    @rule(mode=st.sampled_from(ControllerMode))
    def mode(self, mode: ControllerMode) -> None:
        self.rig.controller.mode = mode

    @invariant()
    def a_request_has_one_verdict_and_one_outcome_if_it_was_accepted(self) -> None:
        for pendant in self.everybody:
            verdicts = [message.request_id for message in pendant.all(Verdict)]
            assert len(verdicts) == len(set(verdicts))
            begun = {m.request_id for m in pendant.all(Verdict) if m.code == V.ACCEPTED}
            outcomes = [message.request_id for message in pendant.all(Outcome)]
            assert len(outcomes) == len(set(outcomes))
            assert set(outcomes) <= begun

    @invariant()
    def the_story_of_the_authority_has_one_holder_at_a_time(self) -> None:
        holder = 0
        for change in self.witness.all(AuthorityChanged):
            assert (holder == 0) != (change.holder == 0)
            holder = change.holder
        holder_now = self.rig.core.cell.authority.holder
        closed = {p.session for p in self.everybody if p not in self.pendants}
        assert holder == (0 if holder_now is None else holder_now.session)
        assert holder not in closed

    @invariant()
    def what_moves_is_the_holders(self) -> None:
        cell = self.rig.core.cell
        if cell.activity in (Activity.MOVING, Activity.PLANNING):
            assert cell.stop is None
            assert cell.authority.is_held_by(known(cell.driving.request).session)

    @invariant()
    def at_most_one_point_waits_for_its_answer(self) -> None:
        sent = [t for t, i in self.rig.log if isinstance(i, SendToController)]
        assert len(sent) == len(self.rig.points) or not self.rig.controller.awaited
        fault = set(self.rig.controller.faults.values()) & {Fault.SILENT, Fault.LATE}
        assert self.rig.controller.awaited <= 1 or fault or self.rig.stops

    def teardown(self) -> None:
        self.mend()
        if self.client is not None:
            self.client.close()
        for who in range(3):
            self.pendant(who).release()
        self.rig.controller.stop(self.rig.now)
        self.rig.wait(50)
        assert self.rig.activity() is Activity.IDLE
        pendant = self.rig.pendant("last")
        pendant.take()
        assert pendant.reset() is V.ACCEPTED
        here = self.rig.controller.position
        goal = (here[0] + (0.3 if here[0] < 1 else -0.3), here[1])
        assert pendant.move(*goal) is V.ACCEPTED
        self.rig.wait(2_000)
        assert pendant.all(Outcome)[-1].outcome == OutcomeKind.COMPLETED


TestAnyOrder = AnyOrder.TestCase
TestAnyOrder.settings = settings(max_examples=examples(30, in_soak=3_000), stateful_step_count=50)
