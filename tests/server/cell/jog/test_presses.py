"""Hold-to-run as pure rules: presses, beats, deadlines (promise 1)."""

import math
import random
import struct
from collections.abc import Callable

import pytest
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.expectations import expect, known, only, refusal_from
from rigs.cells.jog_undos import step
from rigs.cells.robot_cell_situations import enabled
from rigs.cells.server_rig import MS, ServerRig
from rigs.motion.jog_pad import EmulatedPad, JogPad

from openpendant.server.cell.execution.setpoint_sources import (
    LONGEST_DEADLINE,
    SHORTEST_DEADLINE,
    Press,
    PressCounter,
)
from openpendant.server.endpoints.pendant.jog_requests import increment_fault, shares_fault, told
from openpendant.server.endpoints.pendant.notifications import RECENT_NS, RecentStates
from openpendant.server.planning.jobs import JointPathJob
from openpendant.server.refusal import NO_JOINT
from openpendant.simplemsg.pendant import (
    Activity,
    JogEnd,
    JogEnded,
    JogRelease,
    JogSpace,
    OperatingMode,
    Verdict,
)
from openpendant.simplemsg.verdicts import VerdictCode as V

SEQUENCES = 10_000


def begun(session: int = 1, number: int = 1, deadline: float = 0.15, now: int = 0) -> Press:
    return expect(Press, PressCounter().begin(session, number, deadline, now))


@pytest.mark.parametrize("deadline", [0.049, 0.2501, 0.0, -1.0, math.nan, math.inf])
def test_a_deadline_outside_50_to_250_ms_is_refused(deadline: float) -> None:
    assert refusal_from(PressCounter().begin(1, 1, deadline, 0)).code is V.BAD_ARGUMENT


@pytest.mark.parametrize("deadline", [SHORTEST_DEADLINE, LONGEST_DEADLINE])
def test_the_bounds_themselves_are_accepted(deadline: float) -> None:
    assert begun(deadline=deadline).deadline_ns == round(deadline * 1e9)


@pytest.mark.parametrize("number", [7, 6, 1, 0, -3])
def test_a_number_that_is_not_higher_than_all_before_is_dead(number: int) -> None:
    counter = PressCounter()
    assert isinstance(counter.begin(1, 7, 0.15, 0), Press)
    assert refusal_from(counter.begin(1, number, 0.15, 0)).code is V.PRESS_DEAD


def test_each_connection_counts_for_itself_and_its_end_gives_no_other_dead_numbers_back() -> None:
    presses = PressCounter()
    for session in (1, 2):
        assert isinstance(presses.begin(session, 5, 0.15, 0), Press)
    presses.forget(2)
    assert refusal_from(presses.begin(1, 5, 0.15, 0)).code is V.PRESS_DEAD


OTHER_BEATS = {
    "another connection": (2, 1, 2),
    "another press": (1, 2, 2),
    "an old press": (1, 0, 2),
    "replayed": (1, 1, 1),
    "reordered": (1, 1, 0),
    "negative": (1, 1, -5),
}


@pytest.mark.parametrize(("session", "number", "beat"), OTHER_BEATS.values(), ids=OTHER_BEATS)
def test_a_beat_that_is_not_the_next_one_of_this_press_prolongs_nothing(
    session: int, number: int, beat: int
) -> None:
    press = begun()
    press.take_beat(1, 1, 1, 100 * MS)
    press.take_beat(session, number, beat, 150 * MS)
    assert press.heard == 100 * MS


def test_a_beat_at_the_deadline_comes_too_late() -> None:
    press = begun()
    press.take_beat(1, 1, 1, 150 * MS)
    assert press.heard == 0
    assert press.is_overdue(150 * MS)
    assert not press.is_overdue(150 * MS - 1)


def test_a_dead_press_takes_no_beats_and_keeps_its_first_reason() -> None:
    press = begun()
    press.end(JogEnd.RELEASED, 20 * MS)
    press.end(JogEnd.SILENT, 30 * MS)
    press.take_beat(1, 1, 1, 40 * MS)
    assert (press.ended, press.ended_at, press.heard) == (JogEnd.RELEASED, 20 * MS, 0)


