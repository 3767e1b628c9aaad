import os
import signal
import socket
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from rigs.cells.expectations import known
from rigs.peers.full_pipe import filled_pipe

from openpendant.server.settings.cell_settings import make_settings
from openpendant.server.watchdog.watchdog_process import Watchdog, stop_target
from openpendant.server.watchdog.watchdog_protocol import Deadlines, StopTarget
from openpendant.simplemsg import MsgType

pytestmark = pytest.mark.realtime

STOP = b"stop the robot"
ANSWER = struct.pack("<3i", 11, 3, 1)
FRAME = struct.pack("<i", len(ANSWER)) + ANSWER
SCALE = float(os.environ.get("OPENPENDANT_TIME_SCALE", "1"))
DEADLINE = 0.1
DEADLINES = Deadlines(DEADLINE, 4 * DEADLINE)

SERVER = """
import sys, time
from openpendant.server.watchdog.watchdog_protocol import Deadlines, StopTarget
from openpendant.server.watchdog.watchdog_process import Watchdog
answer = "0b0000000300000001000000"
target = StopTarget("cell", "127.0.0.1", int(sys.argv[1]), sys.argv[2], True, answer, "little")
with Watchdog([target], Deadlines(0.1, 0.4), 0.01) as watchdog:
    while True:
        watchdog.beat([True], [False])
        print(".", end="", flush=True)
        time.sleep(0.01)
"""
"""A server that does nothing but tick."""


@pytest.fixture
def controller() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(10 * SCALE)
        yield listener


def target(controller: socket.socket, *, is_kept: bool = True) -> StopTarget:
    port = controller.getsockname()[1]
    return StopTarget("cell", "127.0.0.1", port, STOP.hex(), is_kept, ANSWER.hex(), "little")


@contextmanager
def watched(
    controller: socket.socket, deadlines: Deadlines = DEADLINES
) -> Iterator[tuple[Watchdog, socket.socket]]:
    """Run a watchdog and accept its connection to the controller."""
    with Watchdog([target(controller)], deadlines, 0.01) as watchdog:
        connection, _ = controller.accept()
        with connection:
            yield watchdog, connection


@contextmanager
def ticking(controller: socket.socket, log: int) -> Iterator[subprocess.Popen[bytes]]:
    """Run a server that ticks, with its watchdog, until that is connected; kill it then."""
    port = str(controller.getsockname()[1])
    command = [sys.executable, "-c", SERVER, port, STOP.hex()]
    server = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log)
    try:
        yield server
    finally:
        server.kill()
        server.communicate()


def stopped_at(controller: socket.socket, server: subprocess.Popen[bytes], ending: int) -> bool:
    """Freeze or kill a server that ticks, and say whether its watchdog stops the robot."""
    connection, _ = controller.accept()
    with connection:
        assert server.stdout is not None
        server.stdout.read(20)
        server.send_signal(ending)
        is_stopped = received(connection, 5 * SCALE) == STOP
        connection.sendall(FRAME)
    return is_stopped


def until_another_runs(watchdog: Watchdog, first: subprocess.Popen[bytes]) -> None:
    until = time.monotonic() + 10 * SCALE
    while watchdog.process is first or watchdog.process is None:
        assert time.monotonic() < until, "no other is started"
        beat_for(watchdog, 0.1)


def beat_for(
    watchdog: Watchdog, seconds: float, *, moving: bool = True, emulated: bool = False
) -> None:
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        watchdog.beat([moving], [emulated])
        time.sleep(0.01)


def received(connection: socket.socket, seconds: float) -> bytes:
    connection.settimeout(seconds)
    try:
        return connection.recv(1_000)
    except TimeoutError:
        return b""


def test_promise_26_a_blocked_loop_is_stopped_for(controller: socket.socket) -> None:
    with watched(controller) as (watchdog, connection):
        beat_for(watchdog, 0.3)
        blocked = time.monotonic()
        assert received(connection, 5 * SCALE) == STOP
        waited = time.monotonic() - blocked
        assert waited <= 3 * 2 * DEADLINE * SCALE
        connection.sendall(FRAME)
        # It tells, so that a server that found nothing late knows of the stop as well.
        until = time.monotonic() + 5 * SCALE
        while watchdog.beat([True], [False]) != 1:
            assert time.monotonic() < until, "it does not tell"
            time.sleep(0.01)
        beat_for(watchdog, 0.1)
        assert received(connection, 5 * SCALE) == STOP


