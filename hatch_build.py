"""Let editable installs see the top-level folders under the one import name `openpendant`.

The map of folders is written once, in `pyproject.toml`; this hook reads it and links each folder
into `.dev/openpendant/`, the directory that an editable install puts on the path.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class DevLinks(BuildHookInterface[Any]):
    """Creates the links of an editable install; does nothing for a real wheel."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Link every mapped folder; called by hatchling before the build."""
        if version != "editable":
            return
        root = Path(self.root)
        for folder, target in self.build_config.target_config["sources"].items():
            link = root / ".dev" / target
            link.parent.mkdir(parents=True, exist_ok=True)
            if link.exists():
                continue
            link.unlink(missing_ok=True)  # a link whose folder has gone
            if sys.platform == "win32":
                import _winapi

                _winapi.CreateJunction(str(root / folder), str(link))
            else:
                link.symlink_to(Path("../..") / folder, target_is_directory=True)
