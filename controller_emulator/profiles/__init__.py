"""Vendor behaviours of the emulated controller, one file each, as data."""

from __future__ import annotations

from .generic import GENERIC
from .profile import ControllerProfile

PROFILES: dict[str, ControllerProfile] = {profile.name: profile for profile in (GENERIC,)}

__all__ = ["GENERIC", "PROFILES", "ControllerProfile"]
