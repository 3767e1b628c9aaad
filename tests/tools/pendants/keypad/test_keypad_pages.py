"""The display, character by character: each page of it, and how it gets there."""

from typing import Any

import pytest
from rigs.cells.keypad_rig import KeypadRig, as_it_is
from rigs.cells.panel_rig import PROGRAM

from openpendant.simplemsg.pendant import Activity, OperatingMode, RunKind, StopChanged, StopKind
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import Hold, Refused, WayOut
from openpendant.tools.pendants.panel import commands as do

RECORDINGS: dict[str, Any] = {
    "recordings": [
        {"name": "keypad-1", "duration": 90.0},
        {"name": "keypad-10", "duration": 8.0},
        {"name": "keypad-9", "duration": 12.4},
        {"name": "a"},
    ],
    "recording": None,
}


@pytest.fixture
def rig() -> KeypadRig:
    return KeypadRig()


def page(text: str) -> list[str]:
    """Return the rows of a page that is drawn with bars at both ends."""
    rows = [row.strip()[1:-1] for row in text.strip().splitlines()]
    assert all(len(row) == 20 for row in rows)
    return rows


def test_the_joints(rig: KeypadRig) -> None:
    rig.state(positions=(0.01745329, -1.5707963, 1.5707963, -1.5707963, -1.5707963, 0.0))
    assert rig.rows == page(
        """
        |T1 JOINT      * en--|
        |1:   1.00 2: -90.00 |
        |3:  90.00 4: -90.00 |
        |5: -90.00 6:   0.00 |
        """
    )


def test_the_pose_in_a_frame_while_enabling_is_held(rig: KeypadRig) -> None:
    rig.strike("C")
    rig.state(
        enabling=1, tool_position=(0.4872, -0.1092, 0.4319), tool_orientation=(1.0, 0.0, 0.0, 0.0)
    )
    assert rig.rows == page(
        """
        |T1 BASE       * EN  |
        |X   487.2 A   180.0 |
        |Y  -109.2 B     0.0 |
        |Z   431.9 C     0.0 |
        """
    )


def test_the_speeds_while_a_speed_key_was_just_pressed(rig: KeypadRig) -> None:
    rig.state(override=0.3, tool_speed=0.075)
    before = rig.rows
    rig.strike("A")
    assert rig.rows == page(
        """
        |T1 JOINT      * en--|
        |Override        30 %|
        |Tool cap    250 mm/s|
        |Tool now     75 mm/s|
        """
    )
    rig.wait(1_500)
    assert rig.rows == before


def test_the_page_of_the_mode_comes_fourth(rig: KeypadRig) -> None:
    rig.menu()
    rig.strike("999")
    rig.strike("C")
    assert rig.rows == page(
        """
        |T1 JOINT      * en--|
        |Jog JOINT hold      |
        |Control: you        |
        |Enabling: let go    |
        """
    )


def test_pages_go_round_and_why_asks_the_server(rig: KeypadRig) -> None:
    rig.menu()
    shown = []
    asked = []
    for _ in range(7):
        asked += rig.strike("9")
        shown.append(rig.keypad.page.value)
    assert shown == ["pose", "speed", "mode", "program", "messages", "why", "joints"]
    assert asked == [do.AskWhy()]


def test_the_menu_lies_as_the_keys_do(rig: KeypadRig) -> None:
    rig.menu()
    assert rig.rows == page(
        """
        |REC    PLAY   UP    |
        |TEACH  UNDO   DOWN  |
        |HOME   RUN    PAGE  |
        |CTRL   PAUSE  T1/T2 |
        """
    )


def test_the_menu_closes_after_ten_seconds_without_a_key(rig: KeypadRig) -> None:
    rig.menu()
    rig.wait(9_000)
    rig.strike("9")
    rig.wait(9_900)
    assert rig.keypad.menu.is_open
    rig.wait(200)
    assert not rig.keypad.menu.is_open


def test_recordings_are_listed_the_newest_of_the_keypad_first(rig: KeypadRig) -> None:
    rig.menu()
    assert rig.strike("1") == [do.AskList(do.CellList.RECORDINGS)]
    rig.keypad.told_list(do.CellList.RECORDINGS, RECORDINGS)
    assert rig.rows == page(
        """
        |>keypad-10   00:08.0|
        | keypad-9    00:12.4|
        | keypad-1    01:30.0|
        |hold PLAY; REC: new |
        """
    )
    rig.strike("666")
    assert rig.rows[2] == ">a                  "
    assert rig.strike("1") == [do.RecordMotion("keypad-2")]


