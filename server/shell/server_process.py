"""Process of the server: the event loop that it runs on, its scheduling priority, its open files.

Owns the choice between Python's own loop and uvloop, and that uvloop is imported only where it is
asked for. Its clock and its timers count whole milliseconds, and its transports are no
`asyncio.Transport` by class. What runs on the loop must not know which one it is. The emulator,
which may be asked for another one than the server that drives it, chooses by the same rule in a
module of its own.

Owns the priority that the server asks the system for. A tick that comes late because a browser or
a test run has the processor is as late as any other: the robot runs out of set-points and stops.
So the server asks to run before ordinary programs. Planning processes stay behind them
(`planning_process`).

Owns how many files and sockets a server may need open (promise 21). Asked once at start: a server
that finds out only when the last pendant of a class connects is of no use to it.
"""

from __future__ import annotations

import asyncio
import logging
import os
import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from openpendant.motion.errors import LibraryMissing

from ..access.arrivals import MOST_WAITING
from ..access.places import MOST_STOP_PLACES, MOST_STRANGERS
from ..settings.cell_settings import EventLoop
from ..settings.config_file import ConfigurationError
from ..settings.server_settings import ServerSettings
from .clients import MOST_TURNED_AWAY
from .first_frames import MOST_AWAITED
from .listening import BACKLOG

log = logging.getLogger(__name__)


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


_PER_CELL = 8
"""Three connections to the controller, two listening sockets, and what it plans and keeps."""

_FOR_ALL = 64
"""Standard streams, the loop, libraries, the store, logs, pipes to planners and watchdog."""


def files_needed(settings: ServerSettings) -> int:
    """Return how many descriptors may be open at once, every place taken."""
    connections = settings.cells[0].listen.max_connections
    # Those that wait to be let in, agree on TLS, or wait for their answer, have no place yet, or
    # none any more. Of this machine and of others so many may wait.
    passing = MOST_WAITING + BACKLOG + MOST_STRANGERS + MOST_TURNED_AWAY + MOST_STOP_PLACES
    if settings.cells[0].gateways:
        passing += MOST_AWAITED
    return connections + passing + _PER_CELL * len(settings.cells) + _FOR_ALL


def provide_files(settings: ServerSettings, source: str) -> None:
    """Make sure that so many may be open, raising the soft limit where it is too low.

    Args:
        source: file name for the message.

    Raises:
        ConfigurationError: the hard limit is too low; says what would be accepted.
    """
    needed = files_needed(settings)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft == resource.RLIM_INFINITY or soft >= needed:
        return
    if hard != resource.RLIM_INFINITY and hard < needed:
        asked = settings.cells[0].listen.max_connections
        most = hard - (needed - asked)
        fewer = f"at most {most} connections, or " if most > 0 else ""
        problem = (
            f"{asked} connections need {needed} open files, and the system allows {hard}; "
            f"accepted: {fewer}a higher limit (ulimit -Hn)"
        )
        raise ConfigurationError(source, "listen.max_connections", problem)
    resource.setrlimit(resource.RLIMIT_NOFILE, (needed, hard))
