"""Faults planted in the page's TypeScript, each of which its tests in Node must find."""

import os
import shutil
import subprocess
import tomllib
from pathlib import Path
from typing import Any

import pytest
from rigs.data.keypad_runs import write_keypad_cases
from rigs.processes.node import LEAST, node

FRONTEND = Path(__file__).parents[4] / "tools" / "pendants" / "web" / "frontend"
FAULTS: list[dict[str, Any]] = tomllib.loads(
    (Path(__file__).parent / "typescript_faults.toml").read_text("utf-8")
)["fault"]


@pytest.fixture(name="frontend", scope="module")
def _frontend(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("frontend")
    for name in ("src", "test"):
        shutil.copytree(FRONTEND / name, folder / name)
    shutil.copy(FRONTEND / "package.json", folder)
    write_keypad_cases(folder / "keypad.json")
    return folder


@pytest.mark.soak
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault["name"])
def test_a_planted_fault_of_the_page_is_found(fault: dict[str, Any], frontend: Path) -> None:
    path = node()
    if path is None:
        pytest.skip(f"no Node from {'.'.join(map(str, LEAST))} on")
    file, test = frontend / fault["file"], frontend / "test" / f"{fault['test']}.test.ts"
    text = file.read_text("utf-8")
    assert text.count(fault["before"]) == 1
    assert _passes(path, test)
    file.write_text(text.replace(fault["before"], fault["after"]), "utf-8")
    try:
        assert not _passes(path, test)
    finally:
        file.write_text(text, "utf-8")


def _passes(path: str, test: Path) -> bool:
    ran = subprocess.run(
        [path, "--test", "--test-reporter=tap", str(test)],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
        env=os.environ | {"KEYPAD_CASES": str(test.parents[1] / "keypad.json")},
    )
    # A fault that the file does not even load with is no fault of a rule.
    assert "SyntaxError" not in ran.stdout, ran.stdout
    return ran.returncode == 0
