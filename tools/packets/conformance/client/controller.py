"""Scripted robot controller: correct in everything but the one mutation of a scenario.

Owns when something is answered or reported, and the trace of it all. Pure: bytes and times in,
actions out; the shell (`live`) owns sockets and the clock, `messages` the contents.
"""

from __future__ import annotations

from collections.abc import Sequence

from openpendant.simplemsg import (
    ByteOrder,
    CommType,
    Message,
    ProtocolError,
    Status,
    codec_for,
)
from openpendant.simplemsg.framing import Mode, Splitter

from ...trace import Entry, Event, Packet, TraceDirection
from .actions import Act, Action, ClientLinkId, DelayedPieces, Do, Write
from .messages import ControllerMessages
from .robot import Drive, FollowingRobot
from .scenarios import Mutation, Scenario
from .setup import (
    CLIENT_CLOSED,
    CONNECTED,
    IN_PIECES,
    RESTARTED,
    SERVER_CLOSED,
    SERVER_RESET,
    WRITES_OBSERVED,
    Purpose,
    Setup,
)
from .trajectories import is_stop, parts_of

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
        """Make a controller nobody is connected to.

        Args:
            setup: dialect, byte order and width of reals.
            positions: where the robot stands.
            at_point: index of the point at which a scenario makes its change.
            now: monotonic time [ns].
        """
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
