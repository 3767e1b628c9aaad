"""The pages of twenty columns and four rows, and the words around them."""

import math
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.cells.panel_rig import HELLO, PROGRAM, PanelRig, joint, snapshot
from rigs.peers.scripted_pendant_server import state

from openpendant.simplemsg import joint_array
from openpendant.simplemsg.pendant import (
    JogReason,
    LinkState,
    OperatingMode,
    ProgramReport,
    ProgramState,
    StateField,
    StopKind,
)
from openpendant.simplemsg.pendant.management.cell import Hold, WayOut
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.panel import lcd, wording
from openpendant.tools.pendants.panel.jog_pad import JogKind
from openpendant.tools.pendants.panel.keyboard import Page
from openpendant.tools.pendants.panel.taught_program import TaughtProgram
from openpendant.tools.pendants.panel.wording import why_lines, why_request
from openpendant.tools.pendants.terminal import screen_text


def shown(rig: PanelRig, page: Page) -> list[str]:
    rig.panel.page = page
    return [row.rstrip() for row in lcd.page(rig.panel, rig.now)]


@pytest.fixture
def rig() -> PanelRig:
    made = PanelRig()
    made.state(
        positions=joint_array([math.radians(each) for each in (0, -90, 179.999, 1.005, -0.4, 45)]),
        tool_position=(0.4, -0.1095, 1.2345),
        tool_speed=0.123,
        tool_speed_cap=0.25,
        override=0.25,
    )
    return made


PAGES: list[tuple[Page, str, str]] = [
    (
        *(Page.JOINTS, ""),
        """T1 JOINT      * en--
1:   0.00 2: -90.00
3: 180.00 4:   1.00
5:  -0.40 6:  45.00""",
    ),
    (
        *(Page.POSE, "v tab"),
        """T1 BASE       * EN5s
X   400.0 A     0.0
Y  -109.5 B     0.0
Z  1234.5 C     0.0""",
    ),
    (Page.SPEED, "", "Override        25 %\nTool cap    250 mm/s\nTool now    123 mm/s"),
    (Page.MODE, "", "Jog JOINT 0.5deg 1mm\nControl: you\nEnabling: let go"),
    (Page.MODE, "/ v", "Jog JOINT hold\nControl: you\nEnabling: 5 s left"),
    (Page.MODE, "m", "Mode?\n1 T1      2 T2\n3 AUTO    4 REC\nother key: no"),
    (Page.MODE, "= x = 3", "Go to: x=300;a=180\nx=3_\nEnter: done\nEsc: no  SPACE: stop"),
]


@pytest.mark.parametrize(("page", "keys", "rows"), PAGES)
def test_a_page_ends_with_its_rows(rig: PanelRig, page: Page, keys: str, rows: str) -> None:
    rig.strike(*keys.split())
    assert "\n".join(shown(rig, page)).endswith(rows)
    assert (rig.panel.jog.kind is JogKind.HOLD) == ("/" in keys)


def test_the_program_page_marks_what_is_selected_and_what_runs(rig: PanelRig) -> None:
    rig.open()
    rig.runs("pick", 11, program_state=ProgramState.PAUSED)
    rig.strike("f5", "down")
    assert shown(rig, Page.PROGRAM) == [
        "pick          paused",
        "  1 move PTP home",
        "> 2 wait 2 s",
        " =3 move LIN P1",
    ]


def test_the_message_page_begins_with_the_newest(rig: PanelRig) -> None:
    rig.panel.messages.add("a rather long message of more than one row")
    assert shown(rig, Page.MESSAGES)[:3] == ["a rather long", "message of more than", "one row"]


def test_more_than_six_joints_are_scrolled(rig: PanelRig) -> None:
    rig.panel.cell.connected(HELLO, snapshot(7, joints=[joint("rail", "m")] * 7))
    rig.state(positions=joint_array([1.5, 0.25, 0, 0, 0, 0, -0.75]))
    assert shown(rig, Page.JOINTS)[1] == "1:   1500 2: 250.00"
    rig.panel.scroll = 1
    assert shown(rig, Page.JOINTS)[3] == "7:-750.00"


@pytest.mark.parametrize(
    ("changes", "head"),
    [
        ({"stop": StopKind.SOFTWARE}, "STOP bench-2"),
        ({"link": LinkState.STALE}, "STALE 0.0 s"),
        ({"link": LinkState.DOWN}, "CONTROLLER DOWN"),
        ({"operating_mode": OperatingMode.AUTOMATIC, "holder": 0}, "AUTO JOINT    o en--"),
        ({"operating_mode": 77}, "? JOINT       * en--"),
    ],
)
def test_the_first_row_says_what_is_wrong(
    rig: PanelRig, changes: dict[str, Any], head: str
) -> None:
    rig.panel.cell.stopped_by = "bench-2"
    rig.state(**changes)
    assert shown(rig, Page.JOINTS)[0] == head


