"""What is missing until something moves, the keys of the frame, and the lists of the cell."""

from typing import Any

import pytest
from rigs.cells.panel_rig import PanelRig

from openpendant.simplemsg.pendant import OperatingMode, StopKind
from openpendant.tools.pendants.panel import commands as do
from openpendant.tools.pendants.panel import lcd
from openpendant.tools.pendants.panel.commands import CellList
from openpendant.tools.pendants.panel.keyboard import KEYBOARD, legend
from openpendant.tools.pendants.panel.wording import plan_line
from openpendant.tools.pendants.terminal import screen_text
from openpendant.tools.pendants.terminal.missing_steps import missing_steps, steps_line


def position(name: str, kind: str, *, legal: bool = True, why: str = "") -> dict[str, Any]:
    pose = {"position": [0.4, -0.1, 0.25], "orientation": [0, 0, 0, 1]}
    return {"name": name, "kind": kind, "pose": pose, "legal": legal, "why": why}


PARKED = do.TeachPosition("park", 5)

ANSWERS: dict[CellList, dict[str, Any]] = {
    CellList.RECORDINGS: {
        "recording": None,
        "recordings": [{"name": "sweep", "duration": 4.25}, {"name": "broken"}],
    },
    CellList.FRAMES: {"names": ["base", "tool", "table"]},
    CellList.TOOLS: {
        "tools_revision": 7,
        "content": {"tools": [{"name": "gripper"}], "selected_tool": "gripper"},
    },
    CellList.SCENE: {
        "content": {"objects": [{"name": "crate", "position": [0.5, 0, -0.25], "frame": "base"}]}
    },
    CellList.SIGNALS: {"offered": True, "inputs": [True], "outputs": [False, True]},
    CellList.PLANS: {
        "plans": [
            {
                "plan": 6,
                "state": "stale",
                "kind": "free",
                "label": "",
                "maker": "page",
                "duration": 2.5,
                "samples": 251,
                "expires_in": 0.0,
                "code": 181,
                "text": "the scene has changed",
            },
            {
                "plan": 7,
                "state": "ready",
                "kind": "position",
                "label": "to park",
                "maker": "bench",
                "duration": 1.434,
                "samples": 145,
                "expires_in": 41.7,
                "code": 0,
                "text": "",
            },
        ]
    },
    CellList.POSITIONS: {
        "revision": 5,
        "problem": "",
        "positions": [
            position("home", "robot"),
            position("park", "user"),
            position("bent", "user", legal=False, why="link touches crate"),
        ],
    },
}


@pytest.fixture
def rig() -> PanelRig:
    return PanelRig()


@pytest.mark.parametrize(
    ("state", "keys", "missing"),
    [
        ({"holder": 0}, "", ("c takes control", "v holds enabling")),
        ({"holder": 99}, "v", ("c asks for control",)),
        ({}, "", ("v holds enabling",)),
        ({}, "v", ()),
        ({"operating_mode": OperatingMode.AUTOMATIC}, "v", ("m 1 sets T1",)),
        ({"stop": StopKind.SOFTWARE}, "", ("x resets the stop", "v holds enabling")),
        ({"override": 0.0}, "v", ("+ raises the speed",)),
    ],
)
def test_the_steps_that_are_missing_stand_in_the_order_in_which_they_can_be_done(
    rig: PanelRig, state: dict[str, Any], keys: str, missing: tuple[str, ...]
) -> None:
    rig.strike(*keys)
    rig.state(**state)
    assert missing_steps(rig.panel, rig.now) == missing
    assert all(step[0] in KEYBOARD for step in missing)


def test_the_line_of_the_steps_ends_with_the_key_that_moves_and_fits_eighty_columns(
    rig: PanelRig,
) -> None:
    rig.state(holder=0, operating_mode=OperatingMode.AUTOMATIC)
    line = steps_line(rig.panel, rig.now)
    assert line.startswith("to move: c takes control, m 1 sets T1, v holds enabling")
    assert line.endswith("q/a jogs 1 + and -")
    assert len(line) <= 80
    rig.strike("tab")
    assert steps_line(rig.panel, rig.now).endswith("q/a jogs X + and -")


def test_nothing_is_said_to_be_missing_of_values_that_may_be_old(rig: PanelRig) -> None:
    rig.wait(400, fresh=False)
    assert steps_line(rig.panel, rig.now) == ""


