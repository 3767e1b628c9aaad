"""The command `openpendant program`: check, print and convert program files.

Owns arguments, output and exit codes, nothing else.

Exit codes: 0 done, 1 a program is refused, 2 wrong usage or a file that cannot be read or written.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer

from openpendant.motion.bounded_file import beginning_of
from openpendant.motion.description.robot import SerialRobot, serial_robot
from openpendant.motion.errors import MotionError
from openpendant.simplemsg.pendant.management.program_values import ProgramError, TeachPoint
from openpendant.tools.console import ExitCode, command, emit_json, run_alone

from ..programs.interpreter.dry_run import reachability
from ..programs.language.linking import link
from ..programs.language.parser import Source
from ..programs.language.printer import in_words, print_program
from ..programs.language.program import Program, check_robot
from ..programs.language.program_errors import ProgramSyntaxError, ProgramUnknown, program_refusal
from ..programs.language.program_json import MOST_READ, is_json, program_to_json, source_of
from ..refusal import Refusal, refusal_of
from ..store.documents import check_new_name
from ..store.store_errors import BadName

app = command()

JsonOption = Annotated[bool, typer.Option("--json", help="Answer as one JSON line.")]
ProgramFile = Annotated[Path, typer.Argument(help="Program file, text or JSON.")]


class ProgramFormat(StrEnum):
    """The forms of a program file."""

    TEXT = "text"
    JSON = "json"


@dataclass(slots=True)
class _Checked:
    """A file, and what is wrong with it."""

    file: Path
    source: Source | None = None
    problems: list[tuple[int, Refusal]] = field(default_factory=list)

    def add(self, refusal: Refusal, line: int = 0) -> None:
        """Note a problem; line 0 for none."""
        self.problems.append((line, refusal))


@app.callback()
def programs() -> None:
    """Check, print and convert programs."""


@app.command()
def check(
    files: Annotated[list[Path], typer.Argument(help="Program files; they may call each other.")],
    robot: Annotated[
        str | None, typer.Option(help="Robot that shall run them, name or file.")
    ] = None,
    json_output: JsonOption = False,
) -> None:
    """Say whether programs can be read, call what is there, and keep to the robot's joints."""
    checked = [_read(file) for file in files]
    library = {each.source.program.name: each.source.program for each in checked if each.source}
    robots: dict[str, SerialRobot | Refusal] = {}
    for each in checked:
        if each.source is not None:
            _check_calls(each, each.source, library)
            name = robot or each.source.program.robot
            if name not in robots:
                robots[name] = _robot(name)
            _check_points(each, each.source, robots[name])
    _say(checked, json_output)
    if any(each.problems for each in checked):
        raise typer.Exit(ExitCode.FAILED)


@app.command("print")
def print_(file: ProgramFile, json_output: JsonOption = False) -> None:
    """Print a program in its canonical layout."""
    program = _program(file)
    print(program_to_json(program) if json_output else _text(program), end="")
    if json_output:
        print()


@app.command()
def convert(
    file: ProgramFile,
    to: Annotated[
        ProgramFormat | None, typer.Option(help="Form to write; the other one if left out.")
    ] = None,
    output: Annotated[Path | None, typer.Option(help="File to write; standard output.")] = None,
    json_output: JsonOption = False,
) -> None:
    """Turn a program's text into JSON, or JSON into text, without losing anything."""
    raw = _bytes(file)
    if to is None:
        to = ProgramFormat.TEXT if is_json(raw) else ProgramFormat.JSON
    program = _program(file, raw)
    converted = program_to_json(program) + "\n" if to is ProgramFormat.JSON else _text(program)
    if output is None:
        print(converted, end="")
        return
    try:
        output.write_text(converted, "utf-8")
    except OSError as error:
        _fail(f"{output}: {error.strerror or error}", ExitCode.USAGE)
    if json_output:
        emit_json({"program": program.name, "file": str(output), "form": to.value})
    else:
        print(f"{output}: program {program.name!r} as {to.value}")


