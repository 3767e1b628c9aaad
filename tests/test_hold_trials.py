"""The judgement of the browser tests' hold trials, without a browser."""

from collections.abc import Callable
from itertools import count

import pytest
from browser import hold_trials
from browser.hold_trials import LATE, MOST_FAILED, MOST_TRIALS, TICK, TRIALS, HoldTrials
from browser.motion_tap import Ended, MotionTap, MovedOn, Seen

BOUND = 0.05
STEADY = 0.01


class Idle:
    """An idle process that was late as often as a test says."""

    def __init__(self, *stalls: tuple[float, float]) -> None:
        self.told = stalls

    def now(self) -> float:
        return 0.0

    def stalls(self, more_than: float) -> list[tuple[float, float]]:
        return [(due, woke) for due, woke in self.told if woke - due > more_than]


@pytest.fixture
def idle(monkeypatch: pytest.MonkeyPatch) -> Idle:
    watch = Idle()
    monkeypatch.setattr(hold_trials, "_idle_watch", lambda: watch)
    return watch


def tried(bound: float, *delays: float) -> HoldTrials:
    """Return judged trials that begin each a second later."""
    trials = HoldTrials("a way", bound)
    at = count(1)
    turns = iter((delays * MOST_TRIALS)[:MOST_TRIALS])

    def trial(_: str) -> Ended:
        began = float(next(at))
        return Ended(began, began + next(turns), "ramp")

    trials.run(trial, lambda: None)
    trials.judge()
    return trials


def test_ten_trials_within_the_bound_pass(idle: Idle) -> None:
    assert len(tried(BOUND, 0.049).found) == TRIALS


@pytest.mark.parametrize(
    "delays", [(0.051,), (0.01,) * 9 + (0.151,)], ids=["the median", "the worst"]
)
def test_over_its_bound_fails(idle: Idle, delays: tuple[float, ...]) -> None:
    with pytest.raises(AssertionError, match="bound 50 ms"):
        tried(BOUND, *delays)


def test_a_way_of_ending_that_is_not_allowed_fails(idle: Idle) -> None:
    trials = HoldTrials("a way", BOUND, [Ended(1.0, 1.01, "stop")] * TRIALS)
    with pytest.raises(AssertionError, match="kind='stop'"):
        trials.judge()


@pytest.mark.parametrize(
    ("bound", "late", "void"),
    [(TICK, 0.011, 1), (TICK, 0.009, 0), (0.26, LATE + 0.001, 1), (0.26, LATE - 0.001, 0)],
)
def test_a_trial_is_void_where_the_machine_was_late_by_the_bound_or_20_ms(
    idle: Idle, bound: float, late: float, void: int
) -> None:
    idle.told = ((3.001, 3.001 + late),)
    trials = tried(bound, 0.005)
    assert (trials.void, len(trials.found)) == (void, TRIALS)


def test_a_machine_that_was_late_before_the_hand_left_makes_nothing_void(idle: Idle) -> None:
    idle.told = ((2.5, 2.9),)
    assert tried(BOUND, 0.01).void == 0


def test_where_all_trials_are_void_nothing_is_judged_and_it_says_so(idle: Idle) -> None:
    idle.told = ((0.0, 1000.0),)
    with pytest.raises(AssertionError, match="not judged, 30 of 30 trials were void"):
        tried(BOUND, 0.01)


def _fails(error: AssertionError) -> Callable[[str], Ended]:
    def trial(_: str) -> Ended:
        raise error

    return trial


def test_a_robot_that_moved_on_fails_beside_a_late_machine_too(idle: Idle) -> None:
    idle.told = ((-1.0, 1.0),)
    with pytest.raises(MovedOn):
        HoldTrials("a way", BOUND).run(_fails(MovedOn("it moved")), lambda: None)


def test_a_trial_that_failed_beside_a_late_machine_is_void_and_begun_anew(idle: Idle) -> None:
    idle.told = ((-1.0, 1.0),)
    recovered = []
    with pytest.raises(AssertionError, match="not judged") as judged:
        HoldTrials("a way", BOUND).run(
            _fails(AssertionError("no jog")), lambda: recovered.append(True)
        )
    assert len(recovered) == MOST_FAILED - 1
    assert str(judged.value.__cause__) == "no jog"


def test_a_trial_that_failed_beside_a_machine_in_time_fails(idle: Idle) -> None:
    with pytest.raises(AssertionError, match="no jog"):
        HoldTrials("a way", BOUND).run(_fails(AssertionError("no jog")), lambda: None)


@pytest.fixture
def tap(monkeypatch: pytest.MonkeyPatch) -> MotionTap:
    """A tap that relays nothing."""
    monkeypatch.setattr("browser.loopback_relay.LoopbackRelay.__init__", lambda *_: None)
    return MotionTap(0)


def _saw(tap: MotionTap, steps: list[float], *stops: float) -> None:
    """Have a tap see set-points each tick from 0 s, and STOPs."""
    place, seen = 0.0, [Seen(0.0, (0.0,))]
    for number, step in enumerate(steps, 1):
        place += step
        seen.append(Seen(number * TICK, (place,)))
    seen += [Seen(at, ()) for at in stops]
    tap._seen = sorted(seen, key=lambda each: each.at)


def test_the_ramp_begins_with_its_first_smaller_step(tap: MotionTap) -> None:
    _saw(tap, [STEADY] * 20 + [0.009, 0.005, 0.001])
    found = tap.end_of_steady(0, 0.195)
    assert found.at == pytest.approx(21 * TICK)
    assert found.kind == "ramp"


def test_a_late_tick_begins_no_ramp(tap: MotionTap) -> None:
    _saw(tap, [STEADY] * 20 + [0.005, 0.015, STEADY, 0.005])
    assert tap.end_of_steady(0, 0.195).at == pytest.approx(24 * TICK)


def test_a_stop_in_front_of_a_ramp_ends_it(tap: MotionTap) -> None:
    _saw(tap, [STEADY] * 20, 0.201)
    found = tap.end_of_steady(0, 0.195)
    assert (found.at, found.kind) == (0.201, "stop")


def test_a_jog_that_was_stopped_before_the_hand_left_is_told_as_such(tap: MotionTap) -> None:
    _saw(tap, [STEADY] * 20, 0.201)
    with pytest.raises(AssertionError, match="stopped 99 ms before"):
        tap.end_of_steady(0, 0.3)


def test_a_jog_that_nothing_ended_is_told_as_such(tap: MotionTap) -> None:
    _saw(tap, [STEADY] * 20)
    with pytest.raises(AssertionError, match="nothing ended the jog"):
        tap.end_of_steady(0, 0.15)


def test_a_jog_is_waited_for_until_it_is_steady(tap: MotionTap) -> None:
    rising = [number * STEADY / 10 for number in range(10)]
    _saw(tap, [*rising, *[STEADY] * 5])
    with pytest.raises(AssertionError, match="no steady jog"):
        tap.wait_for_steady(0, within=0.0)
    _saw(tap, [*rising, *[STEADY] * 6])
    tap.wait_for_steady(0, within=0.0)


def test_a_robot_that_is_sent_where_it_stands_is_not_jogged_steadily(tap: MotionTap) -> None:
    _saw(tap, [0.0] * 20)
    with pytest.raises(AssertionError, match="no steady jog"):
        tap.wait_for_steady(0, within=0.0)


def test_a_set_point_after_rest_is_a_violation(tap: MotionTap) -> None:
    tap.forget = lambda: None  # type: ignore[method-assign]
    _saw(tap, [STEADY])
    with pytest.raises(MovedOn, match="violation"):
        tap.stays_at_rest(0.0)