def test_the_keys_that_are_shown_follow_the_frame(rig: PanelRig) -> None:
    assert "jog joints 1:q/a 2:w/s" in legend(rig.panel.jog.axis_names, short=True)
    rig.strike("tab")
    frame = legend(rig.panel.jog.axis_names, rig.panel.jog.frame, short=True)
    assert "jog base X:q/a Y:w/s Z:e/d A:r/f B:t/g C:y/h" in frame


def test_a_key_shows_all_keys_and_the_same_or_escape_hides_them(rig: PanelRig) -> None:
    assert "K all keys" in legend("123456", short=True)
    rig.strike("K")
    assert rig.panel.shows_keys
    assert rig.strike("x") == [do.UnlatchStop()]
    assert rig.panel.shows_keys
    rig.strike("escape")
    assert not rig.panel.shows_keys


def test_the_pose_stands_beside_the_joints(rig: PanelRig) -> None:
    rig.state(tool_position=(0.4, -0.1095, 1.2345))
    rows = screen_text.pose_table(rig.panel).split("\n")
    assert rows == [
        "X    400.0  Y   -109.5  Z   1234.5 mm",
        "A      0.0  B      0.0  C      0.0 °",
    ]


KEYS = dict(zip(CellList, "1234578", strict=True))
"""The digit of each list; 6 is the pairing code."""


@pytest.mark.parametrize(("kind", "key"), KEYS.items())
def test_each_list_is_asked_for_by_two_keys(rig: PanelRig, key: str, kind: CellList) -> None:
    assert rig.strike("M", key) == [do.AskList(kind)]


@pytest.mark.parametrize(
    ("kind", "keys", "asked"),
    [
        (CellList.RECORDINGS, ("enter", *"new", "enter"), [do.RecordMotion("new")]),
        (CellList.RECORDINGS, ("enter", "enter"), []),
        (CellList.RECORDINGS, ("down", "enter", "1"), [do.PlayBack("sweep")]),
        (CellList.RECORDINGS, ("down", "enter", "2"), []),
        (CellList.RECORDINGS, ("down", "down", "down", "up", "enter", "x"), []),
        (CellList.TOOLS, ("enter",), [do.ChooseTool(None, 7)]),
        (CellList.TOOLS, ("down", "enter"), [do.ChooseTool("gripper", 7)]),
        (CellList.SCENE, ("enter",), []),
        (CellList.SIGNALS, ("enter",), [do.SwitchOutput(0, True)]),
        (CellList.SIGNALS, ("down", "enter"), [do.SwitchOutput(1, False)]),
        (CellList.SIGNALS, ("down", "down", "enter"), []),
        (CellList.SIGNALS, ("escape",), []),
        (CellList.PLANS, ("enter", "enter", "1"), [do.ExecutePlan(7)]),
        (CellList.PLANS, ("enter", "enter", "2"), []),
        (CellList.PLANS, ("enter", "down", "enter"), [do.ForgetPlan(7)]),
        (CellList.PLANS, ("down", "enter", "enter"), []),
        (CellList.POSITIONS, ("enter", *"up", "enter"), [do.TeachPosition("up", 5)]),
        (CellList.POSITIONS, ("enter", "enter"), []),
        (CellList.POSITIONS, ("enter", "u", "escape"), []),
        (CellList.POSITIONS, ("enter", *"park", "enter", "2"), []),
        (CellList.POSITIONS, ("enter", *"park", "enter", "1"), [PARKED]),
        (CellList.POSITIONS, ("down", "enter", "1"), [do.GoHome("home")]),
        (CellList.POSITIONS, ("down", "enter", "2"), [do.PlanWay("home")]),
        (CellList.POSITIONS, ("down", "enter", "4"), []),
        (CellList.POSITIONS, ("down", "down", "enter", "3", "1"), [PARKED]),
        (CellList.POSITIONS, ("down", "down", "enter", "3", "2"), []),
        (CellList.POSITIONS, ("down", "down", "enter", "4", "1"), [do.ForgetPosition("park", 5)]),
        (CellList.POSITIONS, ("down", "down", "enter", "4", "4"), []),
    ],
)
def test_an_entry_of_a_list_does_what_it_says(
    rig: PanelRig, kind: CellList, keys: tuple[str, ...], asked: list[do.Command]
) -> None:
    rig.panel.told_list(kind, ANSWERS[kind])
    assert rig.strike(*keys) == asked
    assert rig.panel.question is None


def test_a_recording_under_way_is_what_the_first_entry_ends(rig: PanelRig) -> None:
    answer = {"recording": {"name": "sweep"}, "recordings": []}
    rig.panel.told_list(CellList.RECORDINGS, answer)
    assert rig.strike("enter") == [do.EndRecording()]


