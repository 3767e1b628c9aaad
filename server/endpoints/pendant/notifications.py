"""Connections of a cell's pendants, and what they are told unasked: cell events and state.

Owns the deadlines of a connection, which are hello in time and no silence, and its state rate
(`Listeners`). Must not know what a pendant asks for.

Owns who is told which cell event, and the numbering of state (`Notifications`). How a message is
worded is `replies`' and `state_report`'s business.
"""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from openpendant.simplemsg import Message
from openpendant.simplemsg.verdicts import VerdictCode

from ...cell.robot_cell import RobotCell
from ...cell.robot_model import RobotModel
from ...cell.state_report import state_message
from ...control import Holder
from ...events.cell_events import (
    AuthorityTransferred,
    CellEvent,
    MotionEnded,
    MotionRefused,
    MotionStarted,
    OperatingModeChanged,
    StopLatchChanged,
)
from ...events.effects import Broadcast, Close, Effect, Send
from ...events.replies import (
    authority_changed,
    jog_ended,
    mode_changed,
    outcome,
    stop_changed,
    verdict,
)
from ...refusal import Refusal
from ...settings.cell_settings import CellSettings
from ..frame_faults import MOST_FAULTS, PeerFaults

_SECOND_NS = 1_000_000_000

LOBBY_STAY_NS = 60 * _SECOND_NS
"""So long a connection may go without a hello after it asked which cells there are."""


@dataclass(slots=True)
class Listener:
    """One pendant's connection.

    Attributes:
        holder: the connection as others are told of it.
        opened: when it was accepted [ns].
        heard: when its last message came [ns].
        faults: unknown and malformed frames of late.
        leaving: hello was refused; nothing more is taken.
        version: of the protocol that it speaks, from its hello on.
        wants_notices: whether it is told what others change.
        period_ns: between two state messages, 0 for none.
        due: when the next state message is [ns].
        dropped: state messages that it was too slow for.
        lobby_at: when it was told last which cells there are [ns]; None for never.
    """

    session: int
    holder: Holder
    opened: int
    heard: int
    address: str
    faults: PeerFaults = field(default_factory=PeerFaults)
    hello_name: str = ""
    looks_on: bool = False
    welcomed: bool = False
    leaving: bool = False
    version: int = 2
    wants_notices: bool = False
    period_ns: int = 0
    due: int = 0
    dropped: int = 0
    lobby_at: int | None = None

    def count_fault(self, now: int) -> list[Effect]:
        """Count an unknown or malformed frame; the connection that sends too many is closed."""
        if not self.faults.add(now):
            return []
        return [Close(self.session, f"{MOST_FAULTS} unknown or malformed requests")]


