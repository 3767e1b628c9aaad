"""Processes that carry a mark in their environment: what a command started, and what it left."""

import time
from pathlib import Path


def processes_marked(mark: str) -> dict[int, str]:
    """Return the command lines of all processes with a mark in their environment."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            # A zombie has an empty environment: it is over, whoever has yet to collect it.
            if mark.encode() in (folder / "environ").read_bytes().split(b"\0"):
                found[int(folder.name)] = (folder / "cmdline").read_text().replace("\0", " ")
        except OSError:
            continue
    return found


def left_over(mark: str, patience: float) -> dict[int, str]:
    """Return the processes with a mark that are still there after a while [s]."""
    deadline = time.monotonic() + patience
    while (left := processes_marked(mark)) and time.monotonic() < deadline:
        time.sleep(0.02)
    return left
