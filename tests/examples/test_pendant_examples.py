"""Every pendant example runs as its page says, against a server and an emulated robot."""

import re
import runpy
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from rigs.clock.busy_machine import PATIENCE, PATIENT, SCALE
from rigs.processes.warm_start import warm

from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = pytest.mark.realtime

EXAMPLES = Path(__file__).parent.parent.parent / "examples"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")

PRINTS = {
    "connect_and_jog.py": "let go: stood after",
    "move_to_pose.py": "reached the pose in frame",
    "pause_and_resume.py": "arrived at",
    "pick_and_place.py": "this is for a kawasaki_ra10n, and the server has a ur5",
    "plan_and_execute.py": "samples, ",
    "record_and_play.py": "played back in",
    "roboanalyzer_style.py": "Z from",
    "sync_notebook_style.py": "let go: JogAccount(",
    "taught_path.py": "ran through 3 positions",
    "teach_a_program.py": "of 'five points'",
    "two_keys.py": "and back to",
    "watch_state.py": "IDLE",
}
"""What each example says once it has done what it is about."""

OF_ANOTHER_ROBOT = {"pick_and_place.py"}
"""What it does with its own robot is told by a file of tests of its own."""

IN_A_PROCESS = ("connect_and_jog.py", "sync_notebook_style.py", "watch_state.py")
"""One with each client, asyncio's and the blocking one, and the one that only looks on; the others
run here, without an interpreter of their own to be started."""


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """The pendant port of a server with an emulated robot, one for all examples."""
    folder = tmp_path_factory.mktemp("cell")
    config = folder / "cell.toml"
    config.write_text(PATIENT, encoding="utf-8")
    with ExitStack() as stack:
        controller = stack.enter_context(
            warm(
                "openpendant.controller_emulator",
                *("--robot", "ur5", "--start", "home", "--motion-port", "0", "--state-port", "0"),
            )
        )()
        ports = stack.enter_context(
            warm(
                "openpendant.server",
                *("--robot", "ur5", "--config", str(config), "--pendant-port", "0"),
                *("--ros-motion-port", "0", "--ros-state-port", "0"),
                *("--controller", f"127.0.0.1:{controller['motion']}:{controller['state']}"),
                *("--signals", "openpendant", "--store", str(folder / "store.db")),
            )
        )()
        with SyncPendantClient.connect("127.0.0.1", ports["pendant"]) as pendant:
            pendant.wait_until(lambda state: state.motion_possible == 1, within=PATIENCE)
        yield ports["pendant"]


def ended(*command: str) -> tuple[int, str, str]:
    """Run a command to its end; return its exit code and what it said on its two outputs."""
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=80 * SCALE, check=False, cwd=EXAMPLES
    )
    return done.returncode, done.stdout, done.stderr


def run(*command: str) -> str:
    code, said, complained = ended(*command)
    assert (code, complained) == (0, "")
    return said


@pytest.mark.usefixtures("programs_imported")
def test_no_example_is_left_out() -> None:
    assert {path.name for path in EXAMPLES.glob("*.py")} == set(PRINTS)


def run_here(name: str, port: int, monkeypatch: pytest.MonkeyPatch) -> str:
    """Run a Python example to its end in this process; return with what it exited, else nothing."""
    monkeypatch.setattr(sys, "argv", [name, str(port)])
    try:
        runpy.run_path(str(EXAMPLES / name), run_name="__main__")
    except SystemExit as ended:
        return str(ended.code)
    return ""


