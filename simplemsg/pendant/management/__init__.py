"""Management operations, one topic a file: requests with their roles, and replies.

Importing this package imports every topic, so that the table of operations is whole.
"""

from . import access, cell, devices, frames, kinematics, programs, recordings, scene, shapes
from .declaration import OPERATIONS

__all__ = [
    "OPERATIONS",
    "access",
    "cell",
    "devices",
    "frames",
    "kinematics",
    "programs",
    "recordings",
    "scene",
    "shapes",
]
