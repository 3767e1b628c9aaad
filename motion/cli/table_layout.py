"""Layout of tables on a terminal of any width: no number and no name is cut.

Owns how a table gives way where its window is narrow: it loses its grid and folds its heads; where
that is not enough it also folds cells, at blanks only; else each row becomes a block of lines.
"""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

from rich.cells import cell_len
from rich.console import Console
from rich.measure import Measurement
from rich.table import Column, Table
from rich.text import Text

from openpendant.tools.console import terminal

_UNBOUNDED = 100_000
"""Wider than any table [columns]."""

_GAP = 2
"""Columns between the cells of a table without a grid."""


def print_table(made: Table, console: Console | None = None) -> None:
    """Print a table whole, in as much of a table's form as the width allows."""
    console = console or terminal()
    unbounded = console.options.update(width=_UNBOUNDED)
    if Measurement.get(console, unbounded, made).maximum <= console.width:
        console.print(made)
        return
    columns = [_Column.of(column) for column in made.columns]
    room = console.width - _GAP * (len(columns) - 1)
    if sum(max(each.head, each.whole) for each in columns) <= room:
        console.print(_folded(made, columns, [max(each.head, each.whole) for each in columns]))
    elif sum(max(each.head, each.word) for each in columns) <= room:
        console.print(_folded(made, columns, _widths(columns, room)))
    else:
        console.print(Text("\n".join(_blocks(made, columns, console.width))), soft_wrap=True)


@dataclass(frozen=True, slots=True)
class _Column:
    """A column's texts, and the widths of its longest piece of head, cell and word of a cell."""

    title: str
    texts: tuple[str, ...]
    head: int
    whole: int
    word: int

    @classmethod
    def of(cls, column: Column) -> _Column:
        title = str(column.header)
        texts = tuple(map(str, column.cells))
        words = [word for text in texts for word in text.split()]
        return cls(
            title,
            texts,
            max(map(cell_len, _pieces(title, 1)), default=0),
            max(map(cell_len, texts), default=0),
            max(map(cell_len, words), default=0),
        )


def _pieces(head: str, width: int) -> list[str]:
    """Return the lines of a head, which may break at blanks and hyphens."""
    return textwrap.wrap(head, width, break_long_words=False)


def _widths(columns: list[_Column], room: int) -> list[int]:
    """Return a width for each column in which every word is whole; the narrowest grow first."""
    widths = [max(each.head, each.word) for each in columns]
    for index in sorted(range(len(columns)), key=lambda each: columns[each].whole - widths[each]):
        spare = room - sum(widths)
        widths[index] += max(0, min(spare, columns[index].whole - widths[index]))
    return widths


def _folded(made: Table, columns: list[_Column], widths: list[int]) -> Table:
    """Return the table without a grid, its columns as wide as told."""
    folded = Table(
        title=made.title, title_justify="left", box=None, padding=(0, _GAP, 0, 0), pad_edge=False
    )
    for column, old, width in zip(columns, made.columns, widths, strict=True):
        head = Text("\n".join(_pieces(column.title, width)))
        folded.add_column(head, width=width, justify=old.justify)
    for row in zip(*(column.texts for column in columns), strict=True):
        folded.add_row(*map(Text, row))
    return folded


def _blocks(made: Table, columns: list[_Column], width: int) -> list[str]:
    """Return a block of lines for each row: its first cell, then heads and cells in pairs."""
    lines = [str(made.title)] if made.title else []
    (first, *others) = columns
    # Only where every row has a cell of about that size do pairs stand in columns of their own.
    sizes = [len(each.title) + 2 + each.whole for each in others if _is_short(each, width)]
    size = max(sizes, default=width)
    per_line = max(1, (width - _GAP) // (size + _GAP))
    for number, name in enumerate(first.texts):
        lines.append(f"{first.title} {name}".strip())
        pairs = [
            (each, f"{each.title}: {each.texts[number]}") for each in others if each.texts[number]
        ]
        short = [text.ljust(size) for each, text in pairs if _is_short(each, width)]
        for at in range(0, len(short), per_line):
            lines.append(" " * _GAP + (" " * _GAP).join(short[at : at + per_line]).rstrip())
        for text in (text for each, text in pairs if not _is_short(each, width)):
            margin = " " * _GAP
            lines += textwrap.wrap(
                text,
                width,
                initial_indent=margin,
                subsequent_indent=2 * margin,
                break_long_words=False,
                break_on_hyphens=False,
            )
    return lines


def _is_short(column: _Column, width: int) -> bool:
    """Return True for a column of which at least two pairs stand on a line."""
    return len(column.title) + 2 + column.whole <= (width - 2 * _GAP) // 2