def test_a_recording_under_way_is_shown_kept_and_marked_on_other_pages(rig: KeypadRig) -> None:
    rig.menu()
    rig.strike("1")
    progress = {"name": "keypad-3", "duration": 12.4, "samples": 155}
    rig.keypad.told_list(do.CellList.RECORDINGS, {**RECORDINGS, "recording": progress})
    assert rig.rows == page(
        """
        |REC 00:12.4  155 pts|
        |keypad-3            |
        |MODE: jog on        |
        |REC: end and keep   |
        """
    )
    asked = rig.wait(1_000)
    assert asked == [do.AskList(do.CellList.RECORDINGS)] * 2
    rig.strike("C")
    assert rig.rows[0] == "T1 JOINT    R * en--"
    rig.menu()
    assert rig.strike("1") == [do.EndRecording()]


def played(rig: KeypadRig) -> list[do.Command]:
    rig.menu()
    rig.strike("1")
    rig.keypad.told_list(do.CellList.RECORDINGS, RECORDINGS)
    return rig.press("2")


def test_play_is_held_to_run_and_shows_how_far_it_is(rig: KeypadRig) -> None:
    rig.state(override=0.5)
    assert played(rig) == [do.HoldMotion(do.PlayBack("keypad-10"))]
    rig.state(activity=Activity.MOVING)
    rig.wait(4_000)
    assert rig.rows == page(
        """
        |PLAY keypad-10  50 %|
        |00:02.0 of 00:08.0  |
        |let go: stops       |
        |                    |
        """
    )
    assert rig.let_go() == [do.LetGoMotion()]


def test_a_motion_that_has_ended_needs_no_stop(rig: KeypadRig) -> None:
    played(rig)
    rig.keypad.motion_over()
    assert rig.rows[2] == "ended               "
    assert rig.let_go() == []


def test_a_pulled_cable_ends_a_held_motion(rig: KeypadRig) -> None:
    played(rig)
    rig.is_cut = True
    assert rig.wait(200) == [do.LetGoMotion()]


@pytest.mark.parametrize(
    ("label", "motion"), [("7", do.GoHome("home")), ("5", do.UndoJog())], ids=["HOME", "UNDO"]
)
def test_home_and_undo_are_held_to_run(rig: KeypadRig, label: str, motion: do.GoHome) -> None:
    rig.menu()
    assert rig.press(label) == [do.HoldMotion(motion)]
    assert rig.let_go() == [do.LetGoMotion()]


def test_in_automatic_a_motion_is_asked_for_twice_and_need_not_be_held(rig: KeypadRig) -> None:
    rig.state(operating_mode=OperatingMode.AUTOMATIC)
    rig.menu()
    assert rig.strike("7") == []
    assert rig.rows == page(
        """
        |HOME                |
        |AUTO: it moves alone|
        |HOME again: yes     |
        |other key: no       |
        """
    )
    assert rig.strike("7") == [do.GoHome("home")]
    rig.strike("7")
    assert rig.strike("5") == []
    assert rig.strike("7") == []  # it asks anew


def test_a_held_motion_needs_the_button_where_the_controller_may_be_real(rig: KeypadRig) -> None:
    rig.keypad.controller_described(is_emulated=False)
    rig.menu()
    assert rig.press("7") == []
    assert rig.rows[0] == "! ENABLING BUTTON   "
    rig.let_go()
    rig.emulated.button = True
    rig.wait(60)
    assert rig.press("7") == [do.HoldMotion(do.GoHome("home"))]
    rig.emulated.button = False
    assert rig.wait(60) == [do.LetGoMotion()]


def test_t1_t2_sets_t1_first_and_asks_before_automatic(rig: KeypadRig) -> None:
    rig.state(operating_mode=OperatingMode.AUTOMATIC)
    rig.menu()
    assert rig.strike("#") == [do.ChangeMode(OperatingMode.MANUAL_REDUCED)]
    rig.state(operating_mode=OperatingMode.MANUAL_REDUCED)
    assert rig.strike("#") == [do.ChangeMode(OperatingMode.MANUAL_HIGH)]
    rig.state(operating_mode=OperatingMode.MANUAL_HIGH)
    assert rig.strike("#") == []
    assert rig.rows == page(
        """
        |Mode is T2          |
        |T1/T2 again: AUTO   |
        |UP: T1              |
        |other key: T2       |
        """
    )
    assert rig.strike("#") == [do.ChangeMode(OperatingMode.AUTOMATIC)]
    rig.strike("#")
    assert rig.strike("3") == [do.ChangeMode(OperatingMode.MANUAL_REDUCED)]


