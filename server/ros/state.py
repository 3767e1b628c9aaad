"""The state port of the ROS-Industrial face: joint positions and status, at a fixed rate.

Owns who is due when. What the messages say is `state_report`'s business.
"""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..outgoing import Outgoing, Spread
from ..pendant.state_report import joint_position_message, status_message
from ..robot_cell import RobotCell


class RosStatePort:
    """All state connections of a cell."""

    def __init__(self, cell: RobotCell, period_ns: int) -> None:
        """Make a port nobody listens to; each listener is told once in `period_ns`."""
        self._cell = cell
        self._period_ns = period_ns
        self._due: dict[int, int] = {}

    def opened(self, session: int, refused: VerdictCode | None, now: int) -> list[Outgoing]:
        """Take note of a new connection and tell it the state at once."""
        self._due[session] = now + self._period_ns
        return self._state((session,), refused, now)

    def closed(self, session: int) -> None:
        """Forget a connection."""
        self._due.pop(session, None)

    def tick(self, refused: VerdictCode | None, now: int) -> list[Outgoing]:
        """Tell the state to whoever is due.

        Args:
            refused: why the last trajectory was refused; None where it was not.
            now: monotonic time, ns.
        """
        sessions = tuple(session for session, due in self._due.items() if now >= due)
        for session in sessions:
            self._due[session] = max(self._due[session] + self._period_ns, now)
        return self._state(sessions, refused, now) if sessions else []

    def _state(
        self, sessions: tuple[int, ...], refused: VerdictCode | None, now: int
    ) -> list[Outgoing]:
        """Joint positions first, then status: the order the real clients expect."""
        out: list[Outgoing] = []
        joints = joint_position_message(self._cell, now)
        if joints is not None:
            out.append(Spread(sessions, joints))
        out.append(Spread(sessions, status_message(self._cell, refused, now)))
        return out
