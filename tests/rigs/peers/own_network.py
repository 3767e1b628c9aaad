"""Scripts that take a network down, run in one of their own."""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[2]


@contextmanager
def begun_in_own_network(script: Path) -> Iterator[subprocess.Popen[str]]:
    """Run a script in a network whose only cable is its loopback; it ends by itself or is killed.

    Skips the test where such a network cannot be had.
    """
    # Processes of its own, too: whatever it has begun ends with it, even where it is killed.
    alone = [shutil.which("unshare") or "", "--net", "--pid", "--mount-proc", "--kill-child"]
    if (
        not alone[0]
        or subprocess.run([*alone, "true"], capture_output=True, check=False).returncode
    ):
        pytest.skip("a network of its own cannot be had here")
    with subprocess.Popen(
        [*alone, sys.executable, str(script)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": str(TESTS)},
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def printed_in_own_network(script: Path) -> str:
    """Run a script in such a network to its end; return what it printed."""
    with begun_in_own_network(script) as process:
        return last_words(process)


def last_words(process: subprocess.Popen[str]) -> str:
    """End what a script reads, let it come to its end, and return what it printed since."""
    said, complained = process.communicate(timeout=60)
    assert process.returncode == 0, complained
    return said
