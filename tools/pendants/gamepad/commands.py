"""Commands of a gamepad beside those of every panel: one press whose aim follows the sticks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from ..panel.commands import Command


@dataclass(frozen=True, slots=True)
class PressSticks:
    """Begin a jog.

    Attributes:
        frame: of the axes; empty for joints.
        values: part of the jog speed, -1 to 1: (n,) by joint, or (6,) along x, y, z and about them.
    """

    frame: str
    values: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class AimSticks:
    """Go on with the jog along other axes of its frame; begins nothing where it has ended."""

    frame: str
    values: tuple[float, ...]


GamepadCommand: TypeAlias = Command | PressSticks | AimSticks
"""A press ends by `ReleaseJog`, and by `Enable(False)`, which lets go of everything."""
