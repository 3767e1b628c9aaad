"""Ends the pendant when its terminal has gone: a window that was closed, a line that dropped.

Owns the watch on the terminal. Where it is the controlling terminal, the kernel sends SIGHUP, which
ends a process; where it is not, nothing is sent: reading gives nothing for ever, and the thread
that draws has died and blocks the event loop. So a thread of its own watches, and sends that
signal. The end of the process closes the connection, and the server stops what it moved and takes
the motion authority back.
"""

from __future__ import annotations

import os
import select
import signal
import sys
import threading
from collections.abc import Callable, Sequence


def end_with_terminal(descriptors: Sequence[int]) -> None:
    """Let this process end as by SIGHUP once one of its terminals has gone.

    Call it in the main thread. On Windows it does nothing: there a console that is closed ends its
    processes.

    Args:
        descriptors: open on the terminals.
    """
    if sys.platform == "win32":
        return
    # One that was started with the signal ignored would never end.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    watch = threading.Thread(
        target=watch_terminals,
        args=(tuple(descriptors), lambda: os.kill(os.getpid(), signal.SIGHUP)),
        name="terminal-watch",
        daemon=True,
    )
    watch.start()


def watch_terminals(descriptors: Sequence[int], gone: Callable[[], None]) -> None:
    """Wait until a terminal has hung up, then tell it once; not on Windows.

    Returns without a word where the platform cannot watch a terminal.

    Args:
        descriptors: open on the terminals.
        gone: called in this thread.
    """
    poll = select.poll()
    for descriptor in descriptors:
        poll.register(descriptor, 0)  # hang-ups and errors are told unasked
    events = [event for _, event in poll.poll()]
    if any(event & (select.POLLHUP | select.POLLERR) for event in events):
        gone()
