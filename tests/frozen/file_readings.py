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

from frozen.frozen_files import FILES

from openpendant.tools.cli import main

STORE = ("--store", "store.db")
ARC = ("--kind", "recording", "--name", "arc")

COMMANDS: tuple[tuple[str, ...], ...] = (
    ("program", "check", "pick.program", "pick.json", "place.program", "--json"),
    ("program", "print", "pick.json"),
    ("program", "convert", "pick.program"),
    ("store", "check", *STORE, "--json"),
    ("store", "list", *STORE, "--json"),
    ("store", "show", "program", "pick", *STORE, "--json"),
    ("store", "show", "program", "pick", "--revision", "1", *STORE, "--json"),
    ("store", "show", "program", "pick", "--history", *STORE, "--json"),
    ("store", "show", "program", "gone", *STORE),
    ("store", "show", "program", "gone", "--history", *STORE, "--json"),
    ("store", "show", "recording", "arc", *STORE, "--json"),
    ("store", "show", "frames", "cell", *STORE, "--json"),
    ("store", "show", "tools", "cell", *STORE, "--json"),
    ("store", "show", "scene", "cell", *STORE, "--json"),
    ("store", "export", "pick.text.program", "--name", "pick", *STORE),
    ("store", "export", "pick.csv", "--kind", "program", "--name", "pick", *STORE),
    ("store", "export", "arc.csv", *ARC, *STORE),
    ("store", "export", "all.json", *STORE),
    ("users", "list", *STORE, "--json"),
    ("audit", "verify", "audit.jsonl", "--json"),
    ("audit", "show", "audit.jsonl"),
    ("audit", "show", "audit.jsonl", "--json"),
    ("packets", "show", "session.trace", "--json"),
)

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
    found = []
    for command in COMMANDS:
        before = set(Path().iterdir())
        output, errors = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            code = main(list(command))
        told = {"prints": output.getvalue(), "tells": errors.getvalue()}
        reading = {"command": " ".join(command), "code": code, **told}
        if command[:2] == ("store", "export"):
            (written,) = set(Path().iterdir()) - before
            reading["writes"] = {written.name: written.read_text("utf-8")}
        found.append(reading)
    return found


def as_text(found: list[Reading]) -> str:
    return json.dumps(found, indent=1, ensure_ascii=False) + "\n"