def test_control_is_given_back_and_asked_for_in_the_menu(rig: KeypadRig) -> None:
    rig.menu()
    assert rig.strike("*") == [do.GiveControl()]
    rig.state(holder=0)
    assert rig.strike("*") == [do.TakeControl()]


def test_a_program_is_opened_shown_taught_and_run(rig: KeypadRig) -> None:
    rig.menu()
    assert rig.strike("8") == [do.AskPrograms()]
    rig.keypad.listed(["pick", "keypad-1"])
    assert rig.rows == page(
        """
        |>keypad-1           |
        | pick               |
        |                    |
        |RUN: open TEACH: new|
        """
    )
    rig.strike("6")
    assert rig.strike("8") == [do.OpenProgram("pick")]
    rig.keypad.opened(PROGRAM)
    assert rig.rows == page(
        """
        |pick              r3|
        |> 1 move PTP home   |
        |  2 wait 2 s        |
        |  3 move LIN P1     |
        """
    )
    rig.strike("6")
    assert rig.rows[2] == "> 2 wait 2 s        "
    (taught,) = rig.strike("4")
    assert isinstance(taught, do.ApplyEdit)
    assert rig.press("8") == [do.HoldMotion(do.RunProgram("pick", 3, RunKind.ALL))]


def test_teach_without_a_program_makes_one(rig: KeypadRig) -> None:
    rig.menu()
    assert rig.strike("4") == [do.AskPrograms()]
    rig.keypad.listed(["keypad-1"])
    assert rig.strike("4") == [do.MakeProgram("keypad-2")]


