"""The gamepad's core: what is pressed, aimed and let go, and that nothing moves by itself."""

import pytest
from rigs.cells.gamepad_rig import GamepadRig, left, push
from rigs.cells.panel_rig import MS
from rigs.data.device_bytes import (
    CROSS,
    DROPPED,
    ENABLING,
    FASTER,
    LEFT_X,
    LEFT_Y,
    REL,
    REPORT,
    RIGHT_KEY,
    RIGHT_X,
    SHIFT,
    SLOWER,
    STOP,
    axis,
    button,
)
from rigs.data.device_bytes import KEY as KEYS

from openpendant.simplemsg.pendant import ModeChanged, OperatingMode, StopChanged, StopKind
from openpendant.tools.pendants.gamepad.commands import AimSticks, GamepadCommand, PressSticks
from openpendant.tools.pendants.panel import commands as do

MOVING = (PressSticks, AimSticks)


@pytest.fixture
def rig() -> GamepadRig:
    made = GamepadRig()
    made.open()
    return made


@pytest.fixture
def mouse() -> GamepadRig:
    return GamepadRig(path="/dev/input/event7")


def pressed(rig: GamepadRig) -> None:
    """Hold the enabling button and push the left stick forward."""
    assert rig.hold() == [do.Enable(True)]
    (press,) = rig.stick(-1.0)
    assert isinstance(press, PressSticks)


def along_x(share: float) -> tuple[float, ...]:
    return (pytest.approx(share), 0.0, 0.0, 0.0, 0.0, 0.0)  # type: ignore[return-value]  # equal to a number nearby


def moving(asked: list[GamepadCommand]) -> list[GamepadCommand]:
    return [each for each in asked if isinstance(each, MOVING)]


# Press and aim.


def test_a_stick_without_the_enabling_button_moves_nothing(rig: GamepadRig) -> None:
    assert rig.stick(-1.0) == []
    assert rig.pass_time(500) == []


def test_the_enabling_button_alone_enables_and_moves_nothing(rig: GamepadRig) -> None:
    assert rig.hold() == [do.Enable(True)]
    assert set(rig.pass_time(200)) == {do.FeedBeat()}


def test_a_stick_off_centre_presses_while_the_button_is_held(rig: GamepadRig) -> None:
    rig.hold()
    assert rig.stick(-1.0) == [PressSticks("base", along_x(1.0))]


def test_a_stick_that_is_off_already_moves_once_the_button_goes_down(rig: GamepadRig) -> None:
    rig.stick(-1.0)
    assert rig.hold() == [do.Enable(True), PressSticks("base", along_x(1.0))]


def test_a_stick_within_its_dead_zone_presses_nothing(rig: GamepadRig) -> None:
    rig.hold()
    assert rig.stick(-0.14) == []


def test_the_button_let_go_lets_go_of_all_at_once(rig: GamepadRig) -> None:
    pressed(rig)
    assert rig.let_go() == [do.Enable(False)]
    assert rig.pass_time(500) == []


def test_the_button_held_again_moves_again_without_a_centred_stick(rig: GamepadRig) -> None:
    pressed(rig)
    rig.let_go()
    assert moving(rig.hold())


def test_a_button_that_comes_up_and_goes_down_in_one_read_is_two_presses(rig: GamepadRig) -> None:
    pressed(rig)
    asked = rig.read(button(ENABLING, down=False) + button(ENABLING, down=True))
    assert asked == [do.Enable(False), do.Enable(True), PressSticks("base", along_x(1.0))]


def test_a_centred_stick_releases_and_keeps_enabling(rig: GamepadRig) -> None:
    pressed(rig)
    assert rig.stick(0.0) == [do.ReleaseJog()]
    assert set(rig.pass_time(200)) == {do.FeedBeat()}
    assert moving(rig.stick(1.0))


def test_all_sticks_make_one_press(rig: GamepadRig) -> None:
    rig.hold()
    rig.stick(-1.0)
    rig.now += 40 * MS
    (aim,) = rig.stick(-1.0, RIGHT_X)
    assert aim == AimSticks("base", (1.0, 0.0, 0.0, 0.0, 0.0, 1.0))


def test_a_press_is_aimed_at_most_25_times_a_second_and_at_last_where_the_stick_is(
    rig: GamepadRig,
) -> None:
    pressed(rig)
    asked: list[GamepadCommand] = []
    for step in range(100):
        rig.now += 10 * MS
        rig.state()
        asked += rig.stick(-0.99 + 0.005 * step)
        asked += rig.pad.advance(rig.now)
    aims = [each for each in asked if isinstance(each, AimSticks)]
    assert 10 <= len(aims) <= 25
    rig.stick(-0.4)
    (*_, end) = moving(rig.pass_time(100))
    assert isinstance(end, AimSticks)
    assert end.values[0] == pytest.approx((0.4 - 0.15) / 0.85, abs=1e-3)


