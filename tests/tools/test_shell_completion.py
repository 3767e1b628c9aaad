"""Completion as the shells do it: bash, zsh and fish run the scripts that are made for them.

A shell that is not on this machine is left out aloud.
"""

import os
import shlex
import shutil
import subprocess
import time
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from rigs.clock.busy_machine import SCALE

from openpendant.tools.completion import known_words, script

pytestmark = pytest.mark.realtime

OFFERED = {
    "openpendant sta": ["start"],
    "openpendant robots f": ["fk"],
    "openpendant users pa": ["pair"],
    "openpendant packets con": ["conformance"],
    "openpendant start --robot ur": ["ur5"],
    "openpendant robots show ur": ["ur5"],
    "openpendant robots ik ur5 --al": ["--all"],
    "openpendant start --robot ur5 --pen": ["--pendant-port"],
    "openpendant packets conformance --ju": ["--junit"],
    "openpendant plan --cell left --exe": ["--execute"],
    "openpendant nothing": [],
}
"""What each shell offers for a line whose last word is begun."""

PATIENCE = 20.0 * SCALE
"""A shell that takes longer has hung [s]."""

Answers = list[list[str]]


def of_bash(lines: Sequence[str], script_file: Path, _: Path) -> Answers:
    found = []
    for line in lines:
        given = line.split(" ")
        asked = (
            f"source {shlex.quote(str(script_file))}; COMP_WORDS=({shlex.join(given)});"
            f" COMP_CWORD={len(given) - 1}; _openpendant; printf '%s\\n' \"${{COMPREPLY[@]}}\""
        )
        found.append(_output(["bash", "--norc", "-c", asked], Path.cwd()).split())
    return found


def of_fish(lines: Sequence[str], script_file: Path, home: Path) -> Answers:
    """Ask fish, which finds the script where its help says that it is to be written."""
    folder = home / ".config" / "fish" / "completions"
    folder.mkdir(parents=True)
    shutil.copyfile(script_file, folder / "openpendant.fish")
    empty, programs = home / "empty", home / "bin"
    empty.mkdir()
    programs.mkdir()
    # Completions of a command that is not there are not looked for.
    (programs / "openpendant").symlink_to("/bin/true")
    path = f"{programs}:{os.environ['PATH']}"
    answers = []
    for line in lines:
        ask = ["fish", "-c", f"complete -C {shlex.quote(line)}"]
        told = _output(ask, empty, HOME=str(home), PATH=path)
        answers.append([each.split("\t")[0] for each in told.splitlines()])
    return answers


# What is offered is told beside the completion itself, which goes on as it does for a person.
_ZSH = """
autoload -Uz compinit; compinit -D -u
source {script}
compadd() {{
  local -a offered
  builtin compadd -A offered "$@"
  (( $#offered )) && print -rl -- $offered >> {told}
  builtin compadd "$@"
}}
functions[_asked]=$functions[_openpendant]
_openpendant() {{ _asked "$@"; print -r -- END >> {told} }}
zle-line-init() {{ print -r -- READY >> {told} }}
zle -N zle-line-init
"""


def of_zsh(lines: Sequence[str], script_file: Path, home: Path) -> Answers:
    """Type each line and Tab into zsh at a terminal: its completion runs nowhere else."""
    told = home / "told"
    told.touch()
    setup = home / "setup"
    setup.write_text(_ZSH.format(script=script_file, told=told))
    empty = home / "empty"
    empty.mkdir()
    ours, theirs = os.openpty()
    shell = subprocess.Popen(
        ["zsh", "-f", "-i"],
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        cwd=empty,
        env={**os.environ, "TERM": "dumb", "HOME": str(home)},
        start_new_session=True,
    )
    os.close(theirs)
    os.set_blocking(ours, False)

    def wait_for(mark: str, times: int) -> None:
        deadline = time.monotonic() + PATIENCE
        while told.read_text().split().count(mark) < times:
            assert time.monotonic() < deadline, f"zsh did not come to {mark}"
            # Whoever draws to a terminal that nobody reads stands still once it is full.
            while _drained(ours):
                pass
            time.sleep(0.01)

    try:
        os.write(ours, f"source {shlex.quote(str(setup))}\n".encode())
        wait_for("READY", 1)
        for number, line in enumerate(lines, start=1):
            kill_line = b"\x15"
            os.write(ours, kill_line + line.encode() + b"\t")
            wait_for("END", number)
    finally:
        shell.kill()
        shell.wait()
        os.close(ours)
    answers = told.read_text().removeprefix("READY\n").split("END\n")
    return [each.split() for each in answers[: len(lines)]]


def _drained(terminal: int) -> bool:
    try:
        return bool(os.read(terminal, 65_536))
    except (BlockingIOError, OSError):
        return False


def _output(command: Sequence[str], folder: Path, **environment: str) -> str:
    """Return the output of a command that ends well."""
    done = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=True,
        cwd=folder,
        env={**os.environ, **environment},
        timeout=PATIENCE,
    )
    return done.stdout


ASK: dict[str, Callable[[Sequence[str], Path, Path], Answers]] = {
    "bash": of_bash,
    "zsh": of_zsh,
    "fish": of_fish,
}


@cache
def offers(shell: str) -> dict[str, list[str]]:
    """Return what a shell offers for each line, asked all at once: zsh starts slowly."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "script"
        file.write_text(script(shell, known_words()))
        home = Path(folder) / "home"
        home.mkdir()
        return dict(zip(OFFERED, ASK[shell](list(OFFERED), file, home), strict=True))


@pytest.mark.parametrize("line", OFFERED)
@pytest.mark.parametrize("shell", ASK)
def test_a_shell_completes_commands_options_and_robots(shell: str, line: str) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"there is no {shell}: its script is made, and never run")
    assert offers(shell)[line] == OFFERED[line]
