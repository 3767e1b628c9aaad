"""Vendor behaviours of the emulated controller, one file each, as data."""

from __future__ import annotations

from .generic import GENERIC
from .profile import Profile

PROFILES: dict[str, Profile] = {profile.name: profile for profile in (GENERIC,)}

__all__ = ["GENERIC", "PROFILES", "Profile"]
