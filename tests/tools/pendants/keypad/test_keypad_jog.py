"""Held keys: what begins a motion, what goes on with it, and all that ends it."""

import itertools
from copy import deepcopy

import pytest
from rigs.cells.keypad_rig import KeypadRig, as_it_is, key

from openpendant.simplemsg.pendant import OperatingMode, StopChanged, StopKind
from openpendant.simplemsg.serial_frames import KeyDown, KeypadBeat, KeyUp, bytes_of
from openpendant.tools.pendants.keypad.keypad import EnablingSource
from openpendant.tools.pendants.keypad.keys import JOG_KEYS, LABELS
from openpendant.tools.pendants.keypad.line import LineState
from openpendant.tools.pendants.panel import commands as do

JOINTS = do.JOINTS

AXIS_1_PLUS = ((0, 1),)


@pytest.fixture
def rig() -> KeypadRig:
    return KeypadRig()


@pytest.mark.parametrize(
    ("label", "axis", "sign"),
    [
        *(("1", 0, 1), ("4", 0, -1), ("2", 1, 1), ("5", 1, -1), ("3", 2, 1), ("6", 2, -1)),
        *(("7", 3, 1), ("*", 3, -1), ("8", 4, 1), ("0", 4, -1), ("9", 5, 1), ("#", 5, -1)),
    ],
)
def test_a_jog_key_moves_its_axis_while_it_is_held(
    rig: KeypadRig, label: str, axis: int, sign: int
) -> None:
    assert rig.press(label) == [do.PressJog(JOINTS, ((axis, sign),))]
    assert rig.wait(500) == []
    assert rig.let_go() == [do.ReleaseJog()]


def test_a_held_key_is_beaten_with_the_frames_of_the_keypad(rig: KeypadRig) -> None:
    rig.press("1")
    begun = rig.time
    rig.wait(1_000)
    beats = [at for at in rig.times(do.FeedBeat) if at > begun]
    assert 19 <= len(beats) <= 21
    assert max(after - before for before, after in itertools.pairwise(beats)) <= 55


def test_two_keys_move_two_axes_and_the_second_one_goes_on_alone(rig: KeypadRig) -> None:
    assert rig.press("1") == [do.PressJog(JOINTS, AXIS_1_PLUS)]
    assert rig.press("5") == [do.AimJog(JOINTS, ((0, 1), (1, -1)))]
    assert rig.let_go("1") == [do.AimJog(JOINTS, ((1, -1),))]
    assert rig.let_go("5") == [do.ReleaseJog()]


def test_both_keys_of_an_axis_let_it_stand_and_none_of_them_moves_it_again(rig: KeypadRig) -> None:
    rig.press("1")
    assert rig.press("4") == [do.ReleaseJog()]
    assert rig.let_go("4") == []
    assert rig.wait(300) == []
    assert rig.let_go("1") == []
    assert rig.press("1") == [do.PressJog(JOINTS, AXIS_1_PLUS)]


def test_mode_goes_on_to_the_next_frame_and_the_keys_follow(rig: KeypadRig) -> None:
    frames = []
    for _ in range(5):
        rig.strike("C")
        frames.append(rig.keypad.jog.frame)
    assert frames == ["base", "tool", "root", "table", JOINTS]
    rig.strike("C")
    assert rig.press("6") == [do.PressJog("base", ((2, -1),))]


def test_mode_does_nothing_while_a_jog_key_is_down_nor_a_jog_key_while_mode_is(
    rig: KeypadRig,
) -> None:
    rig.press("1")
    assert rig.press("C", 100) == []
    rig.let_go("C")
    assert rig.keypad.jog.frame == JOINTS
    rig.let_go()
    rig.press("C")
    assert rig.press("1") == []
    rig.let_go("1")
    rig.let_go("C")
    assert rig.keypad.jog.frame == "base"


def test_a_robot_of_seven_joints_has_a_second_set_of_keys() -> None:
    rig = KeypadRig(dof=7)
    rig.strike("C")
    assert rig.press("1") == [do.PressJog(JOINTS, ((6, 1),))]
    rig.let_go()
    assert rig.press("2") == []
    assert rig.keypad.messages.newest == "no axis 8; accepted: 1 to 7"
    rig.let_go()
    rig.strike("C")
    assert rig.keypad.jog.frame == "base"


def test_speed_beside_a_held_key_changes_the_override_and_repeats(rig: KeypadRig) -> None:
    rig.state(override=0.25)
    rig.press("1")
    assert rig.press("A", 499) == [do.ChangeSpeed(0.5)]
    assert rig.wait(200) == [do.ChangeSpeed(0.5)]
    assert rig.wait(500) == [do.ChangeSpeed(0.5)] * 2
    assert rig.let_go("A") == []
    assert rig.keypad.is_jogging
    rig.let_go()
    assert rig.press("B") == [do.ChangeSpeed(0.1)]


