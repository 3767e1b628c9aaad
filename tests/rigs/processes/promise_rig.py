"""A server and an emulated robot as processes, a recording controller between them, and its clock.

Owns the bench on which promises with a time are shown on real sockets: each trial is measured where
bytes reach the controller, and beside each the same instrument measures an event loop that has
nothing to do. What the machine does to that one it does to the server as well.

The recording controller is a relay in front of the emulated one, and the measuring point: what
counts is when bytes arrive there, never what the server says of itself. One thread, times of
`time.monotonic_ns`.
"""

from __future__ import annotations

import json
import selectors
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from promises.promise_figures import Figures
from rigs.peers.wire_pendant import WirePendant
from rigs.processes.warm_start import warm

from openpendant.simplemsg import MsgType, SpecialSequence
from openpendant.tools.bench.jogging_pendants import lateness

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

    @property
    def joint_positions(self) -> tuple[float, ...] | None:
        """Positions of ten joints [rad or m]; None where this is no set-point with velocities."""
        if self.msg_type != MsgType.JOINT_TRAJ_PT_FULL or self.is_stop:
            return None
        return struct.unpack_from("<10f", self.frame, 4 * (4 + 4))


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
        motion, state: where the server is to connect; it waits there until `lead_to` was called.
        control: where the idle control is to connect.
    """

    arrivals: list[Arrival] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._news = threading.Condition()
        self._selector = selectors.DefaultSelector()
        self._upstream: dict[int, int] = {}
        self._is_led = threading.Event()
        self.motion = self._listen()
        self.state = self._listen()
        self.control = self._listen()
        self._is_over = False
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _listen(self) -> int:
        listener = socket.create_server(("127.0.0.1", 0))
        port: int = listener.getsockname()[1]
        self._selector.register(listener, selectors.EVENT_READ, port)
        return port

    def lead_to(self, motion: int, state: int) -> None:
        """Say on which ports the emulated controller listens."""
        self._upstream = {self.motion: motion, self.state: state}
        self._is_led.set()

    def close(self) -> None:
        self._is_over = True
        self._is_led.set()
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

    def _accept(self, listener: socket.socket, port: int) -> None:
        near, _ = listener.accept()
        near.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        heard = _End(near, is_heard=True, is_control=port == self.control)
        if not heard.is_control:
            self._is_led.wait()
            if self._is_over:
                near.close()
                return
            far = socket.create_connection(("127.0.0.1", self._upstream[port]))
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


_TURN = 0.01
"""Between two measurements of the idle control while ticks are watched, less where asked [s]."""

_SLICE = 0.5
"""Ticks of so long are void together [s]."""

PRIORITY = 0
"""Niceness of the server: that of the idle control, and of all else that the tests start."""

_PEERS = Path(__file__).with_name("promise_peers.py")

_SERVER = "openpendant.server"

_OPEN_SERVER = "rigs.processes.open_server"
"""The same server, which takes connections as soon as they come."""


@dataclass
class PromiseRig:
    """The processes, and what tests do with them.

    Attributes:
        emulator_began: when the emulator was ready, from which its log counts [ns].
    """

    controller: RecordingController
    pendant_port: int
    server_pid: int
    referee: Path
    emulator_began: int
    _stack: ExitStack
    _control: socket.socket

    def pendant(self, client: str = "hand", rate: float = 100.0) -> WirePendant:
        pendant = WirePendant(self.pendant_port, client, rate)
        self._stack.callback(pendant.close)
        return pendant

    @contextmanager
    def beside(self, *peers: tuple[object, ...]) -> Iterator[None]:
        """Run processes of `promise_peers`, each a name and its arguments; all are ready."""
        with ExitStack() as stack:
            started = [
                stack.enter_context(_peer(what, self.pendant_port, *arguments))
                for what, *arguments in peers
            ]
            for ready in started:
                ready()
            yield

    def idle_delay(self) -> float:
        """Measure the idle control once [ms]."""
        sent = time.monotonic_ns()
        self._control.sendall(b".")
        arrival = self.controller.first(lambda each: not each.msg_type, sent)
        assert arrival is not None
        return (arrival.time - sent) / 1e6

    def watch_ticks(
        self,
        pendant: WirePendant,
        seconds: float,
        figures: Figures,
        *,
        turn: float = _TURN,
        meanwhile: Callable[[], None] | None = None,
    ) -> float:
        """Measure how late the server's ticks are, by its stamps, and beside it the idle control.

        Args:
            pendant: is told of each tick.
            seconds: how long [s].
            figures: gets both.
            turn: from one measurement of the idle control to the next [s].
            meanwhile: called once each turn.

        Returns:
            By how much the slowest turn here was late, the idle control's answer included [ms]:
            what the machine did to two other processes in these seconds.
        """
        pendant.ticks.clear()
        latest = 0.0
        until = time.monotonic() + seconds
        slice_began = time.monotonic_ns()
        while (began := time.monotonic()) < until:
            if meanwhile is not None:
                meanwhile()
            pendant.listen(turn)
            figures.idle.append(self.idle_delay())
            latest = max(latest, time.monotonic() - began - turn)
            if time.monotonic_ns() - slice_began > _SLICE * 1e9:
                figures.take(slice_began, *_late(pendant.ticks))
                # The last one stays, so that no silence falls between two slices.
                pendant.ticks[:-1] = []
                slice_began = time.monotonic_ns()
        figures.take(slice_began, *_late(pendant.ticks))
        return latest * 1e3


@contextmanager
def promise_rig(
    folder: Path,
    *,
    robot: str = "ur5",
    is_open: bool = False,
    emulator_arguments: tuple[str, ...] = (),
    **settings: Any,
) -> Iterator[PromiseRig]:
    """Run an emulated robot and a server in T1 for it, on free ports.

    Args:
        folder: for what they write.
        is_open: the server takes connections at any rate.
        emulator_arguments: more of them for the emulator.
        settings: tables of the server's settings.
    """
    with ExitStack() as stack:
        referee = folder / "referee.json"
        emulator = stack.enter_context(
            warm(
                *("openpendant.controller_emulator", "--robot", robot),
                *("--motion-port", "0", "--state-port", "0", "--report", str(referee)),
                *emulator_arguments,
            )
        )
        controller = RecordingController()
        stack.callback(controller.close)
        config = folder / "cell.toml"
        config.write_text(_config(robot, controller, folder, settings), encoding="utf-8")
        module = _OPEN_SERVER if is_open else _SERVER
        server = stack.enter_context(warm(module, "--config", str(config)))
        control = stack.enter_context(_peer("forwarder", controller.control))
        emulated = emulator()
        controller.lead_to(emulated["motion"], emulated["state"])
        line = stack.enter_context(socket.create_connection(("127.0.0.1", control())))
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        served = server()
        # Left first of all, so that pendants are gone before what they talk to.
        yield PromiseRig(
            controller,
            served["pendant"],
            served["pid"],
            referee,
            emulated["origin_ns"],
            stack.enter_context(ExitStack()),
            line,
        )


def _late(ticks: list[int]) -> list[float]:
    """Return how late ticks were [ms]; none of fewer than two, between which there is no rhythm."""
    return [late / 1e6 for late in lateness(ticks)] if len(ticks) > 1 else []


def _config(
    robot: str, controller: RecordingController, folder: Path, settings: dict[str, Any]
) -> str:
    listen = {
        "pendant_port": 0,
        "ros_motion_port": "off",
        "ros_state_port": "off",
        "max_connections": 512,
    }
    tables: dict[str, dict[str, Any]] = {
        "listen": listen,
        "controller": {"motion_port": controller.motion, "state_port": controller.state},
        "modes": {"initial": "manual_reduced"},
        "store": {"path": str(folder / "store.db")},
    }
    for table, values in settings.items():
        tables.setdefault(table, {}).update(values)
    lines = [f"robot = {json.dumps(robot)}", f"niceness = {PRIORITY}"]
    for table, values in tables.items():
        lines += [f"[{table}]", *(f"{key} = {json.dumps(value)}" for key, value in values.items())]
    return "\n".join(lines) + "\n"


@contextmanager
def _peer(*arguments: object) -> Iterator[Callable[[], int]]:
    """Run a process of `promise_peers`; yields what waits for the number that it is ready with."""
    command = [sys.executable, str(_PEERS), *map(str, arguments)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        try:
            yield lambda: int(_ready_line(process))
            assert process.poll() is None, f"{arguments[0]} ended before the test did"
        finally:
            process.kill()


def _ready_line(process: subprocess.Popen[bytes]) -> bytes:
    assert process.stdout is not None
    line = process.stdout.readline()
    assert line, f"{process.args!r} ended before it was ready"
    return line