def test_a_refusal_is_named_with_its_numbers_and_the_key_that_leads_out(rig: KeypadRig) -> None:
    rig.press("3")
    asked = rig.keypad.refused(Refused(VerdictCode.OUT_OF_RANGE, "", 2, 2.790780, 2.792527))
    assert asked == [do.AskRetreat()]
    way = WayOut(press="", space=1, frame="", values=[0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
    rig.keypad.ways_out([Hold(reason="joint-limit", text="", ways=[way])])
    assert rig.rows == page(
        """
        |! OUT_OF_RANGE     3|
        |159.90 of 160.00 deg|
        |3- leads out        |
        |                    |
        """
    )
    rig.wait(6_000)
    assert rig.rows[0] == "! OUT_OF_RANGE     3"  # the key that was refused is held
    rig.let_go()
    assert rig.rows[0] == "T1 JOINT      * en--"


def test_a_refusal_without_numbers_says_what_to_do_for_five_seconds_or_until_a_key(
    rig: KeypadRig,
) -> None:
    rig.keypad.refused(Refused(VerdictCode.MODE_FORBIDS, "", -1, 0.0, 0.0))
    assert rig.rows == page(
        """
        |! MODE_FORBIDS      |
        |MODE long opens the |
        |menu; T1/T2 there   |
        |sets T1.            |
        """
    )
    rig.wait(4_500)
    assert rig.rows[0] == "! MODE_FORBIDS      "
    rig.wait(500)
    assert rig.rows[0] == "T1 JOINT      * en--"
    rig.keypad.refused(Refused(VerdictCode.MODE_FORBIDS, "", -1, 0.0, 0.0))
    rig.strike("A")
    rig.wait(1_600)
    assert rig.rows[0] == "T1 JOINT      * en--"


def stopped(rig: KeypadRig) -> None:
    rig.keypad.stop_changed(StopChanged(1, StopKind.SOFTWARE, "kim", "button in browser"))
    rig.keypad.cell.stop_changed(StopChanged(1, StopKind.SOFTWARE, "kim", "button in browser"))
    rig.state(stop=StopKind.SOFTWARE)


def test_a_latched_stop_is_reset_by_mode_held_for_two_seconds_and_not_before(
    rig: KeypadRig,
) -> None:
    stopped(rig)
    assert rig.rows == page(
        """
        |STOP kim            |
        |button in browser   |
        |                    |
        |MODE 2 s: reset     |
        """
    )
    assert rig.press("C", 1_980) == []
    assert rig.wait(60) == [do.UnlatchStop()]
    assert rig.let_go() == []


def test_a_stop_stands_before_the_word_that_keys_are_to_be_let_go(rig: KeypadRig) -> None:
    rig.press("1")
    stopped(rig)
    assert rig.rows == page(
        """
        |STOP kim            |
        |button in browser   |
        |let go of all keys  |
        |MODE 2 s: reset     |
        """
    )
    rig.let_go()
    assert rig.rows[2] == " " * 20


def test_on_the_page_of_a_stop_a_short_mode_looks_at_the_others_and_a_jog_key_goes_back(
    rig: KeypadRig,
) -> None:
    stopped(rig)
    rig.strike("C")
    assert rig.rows[:2] == ["STOP kim            ", "1:   7.16 2:  14.32 "]
    assert rig.press("1") == []
    assert rig.rows[3] == "MODE 2 s: reset     "


def test_who_is_not_in_control_is_told_how_to_reset(rig: KeypadRig) -> None:
    rig.state(holder=0)
    stopped(rig)
    assert rig.rows[2] == "a jog key: control  "
    assert rig.press("1") == [do.TakeControl()]


@pytest.mark.parametrize(
    ("happens", "row"),
    [
        (lambda rig: rig.keypad.lost("gone"), "NO LINK             "),
        (lambda rig: rig.keypad.turned_away("no"), "NO LOGIN            "),
        (lambda rig: rig.state(age=0.4), "STALE 0.4 s         "),
        (lambda rig: rig.state(link=0), "CONTROLLER DOWN     "),
        (lambda rig: rig.state(holder=0), "T1 JOINT      o en--"),
    ],
)
def test_the_first_row_says_what_is_wrong(rig: KeypadRig, happens: Any, row: str) -> None:
    happens(rig)
    assert rig.rows[0][:5] == row[:5]
    if "0.4" not in row:
        assert rig.rows[0] == row


def test_a_keypad_without_a_bridge_says_so(rig: KeypadRig) -> None:
    rig.is_cut = True
    rig.wait(1_100)
    assert rig.emulated.lcd == page(
        """
        |NO BRIDGE           |
        |USE THE ROBOT'S OWN |
        |STOP BUTTON         |
        |keypad 1.0   115200 |
        """
    )


# How pages get there.


def test_at_most_five_pages_a_second_leave_and_only_rows_that_changed(rig: KeypadRig) -> None:
    rig.state(positions=(0.0,) * 6)
    rig.wait(500)
    kinds = bytearray()

    def note(data: bytes) -> bytes:
        kinds.extend(piece[1] for piece in data.split(b"\0") if len(piece) > 1)
        return data

    rig.down = note
    for step in range(100):
        rig.state(positions=(step / 100, 0.0, 0.0, 0.0, 0.0, 0.0))
        rig.wait(10)
    assert 4 <= kinds.count(0x82) <= 6
    assert 0x83 not in kinds


def test_a_display_that_never_answers_is_told_once_and_the_keys_go_on(rig: KeypadRig) -> None:
    rig.up = lambda data: b"" if data[2:3] == b"\x05" else data  # ACK is lost
    rig.state(positions=(0.5,) * 6)
    rig.wait(8_000)
    assert [type(each).__name__ for each in rig.keypad.line_news()].count("DisplaySilent") == 1
    assert rig.press("1") != []
    rig.up = as_it_is
    rig.let_go()
    rig.wait(1_000)
    assert rig.emulated.lcd[1] == "1:  28.65 2:  28.65 "


def test_a_row_that_was_lost_is_sent_again(rig: KeypadRig) -> None:
    lost: list[bytes] = []

    def lose_one(data: bytes) -> bytes:
        if b"\x82" in data and not lost:
            lost.append(data)
            return b""
        return data

    rig.down = lose_one
    rig.state(positions=(0.25, *(0.125 * (joint + 1) for joint in range(1, 6))))
    assert rig.rows[1].startswith("1:  14.32")
    assert lost


def test_a_keypad_whose_page_is_incomplete_gets_all_of_it(rig: KeypadRig) -> None:
    rig.emulated._rows_shown = 0
    rig.emulated.lcd = ["?" * 20] * 4
    rig.wait(400)
    assert rig.emulated.lcd[0] == "T1 JOINT      * en--"
