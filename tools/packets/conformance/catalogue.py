"""The table of all checks in docs/conformance.md, written from the register.

`python -m openpendant.tools.packets.conformance.catalogue docs/conformance.md` brings the page up
to date; a test fails while it is not.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import Any

from .check import Check
from .client.judge import CHECKS
from .server.checks import server_checks

BEGIN = "<!-- checks: written by openpendant.tools.packets.conformance.catalogue -->"
END = "<!-- end of checks -->"


def page_with_checks(page: str) -> str:
    """Return the page with its tables of checks written anew; ValueError where it has no marks."""
    before, begin, rest = page.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not (begin and end):
        raise ValueError("the marks of the tables of checks are missing")
    servers = [
        (entry, ", ".join(sorted(profile.value for profile in entry.profiles)))
        for entry in server_checks()
    ]
    clients = [(entry, "") for entry in CHECKS]
    tables = [
        f"### Servers: {len(servers)} checks",
        *_tables(servers, "profiles"),
        f"### Clients: {len(clients)} checks",
        *_tables(clients, ""),
    ]
    return "\n\n".join([before + begin, *tables, end + after])


def _tables(entries: Iterable[tuple[Check[Any], str]], last: str) -> Iterable[str]:
    for section, group in groupby(entries, key=lambda entry: entry[0].section):
        yield f"#### {section.value}: {section.name.lower().replace('_', ' ')}"
        head = ["number", "what must hold", "because of", *([last] if last else [])]
        rows = [_row(head), _row(["---"] * len(head))]
        for info, profiles in group:
            title = f"{info.title} *(moves)*" if info.moves else info.title
            rows.append(_row([info.number, title, info.clause, *([profiles] if last else [])]))
        yield "\n".join(rows)


def _row(cells: Iterable[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def main(argv: list[str]) -> int:
    """Bring a page up to date."""
    file = Path(argv[0])
    file.write_text(page_with_checks(file.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
