"""Management operations, one topic a file: requests with their roles, and replies.

Importing this package imports every topic, so that the table of operations is whole.
"""

from . import (
    access,
    cell,
    frames,
    programs,
    recordings,
    robots,
    scene,
    signals,
    tools,
    trace,
    users,
)
from .declaration import OPERATIONS

__all__ = [
    "OPERATIONS",
    "access",
    "cell",
    "frames",
    "programs",
    "recordings",
    "robots",
    "scene",
    "signals",
    "tools",
    "trace",
    "users",
]
