"""What tests on real processes grant a machine that is slow, or busy with something else.

Owns their patience, the settings of a server that shall not mind, and which failures are the
machine's: a set-point that came late is refused by every controller, and ends the motion. A test
that is tried again asserts the same each time, and a product that is always late fails every time.
"""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable, Coroutine
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any, Protocol

import pytest

from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import Aborted, Refused

Test = Callable[..., Coroutine[Any, Any, None]]

SCALE = float(os.environ.get("OPENPENDANT_TIME_SCALE", "1"))
"""Waits are multiplied by this on slow machines."""

PATIENCE = 45.0 * SCALE
"""Longest wait for what no test asserts the time of, such as the start of a process [s]."""

ATTEMPTS = 5

PATIENT = """
controller.lead = 0.1
controller.points_in_flight = 4
controller.reply_deadline = 2.0
jog.lead = 0.1
modes.enabling_deadline = 0.25
ros_i.trajectory_gap = 0.4
watchdog.deadline = 1.0
"""
"""Settings as lines of TOML: all that may be late may be as late as the server allows."""

_LATE = {
    # A point behind an under-run; where it was refused for another reason, the emulator's referee
    # counts a violation, of which there may be none in the end.
    VerdictCode.CONTROLLER_REFUSED,
    VerdictCode.CONTROLLER_SILENT,
    VerdictCode.ENABLING_LOST,
    VerdictCode.FEEDBACK_STALE,
    VerdictCode.NOT_ENABLED,
    VerdictCode.PRESS_STALE,
    VerdictCode.SERVER_LATE,
}

_LATE_WORDS = ("under-run", "the controller answered a point with reply code")


class Cells(Protocol):
    """Cells of a test, with an emulated robot each."""

    async def end_and_tell_under_runs(self) -> int:
        """End all of them; return how often points had come late."""
        ...


def came_late(error: Exception) -> bool:
    """Tell whether a motion was refused or ended because something had not come in time."""
    return isinstance(error, Aborted | Refused) and (
        error.code in _LATE or "under-run" in error.text
    )


def run_again(run: Callable[[], CompletedProcess[str]]) -> CompletedProcess[str]:
    """Run a command; run it anew where it failed and says that a point came late."""
    for _ in range(ATTEMPTS):
        done = run()
        said = done.stdout + done.stderr
        if not done.returncode or not any(words in said for words in _LATE_WORDS):
            break
    return done


def tried_again(test: Test) -> Test:
    """Have a test begin anew where what failed it is that something came late.

    Whatever it asks of `start_cell` and `tmp_path` is new each time. What else it uses has to be as
    it was before.
    """

    @functools.wraps(test)
    async def trying(**fixtures: Any) -> None:
        cells: Cells | None = fixtures.get("start_cell")
        folder: Path | None = fixtures.get("tmp_path")
        for attempt in range(1, ATTEMPTS + 1):
            if folder is not None:
                fixtures["tmp_path"] = folder / f"attempt-{attempt}"
                fixtures["tmp_path"].mkdir()
            try:
                return await test(**fixtures)
            except Exception as error:
                under_runs = 0 if cells is None else await cells.end_and_tell_under_runs()
                if attempt == ATTEMPTS or not (under_runs or came_late(error)):
                    raise
                sys.stdout.write(
                    f"attempt {attempt}, begun anew: {under_runs} under-runs, {error}\n"
                )

    patient: Test = pytest.mark.timeout(360)(trying)
    return patient
