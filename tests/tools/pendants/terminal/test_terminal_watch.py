"""The watch on the terminal."""

import os
import sys
import threading
from collections.abc import Iterator

import pytest

from openpendant.tools.pendants.terminal.cli import watch_terminals

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform == "win32", reason="a console that is closed ends its process"),
]

PATIENCE = 10.0
"""How long a busy machine may take over what takes no time [s]."""


@pytest.fixture
def ends() -> Iterator[tuple[int, int]]:
    """Both ends of a terminal: of the window, which the test closes, and of the process."""
    window, process = os.openpty()
    yield window, process
    os.close(process)


def test_a_terminal_that_hangs_up_is_told_once_and_keys_are_not(ends: tuple[int, int]) -> None:
    window, process = ends
    gone = threading.Event()
    watch = threading.Thread(target=watch_terminals, args=([process], gone.set), daemon=True)
    watch.start()
    os.write(window, b"qqq\n")
    assert not gone.wait(0.1)
    os.close(window)
    assert gone.wait(PATIENCE)
    watch.join(PATIENCE)
    assert not watch.is_alive()


def test_one_of_two_terminals_is_enough(ends: tuple[int, int]) -> None:
    window, process = ends
    other_window, other = os.openpty()
    gone = threading.Event()
    os.close(window)
    watch_terminals([other, process], gone.set)
    assert gone.is_set()
    os.close(other_window)
    os.close(other)
