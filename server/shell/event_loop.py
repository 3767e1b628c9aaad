"""The event loop that the server runs on, and its process's scheduling priority.

Owns the choice between Python's own loop and uvloop, and that uvloop is imported only where it is
asked for. Its clock and its timers count whole milliseconds, and its transports are no
`asyncio.Transport` by class. What runs on the loop must not know which one it is. The emulator,
which may be asked for another one than the server that drives it, chooses by the same rule in a
module of its own.

Owns the priority that the server asks the system for. A tick that comes late because a browser or a
test run has the processor is as late as any other: the robot runs out of set-points and stops. So
the server asks to run before ordinary programs. Planning processes stay behind them
(`planning_process`).
"""

from __future__ import annotations

import asyncio
import logging
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from openpendant.motion.errors import LibraryMissing

from ..settings.cell_settings import EventLoop


def loop_factory(wanted: EventLoop) -> Callable[[], asyncio.AbstractEventLoop] | None:
    """Return what makes the event loop, as `asyncio.Runner` takes it; None for Python's own.

    Raises:
        LibraryMissing: uvloop is not installed.
    """
    if wanted == "asyncio":
        return None
    try:
        import uvloop
    except ImportError:
        raise LibraryMissing("uvloop", "fast") from None
    return uvloop.new_event_loop


log = logging.getLogger(__name__)


@contextmanager
def asked_niceness(niceness: int) -> Iterator[None]:
    """Ask the system for a scheduling priority; what it denies is logged, and the server goes on.

    Args:
        niceness: -20, before all others, to 19, after all others (POSIX `setpriority`).
    """
    before = os.getpriority(os.PRIO_PROCESS, 0)
    try:
        os.setpriority(os.PRIO_PROCESS, 0, niceness)
    except PermissionError:
        log.info("the system does not allow niceness %d; it stays at %d", niceness, before)
    try:
        yield
    finally:
        # Only down again: who was denied a higher priority is denied the way back up as well.
        if before > os.getpriority(os.PRIO_PROCESS, 0):
            os.setpriority(os.PRIO_PROCESS, 0, before)
