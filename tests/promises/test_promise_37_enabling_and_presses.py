"""What leaves the server when a key or an enabling device is let go or falls silent (promise 37).

Each row of the table in `docs/safety.md`, to the tick: from the last sign, which arrives at a tick,
just behind one, between two, or just before one.
"""

from dataclasses import replace

import pytest
from promises.promise_table import figure
from rigs.cells.server_rig import LIMITS, MS, TICK
from rigs.cells.two_hands import (
    HELD,
    PANIC,
    RELEASED,
    Act,
    Seen,
    Timeline,
    TwoHands,
    beat,
    beats,
    both,
    device,
    key_up,
    signs,
    tick_at,
    two_hands,
)
from rigs.motion.simple_jogger import SimpleJogger

from openpendant.server.cell.hold_to_run import ramp_time
from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import (
    AuthorityBeat,
    JogEnd,
    JogEnded,
    JogStep,
    JogUndo,
    JointMove,
    OperatingMode,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

PHASES = [0, 1, 3 * MS, TICK - 1]
GRACE = figure(37, "grace").count * TICK
LONG = 500 * MS
DONE, LOST = V.ACCEPTED, V.ENABLING_LOST

DEADLINES = {
    "equal": (3, 0.25, 0.25),
    "the cell's": (3, 0.15, 0.15),
    "a shorter press": (3, 0.05, 0.25),
    "version 2": (2, 0.15, 0.15),
    "version 2, a longer press": (2, 0.25, 0.15),
}
"""Version, deadline of the press, deadline of the enabling device [s]."""

deadlines = pytest.mark.parametrize("deadlines", DEADLINES.values(), ids=DEADLINES)
phases = pytest.mark.parametrize("phase", PHASES)
manual = pytest.mark.parametrize("mode", ["manual_reduced", "manual_high", "recovery"])

Deadlines = tuple[int, float, float]


def jogging(deadlines: Deadlines = (3, 0.25, 0.25), mode: str = "manual_high") -> TwoHands:
    version, press, silence = deadlines
    hands = two_hands(mode, version=version, silence=silence)
    hands.jog(press)
    return hands


def ns(seconds: float) -> int:
    return round(seconds * 1e9)


@phases
@manual
def test_promise_37_a_key_that_is_released_makes_a_ramp(mode: str, phase: int) -> None:
    hands = jogging(mode=mode)
    hands.play([(phase, key_up), *signs(phase, LONG)], LONG)
    assert hands.seen() == Seen(tick_at(phase) or TICK, None, JogEnd.RELEASED, DONE)


@phases
@deadlines
def test_promise_37_a_silent_key_makes_a_ramp_at_its_deadline(
    deadlines: Deadlines, phase: int
) -> None:
    hands = jogging(deadlines)
    hands.play([(phase, beat), *signs(phase, LONG)], LONG)
    ramp = tick_at(phase + ns(deadlines[1]))
    assert hands.seen() == Seen(ramp, None, JogEnd.SILENT, DONE)


@phases
@manual
def test_promise_37_a_released_enabling_device_makes_a_ramp_and_a_stop(
    mode: str, phase: int
) -> None:
    hands = jogging(mode=mode)
    hands.play([(phase, device(RELEASED)), *beats(phase, LONG)], LONG)
    ramp = tick_at(phase) or TICK
    assert hands.seen() == Seen(ramp, ramp + GRACE, JogEnd.STOPPED, LOST)


@phases
@deadlines
def test_promise_37_a_silent_enabling_device_makes_a_stop(deadlines: Deadlines, phase: int) -> None:
    hands = jogging(deadlines)
    hands.play([(phase, device(HELD)), *beats(phase, LONG)], LONG)
    stop = tick_at(phase + ns(max(deadlines[1:])) + TICK)
    assert hands.seen() == Seen(None, stop, JogEnd.STOPPED, LOST)


@pytest.mark.parametrize("gap", [0, 1, 6 * MS, TICK, 2 * TICK])
@pytest.mark.parametrize("first", ["key", "device"])
@phases
def test_promise_37_both_released_are_a_release_whatever_the_order(
    phase: int, first: str, gap: int
) -> None:
    hands = jogging()
    acts: list[Act] = [key_up, device(RELEASED)]
    acts = acts if first == "key" else acts[::-1]
    hands.play([(phase, acts[0]), (phase + gap, acts[1])], LONG)
    assert hands.seen() == Seen(tick_at(phase) or TICK, None, JogEnd.RELEASED, DONE)


def test_promise_37_the_release_of_the_key_comes_too_late_after_the_stop() -> None:
    hands = jogging()
    hands.play([(1, device(RELEASED)), (TICK + GRACE + 1, key_up), *beats(1, TICK)], LONG)
    assert hands.seen() == Seen(TICK, TICK + GRACE, JogEnd.STOPPED, LOST)


@pytest.mark.parametrize("gap", [0, TICK, GRACE])
def test_promise_37_a_device_that_is_pressed_again_revives_nothing(gap: int) -> None:
    hands = jogging()
    again = [(1, device(RELEASED)), (1 + gap, device(HELD)), *both(2 + gap, LONG)]
    hands.play(again, LONG)
    assert hands.seen() == Seen(TICK, TICK + GRACE, JogEnd.STOPPED, LOST)


def press_again(hands: TwoHands) -> None:
    hands.key_down(1.0, 0.25)


def test_promise_37_no_press_takes_over_before_the_stop_or_the_release() -> None:
    hands = jogging()
    hands.play([(1, device(RELEASED)), (2, press_again), (TICK + 1, press_again)], 2 * TICK)
    assert [code for _, code in hands.pendant.verdicts()] == [V.NOT_ENABLED] * 2


def test_promise_37_a_press_may_take_over_once_the_key_was_released_too() -> None:
    hands = jogging()
    released = [(1, device(RELEASED)), (2, key_up), (3, press_again), *both(4, 200 * MS)]
    hands.play(released, 200 * MS)
    assert hands.is_pressed
    assert hands.rig.stops == []


@phases
@deadlines
@manual
def test_promise_37_a_frozen_page_makes_a_ramp_alone(
    mode: str, deadlines: Deadlines, phase: int
) -> None:
    hands = jogging(deadlines, mode)
    hands.play([(phase, device(HELD)), (phase, beat), *both(700 * MS, 800 * MS)], 800 * MS)
    ramp = tick_at(phase + ns(deadlines[1]))
    assert hands.seen() == Seen(ramp, None, JogEnd.SILENT, DONE)
    assert hands.pendant.got  # and what came after the thaw moved nothing:
    assert not any(speed for time, speed in hands.speeds() if time > 700 * MS)


class Sluggish(SimpleJogger):
    """Brakes so slowly that its ramp outlasts any that is accepted."""

    def _asked(self) -> list[float]:
        if self._target is None:
            return [0.999 * speed for speed in self._velocity]
        return super()._asked()


@pytest.fixture
def sluggish(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rigs.cells.server_rig.SimpleJogger", Sluggish)


@pytest.mark.usefixtures("sluggish")
@pytest.mark.parametrize("end", ["released", "silent", "both"])
def test_promise_37_a_ramp_that_lasts_too_long_is_stopped(end: str) -> None:
    hands = jogging()
    longest = ns(hands.rig.core.cell.hold_to_run.ramp_time)
    timelines: dict[str, Timeline] = {
        "released": [(1, key_up), *signs(1, 2 * LONG)],
        "silent": [],
        "both": [(1, device(RELEASED)), (2, key_up)],
    }
    hands.play(timelines[end], 3 * LONG)
    ramp = 250 * MS if end == "silent" else TICK
    assert hands.seen() == Seen(ramp, ramp + longest, JogEnd.STOPPED, V.PRESS_DEAD)
    assert hands.rig.core.cell.stop is None
    hands.jog(0.25, warm=1)  # needs no reset


def test_promise_37_the_ramp_time_is_told_by_declare() -> None:
    hands = jogging()
    hands.key_up()
    hands.rig.wait(300)
    hands.pendant.got.clear()
    hands.declare(0.2)
    (told,) = [each.value for each in hands.pendant.all(Verdict)]
    assert told == pytest.approx(0.77)


@phases
@manual
def test_promise_37_panic_stops_in_the_same_turn(mode: str, phase: int) -> None:
    hands = jogging(mode=mode)
    hands.play([(phase, device(PANIC)), *beats(phase, LONG)], LONG)
    assert hands.seen() == Seen(None, phase, JogEnd.STOPPED, LOST)


@pytest.mark.parametrize("ends", [key_up, device(RELEASED)])
def test_promise_37_panic_stops_a_ramp_too(ends: Act) -> None:
    hands = jogging()
    hands.play([(1, ends), (TICK + 1, device(PANIC))], LONG)
    assert hands.seen() == Seen(TICK, TICK + 1, JogEnd.STOPPED, LOST)


@pytest.mark.parametrize("position", [RELEASED, PANIC])
@pytest.mark.parametrize("begin", ["a jog", "a motion"])
def test_promise_37_the_device_of_another_connection_ends_nothing(
    begin: str, position: int
) -> None:
    hands = jogging() if begin == "a jog" else under_way(move)
    other = hands.rig.pendant()
    hands.play([(1, lambda _: other.enable(HELD, position)), *both(2, 200 * MS)], 200 * MS)
    assert hands.rig.stops == []
    assert hands.rig.core.cell.is_busy


def give_back(hands: TwoHands) -> None:
    hands.pendant.release()


def change_the_mode(hands: TwoHands) -> None:
    hands.mode(OperatingMode.MANUAL_REDUCED)


def stop(hands: TwoHands) -> None:
    hands.pendant.stop()


def hang_up(hands: TwoHands) -> None:
    hands.pendant.close()


@pytest.mark.parametrize(
    ("end", "code"),
    [(give_back, V.AUTHORITY_LOST), (change_the_mode, V.MODE_CHANGED), (stop, V.STOPPED)],
)
def test_promise_37_authority_mode_and_stops_end_a_jog_at_once(end: Act, code: V) -> None:
    hands = jogging()
    hands.play([(1, end), *both(2, LONG)], LONG)
    assert hands.seen() == Seen(None, 1, JogEnd.STOPPED, code)


def test_promise_37_a_lost_link_stops_in_the_same_turn_and_frees_the_authority() -> None:
    hands = jogging()
    hands.play([(1, hang_up)], TICK)
    assert hands.seen().stop == 1
    assert hands.rig.core.cell.authority.holder is None


# What has no press.


def move(hands: TwoHands) -> None:
    hands.move()


def step(hands: TwoHands) -> None:
    values = joint_array((-1.0, 0.0))
    hands.pendant.send(JogStep(hands._request(), 1.0, 1, "", 2, values))


def undo(hands: TwoHands) -> None:
    hands.pendant.send(JogUndo(hands._request(), 0.2))


def under_way(begin: Act, mode: str = "manual_reduced") -> TwoHands:
    """Return hands in the midst of a motion; time counts from the last sign of their device."""
    hands = two_hands(mode, silence=0.25, jog={"joint_speed": 0.2})
    if begin is undo:
        hands.jog(0.25, warm=50)
        hands.key_up()
        hands.play(signs(0, LONG), LONG)
    hands.device(RELEASED)
    hands.device(HELD)
    begin(hands)
    hands.begin()
    hands.play(signs(0, 200 * MS), 200 * MS)
    hands.device(HELD)
    hands.begin()
    assert hands.rig.core.cell.is_busy
    return hands


motions = pytest.mark.parametrize("begin", [move, step, undo])


@motions
@phases
@pytest.mark.parametrize("position", [RELEASED, PANIC])
def test_promise_37_a_motion_is_stopped_where_its_device_is_let_go(
    begin: Act, phase: int, position: int
) -> None:
    """As promise 32 has it: also where it is held again at once."""
    hands = under_way(begin)
    hands.play([(phase, device(position)), (phase, device(HELD)), *signs(phase, LONG)], LONG)
    stop = hands.seen().stop
    assert stop is not None
    assert stop - phase <= figure(32, "ticks").count * TICK
    assert hands.seen().code is LOST


@motions
@phases
def test_promise_37_a_motion_is_stopped_where_its_device_is_silent(begin: Act, phase: int) -> None:
    hands = under_way(begin)
    hands.play([(phase, device(HELD))], LONG)
    seen = hands.seen()
    assert (seen.stop, seen.code) == (tick_at(phase + 250 * MS), LOST)


@pytest.mark.parametrize("begin", [move, step])
def test_promise_37_a_motion_is_stopped_where_its_link_is_lost(begin: Act) -> None:
    hands = under_way(begin)
    hands.play([(1, hang_up)], TICK)
    assert hands.seen().stop == 1


@pytest.mark.parametrize("position", [RELEASED, PANIC])
def test_promise_37_in_automatic_nobody_asks_for_the_device(position: int) -> None:
    hands = under_way(move, "automatic")
    hands.play([(1, device(position))], 2 * LONG)
    assert hands.rig.stops == []


def test_promise_37_in_automatic_a_frozen_page_ends_with_its_authority() -> None:
    hands = two_hands("automatic")
    goal = joint_array((-1.9, 0.0))
    hands.pendant.send(AuthorityBeat())
    hands.begin()
    hands.pendant.send(JointMove(hands._request(), 0.2, 2, goal))
    hands.pendant.speed(0.1)
    hands.play([], 3_500 * MS)
    seen = hands.seen()
    assert (seen.stop, seen.code) == (3_000 * MS, V.AUTHORITY_LOST)


def test_promise_37_in_automatic_no_key_jogs() -> None:
    hands = two_hands("automatic")
    assert hands.press(1.0, 0.0) is V.MODE_FORBIDS


# Ticks that come late: what has arrived is read first, and presses are judged before devices.


@pytest.mark.parametrize("late", [1, 3, 8])
def test_promise_37_late_ticks_let_common_silence_end_as_silence(late: int) -> None:
    hands = jogging()
    due = 250 * MS
    hands.play([], 2 * LONG, left_out=[due + tick * TICK for tick in range(late)])
    assert hands.seen() == Seen(due + late * TICK, None, JogEnd.SILENT, DONE)


@pytest.mark.parametrize("sign", [beat, device(HELD)])
def test_promise_37_a_sign_behind_its_deadline_counts_as_none_though_no_tick_came(
    sign: Act,
) -> None:
    """The first sign of a thaw, which arrives before the tick that would have judged."""
    hands = jogging()
    late = [250 * MS + tick * TICK for tick in range(3)]
    hands.play([(251 * MS, device(HELD)), (251 * MS, beat), (260 * MS, sign)], LONG, late)
    assert hands.seen() == Seen(280 * MS, None, JogEnd.SILENT, DONE)
    assert hands.press(1.0, 0.0, deadline=0.25) is V.NOT_ENABLED


def test_promise_37_a_press_that_is_silent_at_its_deadline_is_not_replaced() -> None:
    hands = jogging()
    late = [250 * MS, 260 * MS]
    again = (255 * MS, lambda hands: hands.key_again(0.25))
    hands.play([*signs(0, 240 * MS), again], LONG, late)
    assert JogEnd.SILENT in [each.reason for each in hands.pendant.all(JogEnded)]


@pytest.mark.parametrize("position", [RELEASED, PANIC])
def test_promise_37_a_released_device_counts_also_behind_its_deadline(position: int) -> None:
    hands = jogging()
    late = [260 * MS, 270 * MS]
    hands.play([*beats(0, LONG), (265 * MS, device(position))], LONG, late)
    assert hands.seen().told is JogEnd.STOPPED
    hands.rig.wait(300)
    hands.device(HELD)
    assert hands.press(1.0, 0.0, deadline=0.25) is (V.ACCEPTED if not position else V.NOT_ENABLED)


# How long a ramp may last.


@pytest.mark.parametrize(
    ("velocity", "acceleration", "seconds"),
    [
        ((2.0, 2.0), (4.0, 4.0), 0.77),
        ((3.0, 1.0), (50.0, 5.0), 0.32),
        ((0.6, 0.6), (10.0, 10.0), 0.11),
        ((2.0, 2.0), (2.0, 2.0), 1.0),
        ((1.0, 1.0), (30.0, 30.0), 0.07),
    ],
)
def test_promise_37_the_ramp_time_follows_from_the_slowest_joint_up_to_whole_ticks(
    velocity: tuple[float, ...], acceleration: tuple[float, ...], seconds: float
) -> None:
    limits = replace(LIMITS, velocity=velocity, acceleration=acceleration)
    assert ramp_time(limits, 100) == pytest.approx(seconds, abs=1e-12)
