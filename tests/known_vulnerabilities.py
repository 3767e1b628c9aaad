"""Known vulnerabilities of what `constraints.txt` pins: `make audit`, by pip-audit.

Owns where the tool comes from (an environment of its own, so that it changes nothing of ours), and
what counts as an answer: pip-audit ends with 0 and "no known vulnerabilities" for a package that it
could not ask about, too. Exit codes: 0 none is known, or nothing could be asked, which is said
aloud; 1 one is known; 2 the tool failed for another reason.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
PINNED = ROOT / "constraints.txt"
TOOL_ENVIRONMENT = ROOT / ".venv" / "audit"
TOOL = "pip-audit>=2.7,<3"

_PATIENCE = 600.0
"""To install, and to ask about all packages [s]."""

_NETWORK = ("connection", "network", "resolve", "timed out", "timeout", "proxy", "ssl", "http")
"""Words of a failure that is none of the tool's own."""

OK, FOUND, FAILED = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Ended:
    """A command that has ended."""

    code: int
    out: str = ""
    err: str = ""

    @property
    def last_words(self) -> str:
        """The last line that it wrote to standard error; else its exit code."""
        lines = self.err.strip().splitlines()
        return lines[-1].strip() if lines else f"exit code {self.code}"


Run = Callable[[Sequence[str]], Ended]
"""Runs a command to its end."""


def run(command: Sequence[str]) -> Ended:
    """Run a command; one that cannot be started or takes too long has failed with 124 or 127."""
    try:
        done = subprocess.run(
            command, cwd=ROOT, capture_output=True, text=True, timeout=_PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        return Ended(124, err=f"timed out after {_PATIENCE:g} s")
    except OSError as error:
        return Ended(127, err=str(error))
    return Ended(done.returncode, done.stdout, done.stderr)


def tool(environment: Path, run: Run) -> tuple[Path, str]:
    """Return the interpreter that has pip-audit, installing it, and why there is none."""
    python = environment / "bin" / "python"
    has_it = [str(python), "-m", "pip_audit", "--version"]
    if python.exists() and run(has_it).code == 0:
        return python, ""
    for command in (
        [sys.executable, "-m", "venv", "--clear", str(environment)],
        [str(python), "-m", "pip", "--disable-pip-version-check", "install", "--no-input", TOOL],
    ):
        ended = run(command)
        if ended.code:
            return python, f"pip-audit cannot be installed: {ended.last_words}"
    return python, ""


def audit(python: Path, pinned: Path, run: Run) -> tuple[int, list[str]]:
    """Ask about every pinned package; return the exit code and the lines to print."""
    ended = run(
        [
            *(str(python), "-m", "pip_audit", "--requirement", str(pinned)),
            # What is pinned is all there is, so nothing has to be resolved or downloaded.
            *("--no-deps", "--disable-pip"),
            *("--format", "json", "--progress-spinner", "off"),
        ]
    )
    try:
        packages: list[dict[str, Any]] = json.loads(ended.out)["dependencies"]
        return _judged(packages)
    except (ValueError, KeyError, TypeError):
        words = ended.err.lower()
        if ended.code == 124 or any(word in words for word in _NETWORK):
            return OK, [f"not checked: nobody could be asked: {ended.last_words}"]
        return FAILED, [f"pip-audit failed: {ended.last_words}"]


def _judged(packages: Sequence[dict[str, Any]]) -> tuple[int, list[str]]:
    lines = [
        f"{each['name']} {each['version']}: {found['id']}{_more(found)}"
        for each in packages
        for found in each.get("vulns", ())
    ]
    code = FOUND if lines else OK
    unasked = [each["name"] for each in packages if "skip_reason" in each]
    asked = len(packages) - len(unasked)
    if not asked:
        why = next((each["skip_reason"] for each in packages), "nothing is pinned")
        return OK, [f"not checked: none of {len(packages)} packages could be asked about: {why}"]
    found = f"{len(lines)} known vulnerabilities" if lines else "no known vulnerability"
    lines.append(f"{found} in the {asked} packages that were asked about")
    if unasked:
        lines.append(f"not checked: {len(unasked)} packages: {', '.join(unasked)}")
    return code, lines


def _more(found: dict[str, Any]) -> str:
    names, fixed = found.get("aliases", ()), found.get("fix_versions", ())
    known_as = f" ({', '.join(names)})" if names else ""
    return known_as + (f", fixed in {', '.join(fixed)}" if fixed else ", no version without it")


def main(run: Run = run, environment: Path = TOOL_ENVIRONMENT, pinned: Path = PINNED) -> int:
    """Look, print what is known, and return the exit code."""
    python, problem = tool(environment, run)
    code, lines = (OK, [f"not checked: {problem}"]) if problem else audit(python, pinned, run)
    sys.stdout.writelines(f"audit: {line}\n" for line in lines)
    return code


if __name__ == "__main__":
    sys.exit(main())