def test_the_first_row_shows_a_lost_link_and_old_values(rig: PanelRig) -> None:
    rig.wait(400, fresh=False)
    assert shown(rig, Page.JOINTS)[0] == "STALE 0.4 s"
    rig.panel.lost("cable")
    assert shown(rig, Page.JOINTS)[0] == "NO LINK"


@given(
    values=st.lists(st.floats(allow_nan=True), min_size=10, max_size=10),
    codes=st.lists(st.integers(-3, 99), min_size=7, max_size=7),
    name=st.text(max_size=40),
    keys=st.text("qwmn*=v0C/5?", max_size=6),
    page=st.sampled_from(Page),
)
def test_every_page_is_four_rows_of_twenty_ascii_characters_whatever_comes(
    values: list[float], codes: list[int], name: str, keys: str, page: Page
) -> None:
    rig = PanelRig()
    rig.open(TaughtProgram(name, 2, (name, "end"), (name, ""), (name,)))
    rig.strike(*keys)
    panel = rig.panel
    panel.cell.stopped_by = panel.cell.owner = name
    panel.messages.add(name)
    panel.explained((name, name))
    activity, stop, mode, program, reason, link, drives = codes
    changed = replace(
        state(9),
        activity=activity,
        stop=stop,
        operating_mode=mode,
        program_state=program,
        jog_reason=reason,
        link=link,
        drives_powered=drives,
        positions=tuple(values),
        tool_position=tuple(values[:3]),
        tool_orientation=tuple(values[3:7]),
        override=values[7],
        tool_speed=values[8],
        age=values[9],
        program_line=activity,
    )
    panel.program_moved(ProgramReport(program, activity, 1, 2 + link % 2, name, ""))
    panel.cell.take_state(changed, rig.now)
    panel.page = page
    rows = lcd.page(panel, rig.now)
    assert [len(row) for row in rows] == [20] * 4
    assert all(row.isascii() and row.isprintable() for row in rows)
    assert screen_text.lamp_line(panel, rig.now)
    assert screen_text.joint_table(panel)
    assert screen_text.status_line(panel, rig.now)
    wording.banner(panel.cell, rig.now)


@pytest.mark.parametrize(
    ("changes", "controller", "drives"),
    [
        ({}, "● server–controller: up", "● controller–drives: on"),
        ({"link": LinkState.DOWN}, "○ server–controller: down", "? controller–drives: unknown"),
        ({"link": LinkState.STALE}, "◐ server–controller: stale", "● controller–drives: on"),
        ({"drives_powered": 0}, "● server–controller: up", "○ controller–drives: off"),
        ({"drives_powered": -1}, "● server–controller: up", "? controller–drives: unknown"),
        (
            {"in_error": 1, "error_code": 42},
            "● server–controller: up",
            "○ controller–drives: error 42",
        ),
        (
            {"e_stopped": 1},
            "● server–controller: up",
            "○ controller–drives: emergency stop at the controller",
        ),
    ],
)
def test_each_lamp_is_a_shape_and_a_word(
    rig: PanelRig, changes: dict[str, Any], controller: str, drives: str
) -> None:
    rig.state(**changes)
    lamps = [str(lamp) for lamp in wording.lamps(rig.panel.cell, rig.now)]
    assert lamps == ["● pendant–server: up", controller, drives]


def test_the_lamps_tell_silence_and_loss_and_nothing_of_what_lies_behind(rig: PanelRig) -> None:
    rig.wait(1000, fresh=False)
    assert [str(lamp) for lamp in wording.lamps(rig.panel.cell, rig.now)] == [
        "◐ pendant–server: silent for 1.0 s",
        "? server–controller: unknown",
        "? controller–drives: unknown",
    ]
    rig.panel.lost("cable")
    assert "○ pendant–server: down" in screen_text.lamp_line(rig.panel, rig.now)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"holder": 9}, "Observing: bench-2 has control; c asks for it"),
        ({"holder": 0}, "Observing: nobody has control; c asks for it"),
        *(
            (
                {"stop": kind},
                f"STOPPED, {name} stop by bench-2: smoke; x resets, which moves nothing",
            )
            for kind, name in ((StopKind.SOFTWARE, "software"), (StopKind.PROTECTIVE, "protective"))
        ),
        (
            {"jog_reason": JogReason.JOINT_LIMIT, "jog_scale": 0.5, "jog_joint": 2},
            "jog at 50 %: joint limit of joint 3",
        ),
        ({"link": LinkState.DOWN}, "STALE: ○ server–controller: down"),
        ({}, ""),
    ],
)
def test_the_banner_is_the_one_sentence_that_matters(
    rig: PanelRig, changes: dict[str, Any], sentence: str
) -> None:
    cell = rig.panel.cell
    cell.owner, cell.stopped_by, cell.stop_reason = "bench-2", "bench-2", "smoke"
    rig.state(**changes)
    assert wording.banner(cell, rig.now) == sentence


def test_the_banner_without_a_link_points_to_the_hardware_button(rig: PanelRig) -> None:
    rig.panel.lost("cable")
    assert wording.banner(rig.panel.cell, rig.now) == (
        "NO LINK: cable; to stop the robot, use the hardware button"
    )


