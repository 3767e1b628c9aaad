"""Jogging in joint space and Cartesian, from rest to rest, slowed down before limits and contacts.

Owns the mathematics between a held key and the set-points of each tick; `jogger` is its entry
point. Knows no server, protocol or clock.

In the whole folder a position is (n,) controller-side [rad or m], a velocity (n,) [rad/s or m/s],
a rate a derivative by the path parameter σ [s], `dt` the length of a tick [s], and `asked` what a
press asks for: a velocity of the joints, or dσ/dt of the tool.
"""

from __future__ import annotations

from .escape_directions import EscapeDirection, find_escapes, leads_out
from .jog_commands import (
    BASE_AXES,
    LONGEST_STEP,
    JogCaps,
    JogCause,
    JogEscape,
    JogSetpoint,
    JogSlowdown,
    JogTarget,
    JointJog,
    ToolJog,
)
from .jog_model import JogModel, jog_model
from .jogger import Jogger

__all__ = [
    "BASE_AXES",
    "LONGEST_STEP",
    "EscapeDirection",
    "JogCaps",
    "JogCause",
    "JogEscape",
    "JogModel",
    "JogSetpoint",
    "JogSlowdown",
    "JogTarget",
    "Jogger",
    "JointJog",
    "ToolJog",
    "find_escapes",
    "jog_model",
    "leads_out",
]
