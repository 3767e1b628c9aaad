import random
from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

import numpy as np
import pytest
from rigs.cells import program_cell
from rigs.cells.program_cell import ProgramCell

from openpendant.motion.pose import Array
from openpendant.motion.timing.parameterization import VelocityProfile
from openpendant.motion.trajectory.joint_curves import JointLine, Path
from openpendant.motion.trajectory.ptp import StraightMove
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.server.events.effects import Effect, StorePlan
from openpendant.simplemsg import JointTrajPtFull
from openpendant.simplemsg.pendant import MotionControlAction
from openpendant.simplemsg.verdicts import VerdictCode as V

PAUSE, RESUME = MotionControlAction.PAUSE, MotionControlAction.RESUME
BOUND = 1e-6
"""How far a paused motion may be from the unpaused path [rad]."""

_POINTS = (
    "point far joints 0.6 -1.2 1.7 -1.4 -1.3 0.4 rad\n"
    "point high joints 0.1 -1.0 2.0 -1.2 -1.6 0.9 rad\n"
    "point low joints -0.3 -1.2 1.5 -1.6 -1.3 0.5 rad\n"
)
PROGRAMS = {
    "joint moves": "move PTP far speed 60 %\nmove PTP a speed 60 %\nmove PTP c\nmove PTP a\n",
    "lines": "move LIN far speed 200 mm/s\nmove LIN a speed 200 mm/s\n",
    "a program": (
        "move PTP far speed 50 %\nmove LIN b speed 250 mm/s zone 10 mm\n"
        "move LIN c speed 250 mm/s\nwait 0.1 s\nmove SPLINE a via b far speed 30 %\n"
    ),
    "zones": (
        "move PTP far zone 0.2 rad\nmove PTP high zone 0.05 rad\nmove PTP low zone 0.3 rad\n"
        "move PTP a\nmove PTP far zone 0.2 rad\nmove LIN high speed 300 mm/s zone 20 mm\n"
        "move PTP low\n"
    ),
    "at full speed": "move SPLINE far via b c\nmove LIN a\nmove PTP far\nmove PTP a\n",
    "slow lines": (
        "move PTP a\nmove LIN b speed 50 mm/s zone 5 mm\nmove LIN c speed 50 mm/s\nmove PTP a\n"
    ),
}
_PLACES = 400
"""Of a path, from which Newton finds the nearest point; too few would make none seem near."""


class WatchedCell(ProgramCell):
    """Keeps the straight moves that began, and where the controller was every 5 ms."""

    def __init__(self, statements: str) -> None:
        self.straight: list[StraightMove] = []
        self.executed: list[tuple[float, ...]] = []
        super().__init__(main=statements)

    def perform(self, outgoing: list[Effect]) -> list[Effect]:
        for item in outgoing:
            if isinstance(item, StorePlan):
                played = item.motion.certified.trajectory
                if isinstance(played, StraightMove):
                    self.straight.append(played)
        return super().perform(outgoing)

    def wait(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, 5):
            super().wait(5)
            self.executed.append(self.position)

    @property
    def set_points(self) -> list[tuple[float, ...]]:
        return [each.positions[:6] for each in self.sent if isinstance(each, JointTrajPtFull)]


@pytest.fixture(autouse=True)
def _points(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(program_cell, "HEAD", program_cell.HEAD + _POINTS)


@cache
def unpaused_paths(statements: str) -> list[Path]:
    paths: list[Path] = []
    sampled = VelocityProfile.sampled

    def noted(self: VelocityProfile, path: Path, *more: Any) -> Trajectory:
        paths.append(path)
        return sampled(self, path, *more)

    cell = WatchedCell(statements)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(VelocityProfile, "sampled", noted)
        assert (cell.run(), cell.until_outcomes()) == (V.ACCEPTED, [V.ACCEPTED])
    return [*paths, *(JointLine(move.start, move.goal) for move in cell.straight)]


def distance(points: Sequence[Sequence[float]], paths: Sequence[Path]) -> float:
    """Return how far the farthest point is from the nearest path, in any joint [rad]."""
    rows = np.unique(np.array(points), axis=0)
    nearest = np.full(len(rows), np.inf)
    for path in paths:
        nearest = np.minimum(nearest, _distances(rows, path))
    return float(nearest.max())


def _distances(rows: Array, path: Path) -> Array:
    s = np.linspace(0.0, path.length, _PLACES)
    step, curve = s[1], path.evaluate(s)
    found: list[Array] = []
    for some in np.array_split(rows, len(rows) // 200 + 1):
        first = s[((some[:, np.newaxis] - curve) ** 2).sum(axis=2).argmin(axis=1)]
        least, most = np.maximum(first - step, 0.0), np.minimum(first + step, path.length)
        at = first
        for _ in range(6):  # Newton's steps to where the way to the point is square to the path
            gap, slope = path.evaluate(at) - some, path.evaluate(at, 1)
            bend = (slope**2).sum(axis=1) + (gap * path.evaluate(at, 2)).sum(axis=1)
            at = np.clip(at - (gap * slope).sum(axis=1) / np.maximum(bend, 1e-9), least, most)
        found.append(np.abs(path.evaluate(at) - some).max(axis=1))
    return np.concatenate(found)


def pauses(cell: WatchedCell, seed: int) -> Iterator[None]:
    """Pause and resume 20 times at random, as long as the program runs."""
    dice = random.Random(seed)
    for _ in range(20):
        cell.pass_time(dice.randrange(10, 500, 10))
        if cell.user.outcomes():
            return
        assert cell.control(PAUSE) is V.ACCEPTED
        cell.pass_time(dice.randrange(10, 300, 10))
        assert cell.control(RESUME) is V.ACCEPTED
        yield


def stays_on_the_path(kind: str, seed: int, between: float = BOUND) -> None:
    paths = unpaused_paths(PROGRAMS[kind])
    cell = WatchedCell(PROGRAMS[kind])
    before = len(cell.set_points)
    cell.executed.clear()
    assert cell.run() is V.ACCEPTED
    assert sum(1 for _ in pauses(cell, seed)) >= 5
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert distance(cell.set_points[before:], paths) <= 0.2 * BOUND
    assert distance(cell.executed, paths) <= between
    assert not any(cell.controller.referee.counts.values())


@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        # Pauses that begin or end where a zone does.
        ("a program", 3),
        ("zones", 1),
        ("at full speed", 1),
    ],
)
def test_twenty_random_pauses_leave_the_path_as_it_is(kind: str, seed: int) -> None:
    stays_on_the_path(kind, seed)


@pytest.mark.soak
@pytest.mark.timeout(3_600)
@pytest.mark.parametrize("kind", PROGRAMS)
def test_twenty_random_pauses_twenty_times_leave_the_path_as_it_is(kind: str) -> None:
    for seed in range(1, 21):
        # At some of them the controller's curve bends off by a little more.
        stays_on_the_path(kind, seed, between=2 * BOUND)


def test_overrides_while_running_leave_the_path_as_it_is() -> None:
    paths = unpaused_paths(PROGRAMS["a program"])
    cell = WatchedCell(PROGRAMS["a program"])
    cell.executed.clear()
    assert cell.run() is V.ACCEPTED
    for override in (0.3, 1.0, 0.07, 0.8, 0.33, 0.9):
        assert cell.user.speed(override) is V.ACCEPTED
        cell.pass_time(700)
    assert cell.until_outcomes() == [V.ACCEPTED]
    assert distance(cell.set_points, paths) <= 0.2 * BOUND
    assert distance(cell.executed, paths) <= BOUND
