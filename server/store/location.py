"""Where the store's file is when nobody says."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

STORE_VARIABLE = "OPENPENDANT_STORE"
"""Environment variable: the store's file."""


def default_path(environment: Mapping[str, str] = os.environ) -> Path:
    """Return the file that the environment names, else the one in the user's data folder."""
    named = environment.get(STORE_VARIABLE)
    if named:
        return Path(named)
    data = environment.get("XDG_DATA_HOME")
    folder = Path(data) if data else Path.home() / ".local" / "share"
    return folder / "openpendant" / "store.db"
