"""Typed absolute targets of the terminal pendant."""

import math
from typing import Any

import pytest
from rigs.cells.panel_rig import HELLO, PanelRig, joint, snapshot

from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import StateField
from openpendant.tools.pendants.motions import quaternion_of, roll_pitch_yaw
from openpendant.tools.pendants.terminal import commands as do
from openpendant.tools.pendants.terminal import lcd
from openpendant.tools.pendants.terminal.keyboard import Page

TURN = (30.0, -20.0, 100.0)
"""A, B and C of the tool [degrees]."""


@pytest.fixture
def rig() -> PanelRig:
    made = PanelRig()
    made.state(tool_orientation=quaternion_of(*map(math.radians, TURN)))
    return made


def typed(rig: PanelRig, text: str) -> Any:
    (command,) = rig.strike("=", *text, "enter")
    return command


@pytest.mark.parametrize(
    ("text", "goal"),
    [
        ("3=-45", {2: math.radians(-45)}),
        ("1=10;6=0.5", {0: math.radians(10), 5: math.radians(0.5)}),
    ],
)
def test_joints_go_to_what_was_typed_and_the_others_stay(
    rig: PanelRig, text: str, goal: dict[int, float]
) -> None:
    stands = rig.panel.cell.positions
    assert stands is not None
    command = typed(rig, text)
    assert isinstance(command, do.MoveJoints)
    assert command.goal == tuple(goal.get(index, here) for index, here in enumerate(stands))


def test_a_linear_joint_is_typed_in_millimetres(rig: PanelRig) -> None:
    rig.panel.cell.connected(HELLO, snapshot(1, joints=[joint("rail", "m")]))
    rig.state(positions=joint_array([0.25]))
    assert typed(rig, "1=400") == do.MoveJoints((0.4,), "joint 1 to 400 mm")


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
    rig: PanelRig, text: str, position: tuple[float, ...], turn: tuple[float, ...]
) -> None:
    command = typed(rig, text)
    assert isinstance(command, do.MoveToPose)
    assert command.position == pytest.approx(position)
    degrees = [math.degrees(angle) for angle in roll_pitch_yaw(command.orientation)]
    assert degrees == pytest.approx(turn, abs=1e-6)


def test_the_pose_page_shows_afterwards_what_was_typed(rig: PanelRig) -> None:
    command = typed(rig, "x=300;a=-60;b=45;c=15")
    rig.state(tool_position=command.position, tool_orientation=command.orientation)
    rig.panel.page = Page.POSE
    assert [row.rstrip() for row in lcd.page(rig.panel, rig.now)[1:]] == [
        "X   300.0 A   -60.0",
        "Y   250.0 B    45.0",
        "Z   750.0 C    15.0",
    ]


def test_where_a_and_c_are_one_all_three_angles_must_be_typed(rig: PanelRig) -> None:
    rig.state(tool_orientation=quaternion_of(0.3, math.pi / 2, 0.0))
    assert rig.strike("=", *"a=10", "enter") == []
    assert rig.said == "at B = 90.0° A and C are not told apart; accepted: all of a, b, c"
    # A length leaves the tool turned as it is, and does not go through the angles.
    assert rig.panel.cell.state is not None
    assert typed(rig, "x=300").orientation == rig.panel.cell.state.tool_orientation
    turn = roll_pitch_yaw(typed(rig, "a=10;b=0;c=20").orientation)
    assert [math.degrees(angle) for angle in turn] == pytest.approx([10, 0, 20], abs=1e-6)


@pytest.mark.parametrize(
    "text",
    [
        *("", "3", "3=", "0=1", "7=1", "xy=1", "3=nan", "3=inf", "3=4,5", "q=1", "²=1", "d=1"),
        *("3=4;", "3=4;3=5", "x=1;x=2", "x=1;3=4", "01=2", "x=300z=250", ";"),
    ],
)
def test_what_is_no_target_is_refused_with_what_would_be(rig: PanelRig, text: str) -> None:
    assert rig.strike("=", *text, "enter") == []
    assert "accepted" in rig.said


def test_nothing_is_gone_to_from_where_nobody_knows(rig: PanelRig) -> None:
    rig.state(valid_fields=StateField.VELOCITY)
    assert rig.strike("=", *"3=4", "enter") == []
    assert rig.said == "no target: the joint values are not known"
    assert rig.strike("=", *"z=4", "enter") == []
    assert rig.said == "no target: the tool's pose is not known"
