"""Pendants do anything in any order; what must always hold of a cell holds (promises 18, 32).

The model is small on purpose: it remembers only what the invariants need. Steps at random hardly
ever meet all that a motion asks for, so some of them do what an operator would until one begins;
how many steps found the robot moving or jogging is counted, and what came amid that.
"""

from collections import Counter
from typing import ClassVar

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from promises.promise_figures import tell
from promises.promise_table import figure
from rigs.cells.expectations import known
from rigs.cells.server_rig import LIMITS, MS, ready
from rigs.motion.jog_pad import BEAT_TICKS, JogPad

from openpendant.server.events.effects import SendToController
from openpendant.server.settings.cell_settings import ControllerPath
from openpendant.simplemsg.pendant import (
    Activity,
    Authority,
    AuthorityAction,
    EnablingPosition,
    MotionControlAction,
    OperatingMode,
)

MANUAL = (OperatingMode.MANUAL_REDUCED, OperatingMode.MANUAL_HIGH, OperatingMode.RECOVERY)
MOST_PADS = 4

STEPS, ONE_IN = figure(18, "steps").count, figure(18, "moving").count
"""Steps at length, and of how many one finds the robot moving or jogging."""

STEPS_OF_A_RUN = 50

AMID = [
    (what, activity)
    for what in ("mode", "stop", "link")
    for activity in (Activity.MOVING, Activity.JOGGING)
]
"""What comes amid motions, and amid which."""

pads = st.integers(0, MOST_PADS - 1)
rates = st.tuples(st.sampled_from((-1.0, 0.0, 1.0)), st.sampled_from((-1.0, 0.0, 0.5)))
goals = st.tuples(st.floats(-1.9, 1.9), st.floats(-1.9, 1.9))


