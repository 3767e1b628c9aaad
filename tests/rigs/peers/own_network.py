"""Scripts that take a network down, run in one of their own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[2]


def printed_in_own_network(script: Path) -> str:
    """Run a script in a network whose only cable is its loopback; return what it printed.

    Skips the test where such a network cannot be had.
    """
    unshare = shutil.which("unshare")
    probe = [unshare or "", "--net", "true"]
    if unshare is None or subprocess.run(probe, capture_output=True, check=False).returncode:
        pytest.skip("a network of its own cannot be had here")
    done = subprocess.run(
        [unshare, "--net", sys.executable, str(script)],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        env=os.environ | {"PYTHONPATH": str(TESTS)},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout
