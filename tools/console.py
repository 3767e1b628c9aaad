"""Console: how a command line is run, what it exits with, and how it writes to a terminal.

Owns the exit codes, the way from an error to one line on standard error, and the layout of tables
and of JSON. The one module of `tools` that the command line of every room may import. The standard
library is enough to load it: who has no typer and no rich runs the emulator and the packet tools.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable, Mapping, Sequence
from enum import IntEnum
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import argparse

    import typer
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

Faults = Mapping[type[Exception], int]
"""The errors that are told to the user, with their exit codes; the first that fits counts."""

_PIPED_WIDTH = 140


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
        result = app(args=list(argv), prog_name=f"openpendant {name}", standalone_mode=False)
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


def run_alone(app: typer.Typer, name: str, argv: Sequence[str]) -> int:
    """Run a typer command that tells wrong usage itself, with its usage, and return its code."""
    try:
        app(list(argv), prog_name=f"openpendant {name}")
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


def fail(text: str, code: int) -> int:
    """Tell the user what is wrong, on one line, and return the exit code."""
    complain(f"error: {one_line(' '.join(text.split()))}")
    return code


def complain(line: str) -> None:
    """Write one line to standard error."""
    if sys.stderr is not None:  # else it would go where the output goes
        print(line, file=sys.stderr, flush=True)


def one_line(text: str, mark: str | None = None) -> str:
    """Return text of others with a mark, or its escape, for each sign that a terminal acts on."""
    return "".join(sign if sign.isprintable() else mark or _escaped(sign) for sign in text)


def _escaped(sign: str) -> str:
    return sign.encode("unicode_escape").decode()


def emit_json(value: object, *, compact: bool = False, flush: bool = False) -> None:
    """Print plain data of finite numbers as one line of JSON, `compact` without blanks."""
    separators = (",", ":") if compact else None
    print(json.dumps(value, separators=separators, allow_nan=False), flush=flush)


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
