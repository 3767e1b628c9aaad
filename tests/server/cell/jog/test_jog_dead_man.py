"""A jog lives as long as its press is beaten, and ends for good (promises 1, 2 and 12)."""

import itertools
import random
from collections.abc import Callable, Iterator

import pytest
from promises.promise_table import figure
from rigs.cells.broken_conditions import stop_the_controller
from rigs.cells.robot_cell_situations import at_a_pad, enabled
from rigs.cells.server_rig import LIMITS, MS, TICK, ServerRig, ready
from rigs.motion.jog_pad import JogPad
from rigs.motion.simple_jogger import point_speed

from openpendant.server.events.effects import SendToController
from openpendant.simplemsg import JointTrajPtFull, TriState
from openpendant.simplemsg.pendant import (
    Activity,
    EnablingPosition,
    JogEnd,
    JogEnded,
    ModeChanged,
    OperatingMode,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

SHORTEST, LONGEST = figure(1, "shortest").seconds, figure(1, "longest").seconds

FULL_SPEED = 0.25
"""Tool speed at the end of the jogged arm when joint 1 turns at as many rad/s."""


def jogging(mode: str = "manual_high", **jog: float) -> tuple[ServerRig, JogPad]:
    rig, pad = enabled(mode, jog=jog)
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    pad.hold(200)
    assert rig.activity() is Activity.JOGGING
    return rig, pad


def sent(rig: ServerRig, since: int = 0) -> Iterator[tuple[int, JointTrajPtFull]]:
    for time, item in rig.log:
        if (
            time >= since
            and isinstance(item, SendToController)
            and isinstance(item.message, JointTrajPtFull)
        ):
            yield time, item.message


def begin_of_ramp(rig: ServerRig, since: int) -> int:
    before = 0.0
    for time, point in sent(rig, since):
        if point.velocities[0] < before - 1e-9:
            return time
        before = point.velocities[0]
    raise AssertionError("no ramp began")


def squeeze_on(pad: JogPad) -> None:
    pad.pendant.enable(EnablingPosition.HELD)
    pad.rig.wait(10)


@pytest.mark.parametrize("deadline", [SHORTEST, 0.1, 0.15, LONGEST])
@pytest.mark.parametrize("phase", [1, 3 * MS, TICK - 1])
def test_promise_1_the_ramp_begins_within_deadline_and_one_tick(
    deadline: float, phase: int
) -> None:
    rig, pad = jogging()
    pad.release()
    pad.hold(300)
    assert pad.press(1.0, 0.0, deadline=deadline) is V.ACCEPTED
    for _ in range(20):
        pad.beat()
        squeeze_on(pad)
    # The last beat comes between two ticks.
    rig.now += phase
    last_beat = rig.now
    pad.beat()
    rig.now -= phase
    for _ in range(40):
        squeeze_on(pad)
    late = begin_of_ramp(rig, last_beat) - last_beat - round(deadline * 1e9)
    assert 0 <= late <= figure(1, "ticks").count * TICK
    assert rig.activity() is Activity.IDLE
    (ended,) = [each for each in pad.pendant.all(JogEnded) if each.press == 2]
    assert ended.reason == JogEnd.SILENT


@pytest.mark.parametrize("ticks", [7, 8, 9, 10])
def test_promise_1_a_robot_that_falls_behind_as_the_press_dies_delays_no_ramp(ticks: int) -> None:
    """By more than the declared lag: no set-point is due, not even as the press is found dead."""
    rig, pad = jogging()
    last_beat = rig.now
    pad.beat()
    for tick in range(30):
        if tick == 15 - ticks:
            rig.controller.fall_behind(12 * TICK)
        squeeze_on(pad)
    assert begin_of_ramp(rig, last_beat) - last_beat == 150 * MS
    left = [time for time, _ in sent(rig, last_beat)]
    assert len(left) == len(set(left)), "two set-points in one tick"


def _random_presses(presses: int) -> None:
    rig, pad = jogging()
    pad.release()
    chance = random.Random(1)
    stranger = JogPad(rig, "stranger", takes=False)
    for _ in range(presses):
        while rig.activity() is not Activity.IDLE:
            squeeze_on(pad)
        rig.log.clear()
        rig.points.clear()
        pad.pendant.got[:-5] = []
        stranger.pendant.got[:-5] = []
        deadline = chance.choice((SHORTEST, 0.1, 0.15, LONGEST))
        away = 1.0 if rig.controller.position[0] < 0 else -1.0
        assert pad.press(away, 0.0, deadline=deadline) is V.ACCEPTED
        last_beat, due, beats = rig.now, round(deadline * 1e9), chance.randrange(5)
        while rig.now - last_beat < due:
            pad.pendant.enable(EnablingPosition.HELD)
            match chance.randrange(8):
                case 0 | 1:
                    # A beat of its own that comes in time, anywhere between two ticks.
                    offset = chance.randrange(TICK)
                    if beats and rig.now + offset - last_beat < due:
                        beats -= 1
                        rig.now += offset
                        pad.beat()
                        last_beat = rig.now
                        rig.now -= offset
                case 2:
                    pad.beat(number=pad.beat_number - 1)
                    pad.beat_number = max(pad.beat_number - 1, 0)
                case 3:
                    stranger.beat(press=pad.press_number)
                case 4:
                    pad.pendant.enable(EnablingPosition.HELD)
            rig.wait(10)
        for _ in range(3):
            squeeze_on(pad)
        speeds = [abs(point.velocities[0]) for time, point in sent(rig) if time > last_beat + due]
        # From the first set-point after the deadline on, each is slower than the one before.
        assert all(after < before for before, after in itertools.pairwise(speeds))
        assert speeds == [] or max(speeds) < FULL_SPEED


def test_promise_1_holds_over_random_gaps_replayed_and_foreign_beats() -> None:
    _random_presses(100)


@pytest.mark.soak
def test_promise_1_holds_over_ten_thousand_random_sequences() -> None:
    _random_presses(10_000)


def test_promise_2_a_lost_connection_stops_in_the_same_call() -> None:
    rig, pad = jogging()
    pad.pendant.close()
    assert (rig.stops, rig.core.cell.authority.holder) == ([rig.now], None)


def test_a_release_ramps_down_and_its_account_is_told_before_the_outcome() -> None:
    rig, pad = jogging()
    released = rig.now
    assert pad.release() is V.ACCEPTED
    rig.wait(20)
    assert begin_of_ramp(rig, released) <= released + TICK
    pad.hold(300)
    assert rig.activity() is Activity.IDLE
    (ended,) = pad.pendant.all(JogEnded)
    assert ended.reason == JogEnd.RELEASED
    assert 0.0 < ended.stop_time < 0.15
    assert 0.0 < ended.joint_distance < 0.02
    assert rig.stops == []


def test_a_second_release_does_not_move_the_start_of_the_ramp() -> None:
    stop_times = []
    for releases in (1, 2):
        rig, pad = jogging()
        for _ in range(releases):
            pad.release()
            rig.wait(30)
        rig.wait(300)
        (ended,) = pad.pendant.all(JogEnded)
        stop_times.append(ended.stop_time)
    assert stop_times[1] == stop_times[0]


@pytest.mark.parametrize("number", [1, 0])
def test_a_dead_press_never_moves_again(number: int) -> None:
    rig, pad = jogging()
    pad.release()
    pad.hold(300)
    assert pad.press(1.0, 0.0, number=number) is V.PRESS_DEAD
    pad.beat(press=1)
    before = len(rig.points)
    pad.hold(300)
    assert len(rig.points) == before


def test_a_press_must_quote_a_recent_state() -> None:
    rig, pad = enabled("manual_high")
    quoted = pad.newest_state.sequence
    pad.hold(600)
    assert pad.press(1.0, 0.0, quoted=quoted) is V.PRESS_STALE
    assert pad.press(1.0, 0.0, quoted=quoted + 10_000) is V.PRESS_STALE
    assert rig.points == []


def test_a_press_of_an_observer_moves_nothing() -> None:
    rig, pad = jogging()
    other = JogPad(rig, "other", takes=False)
    other.squeeze()
    assert other.press(-1.0, 0.0) is V.HELD_BY_OTHER
    assert rig.activity() is Activity.JOGGING
    pad.hold(50)


def test_no_more_than_the_lead_is_ever_sent_ahead() -> None:
    rig, pad = jogging(lead=0.03)
    for _ in range(3):
        pad.release()
        pad.hold(300)
        began = rig.now
        pad.press(1.0, 0.0)
        pad.hold(100)
        for time, point in sent(rig, began):
            assert point.time * 1e9 <= time - began + 30 * MS + 1_000


def test_a_pause_between_two_presses_is_not_caught_up_with() -> None:
    rig, pad = jogging(lead=0.03)
    pad.release()
    rig.controller.reports = False  # so that the server does not see it standing yet
    for _ in range(18):
        squeeze_on(pad)
    assert rig.activity() is Activity.JOGGING
    rig.controller.reports = True
    rig.report()
    began = rig.now
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    assert len(list(sent(rig, began))) <= 4


def test_a_new_press_that_takes_over_must_meet_the_conditions_too() -> None:
    _, pad = jogging()
    pad.release()
    pad.let_go()
    assert pad.press(1.0, 0.0) is V.NOT_ENABLED


def test_a_press_that_takes_over_does_not_get_round_an_override_of_0() -> None:
    rig, pad = jogging()
    assert pad.speed(0.0) is V.ACCEPTED
    assert pad.press(1.0, 0.0) is V.OVERRIDE_ZERO
    pad.hold(300)
    assert rig.activity() is Activity.IDLE


def test_a_changed_override_rules_the_jog_at_once_and_smoothly() -> None:
    rig, pad = jogging()
    pad.speed(0.4)
    pad.hold(200)
    assert list(sent(rig))[-1][1].velocities[0] == pytest.approx(0.4 * 2.0 * 0.25)


# What ends a jog besides its press.


ENDS: dict[str, tuple[Callable[[ServerRig, JogPad], object], V]] = {
    "panic": (lambda _, pad: pad.squeeze(EnablingPosition.PANIC), V.ENABLING_LOST),
    "another mode": (lambda _, pad: pad.mode(OperatingMode.MANUAL_REDUCED), V.MODE_CHANGED),
    "software stop": (lambda _, pad: pad.pendant.stop(), V.STOPPED),
    "an observer's stop": (lambda rig, _: rig.pendant("observer").stop(), V.STOPPED),
    "authority given back": (lambda _, pad: pad.pendant.release(), V.AUTHORITY_LOST),
    "emergency stop": (stop_the_controller, V.CONTROLLER_STOPPED),
}


@pytest.mark.parametrize(("end", "code"), ENDS.values(), ids=ENDS)
def test_promise_32_a_jog_ends_within_a_tick_and_its_beats_wake_nothing(
    end: Callable[[ServerRig, JogPad], object], code: V
) -> None:
    rig, pad = jogging()
    at = rig.now
    end(rig, pad)
    pad.hold(10)
    assert rig.stops
    assert rig.stops[0] <= at + figure(32, "ticks").count * TICK
    assert pad.pendant.outcomes()[-1][1] is code
    rig.controller.e_stopped = False
    before = len(rig.points)
    pad.squeezes = True
    pad.hold(500)
    assert len(rig.points) == before
    assert rig.activity() is Activity.IDLE


def test_promise_32_silence_of_the_enabling_device_stops_a_motion_at_its_deadline() -> None:
    rig = ready(modes={"initial": "manual_reduced"})
    pad = JogPad(rig, silence=0.0)
    pad.squeeze()
    assert pad.pendant.move(1.5, 0.0) is V.ACCEPTED
    pad.hold(200)
    pad.squeeze()
    last = rig.now
    rig.wait(200)
    assert rig.stops[0] - last == figure(32, "silence").ns


# Speeds and limits.


@pytest.mark.parametrize(("mode", "cap"), [("manual_reduced", 0.25), ("recovery", 0.1)])
def test_promise_12_the_tool_keeps_below_its_cap_at_every_tick(mode: str, cap: float) -> None:
    rig, pad = enabled(mode, jog={"joint_speed": 1.0, "tool_speed": 2.0})
    for rates in ((1.0, 1.0), (-1.0, 1.0), (0.0, -1.0)):
        assert pad.press(*rates) is V.ACCEPTED
        pad.hold(700)
        pad.release()
        pad.hold(300)
    fastest = max(point_speed(point.velocities[:2]) for _, point in sent(rig))
    assert cap * 0.99 <= fastest <= cap * (1 + 1e-6)


def test_promise_12_what_is_planned_in_t1_is_told_the_cap() -> None:
    rig, pad = enabled(plans_at_once=False)
    pad.pendant.move(0.5, 0.5)
    assert getattr(rig.jobs[0], "tool_speed", None) == 0.25


def test_jogging_into_a_limit_stays_inside_and_leaves_again() -> None:
    rig, pad = jogging(joint_speed=1.0, tool_speed=2.0)
    assert pad.speed(1.0, 2.0) is V.ACCEPTED
    pad.hold(3_000)
    top = max(point.positions[0] for _, point in sent(rig))
    assert 1.9 < top <= LIMITS.upper[0]
    assert pad.press(-1.0, 0.0) is V.ACCEPTED
    pad.hold(1_000)
    assert rig.controller.position[0] < 1.5


def outside(mode: str) -> tuple[ServerRig, JogPad]:
    rig, pad = at_a_pad(modes={"initial": mode})
    rig.controller.position = (2.05, 0.0)
    rig.wait(20)
    pad.squeeze()
    return rig, pad


def test_recovery_leads_a_joint_back_inside_and_never_farther_out() -> None:
    rig, pad = outside("recovery")
    assert pad.press(-1.0, 0.0) is V.ACCEPTED
    pad.hold(1_500)
    pad.release()
    pad.hold(300)
    places = [point.positions[0] for _, point in sent(rig)]
    assert places == sorted(places, reverse=True)
    assert rig.controller.position[0] < LIMITS.upper[0]


@pytest.mark.parametrize("mode", ["manual_reduced", "manual_high"])
def test_a_joint_outside_its_limits_is_moved_in_recovery_only(mode: str) -> None:
    _, pad = outside(mode)
    assert pad.press(-1.0, 0.0) is V.OUTSIDE_LIMITS
    assert pad.pendant.move(0.0, 0.0) is V.OUTSIDE_LIMITS


@pytest.mark.parametrize(
    ("mode", "code"), [("recovery", V.ACCEPTED), ("manual_reduced", V.BAD_DOCUMENT)]
)
def test_with_a_scene_that_cannot_be_read_a_robot_is_led_out_in_recovery_only(
    mode: str, code: V
) -> None:
    rig = ready(modes={"initial": mode})
    rig.core.cell.unread = "what is kept as scene is not in force"
    pad = JogPad(rig)
    pad.squeeze()
    assert pad.press(1.0, 0.0) is code


# A real controller's own selector.


def test_a_turn_of_the_controllers_selector_stops_a_jog_and_is_told_to_all() -> None:
    rig, pad = at_a_pad(modes={"selector": "controller"})
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    pad.hold(200)
    rig.controller.mode = 1
    pad.hold(10)
    assert rig.stops
    (changed,) = pad.pendant.all(ModeChanged)
    assert (changed.mode, changed.session) == (OperatingMode.MANUAL_REDUCED, 0)
    assert pad.mode(OperatingMode.AUTOMATIC) is V.MODE_NOT_OURS


def test_the_controllers_stops_are_shown_and_not_reset() -> None:
    rig, pad = jogging()
    rig.controller.e_stopped = True
    pad.hold(50)
    assert pad.newest_state.e_stopped == TriState.TRUE
    assert pad.pendant.reset() is V.ACCEPTED
    pad.hold(50)
    assert pad.newest_state.e_stopped == TriState.TRUE
