"""Keys of the operator at the terminal that runs the emulator.

Owns the terminal's mode while they are watched. Does nothing where standard input is no terminal.
"""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

EMERGENCY_STOP, RESET, QUIT = "e", "r", "q"


@contextmanager
def watched_keys(actions: Mapping[str, Callable[[], None]]) -> Iterator[bool]:
    """Call an action for each key that is pressed, while the context lasts.

    Args:
        actions: what to call, by key.

    Yields:
        Whether there is a terminal to watch.
    """
    # A process that was started with its standard input closed has none at all.
    if sys.platform == "win32" or sys.stdin is None or not sys.stdin.isatty():
        yield False
        return
    import termios
    import tty

    terminal = sys.stdin.fileno()
    loop = asyncio.get_running_loop()

    def read() -> None:
        typed = os.read(terminal, 64).decode("ascii", "replace")
        if not typed:
            loop.remove_reader(terminal)
        for key in typed:
            if key in actions:
                actions[key]()

    before = termios.tcgetattr(terminal)
    tty.setcbreak(terminal)
    loop.add_reader(terminal, read)
    try:
        yield True
    finally:
        loop.remove_reader(terminal)
        termios.tcsetattr(terminal, termios.TCSADRAIN, before)
