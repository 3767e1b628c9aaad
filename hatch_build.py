"""Hook of the build: the links of an editable install, and the page of a wheel.

An editable install sees the top-level folders under the one import name `openpendant`. The map of
folders is written once, in `pyproject.toml`; this hook reads it and links each folder into
`.dev/openpendant/`, the directory that an editable install puts on the path.

A wheel takes the page of the browser pendant along: the one that was built, or one that is built
now where a fitting Node.js stands. None is fetched, nothing is asked for, and a page that cannot be
built fails no installation: the gateway serves one that says how to build it.
"""

from __future__ import annotations

import importlib.util
import os
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

NO_PAGE = "OPENPENDANT_NO_PAGE"
"""Environment variable: when set, no page is built; one that is there is taken along."""


class DevLinks(BuildHookInterface[Any]):
    """Creates the links of an editable install, and has the page of a real wheel built."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Link every mapped folder, or build the page; called by hatchling before the build."""
        if version == "editable":
            self._link()
        elif not os.environ.get(NO_PAGE):
            self._build_page()

    def _build_page(self) -> None:
        script = Path(self.root) / "tools" / "pendants" / "web" / "build.py"
        spec = importlib.util.spec_from_file_location("page_build", script)
        if spec is None or spec.loader is None:
            return
        page_build = sys.modules["page_build"] = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(page_build)
        page_build.main([])

    def _link(self) -> None:
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