def test_the_first_jog_key_without_control_asks_for_it_and_moves_nothing(rig: KeypadRig) -> None:
    rig.state(holder=0)
    assert rig.press("1") == [do.TakeControl()]
    rig.state(holder=7)
    assert rig.wait(300) == []
    assert rig.rows[0] == "CONTROL: YOURS      "
    rig.let_go()
    assert rig.press("1") == [do.PressJog(JOINTS, AXIS_1_PLUS)]


@pytest.mark.parametrize("changes", [{"age": 0.4}, {"link": 2}])
def test_values_that_may_be_old_move_nothing(rig: KeypadRig, changes: dict[str, float]) -> None:
    rig.state(**changes)
    assert rig.press("1") == []
    rig.let_go()
    rig.menu()
    assert rig.press("7") == []


def test_without_an_emulated_controller_the_button_must_be_held_as_well(rig: KeypadRig) -> None:
    rig.keypad.controller_described(is_emulated=False)
    assert rig.press("1") == []
    assert rig.rows[0] == "! ENABLING BUTTON   "
    rig.let_go()
    rig.emulated.button = True
    rig.wait(100)
    assert rig.press("1") == [do.PressJog(JOINTS, AXIS_1_PLUS)]
    rig.emulated.button = False
    assert rig.wait(60) == [do.ReleaseJog()]
    rig.emulated.button = True
    assert rig.wait(200) == []


def test_with_the_button_set_it_is_needed_on_an_emulated_controller_too() -> None:
    rig = KeypadRig(enabling=EnablingSource.BUTTON)
    assert rig.press("1") == []
    rig.let_go()
    rig.state(operating_mode=OperatingMode.AUTOMATIC)
    assert rig.press("1") == [do.PressJog(JOINTS, AXIS_1_PLUS)]


# What ends it.


def test_a_pulled_cable_feeds_no_beat_and_is_let_go_within_the_deadline_of_the_line() -> None:
    unpressed = KeypadRig()
    for phase in range(200):
        unpressed.wait(1)
        rig = deepcopy(unpressed)
        rig.press("15" if phase % 2 else "1")
        rig.is_cut, pulled = True, rig.time
        rig.wait(150)
        assert [at for at in rig.times(do.FeedBeat) if at > pulled] == []
        # The last frame came at most 50 ms before, and the core looks at the clock every 20 ms.
        released = [at for at in rig.times(do.ReleaseJog) if at > pulled]
        assert len(released) == 1
        assert released[0] - pulled <= 145


def test_a_keypad_that_starts_anew_with_a_key_down_lets_go_and_waits_for_a_key_up(
    rig: KeypadRig,
) -> None:
    rig.press("1")
    rig.emulated.start(rig.now, reset_cause=8)
    assert do.ReleaseJog() in rig.wait(60)
    rig.asked.clear()
    rig.wait(2_000)
    assert rig.moves == []
    rig.let_go()
    assert rig.press("1") == [do.PressJog(JOINTS, AXIS_1_PLUS)]


def test_a_bridge_that_starts_anew_moves_nothing_before_a_key_up(rig: KeypadRig) -> None:
    rig.press("1")
    fresh = KeypadRig(ready=False)
    fresh.emulated, fresh.now = rig.emulated, rig.now
    fresh.state()
    fresh.keypad.line.opened(fresh.now)
    fresh.wait(3_000)
    assert fresh.keypad.line.state is LineState.LET_GO
    assert fresh.moves == []
    fresh.let_go()
    assert fresh.press("1") == [do.PressJog(JOINTS, AXIS_1_PLUS)]


def test_a_lost_server_needs_control_and_a_key_up_again(rig: KeypadRig) -> None:
    rig.press("1")
    rig.keypad.lost("gone")
    assert not rig.keypad.is_jogging
    assert rig.keypad.line.state is LineState.LET_GO
    rig.wait(200)
    rig.keypad.cell.is_connected = True
    rig.asked.clear()
    rig.wait(500)
    assert rig.moves == []
    rig.let_go()
    rig.state(holder=0)
    assert rig.press("1") == [do.TakeControl()]


def test_the_end_of_the_press_at_the_server_needs_a_key_up(rig: KeypadRig) -> None:
    rig.press("1")
    rig.keypad.jog_over()
    assert rig.wait(500) == []
    assert rig.press("2") == []
    rig.let_go()
    assert rig.press("1") == [do.PressJog(JOINTS, AXIS_1_PLUS)]


