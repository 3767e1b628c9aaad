"""What each mode allows, when the enabling device (training) enables, and the caps (promise 32)."""

import itertools
import math

import pytest
from rigs.cells.expectations import refusal_from
from rigs.cells.server_rig import MS

from openpendant.server.control import RECOVERY_SPEED, REDUCED_SPEED, MotionKind, OperatingModes
from openpendant.server.settings.cell_settings import Modes
from openpendant.simplemsg import ControllerMode
from openpendant.simplemsg.pendant import EnablingPosition, OperatingMode
from openpendant.simplemsg.verdicts import VerdictCode as V

HOLDER, OBSERVER = 1, 2
UNKNOWN, MANUAL, AUTO = ControllerMode.UNKNOWN, ControllerMode.MANUAL, ControllerMode.AUTO
HELD, PANIC = EnablingPosition.HELD, EnablingPosition.PANIC
RELEASED = EnablingPosition.RELEASED
T1, T2 = OperatingMode.MANUAL_REDUCED, OperatingMode.MANUAL_HIGH
AUTOMATIC, RECOVERY = OperatingMode.AUTOMATIC, OperatingMode.RECOVERY
JOG, MOVE, PROGRAM, ROS = MotionKind


def modes(mode: OperatingMode = T1) -> OperatingModes:
    made = OperatingModes(Modes.model_validate({"initial": mode.name.lower()}))
    assert made.mode(UNKNOWN) is mode
    return made


def mirror() -> OperatingModes:
    return OperatingModes(Modes(selector="controller"))


def unready(made: OperatingModes, kind: MotionKind, at: int = 0) -> V | None:
    refusal = made.unready(kind, HOLDER, AUTO, at)
    return None if refusal is None else refusal.code


ALLOWED = {
    T1: {JOG, MOVE, PROGRAM},
    T2: {JOG, MOVE, PROGRAM},
    AUTOMATIC: {MOVE, PROGRAM, ROS},
    RECOVERY: {JOG},
}


@pytest.mark.parametrize(
    ("mode", "kind", "position"),
    list(itertools.product(OperatingMode, MotionKind, EnablingPosition)),
)
def test_promise_32_each_mode_allows_its_motions_and_asks_for_enabling_in_manual(
    mode: OperatingMode, kind: MotionKind, position: EnablingPosition
) -> None:
    made = modes(mode)
    made.enable(HOLDER, RELEASED, 0)
    made.enable(HOLDER, position, 10 * MS)
    if kind not in ALLOWED[mode]:
        expected = V.MODE_FORBIDS
    elif mode is AUTOMATIC or position is HELD:
        expected = None
    else:
        expected = V.NOT_ENABLED
    assert unready(made, kind, 20 * MS) is expected


@pytest.mark.parametrize("kind", MotionKind)
@pytest.mark.parametrize("controller", ControllerMode)
def test_a_mirrored_selector_bars_nothing_and_asks_for_no_enabling_of_ours(
    controller: ControllerMode, kind: MotionKind
) -> None:
    assert mirror().unready(kind, HOLDER, controller, 0) is None


@pytest.mark.parametrize(
    ("controller", "mode", "cap"),
    [(MANUAL, T1, REDUCED_SPEED), (AUTO, AUTOMATIC, None), (UNKNOWN, T1, REDUCED_SPEED)],
)
def test_a_mirrored_mode_is_the_controllers_and_an_unknown_one_the_slowest(
    controller: ControllerMode, mode: OperatingMode, cap: float | None
) -> None:
    assert mirror().mode(controller) is mode
    assert mirror().tool_speed_cap(controller) == cap


def test_a_mirrored_mode_is_never_set() -> None:
    assert refusal_from(mirror().set_mode(AUTOMATIC)).code is V.MODE_NOT_OURS


@pytest.mark.parametrize("mode", [0, 5, -1])
def test_a_mode_that_does_not_exist_is_refused_and_changes_nothing(mode: int) -> None:
    made = modes(T2)
    assert refusal_from(made.set_mode(mode)).code is V.BAD_ARGUMENT
    assert made.mode(AUTO) is T2


# Enabling (training).


def enabled() -> OperatingModes:
    made = modes(T1)
    made.enable(HOLDER, HELD, 0)
    assert made.is_enabled(HOLDER, 0)
    return made


def test_enabling_counts_for_150_ms_and_not_a_nanosecond_longer() -> None:
    made = enabled()
    assert made.is_enabled(HOLDER, 150 * MS - 1)
    assert not made.is_enabled(HOLDER, 150 * MS)
    assert made.enabling(HOLDER, 150 * MS) is RELEASED


ENABLING: dict[str, str] = {
    "a device that fell silent must be let go and pressed again": (
        "200 held: no, 250 held: no, 300 released: no, 350 held: yes"
    ),
    "a long release is no silence": "10 released: no, 10000 held: yes",
    "pressed through enables nothing until let go": (
        "10 panic: no, 20 held: no, 30 released: no, 40 held: yes"
    ),
    "no position that there is enables nothing until let go": (
        "10 3: no, 20 held: no, 30 released: no, 40 held: yes, 50 -1: no, 60 held: no,"
        " 70 released: no, 80 held: yes, 90 2147483647: no, 95 held: no, 97 released: no,"
        " 99 held: yes"
    ),
    "pressing through from released arms nothing": "5 released: no, 10 panic: no, 20 held: no",
    "setting the mode that is set demands nothing": "0 t1: yes",
    "an observer's device does not disturb": (
        "10 observer released: yes, 10 observer held: yes, 10 observer panic: yes"
    ),
    "an observer cannot spare the holder the new press": (
        "0 stop: no, 10 observer released: no, 20 held: no"
    ),
    "a connection that ended enables no more": "0 gone: no",
}
"""When [ms], what, and whether the holder, who enabled at 0, is enabled after it."""


