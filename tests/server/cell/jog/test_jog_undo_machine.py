"""Anything in any order: an undo moves where the last motion that began was a jog, and only there.

The model remembers what began last and where that jog began; an undo leads there and nowhere else.
"""

from __future__ import annotations

from typing import NamedTuple

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule
from rigs.cells.jog_undos import at_rest, refused_by_the_planner, step, undo
from rigs.cells.server_rig import ready
from rigs.data.example_counts import examples
from rigs.motion.jog_pad import JogPad

from openpendant.simplemsg.pendant import MotionControlAction, OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode as V

MODES = (OperatingMode.MANUAL_REDUCED, OperatingMode.MANUAL_HIGH, OperatingMode.RECOVERY)
ENDS = ("arrival", "software stop", "program stop", "mode", "enabling")

small = st.sampled_from((-0.3, -0.05, 0.05, 0.3))
increments = st.tuples(small, small)
rates = st.tuples(st.sampled_from((-1.0, 1.0)), st.sampled_from((-0.5, 0.0, 1.0)))
ends = st.sampled_from(ENDS)
while_ticks = st.integers(1, 60)


class Jog(NamedTuple):
    began_at: tuple[float, ...]


class Undo(RuleBasedStateMachine):
    @initialize(mode=st.sampled_from(MODES))
    def start(self, mode: OperatingMode) -> None:
        caps = {"joint_speed": 1.0, "tool_speed": 1.0}
        self.rig = ready(modes={"initial": mode.name.lower()}, jog=caps)
        self.pad = JogPad(self.rig)
        self.pad.squeeze()
        self.mode = mode
        self.last: Jog | None = None
        self.stood = self.rig.controller.position

    @property
    def here(self) -> tuple[float, ...]:
        return self.rig.controller.position

    def _end(self, how: str, ticks: int) -> bool:
        if how == "arrival":
            at_rest(self.pad)
            return True
        for _ in range(ticks):
            self.pad.hold(10)
        has_ended = not self.rig.core.cell.is_busy
        match how:
            case "software stop":
                self.pad.pendant.stop()
                self.pad.hold(300)
                assert self.pad.pendant.reset() is V.ACCEPTED
            case "program stop":
                self.pad.control(MotionControlAction.PROGRAM_STOP)
            case "mode":
                self._turn(MODES[(MODES.index(self.mode) + 1) % len(MODES)])
            case "enabling":
                self.pad.let_go()
                self.pad.hold(20)
        at_rest(self.pad)
        self._enable()
        return has_ended

    def _turn(self, mode: OperatingMode) -> None:
        assert self.pad.mode(mode) is V.ACCEPTED
        self.mode = mode

    def _enable(self) -> None:
        self.pad.let_go()
        self.pad.squeeze()

    # Jogs.

    @rule(rates=rates, how=ends, ticks=while_ticks)
    def press(self, rates: tuple[float, float], how: str, ticks: int) -> None:
        began_at = self.here
        assert self.pad.press(*rates) is V.ACCEPTED
        self.last = Jog(began_at)
        self.pad.hold(10 * ticks)
        if how == "arrival":
            self.pad.release()
        self._end(how, 1)
        self.pad.is_pressed = False

    @rule(increments=increments, how=ends, ticks=while_ticks)
    def step(self, increments: tuple[float, float], how: str, ticks: int) -> None:
        began_at = self.here
        code = step(self.pad, *increments)
        if code is V.OUT_OF_RANGE:
            return
        assert code is V.ACCEPTED
        self.last = Jog(began_at)
        self._end(how, ticks)

    @rule(how=ends, ticks=while_ticks)
    def undo(self, how: str, ticks: int) -> None:
        code = undo(self.pad)
        if self.last is None:
            assert code is V.NO_JOG_TO_UNDO
            return
        if self.last.began_at == pytest.approx(self.here, abs=1e-6):
            # It was ended before it moved.
            assert code in (V.ACCEPTED, V.NO_MOTION)
        else:
            assert code is V.ACCEPTED
        if code is not V.ACCEPTED:
            return
        if self._end(how, ticks):
            assert self.here == pytest.approx(self.last.began_at, abs=2e-3)
            self.last = None

    # Anything else.

    @precondition(lambda self: self.mode is not OperatingMode.RECOVERY)
    @rule(goal=st.tuples(st.floats(-1.8, 1.8), st.floats(-1.8, 1.8)), how=ends, ticks=while_ticks)
    def move(self, goal: tuple[float, float], how: str, ticks: int) -> None:
        if self.pad.pendant.move(*goal) is V.ACCEPTED:
            self.last = None
            self._end(how, ticks)

    @rule(mode=st.sampled_from(MODES))
    def turn_selector(self, mode: OperatingMode) -> None:
        self._turn(mode)
        self._enable()

    @rule()
    def stop_and_reset(self) -> None:
        self._end("software stop", 1)

    # What is refused.

    @rule(increments=increments)
    def step_that_the_planner_refuses(self, increments: tuple[float, float]) -> None:
        if all(-2.0 <= at + by <= 2.0 for at, by in zip(self.here, increments, strict=True)):
            refused_by_the_planner(self.rig, lambda: step(self.pad, *increments))

    @rule()
    def undo_that_the_planner_refuses(self) -> None:
        if self.last is not None:
            refused_by_the_planner(self.rig, lambda: undo(self.pad))

    @precondition(lambda self: self.mode is not OperatingMode.RECOVERY)
    @rule()
    def move_that_the_planner_refuses(self) -> None:
        refused_by_the_planner(self.rig, lambda: self.pad.pendant.path((0.5, 0.5), (1.0, 1.0)))

    @rule()
    def refused_before_it_is_planned(self) -> None:
        assert step(self.pad, 9.0, 0.0) is V.OUT_OF_RANGE
        assert step(self.pad, 0.1, 0.1, speed=0.0) is V.BAD_ARGUMENT
        assert undo(self.pad, speed=2.0) is V.BAD_ARGUMENT
        assert self.pad.press(1.5, 0.0) is V.BAD_ARGUMENT
        self.pad.let_go()
        assert step(self.pad, 0.1, 0.1) is V.NOT_ENABLED
        assert undo(self.pad) is V.NOT_ENABLED
        self.pad.squeeze()

    @invariant()
    def the_robot_stands_between_what_is_asked(self) -> None:
        self.pad.hold(20)
        assert not any(self.rig.controller.state(self.rig.now)[1])


TestUndo = Undo.TestCase
TestUndo.settings = settings(max_examples=examples(8, in_soak=600), stateful_step_count=25)
