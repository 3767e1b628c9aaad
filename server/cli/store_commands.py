"""The command `openpendant store`: look into the store, delete, check, copy, export and import.

Owns arguments, output and exit codes. All of it is safe while a server runs. Exit codes: 0 done,
1 a check found something wrong, 2 a bad argument or file, 3 the store cannot do it, 130
interrupted.

Owns for export and import which form a file has, and in which order it is read, checked and saved.
What a document of each kind has to hold is `document_check`'s business; it is imported only where
it is needed, because `store list` can do without it.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from openpendant.motion.bounded_file import open_regular
from openpendant.tools.console import ExitCode, command, emit_json, one_line, run

from ..exchange.csv_format import read_points, save_recording, write_points, write_recording
from ..exchange.text_format import (
    ImportedDocument,
    documents_from_json,
    documents_to_json,
    named,
    read_file,
    save_entries,
)
from ..store.documents import DocumentKind, Heading, check_new_name, check_revision
from ..store.sqlite_file import copy
from ..store.sqlite_store import SqliteStore, check_store, open_store
from ..store.store_client import default_path
from ..store.store_errors import BadDocument, BadName, NotFound, StoreError, StoreFailed, TooLarge
from .options import (
    AsJson,
    Force,
    Kind,
    Name,
    StoreFile,
    check_new_file,
    command_author,
    counted,
    new_file,
    print_headings,
    reading,
)

_CSV, _PROGRAM, _JSON = ".csv", ".program", ".json"
_PROGRAM_FORMAT = "openpendant-program/1"


def export_documents(
    output: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="FILE.json; of one document FILE.csv; of one program FILE.program."
        ),
    ],
    kind: Annotated[DocumentKind | None, typer.Option(help="Only of this kind.")] = None,
    name: Annotated[str | None, typer.Option(help="Only of this name.")] = None,
    accounts: Annotated[
        bool, typer.Option("--accounts", help="Also accounts, with the hashes of passwords.")
    ] = False,
    force: Force = False,
    store: StoreFile = None,
) -> None:
    """Write documents as text: all of them, or one program, points or samples."""
    with reading(store) as opened:
        chosen = [
            heading
            for heading in opened.headings(kind)
            if (name is None or heading.name == name)
            and (accounts or heading.kind is not DocumentKind.ACCOUNT)
        ]
        if name is not None and not chosen:
            raise NotFound(kind or "document", name)
        if output.suffix in (_CSV, _PROGRAM) and len(chosen) != 1:
            problem = f"such a file holds one document, not {len(chosen)}; say --kind and --name"
            raise BadDocument(str(output), problem)
        check_new_file(output, opened, force)
        if output.suffix == _CSV:
            _export_csv(opened, chosen[0], output)
        elif output.suffix == _PROGRAM:
            _export_program(opened, chosen[0], output)
        else:
            with new_file(output) as path, path.open("w", encoding="ascii") as out:
                out.writelines(documents_to_json(opened, chosen))
    typer.echo(f"wrote {one_line(str(output))}: {counted(len(chosen), 'document')}")


def _export_csv(store: SqliteStore, heading: Heading, output: Path) -> None:
    with new_file(output) as path, path.open("w", encoding="utf-8", newline="") as out:
        if heading.kind is DocumentKind.RECORDING:
            write_recording(store, heading.name, out)
        else:
            write_points(heading.name, store.load(heading.kind, heading.name).body, out)


def _export_program(store: SqliteStore, heading: Heading, output: Path) -> None:
    from ..exchange.document_check import program_text

    if heading.kind is not DocumentKind.PROGRAM:
        problem = f"a file {_PROGRAM} holds a program, not {heading.kind} {heading.name!r}"
        raise BadDocument(str(output), problem)
    text = program_text(heading.name, store.load(heading.kind, heading.name).body)
    with new_file(output) as path, path.open("w", encoding="utf-8") as out:
        out.write(text)


def import_documents(
    source: Annotated[
        Path, typer.Argument(metavar="FILE", help="FILE.json, FILE.csv, or a program's text.")
    ],
    kind: Annotated[
        DocumentKind, typer.Option(help="Of a CSV: a recording's samples, or points.")
    ] = DocumentKind.PROGRAM,
    name: Annotated[
        str | None, typer.Option(help="Of a file with one document: what it is to be called.")
    ] = None,
    robot: Annotated[
        str | None, typer.Option(help="Of a CSV: the robot of the new program, of the samples.")
    ] = None,
    replace: Annotated[
        bool, typer.Option("--replace", help="Save over documents of the same names.")
    ] = False,
    accounts: Annotated[
        bool, typer.Option("--accounts", help="Also accounts, who may then log in.")
    ] = False,
    store: StoreFile = None,
    as_json: AsJson = False,
) -> None:
    """Read documents from text; all are saved or, if one cannot be, none."""
    from ..exchange.document_check import check_entries

    author = command_author("import")
    is_csv = source.suffix == _CSV
    if is_csv and name is None:
        raise BadDocument(str(source), "a CSV file names no document; say --name")
    if robot is not None and not is_csv:
        raise BadDocument(str(source), "names its robot itself; accepted: without --robot")
    entries = () if is_csv else _entries(source, name)
    with contextlib.closing(open_store(store or default_path())) as opened:
        if is_csv and kind is DocumentKind.RECORDING:
            assert name is not None, "checked above"
            saved = _import_samples(opened, name, source, robot, author)
        else:
            if is_csv:
                assert name is not None, "checked above"
                entries = (_points(opened, kind, name, source, robot, replace),)
            entries = check_entries(entries, str(source), partial(_kept, opened))
            _tell_of_unknown_robots(entries)
            saved = _save(opened, entries, str(source), author, replace, accounts)
    print_headings(saved, as_json)


def _entries(source: Path, name: str | None) -> tuple[ImportedDocument, ...]:
    """Return the documents of a file that is no CSV."""
    from ..exchange.document_check import program_entry

    text, file = read_file(source), str(source)

    def program() -> tuple[ImportedDocument, ...]:
        return (program_entry(text, file, name),)

    if source.suffix != _JSON and not text.lstrip().startswith(("{", "[")):
        return program()
    entries = documents_from_json(text, file, {_PROGRAM_FORMAT: program})
    if name is None or (len(entries) == 1 and entries[0].name == name):
        return entries
    if len(entries) != 1 or entries[0].kind is DocumentKind.ACCOUNT:
        problem = "--name is for a file with one document that is no account"
        found = counted(len(entries), "document")
        raise BadDocument(file, f"{problem}; this one has {found}")
    return (named(entries[0], name),)


def _points(
    store: SqliteStore,
    kind: DocumentKind,
    name: str,
    source: Path,
    robot: str | None,
    replace: bool,
) -> ImportedDocument:
    from ..exchange.document_check import program_of_points

    if kind is not DocumentKind.PROGRAM:
        problem = f"holds points of a program or samples of a recording, no {kind}"
        raise BadDocument(str(source), problem)
    try:
        with open_regular(source) as stream:
            points = read_points(stream, str(source))
    except (OSError, ValueError) as error:
        raise _unreadable(source, error) from None
    return program_of_points(name, points, _kept(store, kind, name), robot, replacing=replace)


def _import_samples(
    store: SqliteStore, name: str, source: Path, robot: str | None, author: str
) -> tuple[Heading, ...]:
    from ..exchange.document_check import check_samples, robot_of_samples

    found, file = robot_of_samples(name, robot), str(source)
    described = {"robot": found.name, "joints": found.limits.names}
    # Now rather than after a file of hours was read; it is looked at once more as it is saved.
    check_new_name(name)
    with contextlib.suppress(NotFound):
        kept = store.load(DocumentKind.RECORDING, name).heading
        check_revision(DocumentKind.RECORDING, name, 0, kept)
    check = partial(check_samples, name, found, file)
    try:
        with open_regular(source) as stream:
            saved = save_recording(store, name, stream, file, author, described, check)
    except (OSError, ValueError) as error:
        raise _unreadable(source, error) from None
    return (saved,)


def _unreadable(source: Path, error: Exception) -> StoreFailed:
    return StoreFailed(f"{source}: {getattr(error, 'strerror', None) or error}")


def _tell_of_unknown_robots(entries: Sequence[ImportedDocument]) -> None:
    """Print which programs could not be checked against the joints of their robot."""
    from ..exchange.document_check import robot_of_program

    for entry in entries:
        if entry.kind is DocumentKind.PROGRAM:
            name, own = robot_of_program(entry.body)
            if own is None:
                text = (
                    f"program {entry.name!r} is of {name!r}, which is no robot of the catalogue:"
                    " its joints were not looked at"
                )
                typer.echo(one_line(text), err=True)


def _kept(store: SqliteStore, kind: DocumentKind, name: str) -> str | None:
    try:
        return store.load(kind, name).body
    except NotFound:
        return None


def _save(
    store: SqliteStore,
    entries: Sequence[ImportedDocument],
    file: str,
    author: str,
    replace: bool,
    accounts: bool,
) -> tuple[Heading, ...]:
    """Save checked documents, all or none; accounts keep the rules of accounts."""
    from ..access.accounts import AccountRefused, StoredAccounts, read_account

    given = [entry for entry in entries if entry.kind is DocumentKind.ACCOUNT]
    if given and not accounts:
        # Whoever reads a file from elsewhere for its programs lets nobody in by it.
        problem = f"account {given[0].name!r} is taken with --accounts only"
        raise BadDocument(file, problem, place=given[0].where)
    others = [entry for entry in entries if entry.kind is not DocumentKind.ACCOUNT]
    try:
        with store.together():
            saved = save_entries(store, others, author, replace=replace)
            if not given:
                return saved
            whole = [read_account(entry.name, entry.body) for entry in given]
            return saved + StoredAccounts(store, author).bring(whole, replace=replace)
    except AccountRefused as error:
        raise StoreError(error.refusal.sentence) from None


_FAULTS: Mapping[type[Exception], int] = {
    **dict.fromkeys((BadDocument, BadName, NotFound, TooLarge), ExitCode.USAGE),
    StoreError: ExitCode.REFUSED,
}

app = command(
    "List, show, export, import, delete, copy and check the documents of a server.",
    "0 done, 1 something wrong was found, 2 bad argument or file, 3 refused",
)


def main(argv: Sequence[str]) -> int:
    """Run `openpendant store` and return its exit code."""
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
