"""`openpendant start`: processes that come and go together, and the first jog of a newcomer."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest
from rigs.clock.busy_machine import PATIENCE
from rigs.processes.marked_processes import left_over, processes_marked
from rigs.processes.terminal_window import TerminalWindow

from openpendant.tools.start import ARGUMENTS_OF_AN_EMULATED_CELL, EmulatedCell

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc"),
]

Open = Callable[..., TerminalWindow]


@pytest.fixture
def mark(tmp_path: Path) -> str:
    return marked(tmp_path)


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Open]:
    """Open a window of a terminal with a command in it."""
    with windows(tmp_path) as opens:
        yield opens


def marked(folder: Path) -> str:
    return f"OPENPENDANT_START_TEST={folder}"


@contextmanager
def windows(folder: Path) -> Iterator[Open]:
    """Leave nothing of what is opened in a folder."""
    opened: list[TerminalWindow] = []
    name, _, value = marked(folder).partition("=")

    def open_window(*command: str) -> TerminalWindow:
        environment = {name: value, "XDG_DATA_HOME": str(folder / "data")}
        opened.append(TerminalWindow(list(command), environment=environment, folder=folder))
        return opened[-1]

    yield open_window
    for window in opened:
        window.close()
    for pid in processes_marked(marked(folder)):
        os.kill(pid, signal.SIGKILL)


FAKE = """
import functools, pathlib, signal, sys
# Whoever runs the tests may ignore it, as `nohup` does, and would hand that down.
signal.signal(signal.SIGHUP, signal.SIG_DFL)
from openpendant.tools.start import EmulatedCell, run, run_to_its_end

def part(name, says, ends="time.sleep(60)"):
    return [sys.executable, "-c", f"import os, sys, time, tty; print({says!r}, flush=True); {ends}"]

class Fake(EmulatedCell):
    def emulator_command(self):
        return part("emulator", '{"motion": 1, "state": 2}')
    def server_command(self, motion, state):
        assert (motion, state) == (1, 2)
        return part("server", '{"pendant": 4711}', SERVER)
    def pendant_command(self, port):
        return part("pendant", "the pendant is here", "tty.setraw(0); " + PENDANT)

