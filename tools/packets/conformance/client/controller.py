"""Scripted robot controller: correct in everything but the one mutation of a scenario.

Owns when something is answered or reported, the trace of it all, and where its robot is: no
emulator, since the judge looks at what the client sent, not at how well it can be followed. Pure:
bytes and times in, actions out; the shell (`live`) owns sockets and the clock, `messages` the
contents.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

from openpendant.simplemsg import (
    JOINT_SLOTS,
    ByteOrder,
    CommType,
    Message,
    ProtocolError,
    Status,
    codec_for,
    joint_array,
)
from openpendant.simplemsg.framing import Mode, Splitter

from ...trace import Entry, Event, Packet, TraceDirection
from .messages import ControllerMessages
from .setup import (
    CLIENT_CLOSED,
    CONNECTED,
    IN_PIECES,
    RESTARTED,
    SERVER_CLOSED,
    SERVER_RESET,
    WRITES_OBSERVED,
    Mutation,
    Purpose,
    Scenario,
    Setup,
)
from .trajectories import BEGINNINGS, GroupPoint, is_stop, parts_of


class Act(Enum):
    """Action of the shell other than a write."""

    CLOSE = "close the connection"
    RESET = "reset the connection"
    AWAY = "close all connections and stop listening"
    BACK = "listen again"


@dataclass(frozen=True, slots=True)
class ClientLinkId:
    """A connection to the controller.

    Attributes:
        port: our TCP port.
        number: number of the connection on that port, from 1.
    """

    purpose: Purpose
    port: int
    number: int


@dataclass(frozen=True, slots=True)
class Write:
    """Write bytes in one piece."""

    link: ClientLinkId
    data: bytes


@dataclass(frozen=True, slots=True)
class Do:
    """Do something to a connection, or to all where it is None."""

    act: Act
    link: ClientLinkId | None = None


Action = Write | Do


@dataclass(order=True)
class Piece:
    """Bytes that leave later.

    Attributes:
        due: when [ns].
        number: keeps the order among pieces of one time.
        frame: the whole frame that this piece completes; empty where it completes none.
    """

    due: int
    number: int
    link: ClientLinkId = field(compare=False)
    data: bytes = field(compare=False)
    frame: bytes = field(compare=False, default=b"")


class DelayedPieces:
    """Pieces that leave later, those of one connection in the order in which they were put off."""

    def __init__(self) -> None:
        self._pieces: list[Piece] = []
        self._count = 0

    def add(self, link: ClientLinkId, due: int, data: bytes, frame: bytes = b"") -> None:
        """Put a piece off."""
        self._count += 1
        self._pieces.append(Piece(due, self._count, link, data, frame))

    def after(self, link: ClientLinkId, now: int) -> int:
        """Return when a connection is free again [ns]: now, or behind its last piece."""
        return max((piece.due + 1 for piece in self._pieces if piece.link == link), default=now)

    def take_due(self, now: int) -> list[Piece]:
        """Remove and return what is due, in order."""
        due = sorted(piece for piece in self._pieces if piece.due <= now)
        self._pieces = [piece for piece in self._pieces if piece.due > now]
        return due

    def times(self) -> list[int]:
        """Return when something is due [ns]."""
        return [piece.due for piece in self._pieces]


SAME_PLACE = 1e-3
"""A robot this close to a point is there [rad or m]."""


class Drive(Enum):
    """State of the robot's drive."""

    ON = "it follows"
    STOPPED = "an emergency stop holds it"


@dataclass(frozen=True, slots=True)
class _Target:
    time: int
    positions: tuple[float, ...]


def _is_finite(part: GroupPoint) -> bool:
    """Return True if a point can be followed at all; the judge says what is wrong with it."""
    return all(map(math.isfinite, (*part.positions, part.time or 0.0, part.duration or 0.0)))


