"""Console: how a command line is run, what it exits with, and how it writes to a terminal.

Owns the exit codes, the way from an error to one line on standard error, the layout of tables and
of JSON, and what a terminal is shown of a text of others. The one module of `tools` that the
command line of every room may import. The standard library is enough to load it: who has no typer
and no rich runs the emulator and the packet tools.
"""

from __future__ import annotations

import json
import os
import shlex
import shutil
import sys
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

if TYPE_CHECKING:
    import argparse

    import typer
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

Faults = Mapping[type[Exception], int]
"""The errors that are told to the user, with their exit codes; the first that fits counts."""

_PIPED_WIDTH = 140

LONGEST_LINE = 4_000
"""A line longer than this is cut, and says so [signs]: fifty rows of eighty columns."""

_LONGEST_STACK = 4
"""So many combining marks on a letter are shown; more of them would paint over the rows beside."""


_commands: WeakKeyDictionary[typer.Typer, Callable[..., Any]] = WeakKeyDictionary()


class ExitCode(IntEnum):
    """Exit codes of every command; the names from 69 on follow `sysexits.h` and the shells."""

    OK = 0
    FAILED = 1
    """It ran, and the answer is no: a check that failed, a difference, a motion not done."""
    USAGE = 2
    """Wrong arguments, or a file that cannot be read or is of no known kind."""
    REFUSED = 3
    """The request is refused or cannot be met: a pose, a store, a port, a peer."""
    UNAVAILABLE = 69
    """A library is not installed, or no server answered."""
    INTERNAL_ERROR = 70
    OUTPUT_FAILED = 74
    INTERRUPTED = 130
    PIPE_CLOSED = 141


# What is run.


def command(about: str | None = None, exit_codes: str | None = None) -> typer.Typer:
    """Return a command without sub-commands yet."""
    import typer

    # What is left out must not be named: an explicit None would hide the help of a callback.
    told: dict[str, Any] = {"help": about} if about else {}
    if exit_codes:
        told["epilog"] = f"Exit codes: {exit_codes}."
    return typer.Typer(
        add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False, **told
    )


def run(
    app: typer.Typer,
    name: str,
    argv: Sequence[str],
    faults: Faults,
    tell: Callable[[str], None] | None = None,
) -> int:
    """Run a typer command and return its exit code; no fault that is expected has a traceback.

    A closed pipe is left to the caller, because nobody is left to be told.

    Args:
        app: the command.
        name: how the user calls it, after `openpendant`.
        argv: the arguments after its name.
        faults: beside wrong usage and an interruption.
        tell: writes what is wrong; `error: ` and the text on one line if left out.
    """
    import typer

    # Newer typers carry their own click, older ones import it; this names its error in both.
    usage_error: type[Exception] = typer.BadParameter.mro()[2]
    known = {usage_error: ExitCode.USAGE, **faults}
    try:
        result = _built(app)(list(argv), prog_name=f"openpendant {name}", standalone_mode=False)
    except BrokenPipeError:
        raise
    except (typer.Abort, KeyboardInterrupt):
        text, code = "interrupted", int(ExitCode.INTERRUPTED)
    except tuple(known) as error:
        text = _described(error, "output")
        code = next(known[kind] for kind in known if isinstance(error, kind))
    else:
        return result if isinstance(result, int) else ExitCode.OK
    if tell is None:
        return fail(text, code)
    tell(text)
    return code


def _built(app: typer.Typer) -> Callable[..., Any]:
    """Return what typer builds of a command at each call, built once."""
    import typer.main

    if app not in _commands:
        _commands[app] = typer.main.get_command(app)
    return _commands[app]


def run_alone(app: typer.Typer, name: str, argv: Sequence[str]) -> int:
    """Run a typer command that tells wrong usage itself, with its usage, and return its code."""
    try:
        _built(app)(list(argv), prog_name=f"openpendant {name}")
    except SystemExit as ended:
        return _code_of(ended, ExitCode.USAGE)
    return ExitCode.OK


def run_parsed(
    parser: argparse.ArgumentParser,
    body: Callable[[argparse.Namespace], int],
    argv: list[str] | None,
    faults: Faults,
) -> int:
    """Parse arguments and run a command; whatever goes wrong becomes a line and a code."""
    try:
        # Options may also stand between a name and what belongs to it.
        arguments = parser.parse_intermixed_args(argv)
    except SystemExit as ended:
        return _code_of(ended, ExitCode.OK)
    if sys.stdout is None:
        # Nothing that a tool finds would be seen, and its exit code would say that all is well.
        complain("standard output is closed")
        return ExitCode.FAILED
    try:
        return body(arguments)
    except BrokenPipeError:
        discard_output()
        return ExitCode.FAILED
    except KeyboardInterrupt:
        return ExitCode.INTERRUPTED
    except tuple(faults) as error:
        # It may quote a file of unknown origin.
        complain(one_line(_described(error, "input or output")))
        return next(faults[kind] for kind in faults if isinstance(error, kind))


