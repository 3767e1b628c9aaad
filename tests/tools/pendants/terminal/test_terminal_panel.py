"""What each key of the terminal pendant asks for, in which situation, and where it sends it."""

import math
from typing import Any

import pytest
from rigs.cells.panel_rig import HELLO, MS, PROGRAM, PanelRig, joint, snapshot

from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import (
    Activity,
    LinkState,
    ModeChanged,
    OperatingMode,
    ProgramState,
    RunKind,
    StateField,
    StopChanged,
    StopKind,
)
from openpendant.tools.pendants.motions import quaternion_of, roll_pitch_yaw
from openpendant.tools.pendants.panel import commands as do
from openpendant.tools.pendants.panel import lcd
from openpendant.tools.pendants.panel.commands import Command
from openpendant.tools.pendants.panel.keyboard import (
    KEYBOARD,
    STOP_KEY,
    STOP_KEYS,
    Intent,
    Page,
    legend,
)
from openpendant.tools.pendants.panel.prompts import Choice, TextEntry, TextPurpose
from openpendant.tools.pendants.panel.stop_key import TIMEOUT_NS
from openpendant.tools.pendants.panel.taught_program import (
    DeleteStatement,
    HistoryStep,
    RecordHere,
    TaughtProgram,
    TouchUpHere,
)

HALF_DEGREE = math.radians(0.5)


@pytest.mark.parametrize(
    ("keys", "command"),
    [
        ("x", do.UnlatchStop()),
        ("c", do.GiveControl()),
        ("b", do.UndoJog()),
        ("?", do.AskWhy()),
        ("9", do.StopProgram()),
        ("8", do.PauseRobot()),
        ("-", do.ChangeSpeed(0.75)),
        ("+", do.ChangeSpeed(1.0)),
        ("<", do.ChangeSpeed(1.0, 0.1)),
        (">", do.ChangeSpeed(1.0, 0.5)),
        ("m1", do.ChangeMode(OperatingMode.MANUAL_REDUCED)),
        ("m2", do.ChangeMode(OperatingMode.MANUAL_HIGH)),
        ("m3", do.ChangeMode(OperatingMode.AUTOMATIC)),
        ("m4", do.ChangeMode(OperatingMode.RECOVERY)),
        ("01", do.GoHome("home")),
        ("02", do.GoHome("zero")),
        ("C1", do.TakeControl(force=True)),
        ("1", do.ApplyEdit(RecordHere("PTP"))),
        ("2", do.ApplyEdit(RecordHere("PTP", 0))),
        ("31", do.ApplyEdit(TouchUpHere(0))),
        ("41", do.ApplyEdit(DeleteStatement(0))),
        (["ctrl+z"], do.ApplyEdit(HistoryStep.UNDO)),
        (["ctrl+y"], do.ApplyEdit(HistoryStep.REDO)),
        (["tab", "1"], do.ApplyEdit(RecordHere("LIN"))),
        (".", do.AskDryRun("pick")),
        ("51", do.RunProgram("pick", 3, RunKind.ALL)),
        ("52", do.RunProgram("pick", 3, RunKind.ALL, 9)),
        ("53", do.RunProgram("pick", 3, RunKind.ALL, loops=0)),
        ("6", do.RunProgram("pick", 3, RunKind.STEP_FORWARD)),
        ("7", do.RunProgram("pick", 3, RunKind.STEP_BACKWARD)),
        ("w", do.StepJog("", ((1, HALF_DEGREE),))),
        ("s", do.StepJog("", ((1, -HALF_DEGREE),))),
        (["tab", "e"], do.StepJog("base", ((2, 0.001),))),
        (["tab", "tab", "h"], do.StepJog("tool", ((5, -HALF_DEGREE),))),
        (["shift+tab", "e"], do.StepJog("table", ((2, 0.001),))),
    ],
)
def test_each_key_asks_for_its_command(rig: PanelRig, keys: list[str], command: Command) -> None:
    rig.open()
    rig.walk()
    rig.state(tool_speed_cap=0.25)
    assert rig.strike(*keys) == [command]


