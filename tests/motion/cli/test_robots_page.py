"""What `docs/robots.md` shows: its files are sound and its commands work as typed, in its order."""

import re
import shlex
from pathlib import Path

import pytest

from openpendant.motion.cli.robots import main

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "robots.md").read_text("utf-8")
FILES = re.findall(r"```(?:csv|yaml) (\S+)\n(.*?)```", PAGE, re.DOTALL)
COMMANDS = re.findall(r"(?m)^\$ openpendant robots (.*)$", PAGE)
OF_THE_PAGES_FILES = [each for each in COMMANDS if re.search("my_|elbow", each)]
"""Work on files that earlier ones of them write; the others are about robots of the project."""


@pytest.fixture
def workbench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, content in FILES:
        (tmp_path / name).write_text(content)
    urdf = (ROOT / "tests" / "robots_files" / "bench_arm.urdf").read_text()
    (tmp_path / "my_arm.urdf").write_text(urdf.replace('name="Bench Arm"', 'name="my_arm"'))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_page_shows_files_and_commands() -> None:
    assert [name for name, _ in FILES] == ["cell.yaml", "my_scara.csv", "my_elbow.yml"]
    assert len(COMMANDS) >= 14
    assert {"check --all", "draw ur5 -o ur5.png --joints [0,-1,1.2,0,1.5,0]"} <= set(COMMANDS)


def told(capsys: pytest.CaptureFixture[str], command: str) -> str:
    assert main(shlex.split(command)) == 0, command
    captured = capsys.readouterr()
    assert captured.out
    assert "error:" not in captured.err
    return captured.out


@pytest.mark.parametrize("command", [each for each in COMMANDS if each not in OF_THE_PAGES_FILES])
def test_every_command_of_the_page_works_as_typed(
    workbench: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    out = told(capsys, command)
    if command == "check --all":
        assert "24 of 24 robots are good" in out
    if command.startswith("draw ur5 -o ur5.png"):
        assert (workbench / "ur5.png").read_bytes().startswith(b"\x89PNG\r\n\x1a\n")


def test_the_commands_for_the_pages_own_files_work_as_typed_in_its_order(
    workbench: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for command in OF_THE_PAGES_FILES:
        told(capsys, command)
    made = {"my_arm.yaml", "my_arm.svg", "my_scara.yaml", "elbow_arm.yaml"}
    assert made <= {path.name for path in workbench.iterdir()}


def test_the_page_tells_the_assumed_values() -> None:
    from openpendant.motion.robot_import.decisions import CONTINUOUS, PRISMATIC, RAMP, REVOLUTE

    assert f"-{REVOLUTE.upper * 57.29577951308232:g}° to" in PAGE
    assert f"-{CONTINUOUS.upper * 57.29577951308232:g}° to" in PAGE
    assert f"{PRISMATIC.lower:g} to {1000 * PRISMATIC.upper:g} mm" in PAGE
    assert f"{REVOLUTE.velocity:g} rad/s), {1000 * PRISMATIC.velocity:g} mm/s" in PAGE
    assert f"speed / {RAMP:g} s" in PAGE