def test_a_speed_key_that_is_held_as_the_jog_ends_repeats_no_more(rig: KeypadRig) -> None:
    rig.press("1A")
    rig.keypad.jog_over()
    assert rig.wait(2_000) == []


@pytest.mark.parametrize("key_down", ["", "1"])
def test_a_stop_by_others_lets_go_and_leaves_ready_where_no_key_was_down(
    rig: KeypadRig, key_down: str
) -> None:
    rig.press(key_down)
    asked = rig.keypad.stop_changed(StopChanged(1, StopKind.SOFTWARE, "kim", "button"))
    assert (do.ReleaseJog() in asked) == bool(key_down)
    expected = LineState.LET_GO if key_down else LineState.READY
    assert rig.keypad.line.state is expected


# STOP.


@pytest.mark.parametrize("before", ["", "1", "15", "C", "A", "12"])
def test_stop_stops_whatever_else_is_down(rig: KeypadRig, before: str) -> None:
    rig.press(before)
    asked = rig.press("D")
    assert do.StopRobot("STOP key") in asked
    first = next(each for each in asked if not isinstance(each, do.AimJog | do.FeedBeat))
    assert first == do.StopRobot("STOP key")
    assert not rig.keypad.is_jogging


def test_stop_counts_before_any_key_was_seen_to_be_let_go(rig: KeypadRig) -> None:
    rig.press("1")
    rig.emulated.start(rig.now)
    rig.wait(40)
    assert rig.keypad.line.state is LineState.LET_GO
    assert do.StopRobot("STOP key") in rig.press("D")


def test_stop_is_noticed_by_a_beat_where_its_key_down_was_lost(rig: KeypadRig) -> None:
    assert rig.feed(bytes_of(KeypadBeat(255, 0, 1 << key("D"), 0), 77)) == [
        do.StopRobot("STOP key")
    ]
    assert rig.feed(bytes_of(KeypadBeat(255, 0, 1 << key("D"), 50), 78)) == []


def test_stop_needs_no_login(rig: KeypadRig) -> None:
    rig.keypad.turned_away("wrong password")
    rig.keypad.cell.is_greeted = True
    assert do.StopRobot("STOP key") in rig.press("D")


def test_a_stop_without_a_link_is_owed_and_the_display_says_so(rig: KeypadRig) -> None:
    rig.keypad.lost("gone")
    assert rig.strike("D") == []
    assert rig.rows[0] == "STOP NOT CONFIRMED  "
    assert rig.keypad.greeted() == [do.StopRobot("STOP key, sent again")]


# Two keys, ghosts.


def test_of_each_pair_of_keys_in_either_order_both_move_and_nothing_else() -> None:
    rig = KeypadRig()
    for first, second in itertools.permutations(sorted(JOG_KEYS), 2):
        rig.asked.clear()
        rig.press(LABELS[first] + LABELS[second])
        rig.let_go()
        one, two = JOG_KEYS[first], JOG_KEYS[second]
        expected: list[do.Command] = [do.PressJog(JOINTS, ((one.axis, one.sign),))]
        if one.axis != two.axis:
            both = tuple(sorted([(one.axis, one.sign), (two.axis, two.sign)]))
            expected.append(do.AimJog(JOINTS, both))
        assert rig.moves[: len(expected)] == expected
        assert all(isinstance(each, do.AimJog) for each in rig.moves[len(expected) :])
        assert rig.keypad.line.state is LineState.READY


OTHER_KEYS = sorted(set(range(16)) - set(JOG_KEYS))


@pytest.mark.parametrize("other", OTHER_KEYS, ids=lambda number: LABELS[number])
@pytest.mark.parametrize("jog_is_first", [True, False])
def test_of_a_jog_key_and_another_the_jog_key_moves_unless_mode_or_stop_was_first(
    other: int, jog_is_first: bool
) -> None:
    rig = KeypadRig()
    for jog in sorted(JOG_KEYS):
        rig.asked.clear()
        pair = (jog, other) if jog_is_first else (other, jog)
        rig.press(LABELS[pair[0]] + LABELS[pair[1]])
        axis = JOG_KEYS[jog]
        may_move = jog_is_first or other not in (key("C"), key("D"))
        moves = [do.PressJog(JOINTS, ((axis.axis, axis.sign),))] if may_move else []
        assert rig.moves == moves, pair
        assert bool(rig.times(do.StopRobot)) == (other == key("D"))
        assert not rig.keypad.is_jogging or other != key("D")
        rig.let_go(LABELS[jog])
        rig.let_go()
        assert rig.moves == moves, pair
        rig.keypad.stop_key.latched()
        rig.keypad.jog.frame = JOINTS


