"""A controller that writes down when each byte reaches it: a relay in front of the emulated one.

Owns the measuring point of the promises that are shown on real sockets: what counts is when bytes
arrive here, never what the server says of itself. One thread, all times of `time.monotonic_ns`.
"""

from __future__ import annotations

import selectors
import socket
import struct
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from openpendant.simplemsg import MsgType, SpecialSequence

_HEADER = struct.Struct("<4i")
"""Length, type, kind and reply code; little-endian as configured."""

_POINTS = {MsgType.JOINT_TRAJ_PT: 4, MsgType.JOINT_TRAJ_PT_FULL: 5}
"""Offset in words of the sequence behind the length: type 14 has the robot's id before it."""


@dataclass(frozen=True, slots=True)
class Arrival:
    """A frame that reached the controller.

    Attributes:
        time: when its last byte did [ns].
        msg_type: its type; 0 for bytes of the idle control, which are no frame.
        sequence: of a point, 0 for anything else.
    """

    time: int
    msg_type: int
    sequence: int
    frame: bytes

    @property
    def is_stop(self) -> bool:
        return self.msg_type in _POINTS and self.sequence == SpecialSequence.STOP

    @property
    def joint_velocity(self) -> float | None:
        """Velocity of the first joint [rad/s]; None where this is no set-point with velocities."""
        if self.msg_type != MsgType.JOINT_TRAJ_PT_FULL or self.is_stop:
            return None
        # Length, three words of header, robot, sequence, valid fields, time, ten positions.
        (velocity,) = struct.unpack_from("<f", self.frame, 4 * (4 + 4 + 10))
        return float(velocity)


@dataclass(eq=False)
class _End:
    """One end of a relayed connection."""

    socket: socket.socket
    is_heard: bool
    other: _End | None = None
    rest: bytes = b""
    is_control: bool = False


@dataclass
class RecordingController:
    """The relay.

    Attributes:
        arrivals: what came from the server, in order.
        motion, state: where the server is to connect.
        control: where the idle control is to connect.
    """

    motion_upstream: int
    state_upstream: int
    arrivals: list[Arrival] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._news = threading.Condition()
        self._selector = selectors.DefaultSelector()
        self._listeners: list[socket.socket] = []
        self.motion = self._listen(self.motion_upstream)
        self.state = self._listen(self.state_upstream)
        self.control = self._listen(None)
        self._is_over = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _listen(self, upstream: int | None) -> int:
        listener = socket.create_server(("127.0.0.1", 0))
        self._listeners.append(listener)
        self._selector.register(listener, selectors.EVENT_READ, upstream or 0)
        port: int = listener.getsockname()[1]
        return port

    def close(self) -> None:
        self._is_over = True
        self._thread.join()
        for key in list(self._selector.get_map().values()):
            assert isinstance(key.fileobj, socket.socket)
            key.fileobj.close()
        self._selector.close()

    # The thread.

    def _run(self) -> None:
        while not self._is_over:
            for key, _ in self._selector.select(0.1):
                if isinstance(key.data, _End):
                    self._move(key.data)
                else:
                    assert isinstance(key.fileobj, socket.socket)
                    self._accept(key.fileobj, key.data)

    def _accept(self, listener: socket.socket, upstream: int) -> None:
        near, _ = listener.accept()
        near.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        heard = _End(near, is_heard=True, is_control=not upstream)
        if upstream:
            far = socket.create_connection(("127.0.0.1", upstream))
            far.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            heard.other = _End(far, is_heard=False, other=heard)
            self._selector.register(far, selectors.EVENT_READ, heard.other)
        self._selector.register(near, selectors.EVENT_READ, heard)

    def _move(self, end: _End) -> None:
        if end.socket.fileno() < 0:
            return  # its other end parted in this turn
        try:
            data = end.socket.recv(65_536)
        except ConnectionError:
            data = b""
        now = time.monotonic_ns()
        if not data:
            self._part(end)
            return
        if end.other is not None:
            try:
                end.other.socket.sendall(data)
            except OSError:
                self._part(end)
                return
        if end.is_heard:
            self._note(end, data, now)

    def _part(self, end: _End) -> None:
        for each in (end, end.other):
            if each is not None and each.socket.fileno() >= 0:
                self._selector.unregister(each.socket)
                each.socket.close()

    def _note(self, end: _End, data: bytes, now: int) -> None:
        came: list[Arrival] = []
        if end.is_control:
            came.append(Arrival(now, 0, 0, data))
        else:
            end.rest += data
            while len(end.rest) >= _HEADER.size:
                length, msg_type, _, _ = _HEADER.unpack_from(end.rest)
                if len(end.rest) < length + 4:
                    break
                frame, end.rest = end.rest[: length + 4], end.rest[length + 4 :]
                came.append(Arrival(now, msg_type, _sequence(msg_type, frame), frame))
        with self._news:
            self.arrivals += came
            self._news.notify_all()

    # The test.

    def first(
        self, wanted: Callable[[Arrival], bool], since: int, within: float = 5.0
    ) -> Arrival | None:
        """Wait for the first arrival of a kind after a time [ns]; None where none comes [s]."""
        until, at = time.monotonic() + within, len(self.arrivals)
        while at and self.arrivals[at - 1].time > since:
            at -= 1
        with self._news:
            while True:
                while at < len(self.arrivals):
                    if self.arrivals[at].time > since and wanted(self.arrivals[at]):
                        return self.arrivals[at]
                    at += 1
                left = until - time.monotonic()
                if left <= 0 or not self._news.wait(left):
                    return None


def _sequence(msg_type: int, frame: bytes) -> int:
    word = _POINTS.get(MsgType(msg_type)) if msg_type in set(MsgType) else None
    if word is None:
        return 0
    (sequence,) = struct.unpack_from("<i", frame, 4 * word)
    return int(sequence)
