"""Shared parts of the commands on the store: its options, how it is opened, how files are written.

Owns also how revisions are printed. Knows none of the commands.
"""

from __future__ import annotations

import contextlib
import getpass
import os
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from openpendant.simplemsg.names import LONGEST_NAME
from openpendant.tools.console import emit_json, one_line

from ..store.documents import DocumentKind, Heading
from ..store.sqlite_store import SqliteStore, open_for_reading
from ..store.store_client import STORE_VARIABLE, default_path
from ..store.store_errors import StoreFailed

StoreFile = Annotated[
    Path | None,
    typer.Option("--store", metavar="FILE", help=f"The store; else ${STORE_VARIABLE}."),
]
"""The option that names the store; `default_path` where it is left out."""


def command_author(command_name: str) -> str:
    """Return who changes the store, as its revisions name him."""
    try:
        return f"{command_name} by {getpass.getuser()}"[:LONGEST_NAME]
    except (KeyError, OSError):  # a process without a name, in a container say
        return command_name


Kind = Annotated[DocumentKind, typer.Argument(help="Kind of the document.")]
Name = Annotated[str, typer.Argument(help="Its name.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON line.")]
Force = Annotated[bool, typer.Option("--force", help="Write over a file that is there already.")]


@contextlib.contextmanager
def reading(path: Path | None) -> Iterator[SqliteStore]:
    """Keep a store open for reading while the context lasts."""
    with contextlib.closing(open_for_reading(path or default_path())) as store:
        yield store


def check_new_file(path: Path, store: SqliteStore, force: bool) -> None:
    """Refuse to write over a file.

    Raises:
        StoreFailed: there is one, and nobody said that it may go; or it is the store itself.
    """
    if path.exists() and path.samefile(store.path):
        raise StoreFailed(f"{path}: is the store itself; choose another file")
    if os.path.lexists(path) and not force:
        raise StoreFailed(f"{path}: exists already; choose another file, or say --force")


@contextlib.contextmanager
def new_file(path: Path) -> Iterator[Path]:
    """Give a file beside the wanted one, which takes its place when the context ends well."""
    beside = path.with_name(path.name + ".partial")
    try:
        beside.touch(mode=0o600)
        yield beside
        os.replace(beside, path)
    except OSError as error:
        raise StoreFailed(f"{path}: {error.strerror or error}") from None
    finally:
        with contextlib.suppress(OSError):
            beside.unlink(missing_ok=True)


def counted(count: int, what: str) -> str:
    """Return a number of things in words, such as 1 document, 2 documents."""
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def print_headings(headings: Sequence[Heading], as_json: bool, what: str = "document") -> None:
    """Print a line for each revision of a document, or all of them as one of JSON.

    Args:
        as_json: as one line of JSON.
        what: each of them is, for the count at the end.
    """
    if as_json:
        emit_json([asdict(heading) for heading in headings], compact=True)
        return
    for heading in headings:
        deleted = " deleted" if heading.deleted else ""
        typer.echo(
            one_line(
                f"{heading.kind:<9}  {heading.name:<24}  revision {heading.revision:>4}"
                f"  {heading.size:>8} bytes  {heading.saved_at}  {heading.saved_by}{deleted}"
            )
        )
    typer.echo(counted(len(headings), what), err=True)
