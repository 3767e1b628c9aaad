"""What tests on real processes grant a machine that is slow, or busy with something else.

Owns their patience, the settings of a server that shall not mind, and which failures are the
machine's: a set-point that came late is refused by every controller, and ends the motion. A test
that is tried again asserts the same each time, and a product that is always late fails every time.
Each time is told in the summary of warnings, in a green run too.
"""

from __future__ import annotations

import functools
import os
import warnings
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

ATTEMPTS = 3
"""The first and at most two more."""

UNHURRIED = """
controller.lead = 0.1
controller.reply_deadline = 2.0
jog.lead = 0.1
modes.enabling_deadline = 0.25
ros_i.trajectory_gap = 0.4
watchdog.deadline = 1.0
"""
"""Settings as lines of TOML: all that may be late may be as late as the server allows."""

PATIENT = f"{UNHURRIED}controller.points_in_flight = 4\n"
"""The same for a controller that takes points before it has answered the last one."""

_LATE = {
    VerdictCode.CONTROLLER_SILENT,
    VerdictCode.ENABLING_LOST,
    VerdictCode.FEEDBACK_STALE,
    VerdictCode.NOT_ENABLED,
    VerdictCode.PRESS_STALE,
    VerdictCode.SERVER_LATE,
}

_LATE_WORDS = "under-run"
"""What the server says of a refused point where those before it had not lasted until it came."""


class BegunAnew(UserWarning):
    """Something came late, and was tried again."""


class Cells(Protocol):
    """Cells of a test, with an emulated robot each."""

    async def end_and_tell_under_runs(self) -> int:
        """End those of the attempt that is over; return how often points had come late.

        Raises:
            AssertionError: the server had sent what no controller may be sent.
        """
        ...


def came_late(error: Exception) -> bool:
    """Tell whether a motion was refused or ended because something had not come in time."""
    return isinstance(error, Aborted | Refused) and (
        error.code in _LATE or _LATE_WORDS in error.text
    )


def tell_begun_anew(why: str) -> None:
    """Tell that something is tried again, as a warning that fails no test."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", BegunAnew)
        warnings.warn(f"begun anew: {why}", BegunAnew, stacklevel=2)


def run_again(run: Callable[[], CompletedProcess[str]]) -> CompletedProcess[str]:
    """Run a command; run it anew where it failed and says that a point came late."""
    for _ in range(ATTEMPTS - 1):
        done = run()
        said = done.stdout + done.stderr
        if not done.returncode or _LATE_WORDS not in said:
            return done
        tell_begun_anew(said)
    return run()


def tried_again(test: Test) -> Test:
    """Have a test begin anew where what failed it is that something came late.

    Whatever it asks of `start_cell` and `tmp_path` is new each time. What else it uses has to be as
    it was before. It is not for tests that freeze or kill a server or a controller: those make
    points come late themselves.
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
                # An assertion says nothing of its cause: it needs points that came late just now.
                under_runs = 0 if cells is None else await cells.end_and_tell_under_runs()
                if attempt == ATTEMPTS or not (under_runs or came_late(error)):
                    raise
                tell_begun_anew(f"{test.__name__}, {under_runs} under-runs, {error}")

    patient: Test = pytest.mark.timeout(360)(trying)
    return patient