class Listeners(dict[int, Listener]):
    """All pendant connections of a cell by their numbers, in the order in which they came.

    Attributes:
        max_rate: no pendant is sent state more often than this [Hz].
        older: connections of version 2.
    """

    def __init__(self, settings: CellSettings, waits: Callable[[int], bool]) -> None:
        """Know nobody yet.

        Args:
            waits: says of a connection whether its login waits for its answer.
        """
        super().__init__()
        self._waits = waits
        self.older: set[int] = set()
        pendants = settings.pendants
        self.max_rate = min(pendants.max_state_rate, float(settings.tick_rate))
        self._hello_deadline_ns = round(pendants.hello_deadline * _SECOND_NS)
        self._idle_timeout_ns = round(pendants.idle_timeout * _SECOND_NS)

    def opened(self, session: int, address: str, now: int) -> None:
        """Take note of a new connection."""
        self[session] = Listener(
            session, Holder(session, ""), opened=now, heard=now, address=address
        )

    def closed(self, session: int) -> None:
        """Forget a connection, also one that an incident ended before it was taken note of."""
        self.pop(session, None)
        self.older.discard(session)

    def set_rate(self, session: int, rate: float, now: int) -> None:
        """Send a connection state at a rate [Hz] from now on, 0 for never."""
        listener = self[session]
        listener.period_ns = round(_SECOND_NS / min(rate, self.max_rate)) if rate else 0
        listener.due = now

    def to_all(self, message: Message) -> list[Effect]:
        """Send a message to everybody who may see what the cell does, and knows the message."""
        since = message.PLACE.since
        return [
            Send(listener.session, message)
            for listener in self.values()
            if listener.welcomed and listener.looks_on and listener.version >= since
        ]

    def notice(self, message: Message) -> list[Effect]:
        """Send a message to everybody who has declared that it wants notices, and may look on."""
        return [
            Send(listener.session, message)
            for listener in self.values()
            if listener.wants_notices and listener.welcomed and listener.looks_on
        ]

    def tick(self, now: int) -> tuple[list[Effect], list[Listener]]:
        """Look at all deadlines.

        Returns:
            The ends of the conversations that never began or fell silent, and who of the others is
            to be sent state now; each is due again after its period.
        """
        ends: list[Effect] = []
        due: list[Listener] = []
        for listener in self.values():
            if listener.welcomed:
                is_overdue = now - listener.heard > self._idle_timeout_ns
            elif listener.lobby_at is not None:
                is_overdue = now - listener.lobby_at > LOBBY_STAY_NS
            else:
                is_overdue = now - listener.opened > self._hello_deadline_ns
            if is_overdue and listener.welcomed and self._waits(listener.session):
                # Its next word is ours: the login waits behind others. The time begins anew.
                listener.heard = now
                is_overdue = False
            if is_overdue:
                missed = "silent for too long" if listener.welcomed else "no hello in time"
                ends.append(Close(listener.session, missed))
            elif listener.period_ns and now >= listener.due and listener.looks_on:
                following = listener.due + listener.period_ns
                listener.due = following if following > now else now
                due.append(listener)
        return ends, due


RECENT_NS = 500_000_000
"""A press must quote a state message that is no older than this."""


class RecentStates:
    """The state messages of the last half second, so that a press can quote one."""

    def __init__(self) -> None:
        self._sent: deque[tuple[int, int]] = deque()

    def sent(self, sequence: int, now: int) -> None:
        """Note a state message that left."""
        self._sent.append((sequence, now))
        while now - self._sent[0][1] > RECENT_NS:
            self._sent.popleft()

    def fault(self, sequence: int, now: int) -> Refusal | None:
        """Return why a press must not quote this message."""
        for number, at in self._sent:
            if number == sequence and now - at <= RECENT_NS:
                return None
        newest = self._sent[-1][0] if self._sent else 0
        text = f"the press quotes state {sequence}; the newest is {newest}"
        return Refusal(VerdictCode.PRESS_STALE, text)


class Notifications:
    """The announcements of one cell to its pendants."""

    def __init__(
        self, cell: RobotCell, robot: RobotModel, listeners: Listeners, recent: RecentStates
    ) -> None:
        """Make one that has told nothing yet.

        Args:
            recent: noted there is each state message, so that a jog can quote it.
        """
        self._cell = cell
        self._robot = robot
        self._listeners = listeners
        self._recent = recent
        self._sequence = 0

    def on_cell_event(self, event: CellEvent, now: int) -> list[Effect]:
        """Tell whoever asked for a motion its fate, and everybody what concerns all."""
        match event:
            case MotionStarted(request=request) if request.session in self._listeners:
                return [Send(request.session, verdict(request.request_id))]
            case MotionRefused(request=request) if request.session in self._listeners:
                return [Send(request.session, verdict(request.request_id, event.refusal))]
            case MotionEnded(request=request) if request.session in self._listeners:
                return [*self._jog_account(event), Send(request.session, outcome(event))]
            case OperatingModeChanged():
                return self._listeners.to_all(mode_changed(event))
            case AuthorityTransferred():
                return self._listeners.to_all(authority_changed(event))
            case StopLatchChanged():
                return self._listeners.to_all(stop_changed(event))
        return []

    def _jog_account(self, event: MotionEnded) -> list[Effect]:
        """Tell a pendant how its jog came to rest, before its outcome."""
        account = event.jog
        if account is None:
            return []
        began, ended = (self._robot.tool_pose(at)[0] for at in (account.began_at, account.ended_at))
        return [Send(event.request.session, jog_ended(account, math.dist(began, ended)))]

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