def _read(file: Path) -> _Checked:
    checked, raw = _Checked(file), _bytes(file)
    try:
        checked.source = source_of(raw, str(file))
        check_new_name(checked.source.program.name)
    except ProgramSyntaxError as error:
        checked.add(program_refusal(error), error.line)
    except ProgramError as error:
        checked.add(program_refusal(error))
    except BadName as error:
        checked.add(error.refusal())
    return checked


def _program(file: Path, raw: bytes | None = None) -> Program:
    try:
        return source_of(_bytes(file) if raw is None else raw, str(file)).program
    except ProgramError as error:
        _fail(str(error), ExitCode.FAILED)


def _text(program: Program) -> str:
    try:
        return print_program(program)
    except ProgramError as error:
        _fail(str(error), ExitCode.FAILED)


def _bytes(file: Path) -> bytes:
    try:
        return beginning_of(file, MOST_READ)
    except (OSError, ValueError) as error:
        _fail(f"{file}: {getattr(error, 'strerror', None) or error}", ExitCode.USAGE)


def _robot(name: str) -> SerialRobot | Refusal:
    try:
        return serial_robot(name)
    except MotionError as error:
        return refusal_of(error)


def _check_calls(checked: _Checked, source: Source, library: dict[str, Program]) -> None:
    program = source.program
    try:
        link(program, library.get)
    except ProgramUnknown as error:
        # What another program calls in vain is said where that program is checked.
        if error.caller == program.name:
            # The file's own line goes before it; that of the canonical text may be another.
            words = in_words(program.statements[error.index])
            refusal = Refusal(error.code, f"{words}: {error.problem}")
            checked.add(refusal, source.statement_lines[error.index])
    except ProgramError as error:
        checked.add(program_refusal(error))


def _check_points(checked: _Checked, source: Source, robot: SerialRobot | Refusal) -> None:
    if isinstance(robot, Refusal):
        checked.add(robot)
        return

    def beyond(point: TeachPoint) -> Refusal | None:
        try:
            robot.limits.check_position(point.joints)
        except MotionError as error:
            return refusal_of(error)
        return None

    try:
        check_robot(source.program, robot.name, robot.limits)
    except ProgramError as error:
        checked.add(program_refusal(error))
        return
    lines = source.point_lines
    for line, verdict in zip(lines, reachability(source.program, beyond), strict=True):
        if verdict.refusal is not None:
            checked.add(verdict.refusal, line)


def _say(checked: list[_Checked], json_output: bool) -> None:
    if json_output:
        ok = not any(each.problems for each in checked)
        emit_json({"ok": ok, "files": [_as_json(each) for each in checked]})
        return
    for each in checked:
        for line, refusal in each.problems:
            text = refusal.sentence
            place = f"{each.file}:{line}: " if line else f"{each.file}: "
            shown = text if text.startswith(f"{each.file}:") else place + text
            print(shown, file=sys.stderr)
        if each.source is not None and not each.problems:
            program = each.source.program
            counts = f"{len(program.points)} points, {len(program.statements)} statements"
            print(f"{each.file}: program {program.name!r} for {program.robot}: {counts}, good")


def _as_json(checked: _Checked) -> dict[str, Any]:
    problems = [
        {
            "line": line or None,
            "code": int(refusal.code),
            "name": refusal.code.name,
            "text": refusal.sentence,
        }
        for line, refusal in checked.problems
    ]
    about: dict[str, Any] = {"file": str(checked.file), "problems": problems}
    if checked.source is not None:
        program = checked.source.program
        about |= {
            "program": program.name,
            "robot": program.robot,
            "points": len(program.points),
            "statements": len(program.statements),
        }
    return about


def _fail(text: str, code: int) -> NoReturn:
    print(f"openpendant program: {text}", file=sys.stderr)
    raise typer.Exit(code)


def main(argv: list[str]) -> int:
    """Run `openpendant program` with arguments; return the exit code."""
    return run_alone(app, "program", argv)
