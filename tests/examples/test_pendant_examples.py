"""Every pendant example runs as its page says, against a server and an emulated robot."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
SCALE = float(os.environ.get("OPENPENDANT_TIME_SCALE", "1"))
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")

PATIENT = """
[jog]
lead = 0.1
[modes]
enabling_deadline = 0.25
[watchdog]
deadline = 1.0
"""
"""A busy test machine must neither starve the controller in the middle of a jog nor latch a stop,
which would be the end of every example behind it."""

PRINTS = {
    "connect_and_jog.py": "let go: stood after",
    "pause_and_resume.py": "arrived at",
    "roboanalyzer_style.py": "Z from",
    "sync_notebook_style.py": "let go: JogAccount(",
    "taught_path.py": "ran through 3 positions",
    "two_keys.py": "and back to",
    "watch_state.py": "IDLE",
}
"""What each example says once it has done what it is about."""


def started(module: str, *arguments: str) -> tuple[subprocess.Popen[str], dict[str, int]]:
    process = subprocess.Popen(
        [sys.executable, "-m", module, *arguments, "--json"], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    return process, json.loads(process.stdout.readline())


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """The pendant port of a server with an emulated robot, one for all examples."""
    config = tmp_path_factory.mktemp("cell") / "cell.toml"
    config.write_text(PATIENT, encoding="utf-8")
    emulator, controller = started(
        "openpendant.controller_emulator",
        *("--robot", "ur5", "--start", "home", "--motion-port", "0", "--state-port", "0"),
    )
    server, ports = started(
        "openpendant.server",
        *("--robot", "ur5", "--config", str(config), "--pendant-port", "0"),
        *("--ros-motion-port", "0", "--ros-state-port", "0"),
        *("--controller", f"127.0.0.1:{controller['motion']}:{controller['state']}"),
        *("--signals", "openpendant"),
    )
    try:
        with SyncPendantClient.connect("127.0.0.1", ports["pendant"]) as pendant:
            pendant.wait_until(lambda state: state.motion_possible == 1, within=15 * SCALE)
        yield ports["pendant"]
    finally:
        for process in (server, emulator):
            process.terminate()
            process.communicate(timeout=10 * SCALE)


def run(*command: str) -> str:
    """Run an example to its end; return what it printed."""
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=40 * SCALE, check=False, cwd=EXAMPLES
    )
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_no_example_is_left_out() -> None:
    assert {path.name for path in EXAMPLES.glob("*.py")} == set(PRINTS)


@pytest.mark.parametrize("name", sorted(PRINTS))
def test_the_python_example_does_what_it_says(port: int, name: str) -> None:
    assert PRINTS[name] in run(sys.executable, name, str(port))


@pytest.fixture
def robot(port: int) -> Iterator[SyncPendantClient]:
    """A look at the robot before and after; resets the stop with which the examples end."""
    with SyncPendantClient.connect("127.0.0.1", port) as pendant:
        pendant.next_state()
        yield pendant
        pendant.take_control()
        pendant.reset_stop()


def has_jogged_and_stopped(robot: SyncPendantClient, before: float) -> bool:
    stopped = robot.wait_until(lambda state: state.stop == 1 and state.holder == 0)
    return 0.02 < stopped.positions[0] - before < 0.6


def test_sixty_lines_of_c_jog_a_joint_and_stop(
    port: int, robot: SyncPendantClient, tmp_path: Path
) -> None:
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler here")
    program = str(tmp_path / "pendant")
    source = str(EXAMPLES / "pendant.c")
    flags = ("-std=c99", "-O2", "-D_POSIX_C_SOURCE=200809L", *WARNINGS)
    assert run(compiler, *flags, "-o", program, source) == ""
    before = robot.joints()[0]
    assert "ms after the release" in run(program, str(port))
    assert has_jogged_and_stopped(robot, before)


def test_sixty_lines_of_javascript_jog_a_joint_and_stop(
    port: int, robot: SyncPendantClient
) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("no Node here")
    before = robot.joints()[0]
    assert "ms after the release" in run(node, "pendant.js", str(port))
    assert has_jogged_and_stopped(robot, before)


def test_an_example_in_another_language_says_why_it_was_refused(
    port: int, robot: SyncPendantClient
) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("no Node here")
    robot.take_control()
    refused = subprocess.run(
        [node, "pendant.js", str(port)],
        capture_output=True,
        text=True,
        timeout=20 * SCALE,
        check=False,
        cwd=EXAMPLES,
    )
    assert refused.returncode == 1
    assert refused.stderr.startswith("refused, code 5: ")


@pytest.mark.parametrize("name", ["pendant.c", "pendant.js"])
def test_a_pendant_in_another_language_stays_small(name: str) -> None:
    lines = (EXAMPLES / name).read_text("utf-8").splitlines()
    assert len([line for line in lines if line.strip()]) <= 75
