import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import pytest
from rigs.clock.busy_machine import PATIENCE, SCALE
from rigs.data.foreign_robots import FOREIGN
from rigs.data.urdf_files import written
from rigs.processes.marked_processes import left_over, processes_marked

from openpendant.motion.cli.robots import main as robots
from openpendant.tools.child_processes import Interruptions
from openpendant.tools.packets.rerun import main as rerun

pytestmark = pytest.mark.realtime

Demos = dict[str, tuple[subprocess.Popen[str], Path]]


def run_demo(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "openpendant.tools", "demo", *arguments],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=110,
        check=False,
    )


@pytest.mark.soak
def test_an_imported_arm_of_four_axes_does_what_it_can(tmp_path: Path) -> None:
    robot = tmp_path / "four_axes.yaml"
    urdf = written(tmp_path, FOREIGN["flat_arm"].urdf)
    assert robots(["import", str(urdf), "--yes", "-o", str(robot)]) == 0
    demo = run_demo("--robot", str(robot), "--output", str(tmp_path))
    assert demo.returncode == 0, demo.stderr
    assert "one of them through 8 taught poses" in demo.stdout
    assert "0 violations" in demo.stdout


def test_an_unknown_robot_ends_the_demo_with_a_sentence(tmp_path: Path) -> None:
    demo = run_demo("--robot", "nobody", "--output", str(tmp_path))
    assert demo.returncode == 1
    assert "nobody" in demo.stderr
    assert "Traceback" not in demo.stderr


@pytest.mark.parametrize("reason", ["a file", "below a file"])
def test_an_output_that_cannot_be_written_is_told_before_anything_starts(
    reason: str, tmp_path: Path
) -> None:
    (tmp_path / "file").touch()
    output = tmp_path / "file" if reason == "a file" else tmp_path / "file" / "folder"
    demo = run_demo("--robot", "nobody", "--output", str(output))
    assert demo.returncode == 1
    assert demo.stderr.startswith(f"openpendant demo: cannot write to the folder {output}: ")
    assert demo.stderr.count("\n") == 1


