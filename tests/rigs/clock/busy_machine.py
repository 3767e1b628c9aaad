"""What tests on real processes grant a machine that is slow, or busy with something else.

Owns their patience, the settings of a server that shall not mind, and that a test marked
`realtime` is tried again where it fails on a machine that was late meanwhile: a set-point that
came late is refused by every controller, and ends the motion. Late was the machine where an idle
process beside the test, of the same priority, was woken late; without that a failure is the
test's own. Each attempt asserts the same; one that had a robot sent what it may not be sent is
final. Each is told in the summary of warnings, in a green run too, with what failed and how late
the idle process was. Lateness that hardly explains a failure is taken a few times in a run; more
of it fails the run, of all workers together.
"""

import os
import time
import warnings

import pytest
from _pytest.runner import runtestprotocol
from rigs.clock.stall_watch import StallWatch

SCALE = float(os.environ.get("OPENPENDANT_TIME_SCALE", "1"))
"""Waits are multiplied by this on slow machines."""

PATIENCE = 45.0 * SCALE
"""Longest wait for what no test asserts the time of, such as the start of a process [s]."""

ATTEMPTS = 3
"""The first and at most two more."""

PROMISE_ATTEMPTS = 2
"""The same for promises: a bound that needs more is not kept."""

ALL_ATTEMPTS = 360.0 * SCALE
"""Longest time that all attempts of a test may take together [s]."""

PLAIN_LATENESS = 0.05
"""Lateness of the idle process that explains that a test failed [s]."""

MOST_DOUBTFUL = 5
"""Second tries of a whole run whose idle process was late, and by less than that."""

UNHURRIED = """
controller.lead = 0.25
controller.reply_deadline = 2.0
jog.lead = 0.1
modes.enabling_deadline = 0.25
ros_i.trajectory_gap = 0.4
watchdog.deadline = 1.0
"""
"""Settings as lines of TOML: all that may be late may be as late as the server allows."""

PATIENT = f"{UNHURRIED}controller.points_in_flight = 4\n"
"""The same for a controller that takes points before it has answered the last one."""

FINAL = "violation"
"""What the failure of a test says where a referee saw what no controller may be sent."""


class BegunAnew(UserWarning):
    """Something failed that may have come late, and was tried again."""


class HardlyLate(BegunAnew):
    """The machine was late by less than what explains that a test failed."""


def tell_begun_anew(why: str, category: type[BegunAnew] = BegunAnew) -> None:
    """Tell that something is tried again, as a warning that fails no test."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", BegunAnew)
        warnings.warn(f"begun anew: {why}", category, stacklevel=2)


class Attempts:
    """Plugin of pytest: runs tests marked `realtime`, again where they fail."""

    def __init__(self) -> None:
        """Watch nothing until there is such a test."""
        self._watch: StallWatch | None = None
        self.doubtful = 0

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Give all attempts of a test together more time than one test has."""
        for item in items:
            if _is_realtime(item) and item.get_closest_marker("timeout") is None:
                item.add_marker(pytest.mark.timeout(ALL_ATTEMPTS))

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item, nextitem: pytest.Item | None) -> object:
        """Run a test until an attempt passes, or the last one fails; report that one."""
        if not _is_realtime(item) or item.get_closest_marker("soak"):
            return None
        if self._watch is None:
            self._watch = StallWatch()
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        attempts = PROMISE_ATTEMPTS if "promises" in item.path.parts else ATTEMPTS
        for attempt in range(1, attempts + 1):
            began = time.monotonic()
            item._initrequest()  # type: ignore[attr-defined]
            reports = runtestprotocol(item, nextitem=nextitem, log=False)
            failed = [report for report in reports if report.failed]
            if not failed or attempt == attempts:
                break
            late = self._watch.worst_since(began)
            if not late or not _may_be_repeated(failed, item):
                break
            _tell(item, failed[0], late)
        for report in reports:
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def pytest_warning_recorded(self, warning_message: warnings.WarningMessage) -> None:
        """Count what is doubtful; where workers run the tests, this is told by all of them."""
        self.doubtful += issubclass(warning_message.category, HardlyLate)

    @pytest.hookimpl(tryfirst=True)
    def pytest_sessionfinish(self, session: pytest.Session) -> None:
        """End what watched; fail a run that had too many doubtful second tries."""
        if self._watch is not None:
            self._watch.end()
        if self.doubtful > MOST_DOUBTFUL:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Say why a run failed whose tests passed."""
        if self.doubtful > MOST_DOUBTFUL:
            terminalreporter.write_line(
                f"ERROR: {self.doubtful} second tries beside an idle process that was less than"
                f" {1e3 * PLAIN_LATENESS:.0f} ms late, at most {MOST_DOUBTFUL} are allowed: the"
                " tests are at fault, or what they test",
                red=True,
            )


def _tell(item: pytest.Item, failed: pytest.TestReport, late: float) -> None:
    lines = failed.longreprtext.splitlines()
    why = next((line[1:].strip() for line in lines if line.startswith("E ")), lines[-1])
    tell_begun_anew(
        f"{item.name}: {why} (an idle process was {1e3 * late:.0f} ms late)",
        HardlyLate if late < PLAIN_LATENESS else BegunAnew,
    )


def _may_be_repeated(failed: list[pytest.TestReport], item: pytest.Item) -> bool:
    """Tell whether a test may run again; then take down what its failure may have broken.

    That is what the module's fixtures run, too: a cell that is shared may have stopped.
    """
    try:
        item.session._setupstate.teardown_exact(None)
    except Exception as error:
        failed[0].sections.append(("what its fixtures say at their end", str(error)))
        return False
    return not any(FINAL in report.longreprtext for report in failed)


def _is_realtime(item: pytest.Item) -> bool:
    return item.get_closest_marker("realtime") is not None
