"""What pendants are told unasked: what happened in the cell, and its state.

Owns who hears which news, and the numbering of state. How a message is worded is `replies`' and
`state_report`'s business.
"""

from __future__ import annotations

import dataclasses
import math

from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...cell.state_report import state_message
from ...events.cell_events import (
    AuthorityTransferred,
    CellEvent,
    MotionEnded,
    MotionRefused,
    MotionStarted,
    OperatingModeChanged,
    StopLatchChanged,
)
from ...events.effects import Broadcast, Effect, Send
from ...events.replies import (
    authority_changed,
    jog_ended,
    mode_changed,
    outcome,
    stop_changed,
    verdict,
)
from .jog_requests import RecentStates
from .listeners import Listener, Listeners


class Notifications:
    """The announcements of one cell to its pendants."""

    def __init__(
        self, cell: RobotCell, robot: RobotModel, listeners: Listeners, recent: RecentStates
    ) -> None:
        """Make one that has told nothing yet.

        Args:
            cell: the cell.
            robot: the mathematics of the robot.
            listeners: the connections.
            recent: noted there is each state message, so that a jog can quote it.
        """
        self._cell = cell
        self._robot = robot
        self._listeners = listeners
        self._recent = recent
        self._sequence = 0

    def on_cell_event(self, news: CellEvent, now: int) -> list[Effect]:
        """Tell whoever asked for a motion its fate, and everybody what concerns all."""
        match news:
            case MotionStarted(request=request) if request.session in self._listeners:
                return [Send(request.session, verdict(request.request_id))]
            case MotionRefused(request=request) if request.session in self._listeners:
                return [Send(request.session, verdict(request.request_id, news.refusal))]
            case MotionEnded(request=request) if request.session in self._listeners:
                return [*self._jog_account(news), Send(request.session, outcome(news))]
            case OperatingModeChanged():
                return self._listeners.to_all(mode_changed(news))
            case AuthorityTransferred():
                return self._listeners.to_all(authority_changed(news))
            case StopLatchChanged():
                return self._listeners.to_all(stop_changed(news))
        return []

    def _jog_account(self, news: MotionEnded) -> list[Effect]:
        """Tell a pendant how its jog came to rest, before its outcome."""
        account = news.jog
        if account is None:
            return []
        began, ended = (self._robot.tool_pose(at)[0] for at in (account.began_at, account.ended_at))
        return [Send(news.request.session, jog_ended(account, math.dist(began, ended)))]

    def state(self, due: list[Listener], now: int) -> list[Effect]:
        """Send the state once for all whose drop counters are alike; each is told its own."""
        if not due:
            return []
        self._sequence += 1
        self._recent.sent(self._sequence, now)
        state = state_message(self._cell, self._robot, self._sequence, now)
        sessions: dict[int, list[int]] = {}
        for listener in due:
            sessions.setdefault(listener.dropped, []).append(listener.session)
        out: list[Effect] = []
        for dropped, alike in sessions.items():
            told = dataclasses.replace(state, dropped=dropped) if out else state
            told.dropped = dropped
            out.append(Broadcast(tuple(alike), told))
        return out