@pytest.fixture
def mark(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    monkeypatch.setenv("OPENPENDANT_DEMO_TEST", str(tmp_path))
    mark = f"OPENPENDANT_DEMO_TEST={tmp_path}"
    # Tests in the background of a shell inherit an ignored SIGINT, those under nohup an ignored
    # SIGHUP, and would hand it down. What is handled here has its default in the demo.
    before = [
        (signal.SIGINT, signal.signal(signal.SIGINT, signal.default_int_handler)),
        (signal.SIGHUP, signal.signal(signal.SIGHUP, lambda number, frame: None)),
    ]
    yield mark
    for number, handler in before:
        signal.signal(number, handler)
    for pid in processes_marked(mark).keys() - {os.getpid()}:
        os.kill(pid, signal.SIGKILL)


def start_demo(output: Path) -> subprocess.Popen[str]:
    with (output / "stderr").open("w") as stderr:
        return subprocess.Popen(
            [sys.executable, "-m", "openpendant.tools", "demo", "--output", str(output)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=stderr,
            text=True,
            start_new_session=True,
        )


def wait_for_part(mark: str, part: str) -> None:
    deadline = time.monotonic() + PATIENCE
    while not any(part in command for command in processes_marked(mark).values()):
        assert time.monotonic() < deadline, f"{part} does not start"
        time.sleep(0.05)


@pytest.fixture
def demo(part: str, tmp_path: Path, mark: str) -> subprocess.Popen[str]:
    """A demo of which one part is the last one that was started."""
    process = start_demo(tmp_path)
    wait_for_part(mark, part)
    return process


linux_only = pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc")
PARTS = ["controller_emulator", "openpendant.server", "demo_pendant"]


PAIRS = [
    (signal.SIGINT, PARTS[0]),
    (signal.SIGTERM, PARTS[1]),
    (signal.SIGHUP, PARTS[2]),
    (signal.SIGINT, PARTS[2]),
]
"""Each signal, while each of the parts is the last one that runs; all others in the soak."""


@linux_only
@pytest.mark.parametrize(
    ("number", "part"),
    [
        pytest.param(*pair, marks=() if pair in PAIRS else pytest.mark.soak)
        for pair in product([signal.SIGINT, signal.SIGTERM, signal.SIGHUP], PARTS)
    ],
)
def test_a_signal_ends_the_demo_and_all_its_processes(
    demo: subprocess.Popen[str], number: signal.Signals, tmp_path: Path, mark: str
) -> None:
    os.killpg(demo.pid, number)  # as a terminal does with Ctrl-C
    assert demo.wait(PATIENCE) == 128 + number
    assert left_over(mark, PATIENCE) == {}
    assert "Traceback" not in (tmp_path / "stderr").read_text()


def test_a_signal_that_is_ignored_stays_ignored_as_nohup_wants() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with Interruptions().installed():
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
            assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)


@linux_only
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("part", PARTS[:1])
def test_a_signal_in_the_middle_ends_it_at_once(
    demo: subprocess.Popen[str], number: signal.Signals, tmp_path: Path, mark: str
) -> None:
    time.sleep(1.5 * SCALE)
    for _ in range(2):  # a second Ctrl-C must not break the unwinding
        demo.send_signal(number)
        time.sleep(0.02)
    assert demo.wait(PATIENCE) == 128 + number
    assert left_over(mark, PATIENCE) == {}
    assert "Traceback" not in (tmp_path / "stderr").read_text()


@linux_only
@pytest.mark.parametrize(
    ("part", "later"),
    [
        *((part, 0.1) for part in PARTS),
        # A server whose controller has gone waits two seconds for the robot to come to rest.
        pytest.param(PARTS[-1], 0.5, marks=pytest.mark.soak),
    ],
)
def test_a_demo_that_is_killed_leaves_no_process(
    demo: subprocess.Popen[str], later: float, tmp_path: Path, mark: str
) -> None:
    time.sleep(later)
    demo.kill()
    demo.wait()
    assert left_over(mark, PATIENCE) == {}
    assert "Traceback" not in (tmp_path / "stderr").read_text()


def start_whole_demo(robot: str, output: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [
            *(sys.executable, "-m", "openpendant.tools", "demo"),
            *("--robot", robot, "--output", str(output)),
        ],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.fixture(scope="module", autouse=True)
def begun(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Demos]:
    """A demo of the ur5 that runs beside the tests before the one that looks at it."""
    output = tmp_path_factory.mktemp("demo")
    process = start_whole_demo("ur5", output)
    yield {"ur5": (process, output)}
    if process.poll() is None:
        process.terminate()
    process.communicate(timeout=PATIENCE)


@pytest.mark.parametrize(
    "robot",
    [
        "ur5",
        pytest.param("abb_irb2400", marks=pytest.mark.soak),
        pytest.param("kawasaki_ra10n", marks=pytest.mark.soak),
    ],
)
@pytest.mark.timeout(360)
def test_the_demo_moves_the_robot_and_leaves_a_plot_and_a_table(
    robot: str, tmp_path: Path, begun: Demos
) -> None:
    if robot not in begun:  # one that is not begun beside the others, or a second attempt
        begun[robot] = start_whole_demo(robot, tmp_path), tmp_path
    demo, output = begun.pop(robot)
    said, complaints = demo.communicate(timeout=110)
    assert demo.returncode == 0, complaints
    assert "0 violations" in said
    assert (output / f"demo-{robot}.png").read_bytes().startswith(b"\x89PNG")
    assert (output / f"demo-{robot}.csv").read_text().startswith("kind,motion,time,")
    journals = [str(output / f"demo-{robot}-{part}.journal") for part in ("server", "emulator")]
    assert rerun(journals) == 0
