"""What the command lines find in the frozen files.

By commands, because those are words that stay, wherever the code behind them is.
"""

import contextlib
import gzip
import io
import json
import shutil
from pathlib import Path
from typing import Any, TypeAlias

from frozen.frozen_files import FILES, READINGS

from openpendant.tools.cli import main

Reading: TypeAlias = dict[str, Any]
"""A command, its exit code, what it prints, and the files that it writes."""


def copy_files(folder: Path) -> None:
    """Copy the frozen files, because reading a store makes files beside it."""
    for file in FILES.iterdir():
        if file.suffix == ".gz":
            (folder / file.stem).write_bytes(gzip.decompress(file.read_bytes()))
        elif file.name != "readings.json":
            shutil.copy(file, folder)


def readings() -> list[Reading]:
    """Read the files by the commands whose readings are kept; a new one is added there alone."""
    found = []
    for kept in json.loads(READINGS.read_text("utf-8")):
        command = kept["command"].split()
        before = set(Path().iterdir())
        output, errors = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            code = main(command)
        told = {"prints": output.getvalue(), "tells": errors.getvalue()}
        reading = {"command": kept["command"], "code": code, **told}
        if command[:2] == ["store", "export"]:
            (written,) = set(Path().iterdir()) - before
            reading["writes"] = {written.name: written.read_text("utf-8")}
        found.append(reading)
    return found


def as_text(found: list[Reading]) -> str:
    return json.dumps(found, indent=1, ensure_ascii=False) + "\n"
