"""`openpendant emulate` as a process: the ready line, signals, summaries, exit codes, imports."""

import csv
import json
import os
import pty
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

import pytest
from rigs.cells.controller_rig import ratio_point

from openpendant.controller_emulator.shell.cli import main
from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    Connection,
    HeaderOnly,
    JointPosition,
    Message,
    ReplyCode,
    Role,
    Status,
)

Capture = pytest.CaptureFixture[str]

MODULE = "openpendant.controller_emulator"
FREE_PORTS = ("--motion-port", "0", "--state-port", "0")
TIMEOUT_S = 20.0

Launch = Callable[..., "subprocess.Popen[str]"]

pytestmark = pytest.mark.realtime


@pytest.fixture
def launch() -> Iterator[Launch]:
    processes: list[subprocess.Popen[str]] = []

    def begin(*arguments: str, stdin: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", MODULE, *FREE_PORTS, *arguments]
        pipe = subprocess.PIPE
        process = subprocess.Popen(command, stdin=stdin, stdout=pipe, stderr=pipe, text=True)
        processes.append(process)
        return process

    yield begin
    for process in processes:
        if process.poll() is None:
            process.kill()
        process.communicate(timeout=TIMEOUT_S)


def ready(process: subprocess.Popen[str]) -> dict[str, int]:
    assert process.stdout is not None
    line = process.stdout.readline()
    if line.startswith("{"):
        event: dict[str, int] = json.loads(line)
        return event
    words = line.split()
    assert words[:2] == ["emulator", "ready"]
    return {name: int(value) for name, value in (word.split("=") for word in words[2:])}


def ended(process: subprocess.Popen[str], how: signal.Signals = signal.SIGTERM) -> tuple[str, str]:
    """End a process, and return what it said since on its two outputs."""
    process.send_signal(how)
    return process.communicate(timeout=TIMEOUT_S)


def ask(port: int, message: Message) -> Message:
    connection = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE)
    with socket.create_connection(("127.0.0.1", port), TIMEOUT_S) as sock:
        sock.sendall(connection.send(message))
        received = connection.receive(sock.recv(1024))
    (reply,) = received
    assert isinstance(reply, HeaderOnly | Status)
    return reply


def reports(port: int) -> Iterator[Message]:
    """Yield what a state port tells, for as long as it does."""
    connection = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE)
    with socket.create_connection(("127.0.0.1", port), TIMEOUT_S) as sock:
        while data := sock.recv(4_096):
            yield from (each for each in connection.receive(data) if isinstance(each, Message))


def _resident_kib(pid: int) -> int:
    """Memory of a process; 0 where there is no /proc to ask."""
    status = Path(f"/proc/{pid}/status")
    lines = status.read_text().splitlines() if status.exists() else []
    return sum(int(line.split()[1]) for line in lines if line.startswith("VmRSS"))


def test_it_is_ready_in_less_than_70_mb_and_sums_up_at_sigterm(launch: Launch) -> None:
    process = launch("--robot", "ur5")
    ports = ready(process)
    assert ports["pid"] == process.pid
    assert ports["motion"] != ports["state"]
    assert _resident_kib(process.pid) < 70 * 1024
    out, err = ended(process)
    assert process.returncode == 0
    assert out == ""
    assert err.startswith("referee: 0 violations")


def test_a_violation_is_in_summary_report_and_exit_code(launch: Launch, tmp_path: Path) -> None:
    report = tmp_path / "report.json"
    process = launch("--json", "--strict", "--report", str(report))
    ports = ready(process)
    reply = ask(ports["motion"], ratio_point(0, (9.0,), 10.0))
    assert reply.reply_code == ReplyCode.FAILURE
    out, err = ended(process, signal.SIGINT)
    assert process.returncode == 1
    summary = json.loads(out)
    assert summary["event"] == "summary"
    assert summary["violations"] == 1
    assert summary["first"][0]["joint"] == "shoulder_pan_joint"
    assert json.loads(report.read_text())["by_kind"]["range"] == 1
    assert "Traceback" not in err


def test_the_executed_motion_is_recorded(launch: Launch, tmp_path: Path) -> None:
    record = tmp_path / "motion.csv"
    process = launch("--record", str(record), "--start", "zero", "--rate", "200")
    joints = (each for each in reports(ready(process)["state"]) if isinstance(each, JointPosition))
    assert len(list(islice(joints, 20))) == 20
    ended(process)
    rows = list(csv.DictReader(record.read_text().splitlines()))
    assert len(rows) > 10
    assert float(rows[0]["shoulder_pan_joint.position"]) == 0.0