@pytest.mark.parametrize("name", sorted(set(PRINTS) - {"watch_state.py"}))
def test_an_example_says_in_one_line_that_somebody_else_moves_the_robot(
    port: int, robot: SyncPendantClient, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot.take_control()
    said = run_here(name, port, monkeypatch)
    assert said.startswith("HELD_BY_OTHER: ")
    assert CATALOGUE[VerdictCode.HELD_BY_OTHER].remedy in said
    assert "\n" not in said


@pytest.mark.parametrize("name", IN_A_PROCESS)
def test_a_python_example_is_a_program_that_does_what_it_says(port: int, name: str) -> None:
    assert PRINTS[name] in run(sys.executable, name, str(port))


@pytest.mark.parametrize("name", sorted(set(PRINTS) - set(IN_A_PROCESS) - OF_ANOTHER_ROBOT))
def test_a_python_example_does_what_it_says(
    port: int, name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_here(name, port, monkeypatch) == ""
    said = capsys.readouterr()
    assert PRINTS[name] in said.out
    assert said.err == ""


@pytest.mark.parametrize("name", sorted(OF_ANOTHER_ROBOT))
def test_an_example_for_another_robot_says_so_and_moves_nothing(
    port: int, robot: SyncPendantClient, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = robot.next_state().positions
    assert run_here(name, port, monkeypatch) == PRINTS[name]
    assert robot.next_state().positions == before


@pytest.mark.parametrize("name", ["record_and_play.py", "teach_a_program.py"])
def test_what_an_example_keeps_is_in_nobody_s_way_when_it_runs_again(
    port: int, name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_here(name, port, monkeypatch) == ""
    assert PRINTS[name] in capsys.readouterr().out


@pytest.mark.parametrize("name", sorted(PRINTS))
def test_without_a_server_an_example_says_in_one_line_how_to_start_one(
    name: str, unused_tcp_port: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    said = run_here(name, unused_tcp_port, monkeypatch)
    assert said.startswith(f"nobody listens at 127.0.0.1:{unused_tcp_port}; start a server: ")
    assert "\n" not in said


def test_an_example_that_fails_says_so_and_nothing_else(unused_tcp_port: int) -> None:
    code, said, complained = ended(sys.executable, "connect_and_jog.py", str(unused_tcp_port))
    assert (code, said) == (1, "")
    assert complained.startswith(f"nobody listens at 127.0.0.1:{unused_tcp_port}; ")
    assert complained.count("\n") == 1


@pytest.fixture
def robot(port: int) -> Iterator[SyncPendantClient]:
    """A look at the robot before and after."""
    with SyncPendantClient.connect("127.0.0.1", port) as pendant:
        pendant.next_state()
        yield pendant


def installed(program: str) -> str:
    """Return where a program is, or skip the test."""
    found = shutil.which(program)
    return found or pytest.skip(f"no {program} here")


def jogs_stops_and_resets(robot: SyncPendantClient, *command: str) -> bool:
    """Run a pendant; tell whether it moved joint 1, latched a stop and left none behind."""
    stops: list[int] = []
    robot.background.on_stop = lambda change: stops.append(change.stop)
    before = robot.joints()[0]
    assert "ms after the release" in run(*command)
    after = robot.wait_until(lambda state: state.stop == 0 and state.holder == 0)
    return 0.02 < after.positions[0] - before < 0.6 and stops == [1, 0]


def test_sixty_lines_of_c_jog_a_joint_stop_and_reset_as_often_as_they_run(
    port: int, robot: SyncPendantClient, tmp_path: Path
) -> None:
    compiler = installed("cc")
    program = str(tmp_path / "pendant")
    source = str(EXAMPLES / "pendant.c")
    flags = ("-std=c99", "-O2", "-D_POSIX_C_SOURCE=200809L", *WARNINGS)
    assert run(compiler, *flags, "-o", program, source) == ""
    for _ in range(2):
        assert jogs_stops_and_resets(robot, program, str(port))


@pytest.mark.parametrize("time", ["once", "again"])
def test_sixty_lines_of_javascript_jog_a_joint_stop_and_reset_as_often_as_they_run(
    port: int, robot: SyncPendantClient, time: str
) -> None:
    assert jogs_stops_and_resets(robot, installed("node"), "pendant.js", str(port)), time


def test_refused_examples_in_other_languages_say_why(port: int, robot: SyncPendantClient) -> None:
    node = installed("node")
    robot.take_control()
    code, _, complained = ended(node, "pendant.js", str(port))
    assert code == 1
    assert complained.startswith("refused, code 5: ")


COMMENTS = {"pendant.c": r"/\*.*?\*/", "pendant.js": r"(?m)^\s*//.*$"}


@pytest.mark.parametrize("name", COMMENTS)
def test_a_pendant_in_another_language_has_sixty_lines_of_code(name: str) -> None:
    source = (EXAMPLES / name).read_text("utf-8")
    code = re.sub(COMMENTS[name], "", source, flags=re.DOTALL if name.endswith(".c") else 0)
    assert len([line for line in code.splitlines() if line.strip()]) <= 60
    assert max(map(len, source.splitlines())) <= 100
