"""A pendant on a real socket that does one thing at a time, so that a test can time its bytes."""

import json
import select
import socket
import struct
import time
from collections.abc import Callable
from typing import Any

from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    Connection,
    Message,
    Role,
    TriState,
    joint_array,
    pendant,
)
from openpendant.simplemsg.verdicts import VerdictCode

BEAT = 0.04
"""Between two beats, as a real pendant sends them at least [s]."""

_PATIENCE = 20.0


class WirePendant:
    """One connection.

    Attributes:
        got: what it was told, all but states.
        state: the newest state.
        ticks: times of the ticks that its states tell of [ns].
        enables: holds the enabling device (training).
    """

    def __init__(self, port: int, client: str = "hand", rate: float = 100.0) -> None:
        self.sock = socket.create_connection(("127.0.0.1", port), timeout=_PATIENCE)
        self.sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.got: list[Message] = []
        self.state: pendant.State | None = None
        self.ticks: list[int] = []
        self.enables = False
        self.beats = False
        self._wire = Connection(
            Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=pendant.MAX_PENDANT_FRAME
        )
        self._press = self._beat = self._request = 0
        self._due = 0.0
        self.send(pendant.Hello(pendant.PROTOCOL_VERSION, rate, "", client))
        if rate:
            self.wait_until(lambda state: state.motion_possible == 1)

    # Bytes.

    def frame(self, message: Message) -> bytes:
        return self._wire.send(message)

    def send(self, *messages: Message) -> int:
        """Send; return when the bytes went [ns]."""
        frame = b"".join(self._wire.send(message) for message in messages)
        now = time.monotonic_ns()
        self.sock.sendall(frame)
        return now

    def listen(self, seconds: float) -> None:
        """Take what comes for so long, with the hands where they are."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            self._keep_on()
            if select.select([self.sock], [], [], min(left, BEAT / 4))[0]:
                self._take()

    def _take(self) -> None:
        data = self.sock.recv(65_536)
        if not data:
            raise ConnectionError("the server closed the connection")
        for message in self._wire.receive(data):
            if isinstance(message, pendant.State):
                self.state = message
                self.ticks.append(message.time_s * 1_000_000_000 + message.time_ns)
            elif isinstance(message, Message):
                self.got.append(message)

    def _keep_on(self) -> None:
        if time.monotonic() < self._due:
            return
        self._due = time.monotonic() + BEAT
        messages: list[Message] = [pendant.AuthorityBeat()]
        if self.enables:
            messages.append(pendant.Enabling(pendant.EnablingPosition.HELD))
        if self.beats:
            self._beat += 1
            messages.append(pendant.JogBeat(self._press, self._beat))
        self.send(*messages)

    def wait_until(self, holds: Callable[[pendant.State], bool]) -> None:
        until = time.monotonic() + _PATIENCE
        while self.state is None or not holds(self.state):
            assert time.monotonic() < until, (self.state, self.got[-3:])
            self.listen(0.01)

    def wait_for(self, kind: type[Message]) -> None:
        """Wait until a message of a kind has come."""
        until = time.monotonic() + _PATIENCE
        while not any(isinstance(each, kind) for each in self.got):
            assert time.monotonic() < until, self.got
            self.listen(0.005)

    def verdict(self, message: Message) -> VerdictCode:
        """Send a request and return the code of its verdict."""
        request = getattr(message, "request_id", 0)
        before = len(self.got)
        self.send(message)
        until = time.monotonic() + _PATIENCE
        while time.monotonic() < until:
            for each in self.got[before:]:
                if isinstance(each, pendant.Verdict) and each.request_id == request:
                    return VerdictCode(each.code)
            self.listen(0.002)
        raise AssertionError(f"no verdict for {message}")

    def ask(self, op: str, **fields: Any) -> dict[str, Any]:
        """Send a management request and return what it is answered, a refusal with its code."""
        request = self.request()
        before = len(self.got)
        body = json.dumps({"op": op, **fields}).encode()
        self.send(pendant.Management(request, body))
        until = time.monotonic() + _PATIENCE
        while time.monotonic() < until:
            for each in self.got[before:]:
                if isinstance(each, pendant.Management) and each.request_id == request:
                    answer: dict[str, Any] = json.loads(each.body)
                    return answer
            self.listen(0.0005)
        raise AssertionError(f"no answer to {op}")

    def request(self) -> int:
        self._request += 1
        return self._request

    # Hands.

    def take_control(self) -> None:
        """Take the authority as soon as it is free, and hold the enabling device (training)."""
        until = time.monotonic() + _PATIENCE
        while self.verdict(
            pendant.Authority(self.request(), pendant.AuthorityAction.REQUEST)
        ) is not (VerdictCode.ACCEPTED):
            assert time.monotonic() < until, self.got[-1]
            self.listen(0.02)
        self.enables = True
        self._due = 0.0
        self.listen(0.03)
        if self.state is not None:
            self.wait_until(_stands)
            if self.state.stop != pendant.StopKind.NONE:
                assert self.reset() is VerdictCode.ACCEPTED

    def press(self, rate: float, deadline: float = 0.15) -> int:
        """Press the key of the first joint; return when the bytes went [ns]."""
        assert self.state is not None
        self._press += 1
        self._beat = 0
        self.beats = True
        start = pendant.JogStart(
            self.request(),
            self._press,
            self.state.sequence,
            deadline,
            pendant.JogSpace.JOINTS,
            "",
            6,
            joint_array((rate, 0.0, 0.0, 0.0, 0.0, 0.0)),
        )
        return self.send(pendant.Enabling(pendant.EnablingPosition.HELD), start)

    def beat(self) -> int:
        """Send one beat now; return when it went [ns]."""
        self._beat += 1
        return self.send(
            pendant.Enabling(pendant.EnablingPosition.HELD),
            pendant.JogBeat(self._press, self._beat),
        )

    def let_go(self, position: pendant.EnablingPosition, *, key: bool) -> int:
        """Put the enabling device elsewhere, and let the key go too; return when that went [ns]."""
        self.enables = False
        messages: list[Message] = [pendant.Enabling(position)]
        if key:
            self.beats = False
            messages.append(pendant.JogRelease(self.request(), self._press))
        return self.send(*messages)

    def come_to_rest(self) -> None:
        """Let the key go where it is held, and wait until nothing moves."""
        if self.beats:
            self.send(pendant.JogRelease(self.request(), self._press))
        self.beats = False
        self.wait_until(_stands)

    def stop(self) -> int:
        """Ask for a software stop; return when the bytes went [ns]."""
        return self.send(pendant.SoftwareStop(self.request(), "a test"))

    def reset(self) -> VerdictCode:
        """Let the enabling device (training) go, reset the stop, and hold it anew."""
        self.enables = False
        self.send(pendant.Enabling(pendant.EnablingPosition.RELEASED))
        code = self.verdict(pendant.ResetStop(self.request()))
        self.hold_anew()
        return code

    def hold_anew(self) -> None:
        """Let the enabling device (training) go and hold it, as has to be done after a silence."""
        self.send(pendant.Enabling(pendant.EnablingPosition.RELEASED))
        self.enables = True
        self._due = 0.0
        self.listen(0.02)

    # Ends.

    def close(self) -> None:
        self.sock.close()

    def abort(self) -> None:
        """Close with a reset instead of an orderly end."""
        self.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.sock.close()


def _stands(state: pendant.State) -> bool:
    is_idle = state.activity == pendant.Activity.IDLE and state.in_motion != TriState.TRUE
    return is_idle and not any(state.velocities)
