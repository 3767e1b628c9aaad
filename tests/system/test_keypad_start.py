"""`make keypad`: a newcomer at the keypad on screen, by what its display says alone."""

import os
import re
import signal
import sys
from pathlib import Path

import pytest
from rigs.clock.busy_machine import PATIENCE, tell_begun_anew
from rigs.processes.marked_processes import left_over, processes_marked
from rigs.processes.terminal_window import TerminalWindow

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.conformance,
    pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc"),
]

CTRL_Q = "\x11"
MOST_PRESSES = 8


def joint_1(shown: str) -> float:
    """Return the value of joint 1 on the display [deg]; far below where it is not there."""
    found = re.search(r"1: *(-?[\d.]+) 2:", shown)
    return float(found[1]) if found else -1e9


def test_a_newcomer_takes_control_jogs_stops_and_leaves(tmp_path: Path) -> None:
    mark = f"OPENPENDANT_KEYPAD_TEST={tmp_path}"
    name, _, value = mark.partition("=")
    window = TerminalWindow(
        [sys.executable, "-m", "openpendant.tools.start_keypad", "--store", "off"],
        environment={name: value, "XDG_DATA_HOME": str(tmp_path)},
        folder=tmp_path,
    )
    try:
        window.until(lambda shown: "T1 JOINT      o en--" in shown)
        window.strike("1")
        window.until(lambda shown: "CONTROL: YOURS" in shown)
        window.strike("1")
        shown = window.until(lambda shown: "T1 JOINT      * en--" in shown)
        before = joint_1(shown)
        for _ in range(MOST_PRESSES):
            window.strike("1")
            shown = window.until(
                lambda shown: "LET GO OF ALL KEYS" in shown or joint_1(shown) > before + 0.5
            )
            if "LET GO OF ALL KEYS" not in shown:
                break
            # A machine that stands still for an eighth of a second ends the jog, as it must.
            tell_begun_anew("the jog of a latched key had broken off")
            window.strike("1")
            window.until(lambda shown: "T1 JOINT      * en--" in shown)
        assert joint_1(shown) > before + 0.5
        window.strike(" ")
        window.until(lambda shown: "STOP keypad" in shown and "MODE 2 s: reset" in shown)
        window.strike(CTRL_Q)
        assert window.ended() == 0
        assert "all four have ended" in window.until(lambda shown: "all four" in shown)
        assert left_over(mark, PATIENCE) == {}
    finally:
        window.close()
        for pid in processes_marked(mark):
            os.kill(pid, signal.SIGKILL)
