"""The lanes of a run: the tests that compute, those of processes, those on the real clock.

Owns which test belongs to which. `pytest --lane=computing` takes the tests that are not marked
`realtime`; of those that are, `--lane=processes` takes the ones of whole processes, which wait for
what these say with much patience, and `--lane=real-time` the others, whose bounds a crowd beside
them would break. Without the option all run. `run_lanes.py` runs one lane after the other.
"""

import re
from enum import Enum
from pathlib import Path

import pytest

_MARK = "realtime"

_OF_PROCESSES = ("system", "examples", "tools")
"""Folders of tests whose processes are waited for, and nearly never hurried."""

_NAMED = f"mark.{_MARK}"
"""How a file names it; a word of it elsewhere, as in a test of marks, is none."""

_ALL_OF_A_FILE = re.compile(rf"^pytestmark = .*\bmark\.{_MARK}\b", re.MULTILINE)


TESTS = Path(__file__).resolve().parent


class Lane(Enum):
    """Which tests run together."""

    COMPUTING = "computing"
    PROCESSES = "processes"
    REAL_TIME = "real-time"


def add_option(parser: pytest.Parser) -> None:
    """Add `--lane` to the command line of pytest."""
    parser.addoption(
        "--lane",
        choices=[lane.value for lane in Lane],  # plain, so that workers can be sent it
        help="run the tests of one lane: computing are those not marked `realtime`",
    )


class OneLane:
    """Plugin of pytest: leaves out the tests of the other lane."""

    def __init__(self, lane: Lane) -> None:
        """Keep which lane runs."""
        self._lane = lane

    @pytest.hookimpl
    def pytest_ignore_collect(self, collection_path: Path) -> bool | None:
        """Import no test file in vain: each of many processes would, and only wait afterwards."""
        if collection_path.suffix != ".py":
            return None
        if self._lane is Lane.COMPUTING:
            return _is_on_real_clock(collection_path) or None
        return not _may_have_some(collection_path, self._lane) or None

    @pytest.hookimpl(tryfirst=True)
    def pytest_collection_modifyitems(
        self, config: pytest.Config, items: list[pytest.Item]
    ) -> None:
        """Leave them out.

        Raises:
            UsageError: a file gets the mark without naming it, so that no lane would run its tests.
        """
        wanted: list[pytest.Item] = []
        others: list[pytest.Item] = []
        for item in items:
            (wanted if _lane_of(item) is self._lane else others).append(item)
        if self._lane is Lane.COMPUTING:
            for path in {item.path for item in others}:
                if not _may_be_on_real_clock(path):
                    raise pytest.UsageError(
                        f"{path} must name the mark {_MARK} that it uses: {_NAMED}"
                    )
        config.hook.pytest_deselected(items=others)
        items[:] = wanted


def _lane_of(item: pytest.Item) -> Lane:
    return Lane.COMPUTING if item.get_closest_marker(_MARK) is None else _waiting_lane(item.path)


def _waiting_lane(path: Path) -> Lane:
    """Return the lane of what a file has on the real clock."""
    within = path.relative_to(TESTS) if path.is_relative_to(TESTS) else path
    return Lane.PROCESSES if within.parts[0] in _OF_PROCESSES else Lane.REAL_TIME


def _may_have_some(path: Path, lane: Lane) -> bool:
    """Return whether a file may have tests of a lane on the real clock."""
    return _waiting_lane(path) is lane and _may_be_on_real_clock(path)


def _is_on_real_clock(path: Path) -> bool:
    """Return whether a file marks all of its tests."""
    return path.is_file() and _ALL_OF_A_FILE.search(path.read_text(encoding="utf-8")) is not None


def _may_be_on_real_clock(path: Path) -> bool:
    return path.is_file() and _NAMED in path.read_text(encoding="utf-8")