def test_a_scenario_presses_the_emergency_stop(launch: Launch, tmp_path: Path) -> None:
    scenario = tmp_path / "scenario.toml"
    scenario.write_text("[[event]]\nat = 0.0\naction = 'emergency_stop'\n")
    process = launch("--scenario", str(scenario))
    ports = ready(process)
    heard = islice(reports(ports["state"]), 1_000)
    assert any(isinstance(each, Status) and each.e_stopped == 1 for each in heard)
    assert ask(ports["motion"], ratio_point(0, (0.0,), 5.0)).reply_code == ReplyCode.FAILURE


def test_keys_at_a_terminal_stop_reset_and_quit(launch: Launch) -> None:
    keyboard, terminal = pty.openpty()
    process = launch("--json", stdin=terminal)
    ready(process)
    os.write(keyboard, b"erq")
    out, _ = process.communicate(timeout=TIMEOUT_S)
    events = json.loads(out)["events"]
    assert (events["emergency-stops"], events["resets"]) == (1, 1)
    os.close(keyboard)
    os.close(terminal)


def test_a_port_in_use_is_one_line_and_an_exit_code(capsys: Capture) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
        assert main(["--motion-port", port, "--state-port", "0"]) == 3
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert port in err


@pytest.mark.parametrize(
    ("arguments", "words", "code"),
    [
        (["--robot", "no_such_robot"], "no_such_robot", 2),
        (["--robot", "stewart_classroom"], "stewart_classroom", 2),
        (["--start", "[0, 0]"], "2 joint values", 2),
        (["--start", "[0, 9, 0, 0, 0, 0]"], "outside its range", 2),
        (["--start", "nowhere"], "--start", 2),
        (["--rate", "1000"], "rate", 2),
        (["--config", "/nowhere.toml"], "/nowhere.toml", 2),
        (["--host", "203.0.113.1"], "203.0.113.1", 3),
        (["--record", "/nowhere/log.csv"], "/nowhere/log.csv", 1),
        (["--count", "0"], "expected 1 to 64", 2),
        (["--count", "65"], "expected 1 to 64", 2),
        (["--count", "3", "--motion-port", "65530"], "expected 1 to 2", 2),
        (["--count", "2", "--record", "motion.csv"], "expected 1 with --record", 2),
    ],
)
def test_what_cannot_be_started_is_one_line_and_an_exit_code(
    arguments: list[str], words: str, code: int, capsys: Capture
) -> None:
    assert main([*FREE_PORTS, *arguments]) == code
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert words in captured.err


def test_the_settings_in_effect_can_be_printed(capsys: Capture) -> None:
    assert main(["--print-config", "--rate", "50"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("[emulator]\n")
    assert "rate = 50" in out


@pytest.mark.parametrize(("host", "warnings"), [("0.0.0.0", 1), ("127.0.0.2", 0)])
def test_an_address_that_others_reach_is_told(launch: Launch, host: str, warnings: int) -> None:
    process = launch("--host", host)
    ready(process)
    _, err = ended(process)
    assert err.count("warning: whoever reaches") == warnings


def test_it_runs_without_a_standard_input() -> None:
    # The shell closes it: Popen can only redirect it.
    command = f"exec {sys.executable} -m {MODULE} {' '.join(FREE_PORTS)} <&-"
    pipe = subprocess.PIPE
    with subprocess.Popen(command, shell=True, stdout=pipe, stderr=pipe, text=True) as process:
        ready(process)
        _, err = ended(process)
    assert process.returncode == 0
    assert "Traceback" not in err


def test_one_process_runs_a_class_of_controllers(launch: Launch) -> None:
    process = launch("--count", "3", "--json", "--strict")
    assert process.stdout is not None
    controllers = json.loads(process.stdout.readline())["controllers"]
    assert len({port for at in controllers for port in at.values()}) == 6
    for at in controllers:
        with socket.create_connection(("127.0.0.1", at["state"]), TIMEOUT_S) as link:
            assert link.recv(4)
    out, _ = ended(process)
    summary = json.loads(out)
    assert summary["violations"] == 0
    assert len(summary["controllers"]) == 3
    assert process.returncode == 0