def test_a_frame_of_the_list_is_the_one_to_jog_in(rig: PanelRig) -> None:
    rig.panel.told_list(CellList.FRAMES, ANSWERS[CellList.FRAMES])
    assert rig.strike("down", "down", "enter") == []
    assert rig.panel.jog.frame == "table"
    rig.panel.told_list(CellList.FRAMES, {"names": ["gone"]})
    rig.strike("enter")
    assert rig.panel.jog.frame == "table"
    assert "no frame gone" in rig.said


@pytest.mark.parametrize("kind", CellList)
def test_a_list_is_on_both_displays_and_the_space_bar_stops_from_it(
    rig: PanelRig, kind: CellList
) -> None:
    rig.panel.told_list(kind, ANSWERS[kind])
    rows = lcd.page(rig.panel, rig.now)
    assert [len(row) for row in rows] == [20] * 4
    first = rows[1].strip("> ").split("  ")[0]
    assert first in screen_text.program_list(rig.panel)
    assert rig.strike(" ") == [do.StopRobot("space bar")]
    assert rig.panel.question is None


def test_a_position_where_the_robot_may_not_stand_is_marked_and_says_why(rig: PanelRig) -> None:
    rig.panel.told_list(CellList.POSITIONS, ANSWERS[CellList.POSITIONS])
    rows = screen_text.program_list(rig.panel).split("\n")
    assert rows[3] == "   park  400 -100 250 mm"
    assert rows[4] == "  !bent  400 -100 250 mm: link touches crate"


def test_the_facts_of_a_plan_stand_below_what_can_be_done_with_it(rig: PanelRig) -> None:
    rig.panel.told_list(CellList.PLANS, ANSWERS[CellList.PLANS])
    assert screen_text.program_list(rig.panel).split("\n")[1:3] == [
        "> 7 ready  1.4 s position  to park",
        "  6 stale  2.5 s free",
    ]
    rig.strike("enter")
    assert screen_text.program_list(rig.panel).split("\n")[:-1] == [
        "plan 7",
        "> execute",
        "  drop",
        "  ready, 42 s left",
        "  1.43 s, 145 samples",
        "  position, by bench",
        "  to park",
    ]


def test_the_preview_of_a_program_is_never_executed(rig: PanelRig) -> None:
    preview = ANSWERS[CellList.PLANS]["plans"][1] | {"kind": "program"}
    rig.panel.told_list(CellList.PLANS, {"plans": [preview]})
    rig.strike("enter")
    assert "execute" not in screen_text.program_list(rig.panel)


@pytest.mark.parametrize(
    ("kind", "keys"),
    [(CellList.PLANS, ("enter", "enter", "1")), (CellList.POSITIONS, ("down", "enter", "1"))],
)
def test_nothing_moves_from_a_list_on_values_that_may_be_old(
    rig: PanelRig, kind: CellList, keys: tuple[str, ...]
) -> None:
    rig.panel.told_list(kind, ANSWERS[kind])
    rig.wait(400, fresh=False)
    assert rig.strike(*keys) == []
    assert "STALE" in rig.said


def test_all_lists_are_offered_on_the_small_display(rig: PanelRig) -> None:
    rig.strike("M")
    assert lcd.page(rig.panel, rig.now) == (
        "1 record. 2 frames  ",
        "3 tools   4 scene   ",
        "5 signals 6 pairing ",
        "7 plans   8 position",
    )


def test_what_was_planned_is_told_in_one_line() -> None:
    near = {"distance": 0.0341, "first": "elbow", "second": "crate", "at": 0.7}
    made: Any = {"plan": 7, "duration": 1.434, "samples": 145, "clearance": near}
    line = "plan 7 to park: 1.43 s, 145 samples, 34 mm from elbow to crate"
    assert plan_line("to park", made | {"why": None}) == line
    why = {"text": "joint 1 is 1 rad away"}
    assert plan_line("to park", made | {"why": why}) == (
        f"{line}; not executed now: joint 1 is 57.30° away"
    )


def test_an_answer_that_comes_while_a_question_is_open_disturbs_it_not(rig: PanelRig) -> None:
    rig.strike("m")
    rig.panel.told_list(CellList.SCENE, ANSWERS[CellList.SCENE])
    assert lcd.page(rig.panel, rig.now)[0].startswith("Mode?")


def test_a_pairing_code_is_asked_for_and_ended(rig: PanelRig) -> None:
    assert rig.strike("M", "6", "1") == [do.AskPairingCode()]
    assert rig.strike("M", "6", "2") == [do.EndPairing()]
