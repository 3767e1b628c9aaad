"""Jogging: joints and the tool by hand, from rest to rest, scaled before anything that must not be.

Owns the mathematics between a key that is held and the set-points of each tick; `jogger` is its
door. Knows no server, protocol or clock.
"""

from __future__ import annotations

from .jogger import Jogger
from .model import JogModel, jog_model
from .reasons import JogCause, JogReason, JogStep, Retreat
from .targets import BASE_AXES, LONGEST_STEP, JogCaps, JogTarget, JointJog, ToolJog
from .ways_out import WayOut, leads_out, ways_out

__all__ = [
    "BASE_AXES",
    "LONGEST_STEP",
    "JogCaps",
    "JogCause",
    "JogModel",
    "JogReason",
    "JogStep",
    "JogTarget",
    "Jogger",
    "JointJog",
    "Retreat",
    "ToolJog",
    "WayOut",
    "jog_model",
    "leads_out",
    "ways_out",
]
