"""The server's place among the other programs of its machine.

A tick that comes late because a browser or a test run has the processor is as late as any other:
the robot runs out of set-points and stops. So the server asks the system to run before ordinary
programs. Planning workers stay behind them (`planning.process`).
"""

from __future__ import annotations

import logging
import os

log = logging.getLogger(__name__)


def ask_for_niceness(niceness: int) -> None:
    """Ask the system for a scheduling priority; what it denies is logged, and the server goes on.

    Args:
        niceness: -20, before all others, to 19, after all others (POSIX `setpriority`).
    """
    try:
        os.setpriority(os.PRIO_PROCESS, 0, niceness)
    except PermissionError:
        kept = os.getpriority(os.PRIO_PROCESS, 0)
        log.info("the system does not allow niceness %d; it stays at %d", niceness, kept)
