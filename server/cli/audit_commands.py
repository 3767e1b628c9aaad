"""The command `openpendant audit`: show the audit log, and check its chain.

Owns arguments, output and exit codes, nothing else. It reads the files and locks nothing, so it is
safe while a server writes.

Exit codes: 0 done, 1 the chain is broken, 2 a bad argument, or a log that cannot be read,
130 interrupted.
"""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from openpendant.tools.console import ExitCode, command, emit_json, one_line, run

from ..access.audit import AuditEvent, ChainCheck, read_line
from ..access.audit_file import all_files, read_lines

_MOST_FAULTS = 20

LogFile = Annotated[
    Path, typer.Argument(metavar="FILE", help="The audit log; older files beside it are read too.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print JSON.")]

app = command(
    "Show the audit log of a server, and check that nobody altered it.",
    "0 done, 1 the chain is broken, 2 bad argument or file",
)


def main(argv: Sequence[str]) -> int:
    """Run `openpendant audit` and return its exit code."""
    return run(app, "audit", argv, {OSError: ExitCode.USAGE})


@app.command()
def show(
    file: LogFile,
    as_json: AsJson = False,
    event: Annotated[
        AuditEvent | None, typer.Option(metavar="EVENT", help="Entries of this kind only.")
    ] = None,
    who: Annotated[str | None, typer.Option(help="Entries of this account or guest only.")] = None,
    last: Annotated[
        int | None, typer.Option(min=1, help="So many entries from the end only.")
    ] = None,
) -> None:
    """Print the entries, oldest first; with --json as they stand in the log."""
    chosen: Iterable[dict[str, Any]] = _records(file, event, who)
    if last is not None:
        chosen = deque(chosen, maxlen=last)
    for record in chosen:
        # ASCII as in the file; what the escapes stand for never reaches a terminal.
        typer.echo(json.dumps(record) if as_json else one_line(_in_words(record)))


@app.command()
def verify(
    file: LogFile,
    as_json: AsJson = False,
    anchor: Annotated[
        str | None, typer.Option(metavar="HASH", help="A line's hash that was noted elsewhere.")
    ] = None,
    from_the_middle: Annotated[
        bool, typer.Option("--from-the-middle", help="Older files were taken away on purpose.")
    ] = False,
) -> int:
    """Check that no line was altered, removed or put in, and print the last line's hash."""
    check = ChainCheck(from_the_middle=from_the_middle)
    faults: list[str] = []
    is_anchored = anchor is None
    for line in _lines(file):
        fault = check.feed(line)
        if fault is not None:
            faults.append(fault)
        is_anchored = is_anchored or check.last.digest == anchor
    unfinished = check.finish()
    if unfinished is not None:
        faults.append(unfinished)
    if not is_anchored:
        faults.append(f"no line has the hash {anchor}")
    if as_json:
        emit_json(_verdict(check, faults))
    else:
        _say(check, faults)
    return ExitCode.FAILED if faults else 0


def _verdict(check: ChainCheck, faults: list[str]) -> dict[str, Any]:
    return {
        "intact": not faults,
        "lines": check.lines,
        "torn": check.torn,
        "last": check.last.number,
        "hash": check.last.digest,
        "faults": faults[:_MOST_FAULTS],
    }


def _say(check: ChainCheck, faults: list[str]) -> None:
    for fault in faults[:_MOST_FAULTS]:
        typer.echo(one_line(fault))
    if len(faults) > _MOST_FAULTS:
        typer.echo(f"and {len(faults) - _MOST_FAULTS} more")
    torn = f", {check.torn} torn by a crash and accounted for" if check.torn else ""
    state = "broken" if faults else "intact"
    typer.echo(f"{state}: {check.lines} lines{torn}; entry {check.last.number} has the hash")
    typer.echo(check.last.digest)


def _lines(file: Path) -> Iterator[bytes]:
    if not all_files(file):
        raise FileNotFoundError(2, "there is no such audit log", str(file))
    return read_lines(file)


def _records(file: Path, event: AuditEvent | None, who: str | None) -> Iterator[dict[str, Any]]:
    for line in _lines(file):
        record = read_line(line)
        if record is None:
            continue  # `verify` reports it
        if event is not None and record.get("event") != event:
            continue
        if who is None or record.get("who") == who:
            yield record


def _in_words(record: dict[str, Any]) -> str:
    who = record.get("who") or "-"
    role = f" ({record['role']})" if record.get("role") else ""
    source = f" from {record['source']}" if record.get("source") else ""
    cell = f" at {record['cell']}" if record.get("cell") else ""
    detail = "".join(f" {key}={value}" for key, value in record.get("detail", {}).items())
    return f"{record.get('time')} {record.get('event')} {who}{role}{source}{cell}{detail}"