def test_promise_26_a_controller_that_says_it_is_emulated_is_given_its_own_deadline(
    controller: socket.socket,
) -> None:
    patient = Deadlines(DEADLINE, 10 * DEADLINE * SCALE)
    with watched(controller, patient) as (watchdog, connection):
        beat_for(watchdog, 0.1, emulated=True)
        assert received(connection, 3 * DEADLINE) == b""
        watchdog.update([True], [False])
        assert received(connection, 3 * DEADLINE * SCALE) == STOP


def test_a_loop_that_ticks_is_left_alone(controller: socket.socket) -> None:
    deadline = 0.5 * SCALE
    with watched(controller, Deadlines(deadline, deadline)) as (watchdog, connection):
        beat_for(watchdog, 1.5 * deadline)
        assert received(connection, 0.05) == b""


def test_a_robot_that_cannot_move_is_not_stopped_for(controller: socket.socket) -> None:
    with watched(controller) as (watchdog, connection):
        beat_for(watchdog, 0.1, moving=False)
        assert received(connection, 0.4) == b""


def test_a_controller_of_one_connection_is_called_only_in_need(
    controller: socket.socket,
) -> None:
    with Watchdog([target(controller, is_kept=False)], DEADLINES, 0.01) as watchdog:
        beat_for(watchdog, 0.3)
        connection, _ = controller.accept()
        with connection:
            assert received(connection, 5 * SCALE) == STOP


def test_a_watchdog_that_died_is_started_again(controller: socket.socket) -> None:
    with Watchdog([target(controller)], DEADLINES, 0.01) as watchdog:
        first = known(watchdog.process)
        first.kill()
        first.wait()
        until_another_runs(watchdog, first)


def test_a_watchdog_that_hangs_is_killed_and_another_started(
    controller: socket.socket, caplog: pytest.LogCaptureFixture
) -> None:
    with watched(controller) as (watchdog, _):
        first = known(watchdog.process)
        # It is up, so it answers; from its first answer on half a second is allowed.
        beat_for(watchdog, 0.3 * SCALE)
        first.send_signal(signal.SIGSTOP)
        until_another_runs(watchdog, first)
    assert first.returncode == -signal.SIGKILL
    assert "does not answer" in caplog.text


def test_promise_26_a_log_that_nobody_reads_delays_no_stop(controller: socket.socket) -> None:
    with filled_pipe() as writing, ticking(controller, writing) as server:
        assert stopped_at(controller, server, signal.SIGSTOP)


def test_an_orderly_end_stops_nothing_and_leaves_no_process(controller: socket.socket) -> None:
    deadline = 1.0 * SCALE
    with Watchdog([target(controller)], Deadlines(deadline, deadline), 0.01) as watchdog:
        connection, _ = controller.accept()
        beat_for(watchdog, 0.1)
        process = known(watchdog.process)
    assert process.returncode == 0
    with connection:
        assert received(connection, 1.5 * deadline) == b""


@pytest.mark.parametrize("ending", [signal.SIGSTOP, signal.SIGKILL])
def test_promise_26_a_server_that_is_frozen_or_killed_is_stopped_for(
    controller: socket.socket, ending: signal.Signals, tmp_path: Path
) -> None:
    with (tmp_path / "log").open("wb") as log, ticking(controller, log.fileno()) as server:
        assert stopped_at(controller, server, ending)
        until = time.monotonic() + 10 * SCALE
        while b"STOP sent to the controller" not in (tmp_path / "log").read_bytes():
            assert time.monotonic() < until, "the watchdog does not say so"
            time.sleep(0.01)


def test_the_stop_of_a_cell_is_a_point_of_sequence_minus_4_in_its_controllers_byte_order() -> None:
    settings = make_settings({"name": "left", "controller": {"byte_order": "big"}}, "test")
    told = stop_target(settings)
    assert (told.cell, told.host, told.port, told.is_kept) == ("left", "127.0.0.1", 12000, True)
    assert bytes.fromhex(told.answer) == struct.pack(">3i", MsgType.JOINT_TRAJ_PT, 3, 1)
    frame = bytes.fromhex(told.stop)
    assert frame[:20] == struct.pack(">5i", len(frame) - 4, MsgType.JOINT_TRAJ_PT, 2, 0, -4)
