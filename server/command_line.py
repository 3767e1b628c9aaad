"""What the commands on the server's files share: `store`, `users` and `audit`.

Owns how a command is run, its exit codes and how a fault is told. Knows none of the commands.
"""

from __future__ import annotations

import getpass
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from .printable import printable
from .store.documents import LONGEST_NAME
from .store.location import STORE_VARIABLE

EXIT_USAGE = 2
EXIT_REFUSED = 3
EXIT_INTERRUPTED = 130

# Newer typers carry their own click, older ones import it; this names its error in both.
_TyperUsageError: type[Exception] = typer.BadParameter.mro()[2]

StoreFile = Annotated[
    Path | None,
    typer.Option("--store", metavar="FILE", help=f"The store; else ${STORE_VARIABLE}."),
]
"""The option that names the store; `default_path` where it is left out."""


def command(about: str, exit_codes: str) -> typer.Typer:
    """Return a command without sub-commands yet.

    Args:
        about: one sentence for its help.
        exit_codes: what its help says of them.
    """
    return typer.Typer(
        add_completion=False,
        rich_markup_mode=None,
        pretty_exceptions_enable=False,
        help=about,
        epilog=f"Exit codes: {exit_codes}.",
    )


def run(
    app: typer.Typer, name: str, argv: Sequence[str], faults: Mapping[type[Exception], int]
) -> int:
    """Run a command and return its exit code; no fault that is expected leaves as a traceback.

    Args:
        app: the command.
        name: how the user calls it, after `openpendant`.
        argv: the arguments after its name.
        faults: the errors that are told to the user, with their exit codes; the first that fits.
    """
    try:
        result = app(args=list(argv), prog_name=f"openpendant {name}", standalone_mode=False)
    except _TyperUsageError as error:
        describe = getattr(error, "format_message", error.__str__)
        return fail(describe(), EXIT_USAGE)
    except typer.Abort:
        return fail("interrupted", EXIT_INTERRUPTED)
    except tuple(faults) as error:
        return fail(str(error), next(faults[kind] for kind in faults if isinstance(error, kind)))
    return result if isinstance(result, int) else 0


def command_author(command_name: str) -> str:
    """Return who changes the store, as its revisions name him."""
    try:
        return f"{command_name} by {getpass.getuser()}"[:LONGEST_NAME]
    except (KeyError, OSError):  # a process without a name, in a container say
        return command_name


def fail(message: str, code: int) -> int:
    """Tell the user what is wrong, on one line, and return the exit code."""
    typer.echo(f"error: {printable(' '.join(message.split()))}", err=True)
    return code
