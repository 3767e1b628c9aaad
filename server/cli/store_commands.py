"""The command `openpendant store`: look into the store, delete from it, check and copy it.

Owns arguments, output and exit codes, nothing else; `store_text_commands` carries documents in
and out. All of it is safe while a server runs.

Exit codes: 0 done, 1 a check found something wrong, 2 a bad argument or file, 3 the store cannot
do it, 130 interrupted.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from openpendant.tools.console import ExitCode, command, emit_json, one_line, run

from ..store.documents import DocumentKind
from ..store.file_check import check_store
from ..store.sqlite_file import copy
from ..store.sqlite_store import open_store
from ..store.store_client import default_path
from ..store.store_errors import BadDocument, BadName, NotFound, StoreError, TooLarge
from .options import (
    AsJson,
    Force,
    Kind,
    Name,
    StoreFile,
    check_new_file,
    command_author,
    counted,
    print_headings,
    reading,
)
from .store_text_commands import export_documents, import_documents

_FAULTS: Mapping[type[Exception], int] = {
    **dict.fromkeys((BadDocument, BadName, NotFound, TooLarge), ExitCode.USAGE),
    StoreError: ExitCode.REFUSED,
}

app = command(
    "List, show, export, import, delete, copy and check the documents of a server.",
    "0 done, 1 something wrong was found, 2 bad argument or file, 3 refused",
)


def main(argv: Sequence[str]) -> int:
    """Run `openpendant store` and return its exit code.

    Args:
        argv: the arguments after `store`.
    """
    return run(app, "store", argv, _FAULTS)


@app.command("list")
def list_documents(
    kind: Annotated[DocumentKind | None, typer.Argument(help="Only of this kind.")] = None,
    store: StoreFile = None,
    as_json: AsJson = False,
) -> None:
    """List the documents."""
    with reading(store) as opened:
        headings = opened.headings(kind)
    print_headings(headings, as_json)


@app.command()
def show(
    kind: Kind,
    name: Name,
    revision: Annotated[int | None, typer.Option(help="An older one that is still kept.")] = None,
    history: Annotated[
        bool, typer.Option("--history", help="List its revisions instead, deletions included.")
    ] = False,
    store: StoreFile = None,
    as_json: AsJson = False,
) -> None:
    """Print a document."""
    with reading(store) as opened:
        if history:
            print_headings(opened.history(kind, name), as_json, what="revision")
            return
        document = opened.load(kind, name, revision)
        about = asdict(document.heading)
        if kind is DocumentKind.RECORDING:
            about |= asdict(opened.extent(name))
    if as_json:
        emit_json(about | {"body": json.loads(document.body)}, compact=True)
        return
    heading = document.heading
    print(one_line(f"{kind} {name}, revision {heading.revision} by {heading.saved_by}"))
    print(json.dumps(json.loads(document.body), indent=2))


app.command("export")(export_documents)
app.command("import")(import_documents)


@app.command()
def delete(
    kind: Kind,
    name: Name,
    store: StoreFile = None,
    as_json: AsJson = False,
) -> None:
    """Delete a document, readable or not; its older revisions stay in its history."""
    if kind is DocumentKind.ACCOUNT:
        advice = "openpendant users remove NAME, which keeps somebody who can manage the others"
        raise BadDocument(f"{kind} {name!r}", f"accounts are removed with {advice}")
    author = command_author("store")
    with contextlib.closing(open_store(store or default_path())) as opened:
        found = [heading for heading in opened.headings(kind) if heading.name == name]
        if not found:
            raise NotFound(kind, name)
        revision = found[0].revision
        gone = opened.delete(kind, name, expected_revision=revision, author=author)
    print_headings((gone,), as_json)


@app.command()
def backup(
    output: Annotated[Path, typer.Argument(metavar="FILE", help="A file that is not there yet.")],
    force: Force = False,
    store: StoreFile = None,
) -> None:
    """Copy the whole store while it is in use; the copy is a store of its own."""
    with reading(store) as opened:
        check_new_file(output, opened, force)
        copy(opened.connection, output, replace=force)
    print(f"wrote {one_line(str(output))}: {output.stat().st_size} bytes")


@app.command()
def check(store: StoreFile = None, as_json: AsJson = False) -> int:
    """Read the whole store and say what is wrong with it; changes nothing."""
    path = store or default_path()
    report = check_store(path)
    if as_json:
        emit_json(asdict(report) | {"file": str(path), "is_sound": report.is_sound}, compact=True)
    else:
        for problem in report.problems:
            print(one_line(problem))
        verdict = "sound" if report.is_sound else "BAD"
        print(
            one_line(
                f"{path}: {verdict}: {counted(report.documents, 'document')},"
                f" {counted(report.revisions, 'revision')},"
                f" {counted(report.chunks, 'chunk')} of recordings"
            )
        )
    return 0 if report.is_sound else ExitCode.FAILED