def _code_of(ended: SystemExit, otherwise: ExitCode) -> int:
    return ended.code if isinstance(ended.code, int) else otherwise


def _described(error: Exception, file: str) -> str:
    """Return the text of an error: typer's as typer words it, the system's with its file."""
    if isinstance(error, OSError):
        return f"{error.filename or file}: {error.strerror or error}"
    describe: Callable[[], str] = getattr(error, "format_message", error.__str__)
    return describe()


def discard_output() -> None:
    """Discard the pending output after the reader of standard output has closed it.

    Otherwise Python would print a traceback when it flushes the output at its end.
    """
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


# What is written.


def as_typed() -> str:
    """Return how this user types the command `openpendant` here.

    Its name alone where the shell finds this very one, in an activated environment, say; else its
    path, relative to the present folder where it lies in that.
    """
    name = "openpendant"
    ours = Path(sys.executable).parent / name
    found = shutil.which(name)
    if not ours.exists() or (found is not None and Path(found).absolute() == ours):
        return name
    here = Path.cwd()
    return shlex.quote(str(ours.relative_to(here) if ours.is_relative_to(here) else ours))


def fail(text: str, code: int) -> int:
    """Tell the user what is wrong, on one line, and return the exit code."""
    complain(f"error: {one_line(' '.join(text.split()))}")
    return code


def complain(line: str) -> None:
    """Write one line to standard error, clean as `one_line` makes it."""
    if sys.stderr is not None:  # else it would go where the output goes
        print(one_line(line), file=sys.stderr, flush=True)


def one_line(text: str, mark: str | None = None, longest: int = LONGEST_LINE) -> str:
    """Return a text of others as one line that a terminal only shows.

    What a terminal would act on gets a mark, or its escape: control characters and the escape
    sequences that begin with them, line ends, signs that turn the direction of writing, and signs
    that nobody sees. What is longer than `longest` is cut, with the number of signs left out.
    """
    kept, over = text[:longest], len(text) - longest
    if not (kept.isascii() and kept.isprintable()):
        kept = _clean(kept, lambda sign: mark or _escaped(sign))
    return kept if over <= 0 else f"{kept}… ({over} signs more)"


def _clean(text: str, substitute: Callable[[str], str]) -> str:
    clean: list[str] = []
    stacked = 0
    for sign in text:
        stacked = stacked + 1 if unicodedata.category(sign) in ("Mn", "Me") else 0
        is_shown = sign.isprintable() and not _is_invisible(sign) and stacked <= _LONGEST_STACK
        clean.append(sign if is_shown else substitute(sign))
    return "".join(clean)


_INVISIBLE = (
    (0x034F, 0x034F),
    (0x115F, 0x1160),
    (0x17B4, 0x17B5),
    (0x180B, 0x180F),
    (0x2800, 0x2800),
    (0x3164, 0x3164),
    (0xFE00, 0xFE0D),
    (0xFFA0, 0xFFA0),
    (0xE0100, 0xE01EF),
)
"""First and last of the letters and marks that no terminal shows, which `isprintable` lets pass."""


def _is_invisible(sign: str) -> bool:
    return any(first <= ord(sign) <= last for first, last in _INVISIBLE)


def _escaped(sign: str) -> str:
    return sign.encode("unicode_escape").decode()


def json_text(value: object, *, indent: int | None = None) -> str:
    """Return plain data as JSON for people and programs: letters as they are.

    What a terminal would act on stands as an escape of JSON, so a program reads the same value.
    """
    lines = json.dumps(value, indent=indent, ensure_ascii=False).split("\n")
    return "\n".join(map(clean_json, lines))


def clean_json(line: str) -> str:
    """Return JSON on one line that says the same, without signs that a terminal acts on."""
    if line.isascii() and line.isprintable():
        return line
    # Whatever else there is stands in a string: JSON itself is printable ASCII.
    return _clean(line, _json_escaped)


def _json_escaped(sign: str) -> str:
    # Of ASCII this is DEL alone, which `json` lets pass.
    return json.dumps(sign)[1:-1] if ord(sign) > 0x7F else f"\\u{ord(sign):04x}"


def emit_json(value: object, *, compact: bool = False, flush: bool = False) -> None:
    """Print plain data of finite numbers as one line of JSON, `compact` without blanks."""
    separators = (",", ":") if compact else None
    line = json.dumps(value, separators=separators, allow_nan=False)
    print(clean_json(line), flush=flush)


def table(*columns: str) -> Table:
    """Return a table with such heads and without rows yet."""
    from rich.table import Table

    made = Table(title_justify="left")
    for column in columns:
        made.add_column(column)
    return made


def cells(*texts: str) -> list[Text]:
    """Return texts for a table: a name in a file can neither style nor break it."""
    from rich.text import Text

    return [Text(one_line(text, " ")) for text in texts]


def terminal() -> Console:
    """Return where tables are printed; a pipe is as wide as the widest of them."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else _PIPED_WIDTH, highlight=False)