class FollowingRobot:
    """The robot's first group; others follow unseen."""

    def __init__(self, positions: tuple[float, ...]) -> None:
        """Put the robot somewhere; missing joints stand at 0."""
        self.drive = Drive.ON
        self._start = _Target(0, joint_array(positions[:JOINT_SLOTS]))
        self._targets: list[_Target] = []
        self._began = 0

    def follow(self, sequence: int, part: GroupPoint, now: int) -> None:
        """Take a point as the next target."""
        if self.drive is Drive.STOPPED or not _is_finite(part):
            return
        if sequence in BEGINNINGS:
            self.stop(now)
            self._began = now
        if part.time is not None:
            due = self._began + round(part.time * 1e9)
        else:
            here = self._targets[-1] if self._targets else _Target(now, self.at(now))
            gap = max(abs(a - b) for a, b in zip(here.positions, part.positions, strict=True))
            # The stock client gives its first point 10 s, wherever the robot stands.
            rests = sequence in BEGINNINGS and gap <= SAME_PLACE
            due = max(here.time, now) + (0 if rests else round((part.duration or 0.0) * 1e9))
        self._targets.append(_Target(due, part.positions))

    def stop(self, now: int) -> None:
        """Stand still where it is and forget all targets."""
        self._start = _Target(now, self.at(now))
        self._targets.clear()

    def at(self, now: int) -> tuple[float, ...]:
        """Return where it is, (10,) [rad or m]."""
        before = self._start
        for target in self._targets:
            if now < target.time:
                share = (now - before.time) / (target.time - before.time)
                pairs = zip(before.positions, target.positions, strict=True)
                return tuple(a + max(0.0, share) * (b - a) for a, b in pairs)
            before = target
        return before.positions

    def moves(self, now: int) -> bool:
        """Return True if a target lies ahead."""
        return bool(self._targets) and now < self._targets[-1].time


REPORT_PERIOD_NS = 25_000_000
BYTE_PAUSE_NS = 500_000
LATE_NS = 2_000_000_000
AWAY_NS = 1_000_000_000
SILENT_NS = 3_000_000_000

MANY_BUSY = 3

MAX_ENTRIES = 200_000
"""A client that fills the trace of a scenario further is hung up on."""