@pytest.mark.parametrize(
    ("changes", "key", "command"),
    [
        ({"holder": 0}, "c", do.TakeControl()),
        ({"activity": Activity.PAUSED}, "8", do.ResumeRobot()),
        ({"program_state": ProgramState.PAUSED}, "8", do.ResumeRobot()),
        ({"program_state": ProgramState.AT_BREAKPOINT}, "8", do.ResumeRobot()),
        ({"program_state": ProgramState.STEPPED}, "8", do.ResumeRobot()),
        ({"holder": 0, "link": LinkState.STALE, "age": 1.0}, STOP_KEY, do.StopRobot("space bar")),
    ],
)
def test_what_a_key_asks_for_depends_on_the_cell(
    rig: PanelRig, changes: dict[str, Any], key: str, command: Command
) -> None:
    rig.state(**changes)
    assert rig.strike(key) == [command]


NOTHING_DONE: dict[str, tuple[dict[str, Any], TaughtProgram | None, str, str]] = {
    "a jog while the robot moves": ({"activity": Activity.MOVING}, None, "q", "still moving"),
    "an axis that is not there": ({}, None, "u", "no axis 7 in joints; accepted: 1 to 6"),
    "a jog with caps lock": ({}, None, "Q", "Caps Lock"),
    **{f"{key} without a program": ({}, None, key, "n opens one") for key in "1234567"},
    **{
        f"{key} in an empty program": ({}, TaughtProgram("new", 1), key, "1 records")
        for key in "234"
    },
}


@pytest.mark.parametrize("case", NOTHING_DONE)
def test_a_key_that_can_do_nothing_says_why_and_is_not_kept(rig: PanelRig, case: str) -> None:
    changes, program, key, said = NOTHING_DONE[case]
    if program is not None:
        rig.open(program)
    rig.state(**changes)
    assert rig.strike(key) == []
    assert said in rig.said
    rig.state()
    assert rig.wait(1000) == []


# Stop.


@pytest.mark.parametrize(("key", "name"), [(" ", "space bar"), ("f8", "F8")])
@pytest.mark.parametrize("before", ["", "m", "n", "nabc", "=", "*", "0", "v", "/q", "C"])
def test_a_stop_key_stops_whatever_was_struck_before(
    rig: PanelRig, before: str, key: str, name: str
) -> None:
    rig.strike(*before)
    assert rig.panel.key(key, rig.now)[0] == do.StopRobot(name)
    assert rig.panel.question is None


def test_no_stop_key_means_anything_else() -> None:
    assert KEYBOARD.keys().isdisjoint(STOP_KEYS)


def test_a_stop_that_is_sent_again_bears_the_name_of_its_key(rig: PanelRig) -> None:
    rig.strike("f8")
    assert rig.wait(1100) == [do.StopRobot("F8, sent again")]


def test_a_step_that_was_gathered_does_not_leave_after_a_stop(rig: PanelRig) -> None:
    rig.panel.key("q", rig.now)
    rig.panel.key(STOP_KEY, rig.now)
    assert rig.wait(500) == []


@pytest.mark.parametrize("key", KEYBOARD)
def test_no_key_but_a_stop_key_does_anything_without_a_link(key: str) -> None:
    rig = PanelRig(connected=False)
    rig.panel.cell.lost("nobody listens")
    assert rig.strike(key, "1", "enter") == []


# Jogs.


def test_two_keys_in_quick_succession_step_two_joints_at_once(rig: PanelRig) -> None:
    assert rig.panel.key("q", rig.now) == []
    rig.now += 50 * MS
    assert rig.strike("d") == [do.StepJog("", ((0, HALF_DEGREE), (2, -HALF_DEGREE)))]


def test_keys_further_apart_make_two_steps(rig: PanelRig) -> None:
    assert rig.strike("q") == [do.StepJog("", ((0, HALF_DEGREE),))]
    assert rig.strike("d") == [do.StepJog("", ((2, -HALF_DEGREE),))]


def test_a_held_key_pulses_and_no_pulse_outlives_the_longest_deadline(rig: PanelRig) -> None:
    rig.strike("/")
    assert rig.panel.key("q", rig.now) == [do.PulseJog("", ((0, 1),), 0.25)]
    rig.now += 33 * MS
    assert rig.panel.key("q", rig.now) == [do.PulseJog("", ((0, 1),), 0.25)]
    assert rig.wait(1000) == []