class Cell(RuleBasedStateMachine):
    """Up to four pendants, one robot.

    Attributes:
        counts: steps of all runs, those that found the robot moving or jogging, and what came
            amid which.
    """

    counts: ClassVar[Counter[object]] = Counter()

    @initialize(mode=st.sampled_from([mode.name.lower() for mode in OperatingMode]))
    def start(self, mode: str) -> None:
        self.rig = ready(modes={"initial": mode}, jog={"joint_speed": 1.0, "tool_speed": 1.0})
        self.pads: list[JogPad] = []
        self.seen = len(self.rig.log)
        self.connect()
        # Else most runs would never move anything.
        self.pads[0].pendant.take()
        self.pads[0].squeeze()

    def _pad(self, number: int) -> JogPad:
        return self.pads[number % len(self.pads)]

    @property
    def is_driving(self) -> bool:
        standing = (Activity.IDLE, Activity.PLANNING, Activity.STOPPING)
        return self.rig.activity() not in standing

    def _note(self, what: str) -> None:
        self.counts[what, self.rig.activity()] += 1

    # What an operator does until the robot moves.

    @precondition(lambda self: not self.is_driving)
    @rule(goal=goals)
    def get_moving_in_automatic(self, goal: tuple[float, float]) -> None:
        self._ready(OperatingMode.AUTOMATIC).pendant.move(*goal, speed=0.2)
        self._hold(3)

    @precondition(lambda self: not self.is_driving)
    @rule(goal=goals, mode=st.sampled_from(MANUAL[:2]))
    def get_moving_in_manual(self, goal: tuple[float, float], mode: OperatingMode) -> None:
        self._ready(mode).pendant.move(*goal, speed=0.2)
        self._hold(3)

    @precondition(lambda self: not self.is_driving)
    @rule(rates=rates)
    def get_jogging_in_recovery(self, rates: tuple[float, float]) -> None:
        self._ready(OperatingMode.RECOVERY).press(*rates, deadline=0.25)
        self._hold(3)

    @precondition(lambda self: not self.is_driving)
    @rule(rate=st.sampled_from((-1.0, -0.2, 0.2, 1.0)), mode=st.sampled_from(MANUAL))
    def get_jogging_with_one_joint(self, rate: float, mode: OperatingMode) -> None:
        self._ready(mode).press(rate, 0.0, deadline=0.25)
        self._hold(3)

    @precondition(lambda self: not self.is_driving)
    @rule(rates=rates, mode=st.sampled_from(MANUAL))
    def get_jogging_with_both(self, rates: tuple[float, float], mode: OperatingMode) -> None:
        self._ready(mode).press(*rates, deadline=0.25)
        self._hold(3)

    @precondition(lambda self: self.is_driving)
    @rule(ticks=st.integers(1, 5))
    def go_on(self, ticks: int) -> None:
        self._hold(ticks)

    def _ready(self, mode: OperatingMode) -> JogPad:
        self._hold(5)
        holder = self.rig.core.cell.authority.holder
        held = [pad for pad in self.pads if holder and pad.pendant.session == holder.session]
        pad = held[0] if held else self.pads[0]
        if not held:
            pad.pendant.take()
        pad.let_go()
        pad.pendant.reset()
        pad.mode(mode)
        pad.speed(1.0, 0.0)
        pad.squeeze()
        self._hold(1)
        return pad

    # What pendants do.

    @precondition(lambda self: len(self.pads) < MOST_PADS)
    @rule()
    def connect(self) -> None:
        self.pads.append(JogPad(self.rig, f"pad {self.rig.now}", takes=False))

    @precondition(lambda self: len(self.pads) > 1)
    @rule(number=pads)
    def close(self, number: int) -> None:
        pad = self._pad(number)
        self.pads.remove(pad)
        pad.pendant.close()

    @rule(number=pads, action=st.sampled_from(AuthorityAction))
    def hand_over(self, number: int, action: AuthorityAction) -> None:
        pad = self._pad(number)
        pad.pendant.last_request += 1
        pad.pendant.send(Authority(pad.pendant.last_request, action))

    @rule(number=pads, position=st.sampled_from(EnablingPosition))
    def squeeze(self, number: int, position: EnablingPosition) -> None:
        self._pad(number).squeeze(position)

    @rule(number=pads, rates=rates, deadline=st.sampled_from((0.05, 0.15, 0.25)))
    def jog(self, number: int, rates: tuple[float, float], deadline: float) -> None:
        self._pad(number).press(*rates, deadline=deadline)

    @rule(number=pads, stale=st.integers(0, 3))
    def beat_wrongly(self, number: int, stale: int) -> None:
        self._pad(number).beat(number=stale, press=stale)

    @rule(number=pads)
    def release(self, number: int) -> None:
        self._pad(number).release()

    @rule(number=pads, goal=goals)
    def move(self, number: int, goal: tuple[float, float]) -> None:
        self._pad(number).pendant.move(*goal)

    @rule(number=pads, action=st.sampled_from(MotionControlAction))
    def control(self, number: int, action: MotionControlAction) -> None:
        self._pad(number).control(action)

    @rule(number=pads, mode=st.sampled_from(OperatingMode))
    def turn_selector(self, number: int, mode: OperatingMode) -> None:
        self._note("mode")
        self._pad(number).mode(mode)

    @rule(
        number=pads, override=st.sampled_from((0.0, 0.2, 1.0)), cap=st.sampled_from((0.0, 0.1, 1.0))
    )
    def set_speed(self, number: int, override: float, cap: float) -> None:
        self._pad(number).speed(override, cap)

    @rule(number=pads)
    def stop(self, number: int) -> None:
        self._note("stop")
        self._pad(number).pendant.stop()

    @rule(number=pads)
    def reset(self, number: int) -> None:
        cell = self.rig.core.cell
        was_latched = cell.stop is not None
        before = len(self._set_points())
        self._pad(number).pendant.reset()
        assert len(self._set_points()) == before
        assert not (was_latched and cell.stop is None and self.is_driving)

    # What happens to them.

    @rule(ticks=st.integers(1, 15))
    def hold(self, ticks: int) -> None:
        self._hold(ticks)

    def _hold(self, ticks: int) -> None:
        for tick in range(ticks):
            for pad in self.pads:
                if tick % BEAT_TICKS == 0 and pad.squeezes:
                    pad.squeeze()
                if tick % BEAT_TICKS == 0 and pad.is_pressed:
                    pad.beat()
            self._tick()

    @rule(ticks=st.sampled_from((1, 5, 16, 30)))
    def fall_silent(self, ticks: int) -> None:
        for _ in range(ticks):
            self._tick()

    def _tick(self) -> None:
        self.rig.wait(10)
        self.what_left_was_allowed_to()
        self.in_manual_only_what_is_enabled_moves()

    @rule(milliseconds=st.integers(1, 250))
    def freeze(self, milliseconds: int) -> None:
        self.rig.now += milliseconds * MS
        self.rig.wait(10)

    @rule(path=st.sampled_from((ControllerPath.MOTION, ControllerPath.STATE)))
    def lose_a_link(self, path: ControllerPath) -> None:
        self._note("link")
        self.rig.path(path, False)
        self.rig.wait(10)
        self.rig.path(path, True)
        self.rig.wait(10)

    # What always holds.

    @invariant()
    def step_is_counted(self) -> None:
        self.counts["steps"] += 1
        self.counts["driven"] += self.rig.activity() in (Activity.MOVING, Activity.JOGGING)

    def _set_points(self) -> list[SendToController]:
        return [item for _, item in self.rig.log if isinstance(item, SendToController)]

    @invariant()
    def what_left_was_allowed_to(self) -> None:
        cell, now = self.rig.core.cell, self.rig.now
        new = self.rig.log[self.seen :]
        self.seen = len(self.rig.log)
        for time, item in new:
            if not isinstance(item, SendToController):
                continue
            for joint in range(2):
                at = item.message.positions[joint]  # type: ignore[attr-defined]  # a set-point
                assert LIMITS.lower[joint] <= at <= LIMITS.upper[joint]
            assert time <= now
        if not self.is_driving:
            return
        work = known(cell.driving.request)
        assert cell.authority.is_held_by(work.session)
        assert cell.stop is None

    @invariant()
    def at_most_one_pendant_is_in_control(self) -> None:
        holder = self.rig.core.cell.authority.holder
        holders = [pad for pad in self.pads if holder and pad.pendant.session == holder.session]
        assert len(holders) == (holder is not None)

    @invariant()
    def nothing_is_driven_while_a_stop_is_latched(self) -> None:
        cell = self.rig.core.cell
        if cell.stop is not None:
            assert not self.is_driving
            if not cell.is_busy:
                assert not any(self.rig.controller.state(self.rig.now)[1])

    @invariant()
    def at_most_one_request_to_the_controller_is_unanswered(self) -> None:
        assert self.rig.controller.awaited <= 1

    @invariant()
    def in_automatic_nothing_is_jogged(self) -> None:
        cell = self.rig.core.cell
        if cell.modes.mode(cell.feedback.mode) is OperatingMode.AUTOMATIC:
            assert cell.driving.driven_jog is None

    def in_manual_only_what_is_enabled_moves(self) -> None:
        cell, now = self.rig.core.cell, self.rig.now
        if cell.modes.mode(cell.feedback.mode) in MANUAL and cell.activity is not Activity.PAUSED:
            work = cell.driving.work
            # A jog whose press has ended only ramps to rest.
            if work is not None and (work.jog is None or work.jog.press.ended is None):
                assert cell.modes.is_enabled(work.request.session, now)