@pytest.mark.parametrize("happenings", ENABLING.values(), ids=ENABLING)
def test_the_holder_is_enabled_by_a_device_that_is_held_and_was_let_go_before(
    happenings: str,
) -> None:
    made = enabled()
    positions = {each.name.lower(): int(each) for each in EnablingPosition}
    for each in happenings.split(", "):
        happening, _, is_enabled = each.partition(": ")
        at, *who, what = happening.split()
        now = int(at) * MS
        if what == "t1":
            made.set_mode(T1)
        elif what == "stop":
            made.disarm()
        elif what == "gone":
            made.forget(HOLDER)
        else:
            position = positions[what] if what in positions else int(what)
            made.enable(OBSERVER if who else HOLDER, position, now)
        assert made.is_enabled(HOLDER, now) is (is_enabled == "yes"), each


def test_a_change_of_mode_demands_a_new_press() -> None:
    made = enabled()
    made.set_mode(T2)
    made.enable(HOLDER, HELD, 10 * MS)
    assert not made.is_enabled(HOLDER, 10 * MS)
    refusal = refusal_from(made.unready(JOG, HOLDER, AUTO, 10 * MS))
    assert "let it go first" in refusal.text


def test_a_stop_demands_a_new_press_of_whoever_squeezes_but_not_of_others() -> None:
    made = enabled()
    made.disarm()
    made.enable(OBSERVER, HELD, 10 * MS)
    made.enable(HOLDER, HELD, 10 * MS)
    assert not made.is_enabled(HOLDER, 10 * MS)
    assert made.is_enabled(OBSERVER, 10 * MS)


# Speeds.


def cap(made: OperatingModes) -> float | None:
    return made.tool_speed_cap(AUTO)


def test_promise_12_t1_is_capped_at_250_mm_a_second_and_only_lowered() -> None:
    made = modes(T1)
    assert cap(made) == 0.25
    assert made.set_speed(1.0, 0.26, AUTO) is not None
    assert made.set_speed(1.0, 0.1, AUTO) is None
    assert cap(made) == 0.1


def test_t2_begins_at_the_reduced_speed_at_each_entry() -> None:
    made = modes(T2)
    assert cap(made) == REDUCED_SPEED
    assert made.set_speed(1.0, 2.0, AUTO) is None
    assert cap(made) == 2.0
    for away in (T1, AUTOMATIC, RECOVERY):
        made.set_mode(away)
        made.set_mode(T2)
        assert cap(made) == REDUCED_SPEED
        made.set_speed(1.0, 2.0, AUTO)


def test_recovery_is_slow_and_a_lower_cap_makes_it_slower() -> None:
    made = modes(RECOVERY)
    assert cap(made) == RECOVERY_SPEED
    made.set_speed(1.0, 0.05, AUTO)
    assert cap(made) == 0.05


def test_automatic_knows_no_cap_of_the_tool() -> None:
    assert cap(modes(AUTOMATIC)) is None


def test_a_cap_that_automatic_would_not_hold_is_refused_and_sets_nothing() -> None:
    made = modes(AUTOMATIC)
    refusal = refusal_from(made.set_speed(0.5, 0.1, AUTO))
    assert (refusal.code, refusal.value, refusal.limit) == (V.MODE_FORBIDS, 0.1, 0.0)
    assert made.override == 1.0
    made.set_mode(T1)
    assert cap(made) == REDUCED_SPEED


def test_automatic_takes_an_override_that_names_no_cap() -> None:
    made = modes(AUTOMATIC)
    assert made.set_speed(0.5, 0.0, AUTO) is None


def test_a_cap_is_refused_in_the_automatic_of_the_controllers_own_selector() -> None:
    made = mirror()
    assert refusal_from(made.set_speed(1.0, 0.1, AUTO)).code is V.MODE_FORBIDS
    assert made.set_speed(1.0, 0.1, MANUAL) is None


@pytest.mark.parametrize("override", [-0.01, 1e-9, 0.0009, 1.01, math.nan, math.inf, -math.inf])
def test_an_override_between_0_and_the_least_or_above_1_is_refused_and_sets_nothing(
    override: float,
) -> None:
    made = modes(T2)
    assert refusal_from(made.set_speed(override, 0.1, AUTO)).code is V.BAD_ARGUMENT
    assert (made.override, cap(made)) == (1.0, REDUCED_SPEED)


@pytest.mark.parametrize("override", [0.0, 0.001, 1.0])
def test_an_override_of_0_or_from_the_least_to_1_is_taken(override: float) -> None:
    made = modes(T2)
    assert made.set_speed(override, 0.0, AUTO) is None
    assert made.override == override


@pytest.mark.parametrize("speed", [-0.1, 10.1, math.nan, math.inf])
def test_a_cap_that_is_none_is_refused_and_sets_nothing(speed: float) -> None:
    made = modes(T2)
    assert made.set_speed(0.5, speed, AUTO) is not None
    assert (made.override, cap(made)) == (1.0, REDUCED_SPEED)
