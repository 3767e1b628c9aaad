"""`make audit` is honest: what was not asked about is never called sound, and a finding fails."""

import json
import re
from collections.abc import Sequence
from pathlib import Path

import known_vulnerabilities
import pytest
from known_vulnerabilities import Ended

SOUND = {"name": "numpy", "version": "2.4.6", "vulns": []}
UNKNOWN = {"name": "pin", "skip_reason": "not found on the index: pin (4.1.0)"}
BROKEN = {
    "name": "textual",
    "version": "8.0.0",
    "vulns": [{"id": "PYSEC-2026-7", "aliases": ["CVE-2026-1"], "fix_versions": ["8.0.1"]}],
}
UNFIXED = {"name": "rich", "version": "15.0.0", "vulns": [{"id": "PYSEC-2026-8"}]}


def answer(*packages: object, code: int = 0) -> Ended:
    return Ended(code, json.dumps({"dependencies": packages, "fixes": []}))


class Machine:
    """Runs nothing: answers what a test says, by a word of the command."""

    def __init__(self, **answers: Ended) -> None:
        self.answers = answers
        self.commands: list[list[str]] = []

    def __call__(self, command: Sequence[str]) -> Ended:
        self.commands.append(list(command))
        return next((self.answers[w] for w in command if w in self.answers), Ended(0))


def audited(tmp_path: Path, machine: Machine) -> int:
    pinned = tmp_path / "constraints.txt"
    pinned.write_text("numpy==2.4.6\n")
    return known_vulnerabilities.main(machine, tmp_path / "audit", pinned)


@pytest.mark.parametrize(
    ("ended", "code", "said"),
    [
        (answer(SOUND), 0, "no known vulnerability in the 1 packages that were asked about"),
        (
            answer(SOUND, BROKEN, code=1),
            1,
            r"textual 8.0.0: PYSEC-2026-7 \(CVE-2026-1\), fixed in 8.0.1",
        ),
        (answer(UNFIXED, code=1), 1, "rich 15.0.0: PYSEC-2026-8, no version without it"),
        (answer(BROKEN, UNKNOWN, code=1), 1, "not checked: 1 packages: pin"),
        (answer(SOUND, UNKNOWN), 0, "not checked: 1 packages: pin"),
        # The tool itself says "No known vulnerabilities found" here, with 0.
        (answer(UNKNOWN), 0, "not checked: none of 1 packages could be asked about: not found"),
        (Ended(1, "", "x\nConnectionError: no route to host"), 0, "not checked: .* no route"),
        (Ended(124, "", "timed out after 600 s"), 0, "not checked: nobody could be asked"),
        (Ended(2, "", "error: unrecognized arguments: --x"), 2, "pip-audit failed: error: unrec"),
        (Ended(0, "{}"), 2, "pip-audit failed: exit code 0"),
    ],
)
def test_the_exit_code_is_that_of_what_is_known_and_what_was_not_asked_is_said(
    ended: Ended, code: int, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert audited(tmp_path, Machine(json=ended)) == code
    shown = capsys.readouterr().out
    assert re.search(f"^audit: {said}", shown, re.MULTILINE), shown
    assert ("no known vulnerability" in shown) == (code == 0 and "not checked: n" not in shown)


def test_a_tool_that_cannot_be_installed_is_said_and_is_no_finding(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    machine = Machine(install=Ended(1, "", "ERROR: No matching distribution found for pip-audit"))
    assert audited(tmp_path, machine) == 0
    said = "audit: not checked: pip-audit cannot be installed: ERROR: No matching distribution"
    assert capsys.readouterr().out.startswith(said)


def test_the_tool_has_an_environment_of_its_own_and_reads_what_is_pinned(tmp_path: Path) -> None:
    machine = Machine(json=answer(SOUND))
    audited(tmp_path, machine)
    made, installed, asked = machine.commands
    assert made[1:3] == ["-m", "venv"]
    assert {installed[0], asked[0]} == {str(tmp_path / "audit" / "bin" / "python")}
    assert asked[asked.index("--requirement") + 1] == str(tmp_path / "constraints.txt")


def test_a_tool_that_is_there_is_not_installed_again(tmp_path: Path) -> None:
    python = tmp_path / "audit" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.touch()
    machine = Machine(json=answer(SOUND))
    assert audited(tmp_path, machine) == 0
    assert [command for command in machine.commands if "install" in command] == []


def test_every_package_is_pinned_to_one_version() -> None:
    lines = known_vulnerabilities.PINNED.read_text(encoding="utf-8").splitlines()
    assert lines
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+", line) for line in lines)


def test_what_cannot_be_started_has_failed(tmp_path: Path) -> None:
    assert known_vulnerabilities.run([str(tmp_path / "none")]).code == 127
