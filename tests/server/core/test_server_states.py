from __future__ import annotations

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule
from rigs.cells.robot_cell_situations import in_control
from rigs.cells.server_rig import LIMITS, MS, ServerRig
from rigs.data.example_counts import examples
from rigs.peers.scripted_controller import Fault
from rigs.peers.server_clients import Pendant, RosClient

from openpendant.server.events.effects import Effect, SendStop, SendToController
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg import ControllerMode, JointTrajPtFull
from openpendant.simplemsg.pendant import (
    Activity,
    AuthorityBeat,
    AuthorityChanged,
    Outcome,
    OutcomeKind,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

COORDINATE = st.sampled_from([-2.5, -2.0, -0.7, 0.0, 0.1, 1.3, 2.0])
WHO = st.integers(0, 2)


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
        assert cell.driving.request is not None, "a point left that nobody asked for"
        assert cell.authority.is_held_by(cell.driving.request.session)
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

    @rule(who=WHO)
    def take(self, who: int) -> None:
        self.pendant(who).take()

    @rule(who=WHO)
    def release(self, who: int) -> None:
        pendant = self.pendant(who)
        before = self.rig.core.cell.authority.holder
        if pendant.release() is not V.ACCEPTED:
            assert self.rig.core.cell.authority.holder == before

    @rule(who=WHO)
    def beat(self, who: int) -> None:
        self.pendant(who).send(AuthorityBeat())

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

    @rule(who=WHO)
    def stop(self, who: int) -> None:
        self.pendant(who).stop()

    @rule(who=WHO)
    def reset(self, who: int) -> None:
        self.pendant(who).reset()

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
        assert self.client is not None
        self.client.stop()

    @precondition(lambda self: self.client is not None)
    @rule()
    def ros_close(self) -> None:
        assert self.client is not None
        self.client.close()
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
            assert cell.driving.request is not None
            assert cell.authority.is_held_by(cell.driving.request.session)

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


def test_the_machine_itself_gets_a_motion_done() -> None:
    """Guards against a machine that refuses everything and so proves nothing."""
    rig, pendant = in_control(plans_at_once=False)
    pendant.path((0.1, 0.0), (1.3, 0.1))
    rig.plan()
    rig.wait(2_000)
    assert pendant.outcomes() == [(pendant.last_request, V.ACCEPTED)]
    assert rig.now % MS == 0
