"""The tests of the firmware find faults that are planted in it."""

import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from rigs.firmware.simulated_board import SOURCES, SOURCES_VARIABLE, Firmware, skip_without_tools

HERE = Path(__file__).parent
ROOT = HERE.parents[4]
FAULTS = tomllib.loads((HERE / "faults.toml").read_text("utf-8"))["fault"]
FOUND = 1
"""What pytest ends with where tests failed."""


def planted(fault: dict[str, str], folder: Path) -> Path:
    """Return a copy of the sources with the fault in them."""
    sources = shutil.copytree(SOURCES, folder / "firmware", ignore=shutil.ignore_patterns("build"))
    file = sources / fault["file"]
    text = file.read_text("utf-8")
    assert text.count(fault["before"]) == 1, f"{fault['file']} has not just one {fault['before']!r}"
    file.write_text(text.replace(fault["before"], fault["after"]), "utf-8")
    return sources


@pytest.mark.parametrize("fault", FAULTS, ids=[fault["name"] for fault in FAULTS])
def test_each_fault_can_still_be_planted(fault: dict[str, str], tmp_path: Path) -> None:
    planted(fault, tmp_path)
    file, _, name = fault["test"].partition("::")
    assert f"def {name}(" in (HERE / file).read_text("utf-8")


@pytest.mark.soak
@pytest.mark.parametrize("fault", FAULTS, ids=[fault["name"] for fault in FAULTS])
def test_the_named_test_finds_the_planted_fault(
    fault: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    skip_without_tools()
    monkeypatch.setenv(SOURCES_VARIABLE, str(planted(fault, tmp_path)))
    Firmware.compiled(tmp_path / "compiles")
    words = ["-q", "-m", "firmware", f"--basetemp={tmp_path}/run", str(HERE / fault["test"])]
    run = subprocess.run(
        [sys.executable, "-m", "pytest", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == FOUND, run.stdout
