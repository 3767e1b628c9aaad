"""The state port of the ROS-Industrial face: joint positions and status, at a fixed rate.

Owns who is due when. What the messages say is `state_report`'s business; from whom positions are
withheld, `outcomes`'.
"""

from __future__ import annotations

from ..outgoing import Outgoing, Spread
from ..pendant.state_report import joint_position_message, status_message
from ..robot_cell import RobotCell
from .outcomes import RosOutcomes


class RosStatePort:
    """All state connections of a cell."""

    def __init__(self, cell: RobotCell, outcomes: RosOutcomes, period_ns: int) -> None:
        """Make a port nobody listens to; each listener is told once in `period_ns`."""
        self._cell = cell
        self._outcomes = outcomes
        self._period_ns = period_ns
        self._due: dict[int, int] = {}
        self._addresses: dict[int, str] = {}

    def opened(self, session: int, address: str, now: int) -> list[Outgoing]:
        """Take note of a new connection and tell it the state at once."""
        self._due[session] = now + self._period_ns
        self._addresses[session] = address
        return self._state((session,), now)

    def closed(self, session: int) -> None:
        """Forget a connection."""
        self._due.pop(session, None)
        self._addresses.pop(session, None)

    def tick(self, now: int) -> list[Outgoing]:
        """Tell the state to whoever is due."""
        sessions = tuple(session for session, due in self._due.items() if now >= due)
        for session in sessions:
            self._due[session] = max(self._due[session] + self._period_ns, now)
        return self._state(sessions, now) if sessions else []

    def _state(self, sessions: tuple[int, ...], now: int) -> list[Outgoing]:
        """Joint positions first, then status: the order the real clients expect."""
        out: list[Outgoing] = []
        joints = joint_position_message(self._cell, now)
        if joints is not None:
            sees, addresses = self._outcomes.sees, self._addresses
            seeing = tuple(each for each in sessions if sees(addresses[each], now))
            out.append(Spread(seeing, joints))
        out.append(Spread(sessions, status_message(self._cell, self._outcomes.newest, now)))
        return out
