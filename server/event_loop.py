"""The event loop that the server runs on: Python's own, or uvloop where it is asked for.

Owns the choice, and that uvloop is imported for nobody else. Its clock and its timers count whole
milliseconds, and its transports are no `asyncio.Transport` by class. What runs on the loop must not
know which one it is. The emulator, which may be asked for another one than the server that drives
it, chooses by the same rule in a module of its own.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Literal

from openpendant.motion.errors import LibraryMissing

EventLoop = Literal["asyncio", "uvloop"]


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
