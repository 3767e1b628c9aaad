"""`make keypad`: a newcomer at the keypad on screen, by what its display says alone."""

import os
import re
import signal
import sys
from pathlib import Path

import pytest
from rigs.clock.busy_machine import PATIENCE
from rigs.processes.marked_processes import left_over, processes_marked
from rigs.processes.terminal_window import TerminalWindow

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.firmware,
    pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc"),
]

CTRL_Q, ESCAPE = "\x11", "\x1b"


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
        before = re.search(r"1: *(-?[\d.]+) 2:", shown)
        assert before is not None
        window.strike("1")
        window.until(lambda shown: "T1 JOINT      * EN" in shown)
        window.until(
            lambda shown: (
                (now := re.search(r"1: *(-?[\d.]+) 2:", shown)) is not None
                and float(now[1]) > float(before[1]) + 0.5
            )
        )
        window.strike(" ")
        window.until(lambda shown: "LET GO OF ALL KEYS" in shown)
        window.strike(ESCAPE)
        window.until(lambda shown: "STOP keypad" in shown and "MODE 2 s: reset" in shown)
        window.strike(CTRL_Q)
        assert window.ended() == 0
        assert "all four have ended" in window.until(lambda shown: "all four" in shown)
        assert left_over(mark, PATIENCE) == {}
    finally:
        window.close()
        for pid in processes_marked(mark):
            os.kill(pid, signal.SIGKILL)