cell = Fake("ur5", 0, 0, 0, "off", pathlib.Path("."))
sys.exit(run_to_its_end(cell, functools.partial(run, cell), "all three"))
"""
"""A cell whose parts only stand there: as quick as processes are, and ended in any way."""

STANDS = "time.sleep(60)"


def fake(server: str = STANDS, pendant: str = STANDS) -> tuple[str, ...]:
    script = FAKE.replace("SERVER", repr(server)).replace("PENDANT", repr(pendant))
    return sys.executable, "-c", script


def stands_there(window: TerminalWindow, mark: str) -> dict[str, int]:
    """Wait until all parts run; return the id of each process."""
    window.until(lambda shown: "the pendant is here" in shown)
    words = {"emulator": '"motion"', "server": '"pendant"', "pendant": "is here"}
    found = processes_marked(mark).items()
    return {
        part: next(pid for pid, command in found if word in command and "Fake" not in command)
        for part, word in words.items()
    }


def test_the_end_of_the_pendant_is_the_end_of_all(opened: Open, mark: str) -> None:
    window = opened(*fake(pendant="time.sleep(0.2)"))
    assert window.ended() == 0
    assert left_over(mark, PATIENCE) == {}
    assert window.is_as_before
    window.until(lambda shown: "all three have ended" in shown)
    assert "another pendant: " in window.raw
    assert "openpendant pendant 127.0.0.1:4711" in window.raw


@pytest.mark.parametrize("part", ["emulator", "server", "pendant"])
def test_a_part_that_is_killed_takes_the_others_with_it(part: str, opened: Open, mark: str) -> None:
    window = opened(*fake())
    os.kill(stands_there(window, mark)[part], signal.SIGKILL)
    assert window.ended() == 1
    assert left_over(mark, PATIENCE) == {}
    assert window.is_as_before
    shown = window.until(lambda shown: "all three have ended" in shown)
    assert shown.count("openpendant start: ") == 1
    assert f"openpendant start: the {part} ended with SIGKILL" in shown


def test_a_server_that_cannot_start_is_told_with_its_own_words(opened: Open, mark: str) -> None:
    words = "sys.stderr.write('port 11010 is taken\\n'); sys.exit(3)"
    window = opened(*fake(server=words))
    assert window.ended() == 1
    shown = window.until(lambda shown: "all three have ended" in shown)
    assert "the server ended with exit code 3: port 11010 is taken" in shown
    assert left_over(mark, PATIENCE) == {}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_all_three(number: signal.Signals, opened: Open, mark: str) -> None:
    window = opened(*fake())
    stands_there(window, mark)
    window.process.send_signal(number)
    assert window.ended() == 128 + number
    assert left_over(mark, PATIENCE) == {}
    assert window.is_as_before
    assert "Traceback" not in window.raw


def test_a_command_that_is_killed_leaves_no_process(opened: Open, mark: str) -> None:
    window = opened(*fake())
    stands_there(window, mark)
    window.process.kill()
    assert left_over(mark, PATIENCE) == {}


def start(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "openpendant.tools", "start", *arguments],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        check=False,
    )


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--robot", "ur55"), "did you mean ur5?"),
        (("--pendant-port", "70000"), "accepted: 0 to 65535"),
        ((), "no terminal"),
    ],
)
def test_what_cannot_be_started_is_one_line_before_anything_starts(
    arguments: tuple[str, ...], told: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    done = start(*arguments)
    assert done.returncode == 2
    assert told in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_the_cell_starts_in_t1_and_is_never_taken_for_a_real_one(tmp_path: Path) -> None:
    cell = EmulatedCell('a "b".yaml', 0, 0, 0, "off", tmp_path)
    assert cell.written() == 'robot = "a \\"b\\".yaml"\n\n[modes]\ninitial = "manual_reduced"\n'
    command = cell.server_command(12000, 12002)
    assert command[-len(ARGUMENTS_OF_AN_EMULATED_CELL) :] == [*ARGUMENTS_OF_AN_EMULATED_CELL]
    assert "127.0.0.1:12000:12002" in command


@dataclass
class Newcomer:
    """A window of 80 columns and 24 rows with the real parts in it, and their mark."""

    window: TerminalWindow
    mark: str


@pytest.fixture(scope="module")
def newcomer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Newcomer]:
    folder = tmp_path_factory.mktemp("newcomer")
    with windows(folder) as opens:
        window = opens(
            *(sys.executable, "-m", "openpendant.tools", "start"),
            *("--robot", "ur5", "--pendant-port", "0", "--store", "off", "--logs", "logs"),
        )
        yield Newcomer(window, marked(folder))


def test_a_newcomer_is_told_how_another_pendant_comes_in(newcomer: Newcomer) -> None:
    window = newcomer.window  # whose pendant soon takes all of the screen
    window.until(lambda _: re.search(r"another pendant: .* pendant 127\.0\.0\.1:\d", window.raw))


def test_a_newcomer_is_shown_the_first_key(newcomer: Newcomer) -> None:
    newcomer.window.until(lambda shown: "c takes control" in shown)


def test_a_newcomer_jogs_after_three_keys_that_the_screen_names(newcomer: Newcomer) -> None:
    """The screen names each key before it is struck."""
    window = newcomer.window
    window.until(lambda shown: "c takes control" in shown)
    window.strike("c")
    window.until(lambda shown: "v holds" in shown and "c takes control" not in shown)
    window.strike("v")
    window.until(lambda shown: "1:q/a" in shown and "HELD" in shown)
    window.strike("q")
    window.until(lambda shown: "1 Base             0.50 °" in shown)


def test_a_newcomer_leaves_and_all_three_have_ended(newcomer: Newcomer) -> None:
    window = newcomer.window
    window.until(lambda shown: "Base" in shown)
    window.strike("\x11")
    assert window.ended() == 0
    assert window.is_as_before
    assert left_over(newcomer.mark, PATIENCE) == {}
    assert "cell file and logs: logs" in window.until(lambda shown: "all three" in shown)
