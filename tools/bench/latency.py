"""Latency over loopback: a packet's way through the server, against the least asyncio can do.

(a) a ROS-I point to its reply, against an echo; (b) a pendant's joint command to the first point at
the controller, against a relay. The baseline is measured in the same run, turn by turn, and so is
the idle control: what a busy machine does to the baseline, it does to ours.
"""

from __future__ import annotations

import socket
import statistics
import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager

from openpendant.motion.description.robot import serial_robot
from openpendant.simplemsg import (
    PENDANT,
    JointTrajPt,
    Message,
    SpecialSequence,
    codec_for,
    joint_array,
)
from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSION,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    Hello,
    JointMove,
    Outcome,
    Verdict,
)

from .peers import (
    EMULATOR,
    ROBOT,
    SERVER,
    PlainController,
    accept,
    connect,
    listen,
    pinned,
    plain_controller,
    process,
    receive_exactly,
    receive_message,
)
from .table import Benchmark, Bound, Sides

HERE, PEER = 0, 1
"""Places of this process and of whoever it measures."""

POINTS = 200
"""Points of one sample of (a)."""

MOVES = 5
"""Joint commands of one sample of (b)."""

_SETTLE = 4.0
"""Until the planning process is warm and leaves the processors alone [s]."""


def benchmarks() -> list[Benchmark]:
    """Return both latency benchmarks."""
    return [
        Benchmark(
            "latency (a) ROS-I point to reply", "us", _point_to_reply, Bound(2.5, aim=1.5), 15
        ),
        Benchmark(
            "latency (b) joint command to point", "us", _command_to_point, Bound(3.0, aim=2.0), 15
        ),
    ]


@contextmanager
def _point_to_reply() -> Iterator[Sides]:
    """Time points of a trajectory that a real server collects for an emulated controller."""
    with ExitStack() as stack:
        emulator = stack.enter_context(process(*EMULATOR))
        controller = f"127.0.0.1:{emulator['motion']}:{emulator['state']}"
        server = stack.enter_context(process(*SERVER, "--controller", controller, place=PEER))
        echo = stack.enter_context(process("openpendant.tools.bench.peers", "echo", place=PEER))
        time.sleep(_SETTLE)
        stack.enter_context(pinned(HERE))
        ours = stack.enter_context(closing(connect(server["ros_motion"])))
        theirs = stack.enter_context(closing(connect(echo["port"])))
        home = joint_array(serial_robot(ROBOT).home_position)
        codec = codec_for()
        frames = [
            codec.encode(JointTrajPt(sequence=number, joints=home, velocity=0.1, duration=0.1))
            for number in range(POINTS)
        ]
        stop = codec.encode(
            JointTrajPt(
                sequence=SpecialSequence.STOP, joints=joint_array(()), velocity=0.0, duration=0.0
            )
        )

        def subject() -> float:
            taken = []
            for frame in frames:
                began = time.perf_counter()
                ours.sendall(frame)
                reply = receive_exactly(ours, 16)
                taken.append(time.perf_counter() - began)
                if codec.decode(reply).reply_code != 1:
                    raise RuntimeError("the server refused a point")
            ours.sendall(stop)
            receive_exactly(ours, 16)
            return statistics.median(taken) * 1e6

        def baseline() -> float:
            taken = []
            for frame in frames:
                began = time.perf_counter()
                theirs.sendall(frame)
                receive_exactly(theirs, len(frame))
                taken.append(time.perf_counter() - began)
            return statistics.median(taken) * 1e6

        yield Sides(subject, baseline)


class _Pendant:
    """A pendant on a blocking socket that moves one joint to and fro."""

    def __init__(self, connection: socket.socket) -> None:
        self._connection = connection
        self._codec = codec_for(PENDANT)
        self._moves = 0
        hello = Hello(
            protocol_version=PROTOCOL_VERSION, state_rate=0.0, cell="", client="benchmark"
        )
        self._send(hello)
        self._send(Authority(request_id=1, action=AuthorityAction.REQUEST))
        self._await(Verdict)

    def _send(self, message: Message) -> None:
        self._connection.sendall(self._codec.encode(message))

    def _await(self, kind: type[Verdict] | type[Outcome]) -> None:
        while True:
            prefix = receive_exactly(self._connection, 4)
            size = int.from_bytes(prefix, "little")
            message = self._codec.decode(prefix + receive_exactly(self._connection, size))
            if isinstance(message, Verdict | Outcome) and message.code:
                raise RuntimeError(message.text)
            if isinstance(message, kind):
                return

    def move(self, controller: PlainController) -> float:
        """Return the time from writing a joint move to its first point at the controller [s]."""
        self._moves += 1
        self._send(AuthorityBeat())
        home = serial_robot(ROBOT).home_position
        goal = (home[0] + (0.02 if self._moves % 2 else 0.0), *home[1:])
        frame = self._codec.encode(
            JointMove(
                request_id=100 + self._moves,
                speed=1.0,
                joint_count=len(goal),
                joints=joint_array(goal),
            )
        )
        began = time.perf_counter()
        self._connection.sendall(frame)
        first = receive_message(controller.motion)
        taken = time.perf_counter() - began
        controller.obey(first, goal)
        self._await(Outcome)
        return taken


@contextmanager
def _command_to_point() -> Iterator[Sides]:
    """Time joint moves from the pendant's write to the first point at the controller."""
    with ExitStack() as stack:

        def opened(connection: socket.socket) -> socket.socket:
            return stack.enter_context(closing(connection))

        motion, state, sink = opened(listen()), opened(listen()), opened(listen())
        server = stack.enter_context(_server_of(motion, state))
        relay = stack.enter_context(
            process("openpendant.tools.bench.peers", "relay", _port(sink), place=PEER)
        )
        controller = stack.enter_context(
            plain_controller(
                opened(accept(motion)), opened(accept(state)), serial_robot(ROBOT).home_position
            )
        )
        to_relay, from_relay = opened(connect(relay["port"])), opened(accept(sink))
        time.sleep(_SETTLE)
        stack.enter_context(pinned(HERE))
        pendant = _Pendant(opened(connect(server["pendant"])))

        def subject() -> float:
            return statistics.median(pendant.move(controller) for _ in range(MOVES)) * 1e6

        def baseline() -> float:
            return statistics.median(_passed_on(to_relay, from_relay) for _ in range(MOVES)) * 1e6

        yield Sides(subject, baseline)


def _port(listener: socket.socket) -> str:
    return str(listener.getsockname()[1])


def _server_of(
    motion: socket.socket, state: socket.socket
) -> AbstractContextManager[dict[str, int]]:
    """Return a server whose controller is this process."""
    return process(
        *SERVER,
        "--no-stop-connection",
        *("--controller", f"127.0.0.1:{_port(motion)}:{_port(state)}"),
        place=PEER,
    )


def _passed_on(to_relay: socket.socket, from_relay: socket.socket) -> float:
    """Return the time that a relay takes to pass a packet on [s]."""
    packet = bytes(64)
    # As far apart as the moves: a process that slept wakes more slowly than a busy one.
    time.sleep(0.1)
    began = time.perf_counter()
    to_relay.sendall(packet)
    receive_exactly(from_relay, len(packet))
    return time.perf_counter() - began