def test_of_two_keys_that_jog_nothing_none_moves() -> None:
    rig = KeypadRig()
    for pair in itertools.permutations(OTHER_KEYS, 2):
        rig.asked.clear()
        rig.press(LABELS[pair[0]] + LABELS[pair[1]])
        rig.let_go()
        assert rig.moves == [], pair
        assert bool(rig.times(do.StopRobot)) == (key("D") in pair)
        rig.keypad.stop_key.latched()


def test_of_all_triples_of_keys_pressed_at_once_none_moves_and_one_with_stop_stops() -> None:
    rig = KeypadRig()
    for triple in itertools.combinations(range(16), 3):
        rig.asked.clear()
        for number in triple:
            rig.emulated.press(number)
        rig.wait(20)
        assert rig.moves == [], triple
        if key("D") in triple:
            assert rig.times(do.StopRobot), triple
        rig.let_go(wait=20)
        rig.keypad.stop_key.latched()
        rig.keypad.menu.close()
        assert rig.keypad.line.state is LineState.READY


def test_a_third_key_ends_what_two_moved_until_all_were_let_go(rig: KeypadRig) -> None:
    rig.press("15")
    rig.asked.clear()
    assert rig.press("9") == [do.ReleaseJog()]
    rig.wait(100)
    assert rig.rows[:3] == ["TOO MANY KEYS       ", "two at most         ", "let go of all       "]
    rig.let_go("9")
    rig.let_go("5")
    assert rig.press("2") == []
    assert rig.moves == []
    rig.let_go()
    assert rig.press("1") == [do.PressJog(JOINTS, AXIS_1_PLUS)]


# What a frame may do.


def test_a_key_that_only_a_beat_shows_does_nothing_until_it_was_up(rig: KeypadRig) -> None:
    rig.up = lambda data: b"" if data[2:3] == b"\x02" else data  # KEY_DOWN is lost
    rig.press("1")
    assert rig.wait(500) == []
    rig.up = as_it_is
    assert rig.press("2") == []
    rig.let_go()
    assert rig.press("1") == [do.PressJog(JOINTS, AXIS_1_PLUS)]


def test_a_lost_key_up_is_made_good_by_the_next_beat(rig: KeypadRig) -> None:
    rig.press("1")
    rig.up = lambda data: b"" if data[2:3] == b"\x03" else data
    assert rig.let_go(wait=100) == [do.ReleaseJog()]


@pytest.mark.parametrize("late", range(0, 301, 25))
def test_a_key_down_that_waited_for_a_tenth_of_a_second_moves_nothing(
    rig: KeypadRig, late: int
) -> None:
    """The beats before it came in time, so its own clock tells how late it is."""
    time = rig.time - 100_000
    rig.wait(200)
    frame = bytes_of(KeyDown(0, 0, 1, (time + 200 - late) % 65_536), 99)
    moved = rig.feed(frame) == [do.PressJog(JOINTS, AXIS_1_PLUS)]
    assert moved == (late < 100)


def test_frames_that_were_held_back_for_ten_seconds_move_nothing(rig: KeypadRig) -> None:
    held_back = bytearray()

    def hold(data: bytes) -> bytes:
        held_back.extend(data)
        return b""

    rig.up = hold
    rig.strike("1")
    rig.press("2")
    rig.wait(10_000)
    rig.up = as_it_is
    rig.asked.clear()
    rig.feed(bytes(held_back))
    rig.wait(1_000)
    assert rig.moves == []


def test_a_hello_and_all_that_follows_in_one_burst_move_nothing(rig: KeypadRig) -> None:
    """The welcome is answered first, which no burst from before it can hold."""
    rig.is_cut = True
    rig.wait(1_000)
    burst = bytearray()
    rig.emulated.start(rig.now)
    for _ in range(200):
        rig.now += 1_000_000
        rig.emulated.tick(rig.now)
        burst += rig.emulated.output()
    burst += bytes_of(KeyUp(255, 0, 0, 210), 200) + bytes_of(KeyDown(0, 0, 1, 220), 201)
    rig.keypad.line.opened(rig.now)
    rig.asked.clear()
    rig.feed(bytes(burst))
    assert rig.moves == []


@pytest.mark.parametrize("silence", range(20, 320, 20))
def test_beats_that_come_late_release_from_an_eighth_of_a_second_on(
    rig: KeypadRig, silence: int
) -> None:
    rig.press("1")
    rig.wait(40)
    rig.asked.clear()
    rig.is_cut = True
    rig.wait(silence)
    rig.is_cut = False
    rig.wait(200)
    released = do.ReleaseJog() in [each for _, each in rig.asked]
    if silence <= 70:
        assert not released
    if silence >= 130:
        assert released
    assert all(isinstance(each, do.FeedBeat | do.ReleaseJog) for _, each in rig.asked)
