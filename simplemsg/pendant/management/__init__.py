"""Management operations, one topic a file: requests with their roles, and replies.

Importing this package imports every topic, so that the table of operations is whole.
"""

from . import access, cell, devices, frames, positions, programs, recordings, scene
from .declaration import OPERATIONS

__all__ = [
    "OPERATIONS",
    "access",
    "cell",
    "devices",
    "frames",
    "positions",
    "programs",
    "recordings",
    "scene",
]