def test_a_joint_a_little_below_zero_is_shown_as_zero(rig: PanelRig) -> None:
    rig.state(positions=joint_array([-1e-6] * 6))
    assert shown(rig, Page.JOINTS)[1] == "1:   0.00 2:   0.00"
    assert "-0.00" not in screen_text.joint_table(rig.panel)


def test_a_joint_outside_its_limits_is_pointed_at(rig: PanelRig) -> None:
    rig.state(positions=joint_array([2.5, -2.5, 0, 0, 0, 0]))
    first, second, third = screen_text.joint_table(rig.panel).splitlines()[:3]
    assert first.endswith("!>]")
    assert "[<!" in second
    assert "|" in third


@pytest.mark.parametrize("why", ["not valid", "not named yet"])
def test_values_that_are_not_known_are_not_shown(rig: PanelRig, why: str) -> None:
    if why == "not valid":
        rig.state(valid_fields=StateField.VELOCITY)
        assert shown(rig, Page.POSE)[1] == "no tool pose"
    else:
        rig.panel.cell.joints = ()
    assert shown(rig, Page.JOINTS)[1] == "no joint values"
    assert screen_text.joint_table(rig.panel) == "no joint values"


def test_the_screen_says_that_enabling_lets_go_by_itself(rig: PanelRig) -> None:
    assert "5 s without a key" in screen_text.jog_line(rig.panel, rig.now)
    rig.strike("v")
    assert "HELD, 5 s left" in screen_text.jog_line(rig.panel, rig.now)


def test_the_program_list_shows_lines_round_the_selected_one(rig: PanelRig) -> None:
    assert "n opens one" in screen_text.program_list(rig.panel)
    rig.open(PROGRAM)
    assert screen_text.program_list(rig.panel).splitlines() == [
        "pick, revision 3",
        "no dry run of this revision; . makes one",
        ">    1 move PTP home",
        "     2 wait 2 s",
        "     3 move LIN P1",
    ]


def test_why_names_the_first_broken_condition_and_the_remedy() -> None:
    answer = {
        "kind": "jog",
        "conditions": [
            {"meaning": "you have the authority", "holds": True},
            {
                "meaning": "no stop",
                "holds": False,
                "text": "stop by x",
                "cause": "It is latched.",
                "remedy": "Reset it.",
            },
        ],
    }
    assert why_lines(answer) == (
        "No jog:",
        "stop by x",
        "It is latched.",
        "-> Reset it.",
        "ok you have the authority",
        "NO no stop",
    )
    conditions: list[Any] = answer["conditions"]  # type: ignore[assignment]
    conditions[1]["code"] = VerdictCode.STOP_LATCHED
    assert why_lines(answer)[3] == "-> Press x in control, which resets it and moves nothing."
    assert why_request(OperatingMode.AUTOMATIC)["kind"] == "program"
    assert why_request(None)["kind"] == "jog"


def test_why_names_the_key_that_leads_out_of_what_the_robot_stands_at() -> None:
    """Feature J23."""
    way = WayOut(press="tool Z+ in base", space=2, frame="base", values=[0, 0, 1, 0, 0, 0])
    other = WayOut(press="joint 2 towards -", space=1, frame="", values=[0, -1, 0, 0, 0, 0])
    both = WayOut(
        press="joint 3 towards + and joint 5 towards -",
        space=1,
        frame="",
        values=[0, 0, 1, 0, -0.5, 0],
    )
    holds = [
        Hold(reason="collision", text="table and tool are 5.1 mm apart", ways=[way, other]),
        Hold(reason="joint-limit", text="joint 3 stands at 1.5708 rad", ways=[both]),
        Hold(reason="singularity", text="it stands at a singularity", ways=[]),
    ]
    assert why_lines({"kind": "jog", "conditions": []}, holds)[1:] == (
        "table and tool are 5.1 mm apart:",
        "-> tool Z+ in base: key e, frame base",
        "or joint 2 towards -: key s",
        "joint 3 stands at 90.00°:",
        "-> joint 3 towards + and joint 5 towards -: keys e g together",
        "it stands at a singularity:",
        "-> no key leads out",
    )


def test_why_says_so_where_nothing_is_broken() -> None:
    assert why_lines({"kind": "jog", "conditions": []})[0].startswith("A jog may start")


@pytest.mark.parametrize(("names_as_in_file", "shown"), [(False, "Upper-Arm"), (True, "elbow")])
def test_joints_are_named_as_people_do_unless_told_otherwise(
    names_as_in_file: bool, shown: str
) -> None:
    rig = PanelRig()
    told = snapshot(6)
    told["joints"][2].update({"name": "elbow", "display_name": "Upper-Arm"})
    rig.panel.cell.names_as_in_file = names_as_in_file
    rig.panel.cell.connected(HELLO, told)
    rig.state()
    assert shown in screen_text.joint_table(rig.panel).splitlines()[2]
