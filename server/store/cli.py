"""The command `openpendant store`: look into the store, carry documents in and out, copy it.

Owns arguments, output and exit codes, nothing else. All of it is safe while a server runs.

Exit codes: 0 done, 1 a check found something wrong, 2 a bad argument or file, 3 the store cannot
do it, 130 interrupted.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from ..command_line import EXIT_REFUSED, EXIT_USAGE, StoreFile, command, command_author, run
from ..printable import printable
from .csv_export import POINTS, read_points, save_recording, write_points, write_recording
from .documents import DocumentKind, Heading
from .errors import BadDocument, BadName, NotFound, StoreError, StoreFailed, TooLarge
from .file_check import check_store
from .location import default_path
from .sqlite_file import copy
from .sqlite_store import SqliteStore, open_for_reading, open_store
from .text_export import documents_to_json
from .text_import import Entry, documents_from_json, read_file, save_entries

EXIT_FOUND = 1

_FAULTS: Mapping[type[Exception], int] = {
    **dict.fromkeys((BadDocument, BadName, NotFound, TooLarge), EXIT_USAGE),
    StoreError: EXIT_REFUSED,
}

Kind = Annotated[DocumentKind, typer.Argument(help="Kind of the document.")]
Name = Annotated[str, typer.Argument(help="Its name.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON line.")]

app = command(
    "List, show, export, import, copy and check the documents of a server.",
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
    with _reading(store) as opened:
        headings = opened.headings(kind)
    _print_headings(headings, as_json)


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
    with _reading(store) as opened:
        if history:
            _print_headings(opened.history(kind, name), as_json)
            return
        document = opened.load(kind, name, revision)
        about = asdict(document.heading)
        if kind is DocumentKind.RECORDING:
            about |= asdict(opened.extent(name))
    if as_json:
        _print_json(about | {"body": json.loads(document.body)})
        return
    heading = document.heading
    print(printable(f"{kind} {name}, revision {heading.revision} by {heading.saved_by}"))
    print(json.dumps(json.loads(document.body), indent=2))


@app.command("export")
def export_documents(
    output: Annotated[
        Path, typer.Argument(metavar="FILE", help="FILE.json, or FILE.csv for one document.")
    ],
    kind: Annotated[DocumentKind | None, typer.Option(help="Only of this kind.")] = None,
    name: Annotated[str | None, typer.Option(help="Only of this name.")] = None,
    accounts: Annotated[
        bool, typer.Option("--accounts", help="Also accounts, with the hashes of passwords.")
    ] = False,
    store: StoreFile = None,
) -> None:
    """Write documents as text: all of them, or the points or samples of one as CSV."""
    with _reading(store) as opened:
        chosen = [
            heading
            for heading in opened.headings(kind)
            if (name is None or heading.name == name)
            and (accounts or heading.kind is not DocumentKind.ACCOUNT)
        ]
        if name is not None and not chosen:
            raise NotFound(kind or "document", name)
        if output.suffix == ".csv":
            _export_csv(opened, chosen, output)
        else:
            with _new_file(output) as path, path.open("w", encoding="ascii") as out:
                out.writelines(documents_to_json(opened, chosen))
    print(f"wrote {printable(str(output))}: {len(chosen)} documents")


@app.command("import")
def import_documents(
    source: Annotated[Path, typer.Argument(metavar="FILE", help="FILE.json or FILE.csv.")],
    kind: Annotated[
        DocumentKind, typer.Option(help="Of a CSV: a recording's samples, or points.")
    ] = DocumentKind.PROGRAM,
    name: Annotated[str | None, typer.Option(help="Of a CSV: name of the document.")] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Save over documents of the same names.")
    ] = False,
    store: StoreFile = None,
    as_json: AsJson = False,
) -> None:
    """Read documents from text; all are saved or, if one cannot be, none."""
    author = command_author("import")
    with contextlib.closing(open_store(store or default_path())) as opened:
        if source.suffix != ".csv":
            entries = documents_from_json(read_file(source), str(source))
            saved = save_entries(opened, entries, author, replace=replace)
        elif name is None:
            raise BadDocument(str(source), "a CSV file names no document; say --name")
        else:
            saved = (_import_csv(opened, kind, name, source, author, replace),)
    _print_headings(saved, as_json)


@app.command()
def backup(
    output: Annotated[Path, typer.Argument(metavar="FILE", help="A file that is not there yet.")],
    store: StoreFile = None,
) -> None:
    """Copy the whole store while it is in use; the copy is a store of its own."""
    with _reading(store) as opened:
        copy(opened.connection, output)
    print(f"wrote {printable(str(output))}: {output.stat().st_size} bytes")


@app.command()
def check(store: StoreFile = None, as_json: AsJson = False) -> int:
    """Read the whole store and say what is wrong with it; changes nothing."""
    path = store or default_path()
    report = check_store(path)
    if as_json:
        _print_json(asdict(report) | {"file": str(path), "is_sound": report.is_sound})
    else:
        for problem in report.problems:
            print(printable(problem))
        verdict = "sound" if report.is_sound else "BAD"
        print(
            printable(
                f"{path}: {verdict}: {report.documents} documents, {report.revisions} revisions,"
                f" {report.chunks} chunks of recordings"
            )
        )
    return 0 if report.is_sound else EXIT_FOUND


def _export_csv(store: SqliteStore, chosen: Sequence[Heading], output: Path) -> None:
    if len(chosen) != 1:
        problem = f"a CSV file holds one document, not {len(chosen)}; say --kind and --name"
        raise BadDocument(str(output), problem)
    heading = chosen[0]
    with _new_file(output) as path, path.open("w", encoding="utf-8", newline="") as out:
        if heading.kind is DocumentKind.RECORDING:
            write_recording(store, heading.name, out)
        else:
            write_points(heading.name, store.load(heading.kind, heading.name).body, out)


def _import_csv(
    store: SqliteStore, kind: DocumentKind, name: str, source: Path, author: str, replace: bool
) -> Heading:
    try:
        with source.open("rb") as stream:
            if kind is DocumentKind.RECORDING:
                return save_recording(store, name, stream, str(source), author)
            points = read_points(stream, str(source))
    except OSError as error:
        raise StoreFailed(f"{source}: {error.strerror}") from None
    data: dict[str, object] = {}
    if replace:
        with contextlib.suppress(NotFound):
            data = json.loads(store.load(kind, name).body)
    body = json.dumps(data | {POINTS: points}, ensure_ascii=False, allow_nan=False)
    (saved,) = save_entries(store, [Entry(kind, name, body)], author, replace=replace)
    return saved


@contextlib.contextmanager
def _reading(path: Path | None) -> Iterator[SqliteStore]:
    with contextlib.closing(open_for_reading(path or default_path())) as store:
        yield store


@contextlib.contextmanager
def _new_file(path: Path) -> Iterator[Path]:
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


def _print_headings(headings: Sequence[Heading], as_json: bool) -> None:
    if as_json:
        _print_json([asdict(heading) for heading in headings])
        return
    for heading in headings:
        deleted = " deleted" if heading.deleted else ""
        print(
            printable(
                f"{heading.kind:<9}  {heading.name:<24}  revision {heading.revision:>4}"
                f"  {heading.size:>8} bytes  {heading.saved_at}  {heading.saved_by}{deleted}"
            )
        )
    print(f"{len(headings)} {'document' if len(headings) == 1 else 'documents'}", file=sys.stderr)


def _print_json(value: object) -> None:
    print(json.dumps(value, separators=(",", ":"), allow_nan=False))
