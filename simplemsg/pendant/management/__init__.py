"""Management operations, one topic a file: requests with their roles, and replies.

Importing this package imports every topic, so that the table of operations is whole.
"""

from . import (
    access,
    catalogue,
    cell,
    controller,
    devices,
    frames,
    kinematics,
    plans,
    positions,
    programs,
    recordings,
    scene,
    shapes,
)
from .declaration import OPERATIONS

__all__ = [
    "OPERATIONS",
    "access",
    "catalogue",
    "cell",
    "controller",
    "devices",
    "frames",
    "kinematics",
    "plans",
    "positions",
    "programs",
    "recordings",
    "scene",
    "shapes",
]
