"""Imports one source file with other text than it has: an import hook.

Owns that the changed text is compiled instead of the file's, wherever the file is imported from:
the editable install goes through links, so files are told apart by their resolved paths. No
bytecode is read or written, nor is any source file. Knows neither tables nor tests, and imports as
little as it can: every process that a test starts begins with it.
"""

import os
import sys
from collections.abc import Sequence
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from types import CodeType, ModuleType

FILE = "file"
"""In the folder of a fault: the resolved path of the file that it changes."""

CHANGED = "changed"
"""In the folder of a fault: the whole text that is imported instead."""

LOADED = "loaded"
"""In the folder of a fault: made by the first process that imports the changed text."""


class FaultyLoader(SourceFileLoader):
    """Compiles the changed text under the name and path of the file."""

    def __init__(self, fullname: str, path: str, folder: str) -> None:
        super().__init__(fullname, path)
        self._folder = folder

    def get_code(self, fullname: str) -> CodeType | None:
        """Return the changed text as code, and leave the mark that it was loaded."""
        with open(os.path.join(self._folder, CHANGED), encoding="utf-8", newline="") as changed:
            text = changed.read()
        with open(os.path.join(self._folder, LOADED), "a"):
            pass
        code: CodeType = compile(text, self.path, "exec", dont_inherit=True)
        return code


class FaultFinder:
    """Finds modules as Python does, but for the file with the fault."""

    def __init__(self, folder: str) -> None:
        self._folder = folder
        with open(os.path.join(folder, FILE), encoding="utf-8") as file:
            self._file = file.read()
        place, name = os.path.split(self._file)
        stem = name.removesuffix(".py")
        self._last_name = os.path.basename(place) if stem == "__init__" else stem

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return where the changed module comes from; None leaves any other to Python."""
        if fullname.rpartition(".")[2] != self._last_name:
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is None or spec.origin is None or os.path.realpath(spec.origin) != self._file:
            return None
        spec.loader = FaultyLoader(fullname, spec.origin, self._folder)
        return spec


def plant(folder: str) -> None:
    """Have this process import the file of a fault with its changed text.

    Args:
        folder: of the fault, with the files `FILE` and `CHANGED`.
    """
    sys.meta_path.insert(0, FaultFinder(folder))
