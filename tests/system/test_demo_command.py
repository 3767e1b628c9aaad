"""`openpendant demo`, as `make demo` runs it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.realtime


def run_demo(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "openpendant.tools", "demo", *arguments],
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=110,
        check=False,
    )


@pytest.mark.parametrize("robot", ["ur5", "abb_irb2400", "kawasaki_ra10n"])
def test_the_demo_moves_the_robot_and_leaves_a_plot_and_a_table(robot: str, tmp_path: Path) -> None:
    demo = run_demo("--robot", robot, "--output", str(tmp_path))
    assert demo.returncode == 0, demo.stderr
    assert "0 violations" in demo.stdout
    assert (tmp_path / f"demo-{robot}.png").read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / f"demo-{robot}.csv").read_text().startswith("kind,motion,time,")


def test_an_unknown_robot_ends_the_demo_with_a_sentence(tmp_path: Path) -> None:
    demo = run_demo("--robot", "nobody", "--output", str(tmp_path))
    assert demo.returncode == 1
    assert "nobody" in demo.stderr
    assert "Traceback" not in demo.stderr