@pytest.mark.parametrize(("to", "is_aimed"), [(-0.9, True), (-0.99, False)])
def test_a_change_of_two_hundredths_or_less_is_no_other_aim(
    rig: GamepadRig, to: float, is_aimed: bool
) -> None:
    pressed(rig)
    rig.now += 100 * MS
    assert bool(moving(rig.stick(to))) is is_aimed


def test_an_axis_that_comes_to_rest_is_aimed_anew_however_small_it_was(rig: GamepadRig) -> None:
    rig.hold()
    rig.read(axis(LEFT_Y, -1.0) + axis(LEFT_X, -0.16))
    rig.now += 100 * MS
    (aim,) = rig.stick(0.0, LEFT_X)
    assert aim == AimSticks("base", along_x(1.0))


def test_the_shift_button_turns_where_the_stick_moved(rig: GamepadRig) -> None:
    pressed(rig)
    rig.now += 100 * MS
    (aim,) = rig.read(button(SHIFT, down=True))
    assert aim == AimSticks("base", (0.0, 0.0, 0.0, 0.0, 1.0, 0.0))


def test_a_sign_leaves_every_40_ms_while_the_button_is_held(rig: GamepadRig) -> None:
    pressed(rig)
    beats = [each for each in rig.pass_time(1000) if each == do.FeedBeat()]
    assert len(beats) == 25


def test_joints_are_as_many_as_the_robot_has() -> None:
    for dof, values in ((4, (1.0, 0.0, 0.0, 0.0)), (7, (1.0, *[0.0] * 6))):
        rig = GamepadRig(dof=dof)
        rig.pad.jog.frame = ""
        rig.open()
        rig.hold()
        assert rig.stick(-1.0) == [PressSticks("", values)]


# What must be let go first.


@pytest.mark.parametrize("axes", [{"a1": -1.0}, {"a0": 0.3}, {"down": frozenset({ENABLING})}])
def test_what_is_pressed_at_opening_counts_once_it_was_let_go(axes: dict[str, float]) -> None:
    rig = GamepadRig()
    assert rig.open(**axes) == []
    rig.hold()
    assert rig.pass_time(200) == []
    assert rig.read(axis(LEFT_Y, -1.0)) == []
    rig.let_go()
    for number in (LEFT_X, LEFT_Y):
        rig.stick(0.0, number)
    pressed(rig)


def test_the_state_at_opening_moves_nothing_however_it_is_read() -> None:
    rig = GamepadRig()
    asked = rig.read(button(ENABLING, down=True, at_opening=True))
    asked += rig.read(axis(LEFT_Y, -1.0, at_opening=True))
    assert [*asked, *rig.pass_time(200)] == []


def test_a_state_told_anew_in_motion_lets_go(rig: GamepadRig) -> None:
    pressed(rig)
    assert rig.read(axis(LEFT_Y, -1.0, at_opening=True)) == [do.Enable(False)]
    assert rig.hold() == []
    rig.let_go()
    rig.stick(0.0)
    pressed(rig)


def test_a_device_that_is_gone_lets_go_and_the_next_one_begins_anew(rig: GamepadRig) -> None:
    pressed(rig)
    assert rig.pad.unplugged("unplugged") == [do.Enable(False)]
    rig.plug()
    assert rig.open(a1=-1.0, down=frozenset({ENABLING})) == []
    assert rig.pass_time(200) == []


def test_a_device_that_says_nothing_for_two_seconds_lets_go(rig: GamepadRig) -> None:
    pressed(rig)
    asked = rig.pass_time(1_980)
    assert do.Enable(False) not in asked
    assert rig.pass_time(20) == [do.Enable(False)]
    assert "let go: no event of the device for 2 s" in rig.pad.messages.newest
    rig.stick(-0.9)
    assert rig.pass_time(200) == []


def test_a_stop_lets_go_until_the_button_was_up(rig: GamepadRig) -> None:
    pressed(rig)
    stopped = StopChanged(StopKind.SOFTWARE, 9, "kim", "tea")
    assert rig.pad.stop_changed(stopped) == [do.Enable(False)]
    rig.stick(-0.5)
    assert rig.pass_time(100) == []
    rig.let_go()
    rig.stick(0.0)
    pressed(rig)


def test_another_mode_lets_go(rig: GamepadRig) -> None:
    pressed(rig)
    changed = ModeChanged(OperatingMode.AUTOMATIC, 9, "kim")
    assert rig.pad.mode_changed(changed) == [do.Enable(False)]
    assert rig.pass_time(100) == []


def test_a_jog_that_ended_by_itself_lets_go(rig: GamepadRig) -> None:
    pressed(rig)
    assert rig.pad.jog_ended() == [do.Enable(False)]
    rig.stick(-0.5)
    assert rig.pass_time(100) == []