class ScriptedController:
    """The controller's end of all connections, scenario after scenario.

    Attributes:
        trace: packets and events of the scenario under way, times from its beginning.
        began: when the client sent the first point of the scenario [ns]; None before.
        mutated_at: when the change was made [ns]; None before.
        last_received: time of the client's last bytes [ns].
    """

    def __init__(
        self, setup: Setup, positions: Sequence[float] = (), *, at_point: int = 1, now: int = 0
    ) -> None:
        """Make a controller nobody is connected to: positions [rad or m], now [ns]."""
        self.trace: list[Entry] = []
        self.began: int | None = None
        self.mutated_at: int | None = None
        self.last_received = now
        self._setup = setup
        self._order = setup.order or ByteOrder.LITTLE
        self._codec = codec_for(setup.dialect, self._order, setup.real_size)
        self._messages = ControllerMessages(setup, self._order)
        self._robot = FollowingRobot(tuple(positions))
        self._at_point = at_point
        self._scenario = Scenario(Mutation.NONE)
        self._epoch = now
        self._pending: dict[ClientLinkId, Splitter] = {}
        self._put_off = DelayedPieces()
        self._report_due = now
        self._silent_until = now
        self._back_at: int | None = None
        self._deaf: set[ClientLinkId] = set()
        self._busy_left = 0

    def begin(self, scenario: Scenario, now: int) -> None:
        """Start a scenario: a fresh trace, the same connections, no trouble left."""
        self._scenario = scenario
        self._epoch = now
        self.trace = []
        self.began = self.mutated_at = None
        self._deaf.clear()
        self._silent_until = now
        self._busy_left = MANY_BUSY
        self._robot.stop(now)
        self._robot.drive = Drive.ON
        self.note(WRITES_OBSERVED, now)
        for link in self._pending:
            self.note(CONNECTED, now, link)
        if scenario.mutation in (Mutation.NOT_POSSIBLE, Mutation.NOT_READY):
            self.mutated_at = now

    def note(self, text: str, now: int, link: ClientLinkId | None = None) -> None:
        """Put an event into the trace."""
        port, number = (link.port, link.number) if link else (0, 0)
        self.trace.append(Event(now - self._epoch, text, port, number, self._scenario.name))

    def moves(self, now: int) -> bool:
        """Return True if the robot moves."""
        return self._robot.moves(now)

    # Connections.

    def connected(self, link: ClientLinkId, now: int) -> None:
        """Take a new connection."""
        # The shortest length is a frame here too: the checks judge it.
        self._pending[link] = Splitter(Mode.STRICT, self._order, least_length=0)
        self.note(CONNECTED, now, link)

    def disconnected(self, link: ClientLinkId, now: int) -> None:
        """Note that the client is gone; a connection that we closed is gone already."""
        pending = self._pending.pop(link, None)
        if pending is None:
            return
        for cut in pending.finish():
            self._keep(link, TraceDirection.TO_SERVER, cut.data, now, is_frame=False)
        self.note(CLIENT_CLOSED, now, link)
        if link.purpose is Purpose.MOTION and not self._has_motion_link():
            self._robot.stop(now)

    def _has_motion_link(self) -> bool:
        return any(link.purpose is Purpose.MOTION for link in self._pending)

    def _drop(self, link: ClientLinkId, act: Act, now: int) -> list[Action]:
        if self._pending.pop(link, None) is None:
            return []
        self.note(SERVER_RESET if act is Act.RESET else SERVER_CLOSED, now, link)
        return [Do(act, link)]

    # What comes in.

    def received(self, link: ClientLinkId, data: bytes, now: int) -> list[Action]:
        """Take bytes of the client and answer what they complete."""
        pending = self._pending.get(link)
        if pending is None:
            return []
        self.last_received = now
        if len(self.trace) > MAX_ENTRIES:
            return self._drop(link, Act.CLOSE, now)
        in_pieces = bool(pending.pending)
        out: list[Action] = []
        for cut in pending.feed(data):
            if link not in self._pending:
                break
            if in_pieces and cut.is_frame:
                self.note(IN_PIECES, now, link)
            in_pieces = False
            self._keep(link, TraceDirection.TO_SERVER, cut.data, now, is_frame=cut.is_frame)
            if not cut.is_frame:
                return out + self._drop(link, Act.CLOSE, now)
            out += self._answer(link, cut.data, now)
        return out

    def _keep(
        self,
        link: ClientLinkId,
        way: TraceDirection,
        data: bytes,
        now: int,
        *,
        is_frame: bool = True,
    ) -> None:
        time, name = now - self._epoch, self._scenario.name
        self.trace.append(Packet(time, way, data, link.port, link.number, name, is_frame))

    def _answer(self, link: ClientLinkId, frame: bytes, now: int) -> list[Action]:
        if link in self._deaf:
            return []
        try:
            message = self._codec.decode(frame)
        except ProtocolError:
            return []
        if is_stop(message):
            self._robot.stop(now)
        parts = parts_of(message)
        is_point = bool(parts) and not is_stop(message)
        if not is_point:
            if message.comm_type != CommType.REQUEST:
                return []
            return self._reply(link, self._messages.usual(message, is_ready=self._is_ready), now)
        if self.began is None:
            self.began = now
        sequence: int = getattr(message, "sequence", 0)
        if self.mutated_at is None and sequence >= self._at_point:
            return self._mutate(link, message, now)
        if self._scenario.mutation is Mutation.BUSY and self.mutated_at and self._busy_left:
            return self._mutate(link, message, now)
        return self._take(link, message, now)

    def _take(self, link: ClientLinkId, message: Message, now: int) -> list[Action]:
        """Take a point as a correct controller does."""
        self._follow(message, now)
        if message.comm_type != CommType.REQUEST:
            return []
        return self._reply(link, self._messages.usual(message, is_ready=self._is_ready), now)

    def _follow(self, message: Message, now: int) -> None:
        part = parts_of(message)[0]
        self._robot.follow(getattr(message, "sequence", 0), part, now)

    # What goes out.

    @property
    def _is_ready(self) -> bool:
        return self._scenario.mutation is not Mutation.NOT_READY

    def _reply(self, link: ClientLinkId, frame: bytes, now: int) -> list[Action]:
        free = self._put_off.after(link, now)
        if self._scenario.mutation is Mutation.BYTEWISE:
            for index in range(len(frame)):
                ends = frame if index == len(frame) - 1 else b""
                due = free + index * BYTE_PAUSE_NS
                self._put_off.add(link, due, frame[index : index + 1], ends)
            return []
        if free > now:
            self._put_off.add(link, free, frame, frame)
            return []
        return self._send(link, frame, now)

    def _send(self, link: ClientLinkId, frame: bytes, now: int) -> list[Action]:
        self._keep(link, TraceDirection.TO_CLIENT, frame, now)
        return [Write(link, frame)]

    def next_due(self) -> int:
        """Return when `due` has something to do next [ns]."""
        times = [self._report_due, *self._put_off.times()]
        return min(times if self._back_at is None else [*times, self._back_at])

    def due(self, now: int) -> list[Action]:
        """Send what is due: pieces that were put off, and reports at 40 Hz."""
        out: list[Action] = []
        for piece in self._put_off.take_due(now):
            if piece.link in self._pending:
                if piece.frame:
                    self._keep(piece.link, TraceDirection.TO_CLIENT, piece.frame, now)
                out.append(Write(piece.link, piece.data))
        if self._back_at is not None and now >= self._back_at:
            self._back_at = None
            self.note(RESTARTED, now)
            out.append(Do(Act.BACK))
        if now >= self._report_due:
            missed = (now - self._report_due) // REPORT_PERIOD_NS
            self._report_due += (missed + 1) * REPORT_PERIOD_NS
            if now >= self._silent_until:
                out += self._report(now)
        return out

    def _report(self, now: int) -> list[Action]:
        """Send position and status, in one piece, on every state connection."""
        links = [link for link in self._pending if link.purpose is Purpose.STATE]
        if not links:
            return []
        status = self._codec.encode(self._status(now))
        frames = [self._messages.joints(self._robot.at(now)), status]
        for link in links:
            for frame in frames:
                self._keep(link, TraceDirection.TO_CLIENT, frame, now)
        return [Write(link, b"".join(frames)) for link in links]

    # The one change.

    def _mutate(self, link: ClientLinkId, message: Message, now: int) -> list[Action]:
        """Make the scenario's change at this point."""
        self.mutated_at = now
        mutation = self._scenario.mutation
        if mutation.of_replies:
            if message.comm_type != CommType.REQUEST:
                return self._take(link, message, now)  # a topic has no reply to change
            return self._change_reply(link, mutation, message, now)
        match mutation:
            case Mutation.CLOSED:
                return self._drop(link, Act.CLOSE, now)
            case Mutation.RESET:
                return self._drop(link, Act.RESET, now)
            case Mutation.RESTART:
                return self._go_away(now)
            case Mutation.HALF_OPEN:
                self._deaf.add(link)
                return []
        return self._take(link, message, now) + self._besides(link, mutation, now)

    def _change_reply(
        self, link: ClientLinkId, mutation: Mutation, message: Message, now: int
    ) -> list[Action]:
        """Answer a point with the scenario's mutation."""
        if mutation not in (Mutation.REFUSED, Mutation.BUSY):
            self._follow(message, now)
        self._busy_left -= mutation is Mutation.BUSY
        frames = self._messages.changed(mutation, message)
        if mutation is Mutation.LATE:
            self._put_off.add(link, now + LATE_NS, frames[0], frames[0])
            return []
        for frame in frames:
            self._keep(link, TraceDirection.TO_CLIENT, frame, now)
        return [Write(link, b"".join(frames))] if frames else []

    def _besides(self, motion: ClientLinkId, mutation: Mutation, now: int) -> list[Action]:
        """Make a change that leaves the point's own answer alone."""
        states = [link for link in self._pending if link.purpose is Purpose.STATE]
        frame = self._messages.besides(mutation, self._status(now))
        if frame is not None:
            links = states if mutation.on_state else [motion]
            return [action for link in links for action in self._send(link, frame, now)]
        match mutation:
            case Mutation.EMERGENCY_STOP:
                self._robot.stop(now)
                self._robot.drive = Drive.STOPPED
            case Mutation.SILENCE:
                self._silent_until = now + SILENT_NS
            case Mutation.STATE_CLOSED:
                return [action for link in states for action in self._drop(link, Act.CLOSE, now)]
        return []

    def _go_away(self, now: int) -> list[Action]:
        for link in list(self._pending):
            self._drop(link, Act.CLOSE, now)
        self._robot.stop(now)
        self._back_at = now + AWAY_NS
        return [Do(Act.AWAY)]

    def _status(self, now: int) -> Status:
        return self._messages.status(
            is_stopped=self._robot.drive is Drive.STOPPED,
            moves=self.moves(now),
            is_possible=self._scenario.mutation is not Mutation.NOT_POSSIBLE,
        )
