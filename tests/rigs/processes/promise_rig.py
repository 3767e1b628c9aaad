"""A server and an emulated robot as processes, a recording controller between them, and its clock.

Owns the bench on which promises with a time are shown on real sockets: each trial is measured where
bytes reach the controller, and beside each the same instrument measures an event loop that has
nothing to do. What the machine does to that one it does to the server as well.
"""

import json
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from promises.promise_figures import Figures
from rigs.clock.busy_machine import SCALE
from rigs.peers.recording_controller import RecordingController
from rigs.peers.wire_pendant import WirePendant

from openpendant.tools.bench.jogging_pendants import lateness

_TURN = 0.01
"""Between two measurements of the idle control while ticks are watched, less where asked [s]."""

_SLICE = 0.5
"""Ticks of so long are void together [s]."""

PRIORITY = 0
"""Niceness of the server: that of the idle control, and of all else that the tests start."""

_PEERS = Path(__file__).with_name("promise_peers.py")


@dataclass
class PromiseRig:
    """The processes, and what tests do with them."""

    controller: RecordingController
    pendant_port: int
    server_pid: int
    referee: Path
    _stack: ExitStack
    _control: socket.socket

    def pendant(self, client: str = "hand", rate: float = 100.0) -> WirePendant:
        pendant = WirePendant(self.pendant_port, client, rate)
        self._stack.callback(pendant.close)
        return pendant

    def beside(self, what: str, *arguments: object) -> None:
        """Start a process of `promise_peers` and wait until it is ready."""
        self._stack.enter_context(_peer(what, self.pendant_port, *arguments))

    @contextmanager
    def storm(self) -> Iterator[None]:
        """Have another process connect as often as it can."""
        with _peer("storm", self.pendant_port):
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
def promise_rig(folder: Path, **settings: Any) -> Iterator[PromiseRig]:
    """Run an emulated UR5 and a server in T1 for it, on free ports."""
    with ExitStack() as stack:
        referee = folder / "referee.json"
        emulator = stack.enter_context(
            _process(
                *("openpendant.controller_emulator", "--robot", "ur5", "--json"),
                *("--motion-port", "0", "--state-port", "0", "--report", str(referee)),
            )
        )
        controller = RecordingController(emulator["motion"], emulator["state"])
        stack.callback(controller.close)
        config = folder / "cell.toml"
        config.write_text(_config(controller, folder, settings), encoding="utf-8")
        server = stack.enter_context(
            _process("openpendant.server", "--json", "--config", str(config))
        )
        control = stack.enter_context(_peer("forwarder", controller.control))
        line = stack.enter_context(socket.create_connection(("127.0.0.1", control)))
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # Left first of all, so that pendants are gone before what they talk to.
        yield PromiseRig(
            controller,
            server["pendant"],
            server["pid"],
            referee,
            stack.enter_context(ExitStack()),
            line,
        )


def _late(ticks: list[int]) -> list[float]:
    """Return how late ticks were [ms]; none of fewer than two, between which there is no rhythm."""
    return [late / 1e6 for late in lateness(ticks)] if len(ticks) > 1 else []


def _config(controller: RecordingController, folder: Path, settings: dict[str, Any]) -> str:
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
    lines = ['robot = "ur5"', f"niceness = {PRIORITY}"]
    for table, values in tables.items():
        lines += [f"[{table}]", *(f"{key} = {json.dumps(value)}" for key, value in values.items())]
    return "\n".join(lines) + "\n"


@contextmanager
def _process(module: str, *arguments: str) -> Iterator[dict[str, Any]]:
    """Run a module until the context is left; yields its ready line."""
    command = [sys.executable, "-m", module, *arguments]
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            assert line, f"{module} ended before it was ready"
            yield json.loads(line)
        finally:
            process.terminate()
            try:
                process.wait(10 * SCALE)
            except subprocess.TimeoutExpired:
                process.kill()


@contextmanager
def _peer(*arguments: object) -> Iterator[int]:
    """Run a process of `promise_peers`; yields the number that it is ready with."""
    command = [sys.executable, str(_PEERS), *map(str, arguments)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            line = process.stdout.readline()
            assert line, f"{arguments[0]} ended before it was ready"
            yield int(line)
            assert process.poll() is None, f"{arguments[0]} ended before the test did"
        finally:
            process.kill()