class LongCell(Cell):
    counts: ClassVar[Counter[object]] = Counter()


def judge(counts: Counter[object], share: float = 1.0) -> None:
    tell(f"promises 18 and 32: {dict(counts)}")
    assert counts["driven"] >= share * counts["steps"] / ONE_IN, counts


class TestCell(Cell.TestCase):  # type: ignore[misc, valid-type]  # made by hypothesis when it is asked for
    settings = settings(max_examples=30, stateful_step_count=STEPS_OF_A_RUN)

    def runTest(self) -> None:
        Cell.counts.clear()
        super().runTest()
        # Hypothesis draws anew whenever the code changes, and so few steps scatter widely.
        judge(Cell.counts, share=0.5)
        for activity in (Activity.MOVING, Activity.JOGGING):
            assert sum(Cell.counts[amid] for amid in AMID if activity in amid) >= 3, activity


@pytest.mark.soak
@pytest.mark.timeout(3_600)
class TestCellAtLength(LongCell.TestCase):  # type: ignore[misc, valid-type]  # as above
    # Not every run has all its steps.
    settings = settings(
        max_examples=3 * STEPS // STEPS_OF_A_RUN // 2, stateful_step_count=STEPS_OF_A_RUN
    )

    def runTest(self) -> None:
        LongCell.counts.clear()
        super().runTest()
        assert LongCell.counts["steps"] >= STEPS
        judge(LongCell.counts)
        rare = {amid: LongCell.counts[amid] for amid in AMID if LongCell.counts[amid] < 500}
        assert not rare, f"hardly ever amid a motion: {rare}"