def test_two_held_keys_move_two_joints_and_none_longer_than_its_own_key(rig: PanelRig) -> None:
    rig.strike("/")
    rig.panel.key("q", rig.now)
    rig.now += 100 * MS
    assert rig.panel.key("s", rig.now) == [do.PulseJog("", ((0, 1), (1, -1)), 0.15)]
    rig.now += 90 * MS
    (pulse,) = rig.panel.key("s", rig.now)
    assert isinstance(pulse, do.PulseJog)
    assert pulse.axes == ((0, 1), (1, -1))
    assert pulse.deadline == pytest.approx(0.06)
    rig.now += 20 * MS
    assert rig.panel.key("s", rig.now) == [do.PulseJog("", ((1, -1),), 0.25)]


def test_the_other_direction_of_a_held_axis_replaces_the_first(rig: PanelRig) -> None:
    rig.strike("/")
    rig.panel.key("q", rig.now)
    assert rig.panel.key("a", rig.now) == [do.PulseJog("", ((0, -1),), 0.25)]


# Enabling (training).


def test_enabling_is_a_toggle_that_lets_go_after_seconds_without_a_key(rig: PanelRig) -> None:
    assert rig.strike("v") == [do.Enable(True)]
    assert rig.wait(TIMEOUT_NS // MS - 200) == []
    assert rig.wait(400) == [do.Enable(False)]
    assert "no key for 5 s" in rig.said
    assert not rig.panel.enabling.is_on


def test_any_key_shows_that_somebody_is_there(rig: PanelRig) -> None:
    rig.strike("v")
    for _ in range(5):
        assert rig.wait(4000) == []
        rig.strike("f1")
    assert rig.panel.enabling.is_on


@pytest.mark.parametrize("key", ["v", "escape", STOP_KEY])
def test_enabling_is_let_go_by_its_key_by_escape_and_by_a_stop(rig: PanelRig, key: str) -> None:
    rig.strike("v")
    stop = [do.StopRobot("space bar")] if key == STOP_KEY else []
    assert rig.strike(key) == [*stop, do.Enable(False)]


LETS_GO = [do.Enable(False)]
ANOTHER: dict[str, Any] = {"session": 9, "client": "bench-2"}


@pytest.mark.parametrize(
    ("news", "asked", "said"),
    [
        (StopChanged(stop=StopKind.SOFTWARE, reason="fire", **ANOTHER), LETS_GO, "bench-2"),
        (StopChanged(stop=StopKind.NONE, reason="", **ANOTHER), [], "stop reset by bench-2"),
        (ModeChanged(mode=OperatingMode.AUTOMATIC, **ANOTHER), LETS_GO, "bench-2"),
    ],
)
def test_a_stop_or_a_mode_of_another_is_told_and_lets_enabling_go_but_no_reset_does(
    rig: PanelRig, news: StopChanged | ModeChanged, asked: list[Command], said: str
) -> None:
    rig.strike("v")
    panel = rig.panel
    heard = panel.stop_changed(news) if isinstance(news, StopChanged) else panel.mode_changed(news)
    assert heard == asked
    assert said in rig.said


def test_enabling_that_the_server_does_not_take_is_not_shown_as_held(rig: PanelRig) -> None:
    rig.strike("v")
    assert rig.panel.not_enabled() == [do.Enable(False)]
    assert not rig.panel.enabling.is_on


def test_a_lost_link_lets_everything_go_and_nothing_comes_back(rig: PanelRig) -> None:
    rig.strike("v", "m")
    rig.panel.key("q", rig.now)
    rig.panel.lost("cable")
    rig.panel.cell.is_connected = True
    assert rig.panel.connected() == []
    assert rig.wait(6000) == []
    assert (rig.panel.enabling.is_on, rig.panel.question) == (False, None)


# Questions.


@pytest.mark.parametrize(
    ("asks", "key"),
    [
        *(("m", key) for key in ("5", "q", "escape", "enter", "left")),
        *(("51", key) for key in ("1", "q", "escape", "enter")),  # to run without a dry run
    ],
)
def test_any_other_key_says_no_to_a_choice(rig: PanelRig, asks: str, key: str) -> None:
    rig.open()
    rig.strike(*asks)
    assert isinstance(rig.panel.question, Choice)
    assert rig.strike(key) == []
    assert rig.panel.question is None


def test_letters_that_are_typed_jog_nothing(rig: PanelRig) -> None:
    assert rig.strike("*", *"qwe", "backspace", "tab") == []
    assert rig.panel.question == TextEntry(TextPurpose.STEP, "qw")


def test_a_typed_text_has_an_end(rig: PanelRig) -> None:
    rig.strike("=", *"q" * 200)
    assert rig.panel.question == TextEntry(TextPurpose.TARGET, "q" * 64)


def test_a_step_size_is_typed_or_taken_from_the_ladder(rig: PanelRig) -> None:
    rig.strike("*", *"2mm", "enter")
    assert (rig.panel.jog.step.millimetres, rig.panel.jog.step.degrees) == (2.0, 0.5)
    rig.strike("]")
    assert (rig.panel.jog.step.millimetres, rig.panel.jog.step.degrees) == (5.0, 2.5)
    rig.strike("[", "[", "[", "[")
    assert (rig.panel.jog.step.millimetres, rig.panel.jog.step.degrees) == (0.1, 0.05)


@pytest.mark.parametrize("text", ["", "2", "0mm", "-1mm", "101mm", "46deg", "nanmm", "1,5mm"])
def test_what_is_no_step_size_is_refused(rig: PanelRig, text: str) -> None:
    before = rig.panel.jog.step
    rig.strike("*", *text, "enter")
    assert rig.panel.jog.step == before
    assert "accepted" in rig.said


# Programs.


def test_an_empty_program_takes_a_point(rig: PanelRig) -> None:
    rig.open(TaughtProgram("new", 1))
    assert rig.strike("1") == [do.ApplyEdit(RecordHere("PTP"))]


def test_a_statement_without_a_point_cannot_be_touched_up(rig: PanelRig) -> None:
    rig.open()
    rig.strike("f5", "down")
    assert rig.strike("3") == []
    assert rig.said == "wait 2 s moves to no point"


def test_what_was_appended_is_selected_and_the_selection_stays_inside(rig: PanelRig) -> None:
    rig.open()
    longer = TaughtProgram("pick", 4, (*PROGRAM.lines, "move PTP P2"), (*PROGRAM.targets, "P2"))
    rig.open(longer)
    assert rig.panel.teaching.selected == 3
    rig.open(PROGRAM)
    assert rig.panel.teaching.selected == 2


def test_each_edit_names_the_revision_that_it_was_made_from() -> None:
    assert PROGRAM.request(RecordHere("LIN", 1)) == {
        "op": "programs.record",
        "name": "pick",
        "expected_revision": 3,
        "point": "P2",
        "move": {"statement": "move", "way": "LIN", "point": "P2"},
        "at": 1,
    }
    assert PROGRAM.request(TouchUpHere(2))["point"] == "P1"
    assert PROGRAM.request(DeleteStatement(1))["edit"]["first"] == 1
    assert PROGRAM.request(HistoryStep.UNDO)["op"] == "programs.undo"


def test_a_message_that_repeats_is_counted(rig: PanelRig) -> None:
    for _ in range(3):
        rig.panel.messages.add("no")
    assert rig.panel.messages.lines[-1] == "no (×3)"


def test_the_legend_names_every_intent_but_the_turning_of_pages() -> None:
    shown = legend("123456")
    intents = {meaning for meaning in KEYBOARD.values() if isinstance(meaning, Intent)}
    missing = {intent for intent in intents if intent.value not in shown}
    assert missing == {Intent.LAST_FRAME, Intent.NEXT_PAGE, Intent.LAST_PAGE}


TURN = (30.0, -20.0, 100.0)
"""A, B and C of the tool [degrees]."""


@pytest.fixture
def turned() -> PanelRig:
    made = PanelRig()
    made.state(tool_orientation=quaternion_of(*map(math.radians, TURN)))
    return made


def typed(turned: PanelRig, text: str) -> Any:
    (command,) = turned.strike("=", *text, "enter")
    return command


@pytest.mark.parametrize(
    ("text", "goal"),
    [
        ("3=-45", {2: math.radians(-45)}),
        ("1=10;6=0.5", {0: math.radians(10), 5: math.radians(0.5)}),
    ],
)
def test_joints_go_to_what_was_typed_and_the_others_stay(
    turned: PanelRig, text: str, goal: dict[int, float]
) -> None:
    stands = turned.panel.cell.positions
    assert stands is not None
    command = typed(turned, text)
    assert isinstance(command, do.MoveJoints)
    assert command.goal == tuple(goal.get(index, here) for index, here in enumerate(stands))


def test_a_linear_joint_is_typed_in_millimetres(turned: PanelRig) -> None:
    turned.panel.cell.connected(HELLO, snapshot(1, joints=[joint("rail", "m")]))
    turned.state(positions=joint_array([0.25]))
    assert typed(turned, "1=400") == do.MoveJoints((0.4,), "joint 1 to 400 mm")


@pytest.mark.parametrize(
    ("text", "position", "turn"),
    [
        ("z=400", (0.5, 0.25, 0.4), TURN),
        ("x=300;z=250;a=180", (0.3, 0.25, 0.25), (180.0, -20.0, 100.0)),
        ("c=-90", (0.5, 0.25, 0.75), (30.0, -20.0, -90.0)),
        ("a=0;b=0;c=0", (0.5, 0.25, 0.75), (0.0, 0.0, 0.0)),
    ],
)
def test_the_tool_goes_to_what_was_typed_and_the_rest_stays_as_shown(
    turned: PanelRig, text: str, position: tuple[float, ...], turn: tuple[float, ...]
) -> None:
    command = typed(turned, text)
    assert isinstance(command, do.MoveToPose)
    assert command.position == pytest.approx(position)
    degrees = [math.degrees(angle) for angle in roll_pitch_yaw(command.orientation)]
    assert degrees == pytest.approx(turn, abs=1e-6)


def test_the_pose_page_shows_afterwards_what_was_typed(turned: PanelRig) -> None:
    command = typed(turned, "x=300;a=-60;b=45;c=15")
    turned.state(tool_position=command.position, tool_orientation=command.orientation)
    turned.panel.page = Page.POSE
    assert [row.rstrip() for row in lcd.page(turned.panel, turned.now)[1:]] == [
        "X   300.0 A   -60.0",
        "Y   250.0 B    45.0",
        "Z   750.0 C    15.0",
    ]


def test_where_a_and_c_are_one_all_three_angles_must_be_typed(turned: PanelRig) -> None:
    turned.state(tool_orientation=quaternion_of(0.3, math.pi / 2, 0.0))
    assert turned.strike("=", *"a=10", "enter") == []
    assert turned.said == "at B = 90.0° A and C are not told apart; accepted: all of a, b, c"
    # A length leaves the tool turned as it is, and does not go through the angles.
    assert turned.panel.cell.state is not None
    assert typed(turned, "x=300").orientation == turned.panel.cell.state.tool_orientation
    turn = roll_pitch_yaw(typed(turned, "a=10;b=0;c=20").orientation)
    assert [math.degrees(angle) for angle in turn] == pytest.approx([10, 0, 20], abs=1e-6)


@pytest.mark.parametrize(
    "text",
    [
        *("", "3", "3=", "0=1", "7=1", "xy=1", "3=nan", "3=inf", "3=4,5", "q=1", "²=1", "d=1"),
        *("3=4;", "3=4;3=5", "x=1;x=2", "x=1;3=4", "01=2", "x=300z=250", ";"),
    ],
)
def test_what_is_no_target_is_refused_with_what_would_be(turned: PanelRig, text: str) -> None:
    assert turned.strike("=", *text, "enter") == []
    assert "accepted" in turned.said


def test_nothing_is_gone_to_from_where_nobody_knows(turned: PanelRig) -> None:
    turned.state(valid_fields=StateField.VELOCITY)
    assert turned.strike("=", *"3=4", "enter") == []
    assert turned.said == "no target: the joint values are not known"
    assert turned.strike("=", *"z=4", "enter") == []
    assert turned.said == "no target: the tool's pose is not known"
