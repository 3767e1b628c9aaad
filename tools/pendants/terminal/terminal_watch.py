"""Watch on the terminal: ends the pendant when its window was closed or its line dropped.

For a controlling terminal the kernel sends SIGHUP, which ends the process. For any other terminal
it sends nothing: reads return no data for ever, and the drawing thread has died and blocks the
event loop. Therefore a separate thread polls the terminals and sends that signal. The end of the
process closes the connection; the server then stops the robot and releases the motion authority.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Sequence


def end_with_terminal(descriptors: Sequence[int]) -> None:
    """End this process by SIGHUP once one of its terminals has hung up.

    Call it in the main thread. On Windows it does nothing: closing a console ends its processes
    there.

    Args:
        descriptors: open on the terminals.
    """
    if sys.platform == "win32":
        return
    # nohup starts a process with SIGHUP ignored; such a process would never end.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    watch = threading.Thread(
        target=watch_terminals,
        args=(tuple(descriptors), lambda: os.kill(os.getpid(), signal.SIGHUP)),
        name="terminal-watch",
        daemon=True,
    )
    watch.start()


def watch_terminals(descriptors: Sequence[int], gone: Callable[[], None]) -> None:
    """Wait until a terminal has hung up, then call `gone` once; not on Windows.

    Returns without calling `gone` where the platform cannot watch a terminal.

    Args:
        descriptors: open on the terminals.
        gone: called in this thread.
    """
    poll = select.poll()
    for descriptor in descriptors:
        poll.register(descriptor, 0)  # poll reports hang-ups and errors without a mask
    events = [event for _, event in poll.poll()]
    if any(event & (select.POLLHUP | select.POLLERR) for event in events):
        gone()
