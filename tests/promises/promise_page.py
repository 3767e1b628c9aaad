"""Writes what `docs/promises.md` says of the promises from their table; run as a script.

Owns how a figure is printed. The page's own text stands around the blocks that this writes; a test
holds the blocks against the table.
"""

import re
import sys
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

if __name__ == "__main__":
    sys.path[0] = str(Path(__file__).resolve().parents[1])  # tests/, as pytest has it

from promises.promise_table import COMMON, Figure, figure, figures, table

PAGE = Path(__file__).parents[2] / "docs" / "promises.md"
MEASURED = Path(__file__).parent / "measured.toml"

_ALONE = {"ms", "s", "min", "KiB", "MiB", "mm", "mm/s", "rad", "%"}
"""Units that have no plural."""

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def printed(promised: Figure) -> str:
    """Return a figure as the page says it, such as 20 ms, 1,024, 10⁻⁶, 2 ticks."""
    number = f"{promised.bound:,g}" if promised.bound < 1e6 else f"{promised.bound:,.0f}"
    if promised.bound and promised.bound < 1e-2:
        number = f"10{f'{promised.bound:e}'.split('e')[1].lstrip('+').replace('-0', '-')}"
        number = "10" + number[2:].translate(_RAISED)
    if not promised.unit:
        return number
    plural = "" if promised.unit in _ALONE or promised.bound == 1 else "s"
    return f"{number} {promised.unit}{plural}"


def filled(text: str, row: int | str) -> str:
    """Return a text of a row with its figures put in."""
    return text.format_map({name: printed(each) for name, each in figures(row).items()})


def rows() -> list[int]:
    """Return the numbers of the page's rows, rising."""
    return sorted(int(number) for number in table() if number != COMMON)


def _promises() -> str:
    lines = ["| # | When | What happens | Exact | Sockets |", "|---|---|---|---|---|"]
    for row in rows():
        entry: Mapping[str, Any] = table()[str(row)]
        names = ("when", "then", "exact_bound", "socket_bound")
        cells = [filled(entry.get(name, ""), row) for name in names]
        lines.append(re.sub(r" +\|", " |", f"| {row} | {' | '.join(cells)} |"))
    return "\n".join([*lines, "", filled(table()[COMMON]["besides"], COMMON)])


def _notes() -> str:
    return "\n".join(
        f"- Row {row}. {filled(note, row)}"
        for row in rows()
        for note in table()[str(row)].get("notes", [])
    )


def _measured() -> str:
    lines = [
        "| What | Trials | p50 | p99 | most | idle control p99 | allowed p99 |",
        "|---|---|---|---|---|---|---|",
    ]
    for each in tomllib.loads(MEASURED.read_text(encoding="utf-8"))["measured"]:
        row, promised = each["row"], figure(each["row"], each["figure"])
        what = each["what"] if row == COMMON else f"{row}: {each['what']}"
        most = f"{each['most']:,g}"
        if "most_allowed" in each:
            most += f" ({figure(row, each['most_allowed']).ms:,g} allowed)"
        small = [f"{each[name]:g}" if name in each else "" for name in ("p50", "p99")]
        idle = f"{each['idle']:g}" if "idle" in each else ""
        cells = [what, f"{each['trials']:,}", *small, most, idle, f"{promised.ms:,g}"]
        lines.append(re.sub(r" +\|", " |", f"| {' | '.join(cells)} |"))
    return "\n".join(lines)


BLOCKS: Mapping[str, Callable[[], str]] = {
    "method": lambda: filled(table()[COMMON]["method"].strip(), COMMON),
    "promises": _promises,
    "notes": _notes,
    "measured": _measured,
}
"""What is written between the lines `<!-- begin NAME -->` and `<!-- end NAME -->`."""


def written_anew(page: str) -> str:
    """Return the page with its blocks as the table has them."""
    for name, block in BLOCKS.items():
        begin, end = f"<!-- begin {name} -->\n", f"\n<!-- end {name} -->"
        before, found, rest = page.partition(begin)
        _, also_found, after = rest.partition(end)
        assert found, f"the page has no block {name}"
        assert also_found, f"the page has no end of the block {name}"
        page = before + begin + block() + end + after
    return page


if __name__ == "__main__":
    PAGE.write_text(written_anew(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