def test_promise_1_no_press_outlives_its_deadline_whatever_comes_in_between() -> None:
    chance = random.Random(1)
    for _ in range(SEQUENCES):
        deadline_ns = chance.randrange(50, 251) * MS
        press = begun(deadline=deadline_ns / 1e9)
        valid, number, now = 0, 0, 0
        for _ in range(12):
            now += chance.randrange(1, 2 * deadline_ns // 3 if chance.random() < 0.8 else 300 * MS)
            alive = now - valid < deadline_ns
            session = chance.choice((1, 1, 1, 2))
            pressed = chance.choice((1, 1, 1, 0, 2))
            beat = number + chance.choice((1, 1, 1, 2, 0, -1))
            press.take_beat(session, pressed, beat, now)
            if alive and (session, pressed) == (1, 1) and beat > number:
                valid, number = now, beat
            assert press.is_overdue(now) == (now - valid >= deadline_ns)
            if press.is_overdue(now):
                break


def jogging() -> tuple[ServerRig, JogPad]:
    rig, pad = enabled("manual_high")
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    pad.hold(200)
    return rig, pad


def let_go(pad: JogPad) -> None:
    assert pad.release() is V.ACCEPTED


def beat_no_more(pad: JogPad) -> None:
    pad.is_pressed = False


@pytest.mark.parametrize("end", [let_go, beat_no_more])
def test_a_press_that_took_over_from_a_braking_one_ends_as_any_other(
    end: Callable[[JogPad], None],
) -> None:
    rig, pad = jogging()
    let_go(pad)
    pad.hold(20)
    assert rig.activity() is Activity.JOGGING
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    pad.hold(200)
    end(pad)
    pad.hold(500)
    assert rig.activity() is Activity.IDLE
    before = rig.controller.position
    pad.hold(100)
    assert rig.controller.position == before


def test_the_release_of_an_earlier_press_does_not_end_the_one_that_is_held() -> None:
    rig, pad = jogging()
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    assert pad.pendant.code(JogRelease(900, 1)) is V.NOTHING_TO_CONTROL
    pad.hold(300)
    assert rig.activity() is Activity.JOGGING


def test_the_release_of_another_connection_ends_no_press() -> None:
    rig, pad = jogging()
    other = rig.pendant("other")
    assert other.code(JogRelease(900, pad.press_number)) is V.NOTHING_TO_CONTROL
    pad.hold(300)
    assert rig.activity() is Activity.JOGGING


def test_a_state_that_was_the_newest_for_more_than_half_a_second_is_no_recent_one() -> None:
    states = RecentStates()
    states.sent(7, 0)
    assert states.fault(7, 500 * MS) is None
    assert refusal_from(states.fault(7, 500 * MS + 1)).code is V.PRESS_STALE


def test_an_increment_is_planned_under_the_cap_that_was_lowered() -> None:
    rig, pad = enabled(plans_at_once=False)
    assert pad.speed(1.0, 0.1) is V.ACCEPTED
    step(pad, 0.3, 0.0)
    assert only(JointPathJob, rig.jobs).tool_speed == 0.1


# What is told of the press that was taken over.


def hold_on(pad: JogPad) -> None:
    """Leave the press as it is."""


def release(pad: JogPad) -> None:
    assert pad.release() is V.ACCEPTED
    pad.hold(40)


def fall_silent(pad: JogPad) -> None:
    pad.is_pressed = False
    pad.hold(190)


def set_the_override_to_0(pad: JogPad) -> None:
    assert pad.speed(0.0) is V.ACCEPTED
    pad.hold(40)
    assert pad.speed(1.0) is V.ACCEPTED


@pytest.mark.parametrize(
    ("end", "reason"),
    [
        (hold_on, JogEnd.REPLACED),
        (release, JogEnd.RELEASED),
        (fall_silent, JogEnd.SILENT),
        (set_the_override_to_0, JogEnd.STOPPED),
    ],
)
def test_a_press_that_was_taken_over_is_told_as_it_ended(
    end: Callable[[JogPad], None], reason: JogEnd
) -> None:
    rig, pad = jogging()
    end(pad)
    assert rig.activity() is Activity.JOGGING
    assert pad.press(1.0, 0.0) is V.ACCEPTED
    (ended,) = pad.pendant.all(JogEnded)
    assert (ended.press, ended.reason) == (1, reason)
    braked = reason is not JogEnd.REPLACED
    assert (ended.stop_time > 0.0, ended.joint_distance > 0.0) == (braked, braked)


# Where scene, frames or tools are others than those that the jog began with.


def repeat(pad: EmulatedPad, milliseconds: int) -> list[V | None]:
    """Press every 30 ms, as a key that is held in a terminal does."""
    codes = []
    for _ in range(0, milliseconds, 30):
        codes.append(pad.press(1.0, 0.0, 0.0, 0.0, 0.0, 0.0))
        pad.hold(30)
    return codes


def add_to_the_scene(pad: EmulatedPad) -> None:
    shape = {"type": "sphere", "radius": 0.05}
    ball = {"name": "ball", "shape": shape, "position": [0.0, 0.0, 3.0]}
    pad.ask("scene.add", object=ball, expected_revision=0)


def swap_tools(pad: EmulatedPad) -> None:
    view = known(pad.cell.core.environment)
    view.world._view.apply_scene(view.world.frames, view.world._view.built)


@pytest.mark.parametrize("change", [add_to_the_scene, swap_tools])
def test_a_key_that_repeats_does_not_jog_on_in_the_surroundings_of_before(
    change: Callable[[EmulatedPad], None],
) -> None:
    pad = EmulatedPad(EmulatedCell(has_surroundings=True), OperatingMode.MANUAL_HIGH)
    assert repeat(pad, 300) == [V.ACCEPTED] * 10
    began = pad.cell.core.cell.driving.driven_jog
    change(pad)
    codes = repeat(pad, 900)
    assert codes[0] is V.MOVING
    rested = codes.index(V.ACCEPTED)
    assert set(codes[:rested]) == {V.MOVING}
    assert set(codes[rested:]) == {V.ACCEPTED}
    assert known(pad.cell.core.cell.driving.driven_jog) is not began


JOINTS, TOOL = JogSpace.JOINTS, JogSpace.TOOL


def four_bytes(value: float) -> float:
    """Return what a value is after a message with 4-byte reals."""
    rounded: float = struct.unpack("<f", struct.pack("<f", value))[0]
    return rounded


@pytest.mark.parametrize(
    ("space", "values", "share", "joint"),
    [
        (JOINTS, (0.0, 1.01), "joint 2 is 1.01", 1),
        (JOINTS, (-3.0, 0.0), "joint 1 is -3", 0),
        (TOOL, (0.0, 0.0, 1.5, 0.0, 0.0, 0.0), "the tool along z is 1.5", NO_JOINT),
        (TOOL, (0.0, 0.0, 0.0, 0.0, -1.1, 0.0), "the tool about y is -1.1", NO_JOINT),
    ],
)
def test_a_share_beyond_1_is_named_with_its_joint_or_axis(
    space: JogSpace, values: tuple[float, ...], share: str, joint: int
) -> None:
    refusal = refusal_from(shares_fault(space, [four_bytes(value) for value in values]))
    assert (refusal.code, refusal.joint) == (V.BAD_ARGUMENT, joint)
    assert refusal.text == f"the share of {share}; accepted: -1 to 1"
    assert abs(refusal.value) > abs(refusal.limit) == 1.0


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(("space", "joint"), [(JOINTS, 1), (TOOL, NO_JOINT)])
def test_what_is_no_number_is_named_too(value: float, space: JogSpace, joint: int) -> None:
    for judge in (shares_fault, increment_fault):
        refusal = refusal_from(judge(space, (0.0, value, 0.0, 0.0, 0.0, 0.0)))
        assert (refusal.code, refusal.joint) == (V.NOT_FINITE, joint)


def test_shares_in_order_are_not_refused() -> None:
    assert shares_fault(JOINTS, (-1.0, 0.0, 1.0)) is None
    assert increment_fault(JOINTS, (-5.0, 0.0, 1e30)) is None


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (four_bytes(1.01), "1.01"),
        (1.01, "1.01"),
        (four_bytes(0.1), "0.1"),
        (math.nextafter(1.0, 2.0), "1.0000000000000002"),
        (four_bytes(1.0000001), "1.0000001"),
        (1e300, "1e+300"),
    ],
)
def test_a_number_is_told_in_the_fewest_digits_that_mean_it(value: float, text: str) -> None:
    assert told(value) == text


def test_the_verdict_of_a_press_carries_joint_value_and_limit() -> None:
    _, pad = enabled()
    assert pad.press(0.0, four_bytes(1.01)) is V.BAD_ARGUMENT
    verdict = pad.pendant.all(Verdict)[-1]
    assert (verdict.joint, verdict.limit) == (1, 1.0)
    assert verdict.value == pytest.approx(1.01)
    assert verdict.text == "the share of elbow is 1.01; accepted: -1 to 1"


@pytest.mark.parametrize("rate", [50, 100, 250])
def test_all_of_the_last_half_second_may_be_quoted_at_any_tick_rate(rate: int) -> None:
    states, period = RecentStates(), 1_000_000_000 // rate
    for sequence in range(1000):
        states.sent(sequence, sequence * period)
    now = 999 * period
    oldest = 999 - RECENT_NS // period
    assert all(states.fault(sequence, now) is None for sequence in range(oldest, 1000))
    stale = refusal_from(states.fault(oldest - 1, now))
    assert stale.code is V.PRESS_STALE
    assert "the newest is 999" in stale.text
