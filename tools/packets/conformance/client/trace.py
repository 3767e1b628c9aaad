"""A trace of one client, taken apart: links, frames, answers, and the controller's reports.

Owns how a trace is read: which port serves what, in which byte order a frame is written, what its
header says and what its body means, and the state that the client had to know at each time. Judges
nothing: a frame that cannot be read says why, and the checks decide what that is worth.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from openpendant.simplemsg import (
    ByteOrder,
    CommType,
    JointFeedback,
    JointPosition,
    Message,
    MsgType,
    ProtocolError,
    Status,
    ValidField,
    codec_for,
)
from openpendant.simplemsg.framing import MAX_DETECTABLE_LENGTH, PREFIX_SIZE, Frame
from openpendant.simplemsg.motoman import MotomanJointFeedbackEx

from ...trace import Entry, Event, Packet, TraceDirection
from .setup import CLOSERS, CONNECTED, WELL_KNOWN, Purpose, Setup

_STATE_TYPES = {MsgType.JOINT_POSITION, MsgType.STATUS, MsgType.JOINT_FEEDBACK, 2017}
_IO_TYPES = {2003, 2005, 2007, 2009, 2012, 2013}


class TracedFrame(Frame):
    """One packet of the trace, read as far as it can be read.

    Attributes:
        number: its place in the trace.
        time: since the start of the trace [ns].
        from_client: who sent it.
        link: the connection that carried it.
        is_frame: False for bytes in which no frame was found.
        order: the byte order in which its length makes sense; None where it does in neither.
        message: what it means; None where it cannot be decoded.
        fault: why it cannot be decoded.
    """

    __slots__ = ("fault", "from_client", "is_frame", "link", "message", "number", "order", "time")

    def __init__(self, number: int, packet: Packet, link: TracedLink, setup: Setup) -> None:
        self.order = _order_of(packet.data, setup.order)
        super().__init__(packet.data, self.order or ByteOrder.LITTLE)
        self.number = number
        self.time = packet.time
        self.from_client = packet.direction is TraceDirection.TO_SERVER
        self.link = link
        self.is_frame = packet.is_frame
        self.message: Message | None = None
        self.fault = ""
        if not self.is_whole_header:
            self.fault = "no whole header"
            return
        try:
            codec = codec_for(setup.dialect, self.byte_order, setup.real_size)
            self.message = codec.decode(self.data)
        except ProtocolError as error:
            self.fault = str(error)

    @property
    def is_whole_header(self) -> bool:
        """True if there are enough bytes for a header."""
        return self.is_frame and self.has_header

    @property
    def where(self) -> str:
        """Time and connection, as a report names them."""
        return f"at {self.time / 1e9:.3f} s on {self.link.name}"


@dataclass(slots=True, eq=False)
class TracedLink:
    """One TCP connection.

    Attributes:
        port: the server's port.
        number: number of the connection on that port, from 1.
        purpose: what the port is for.
        opened: when it was opened [ns]; None where the trace does not say.
        closed: when it was closed [ns]; None while it is open.
        closed_by_client: whether the client closed it first.
        frames: what it carried, in order.
    """

    port: int
    number: int
    purpose: Purpose = Purpose.MOTION
    opened: int | None = None
    closed: int | None = None
    closed_by_client: bool = False
    frames: list[TracedFrame] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Port and number, as a report names them."""
        return f"port {self.port}, connection {self.number}"


class ClientTrace:
    """Messages of a client and its server in one scenario.

    Attributes:
        setup: what is known of the controller.
        frames: all packets, in order.
        sent: those of the client.
        links: the connections.
        events: what happened besides.
        replies: number of a request: the reply to it, both directions.
        unasked: the client's replies that answer nothing.
        ended: time of the last entry [ns].
    """

    def __init__(self, entries: Sequence[Entry], setup: Setup) -> None:
        self.setup = setup
        self.frames: list[TracedFrame] = []
        self.links: dict[tuple[int, int], TracedLink] = {}
        self.events: list[Event] = []
        self.replies: dict[int, TracedFrame] = {}
        self.unasked: list[TracedFrame] = []
        self.ended = max((entry.time for entry in entries), default=0)
        for number, entry in enumerate(entries):
            if isinstance(entry, Event):
                self._note(entry)
            else:
                self._take(number, entry)
        self.sent = [frame for frame in self.frames if frame.from_client]
        self._name_purposes()
        for link in self.links.values():
            self._pair(link)

    def _link(self, port: int, number: int) -> TracedLink:
        return self.links.setdefault((port, number), TracedLink(port, number))

    def _note(self, event: Event) -> None:
        self.events.append(event)
        opens = event.text.startswith(CONNECTED)
        closer = CLOSERS.get(event.text)
        if not opens and closer is None:
            return
        link = self._link(event.port, event.connection)
        if opens:
            link.opened = event.time
        elif link.closed is None:
            link.closed = event.time
            link.closed_by_client = closer == "client"

    def _take(self, number: int, packet: Packet) -> None:
        link = self._link(packet.port, packet.connection)
        frame = TracedFrame(number, packet, link, self.setup)
        link.frames.append(frame)
        self.frames.append(frame)

    def _name_purposes(self) -> None:
        """Name the purpose of each port: as given, as usual, or by what it carried."""
        by_port: dict[int, Purpose] = {}
        for link in self.links.values():
            known = self.setup.ports.get(link.port) or WELL_KNOWN.get(link.port)
            purpose = known or _purpose_of(link.frames)
            if purpose is not None:
                by_port.setdefault(link.port, purpose)
        for link in self.links.values():
            link.purpose = by_port.get(link.port, Purpose.MOTION)

    def _pair(self, link: TracedLink) -> None:
        """Give each reply of a link to the request that it answers.

        The oldest request of the same type comes first, because one that is never answered must not
        take the answers of all that follow; then simply the oldest.
        """
        waiting: dict[bool, list[TracedFrame]] = {True: [], False: []}
        for frame in link.frames:
            if not frame.is_whole_header:
                continue
            if frame.comm_type == CommType.REQUEST:
                waiting[frame.from_client].append(frame)
            elif frame.comm_type == CommType.REPLY:
                asked = waiting[not frame.from_client]
                if not asked:
                    if frame.from_client:
                        self.unasked.append(frame)
                    continue
                same = (request for request in asked if request.msg_type == frame.msg_type)
                request = next(same, asked[0])
                asked.remove(request)
                self.replies[request.number] = frame

    def on(self, *purposes: Purpose) -> list[TracedFrame]:
        """Return the client's frames on ports for these purposes."""
        return [frame for frame in self.sent if frame.link.purpose in purposes]

    def links_for(self, purpose: Purpose) -> list[TracedLink]:
        """Return the connections to ports for a purpose, in order of their opening."""
        return [link for link in self.links.values() if link.purpose is purpose]

    def from_controller(self) -> Iterable[TracedFrame]:
        """Return the server's frames that can be read."""
        return (frame for frame in self.frames if not frame.from_client and frame.message)