def test_a_lost_connection_lets_go(rig: GamepadRig) -> None:
    pressed(rig)
    rig.pad.lost("cable")
    assert rig.pass_time(100) == []
    assert not rig.pad.is_held


def test_values_that_are_old_move_nothing(rig: GamepadRig) -> None:
    rig.now += 400 * MS
    assert rig.hold() == []
    assert "STALE" in rig.pad.messages.newest
    rig.state()
    assert rig.stick(-1.0) == []


def test_a_press_on_values_that_became_old_lets_go(rig: GamepadRig) -> None:
    rig.hold()
    rig.now += 400 * MS
    assert rig.stick(-1.0) == [do.Enable(False)]


def test_without_control_the_button_asks_for_it_and_moves_nothing(rig: GamepadRig) -> None:
    rig.state(holder=0)
    rig.stick(-1.0)
    assert rig.hold() == [do.TakeControl()]
    rig.state()
    assert rig.pass_time(100) == []
    rig.let_go()
    rig.stick(0.0)
    pressed(rig)


# Other buttons.


@pytest.mark.parametrize("is_held", [False, True])
def test_the_stop_button_stops_whatever_is_held(rig: GamepadRig, is_held: bool) -> None:
    if is_held:
        pressed(rig)
    asked = rig.read(button(STOP, down=True))
    assert asked == [do.StopRobot("gamepad"), *[do.Enable(False)] * is_held]
    assert rig.read(button(STOP, down=False)) == []


def test_a_stop_button_that_is_down_at_opening_stops() -> None:
    rig = GamepadRig()
    assert rig.open(down=frozenset({STOP})) == [do.StopRobot("gamepad")]


def test_a_stop_leaves_though_the_same_read_is_cut(rig: GamepadRig) -> None:
    assert rig.read(button(STOP, down=True) + b"\0\0") == [do.StopRobot("gamepad")]


def test_the_mode_button_turns_the_frame_while_nothing_is_held(rig: GamepadRig) -> None:
    frames = []
    for _ in range(4):
        rig.read(button(CROSS, down=True))
        rig.read(button(CROSS, down=False))
        frames.append(rig.pad.jog.frame)
    assert frames == ["tool", "root", "table", ""]
    rig.hold()
    rig.read(button(CROSS, down=True))
    assert rig.pad.jog.frame == ""


@pytest.mark.parametrize(("number", "override"), [(SLOWER, 0.75), (FASTER, 1.0)])
def test_the_speed_buttons_walk_the_ladder_beside_a_press(
    rig: GamepadRig, number: int, override: float
) -> None:
    pressed(rig)
    assert rig.read(button(number, down=True)) == [do.ChangeSpeed(override)]


# A SpaceMouse.


def test_a_cap_moves_while_its_left_button_is_held(mouse: GamepadRig) -> None:
    assert mouse.cap(push(along=1)) == []
    asked = mouse.cap(left(down=True))
    assert asked == [do.Enable(True), PressSticks("base", along_x(1.0))]
    assert mouse.cap(left(down=False)) == [do.Enable(False)]


def test_the_right_button_of_a_cap_stops(mouse: GamepadRig) -> None:
    assert mouse.cap((KEYS, RIGHT_KEY, 1)) == [do.StopRobot("gamepad")]


def test_a_device_that_is_gone_leaves_no_stick_behind(mouse: GamepadRig) -> None:
    mouse.cap(push(along=1))
    mouse.pad.unplugged("unplugged")
    mouse.plug()
    assert mouse.cap(left(down=True)) == [do.Enable(True)]


def test_lost_events_of_a_cap_let_go_until_its_button_is_pressed_anew(mouse: GamepadRig) -> None:
    mouse.cap(push(along=1), left(down=True))
    assert mouse.read(DROPPED) == [do.Enable(False)]
    assert mouse.read(REPORT) == []
    assert mouse.cap(push(along=1), (KEYS, 256, 2)) == []
    assert mouse.pass_time(100) == []
    assert moving(mouse.cap(left(down=True)))


def test_a_relative_cap_that_is_repeated_no_more_is_centred(mouse: GamepadRig) -> None:
    mouse.cap(left(down=True))
    assert moving(mouse.cap((REL, 1, -350)))
    assert do.ReleaseJog() not in mouse.pass_time(80)
    assert do.ReleaseJog() in mouse.pass_time(20)


def test_a_centre_by_silence_is_no_sign_that_the_device_lives(mouse: GamepadRig) -> None:
    mouse.cap((REL, 1, -350), left(down=True))
    assert do.Enable(False) not in mouse.pass_time(1_980)
    assert do.Enable(False) in mouse.pass_time(20)
