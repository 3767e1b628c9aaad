"""An emulated cell that moves in each of the ways there are, and reports what a test says.

Owns the beginnings of these motions, and an oracle of its own for where the robot may be reported:
it knows only the points that reached the controller, and samples them densely.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from rigs.cells.emulated_cell import EmulatedCell
from rigs.cells.program_cell import ProgramCell
from rigs.peers.server_clients import Pendant

from openpendant.simplemsg import JointTrajPt, JointTrajPtFull, SpecialSequence, joint_array
from openpendant.simplemsg import pendant as messages
from openpendant.simplemsg.verdicts import VerdictCode as V

MS = 1_000_000
TICK_MS = 10
FIRST, SECOND = 0, 1


class MovingCell:
    """An emulated cell in a motion that a test began, and that goes on while time passes.

    Attributes:
        pendant: a pendant that hears of everything.
        began: when the motion began [ns].
    """

    def __init__(self, cell: EmulatedCell, pendant: Pendant, beat: Callable[[int], None]) -> None:
        self.cell = cell
        self.pendant = pendant
        self.began = cell.now
        self._beat = beat
        self._ticks = 0

    def wait(self, milliseconds: int) -> None:
        for _ in range(0, milliseconds, TICK_MS):
            if self._ticks % 5 == 0:
                self._beat(self._ticks // 5 + 1)
            self._ticks += 1
            self.cell.wait(TICK_MS)

    def until_stopped(self, most_ms: int) -> int:
        """Let time pass until STOP leaves; return when that was [ns]."""
        for _ in range(0, most_ms, TICK_MS):
            self.wait(TICK_MS)
            if self.stops:
                return self.cell.now
        raise AssertionError(f"no STOP within {most_ms} ms")

    @property
    def stops(self) -> int:
        return sum(map(is_stop, self.cell.sent))

    @property
    def code(self) -> V:
        stop = self.cell.core.cell.stop
        assert stop is not None
        assert stop.is_protective
        return stop.code

    @property
    def reason(self) -> str:
        stop = self.cell.core.cell.stop
        assert stop is not None
        return stop.reason


def is_stop(message: object) -> bool:
    return isinstance(message, JointTrajPt) and message.sequence == SpecialSequence.STOP


def jogging(
    values: Sequence[float] = (1.0, 0, 0, 0, 0, 0), robot: str = "ur5", **settings: Any
) -> MovingCell:
    """Hold a key of joints in T1."""
    cell = EmulatedCell(robot, **settings)
    pendant = cell.holder()
    pendant.send(messages.Subscribe(2, 100.0))
    assert pendant.mode(messages.OperatingMode.MANUAL_REDUCED) is V.ACCEPTED
    pendant.enable(1)
    cell.wait(30)

    def beat(number: int) -> None:
        pendant.enable(1)
        pendant.send(messages.JogBeat(1, number))

    share = joint_array(tuple(values))
    newest = pendant.all(messages.State)[-1].sequence
    request = messages.JogStart(
        9, 1, newest, 0.15, messages.JogSpace.JOINTS, "base", len(values), share
    )
    assert pendant.code(request) is V.ACCEPTED
    return MovingCell(cell, pendant, beat)


def _beats(pendant: Pendant) -> Callable[[int], None]:
    def beat(_: int) -> None:
        pendant.send(messages.AuthorityBeat())

    return beat


def moving(
    way: Sequence[float] = (1.0, 0.5, 0.5, 0.2, 0.2, 0.2), speed: float = 0.3, **settings: Any
) -> MovingCell:
    cell = EmulatedCell(**settings)
    pendant = cell.holder()
    goal = [at + by for at, by in zip(cell.position, way, strict=True)]
    assert pendant.move(*goal, speed=speed) is V.ACCEPTED
    return MovingCell(cell, pendant, _beats(pendant))


def running() -> MovingCell:
    cell = ProgramCell(main="move PTP a\nmove PTP c\nmove PTP b\n")
    assert cell.run(speed=0.3) is V.ACCEPTED
    return MovingCell(cell, cell.user, _beats(cell.user))


def following_ros() -> MovingCell:
    cell = EmulatedCell()
    pendant = cell.pendant()
    client = cell.ros()
    home = cell.position
    steps = [tuple(at + 0.2 * step for at in home) for step in range(4)]
    client.trajectory(*steps)
    cell.wait(300)
    return MovingCell(cell, pendant, lambda _: None)


MOTIONS = [jogging, moving, running, following_ros]


class Commanded:
    """What a controller was sent since a motion began, as an oracle sees it.

    `beyond` samples the path that was due in the last 0.3 s every half millisecond and asks of each
    sample how far each joint is beyond its tolerance; it shares no line with the server.
    """

    def __init__(self, moving: MovingCell) -> None:
        self._moving = moving

    def beyond(
        self, reported: Sequence[float], now: int, path: float, lag: float, noise: float
    ) -> bool:
        points = [m for m in self._moving.cell.sent if isinstance(m, JointTrajPtFull)]
        dof = len(reported)
        times = np.array([point.time for point in points])
        places = np.array([point.positions[:dof] for point in points])
        speeds = np.abs([point.velocities[:dof] for point in points])
        until = (now - self._moving.began) / 1e9
        when = np.arange(max(until - 0.3, 0.0), until + 1e-9, 5e-4)
        piece = np.stack([np.interp(when, times, column) for column in places.T], axis=1)
        counts = (times >= until - 0.31) & (times <= until + 0.01)
        allowed = path + noise + lag * speeds[counts].max(axis=0)
        return bool((np.abs(piece - np.array(reported)) > allowed).any(axis=1).all())


def aborted(pendant: Pendant) -> list[V]:
    return [V(outcome.code) for outcome in pendant.all(messages.Outcome)]


def why(cell: EmulatedCell) -> dict[str, Any]:
    return cell.pendant().ask("why")