def _order_of(data: bytes, usual: ByteOrder | None) -> ByteOrder | None:
    """Return the byte order in which the length of a frame makes sense."""
    if len(data) < PREFIX_SIZE:
        return None
    if usual is not None and Frame(data, usual).length == len(data) - PREFIX_SIZE:
        return usual
    lengths = {order: Frame(data, order).length for order in ByteOrder}
    exact = [order for order, length in lengths.items() if length == len(data) - PREFIX_SIZE]
    plausible = [order for order, length in lengths.items() if 0 <= length <= MAX_DETECTABLE_LENGTH]
    for fitting in (exact, plausible):
        if usual in fitting or len(fitting) == 1:
            return usual if usual in fitting else fitting[0]
    return usual


def _purpose_of(frames: Iterable[TracedFrame]) -> Purpose | None:
    """Return the purpose of a port by what it carried; None where that does not show it."""
    for frame in frames:
        if frame.from_client and frame.msg_type in _IO_TYPES:
            return Purpose.IO
        if frame.from_client and frame.comm_type != CommType.REPLY:
            return Purpose.MOTION
        if not frame.from_client and frame.comm_type == CommType.TOPIC:
            if frame.msg_type in _STATE_TYPES:
                return Purpose.STATE
    return None


LOOK_BACK_NS = 300_000_000
"""A client may act on a report that is this old: it takes a moment to read and to plan."""


@dataclass(frozen=True, slots=True)
class JointReport:
    """Reported position of one group.

    Attributes:
        time: when the server sent it [ns].
        positions: (10,) [rad or m].
    """

    time: int
    group: int
    positions: tuple[float, ...]


class ReportHistory:
    """The state messages of a trace, oldest first.

    Attributes:
        status: status reports with their times [ns].
    """

    def __init__(self, trace: ClientTrace) -> None:
        self.joints: list[JointReport] = []
        self.status: list[tuple[int, Status]] = []
        self._ended = trace.ended + 1
        for frame in trace.from_controller():
            match frame.message:
                case JointPosition(joints=joints):
                    self.joints.append(JointReport(frame.time, 0, joints))
                case JointFeedback(robot_id=group, valid_fields=valid, positions=positions):
                    if valid & ValidField.POSITION:
                        self.joints.append(JointReport(frame.time, group, positions))
                case MotomanJointFeedbackEx(groups=groups):
                    self.joints += [
                        JointReport(frame.time, group.robot_id, group.positions)
                        for group in groups
                        if group.valid_fields & ValidField.POSITION
                    ]
                case Status():
                    self.status.append((frame.time, frame.message))

    def status_at(self, time: int) -> Status | None:
        """Return the last status that was sent by a time; None before the first."""
        index = bisect_right(self.status, time, key=lambda entry: entry[0])
        return self.status[index - 1][1] if index else None

    def spells(self, holds: Callable[[Status], bool]) -> list[tuple[int, int]]:
        """Return from when to when a condition was reported to hold [ns].

        The end is the first report to the contrary; the end of the trace where there is none.
        """
        found: list[tuple[int, int]] = []
        began: int | None = None
        for time, status in self.status:
            if holds(status):
                began = time if began is None else began
            elif began is not None:
                found.append((began, time))
                began = None
        return found if began is None else [*found, (began, self._ended)]

    def last_joints(self, time: int) -> JointReport | None:
        """Return the last joint report that was sent by a time; None before the first."""
        index = bisect_right(self.joints, time, key=lambda report: report.time)
        return self.joints[index - 1] if index else None

    def places(self, time: int, group: int) -> list[tuple[float, ...]]:
        """Return where a client may believe that a group stands at a time.

        The last report, and those shortly before: the client may have started from any of them.
        """
        index = bisect_right(self.joints, time, key=lambda report: report.time)
        own = [report for report in self.joints[:index] if report.group == group]
        if not own:
            return []
        recent = [report for report in own if time - report.time <= LOOK_BACK_NS] or own[-1:]
        return [report.positions for report in recent]
