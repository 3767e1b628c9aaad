"""The server's place among the other programs of its machine.

A tick that comes late because a browser or a test run has the processor is as late as any other:
the robot runs out of set-points and stops. So the server asks the system to run before ordinary
programs. Planning workers stay behind them (`planning.process`).
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager

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
