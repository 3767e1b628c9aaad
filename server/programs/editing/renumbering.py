"""Renumbering of a program's statements by a change.

Owns its rule, as a value that can be reversed. An edit defines the moves of its statements; between
two texts, a statement is found again only where its place is beyond doubt.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from .edits import (
    DeleteStatements,
    Edit,
    InsertStatements,
    RecordPoint,
    ReorderStatements,
)


class StatementSpan(NamedTuple):
    """Consecutive statements that stay together.

    Attributes:
        before: number of the first before the change, from 0.
        after: its number after the change, from 0.
        length: number of statements.
    """

    before: int
    after: int
    length: int


@dataclass(frozen=True, slots=True)
class Renumbering:
    """Statements that a change keeps, with their numbers; all others are gone or new.

    Attributes:
        stretches: statements that stay together; none is in two of them.
    """

    stretches: tuple[StatementSpan, ...]

    @property
    def reversed(self) -> Renumbering:
        """Reverse renumbering."""
        return Renumbering(
            tuple(StatementSpan(s.after, s.before, s.length) for s in self.stretches)
        )

    def place(self, before: int) -> int | None:
        """Return the number of a statement after the change; None if it is gone."""
        for stretch in self.stretches:
            if stretch.before <= before < stretch.before + stretch.length:
                return stretch.after + before - stretch.before
        return None

    def places(self, before: Iterable[int]) -> frozenset[int]:
        """Return the numbers after the change of the statements that are kept."""
        found = (self.place(each) for each in before)
        return frozenset(each for each in found if each is not None)


def by_edit(edit: Edit, count: int) -> Renumbering:
    """Return the renumbering by an edit.

    Args:
        edit: one that the program accepts. A statement that is replaced keeps its place.
        count: statements before the edit.
    """
    match edit:
        case InsertStatements(statements, at):
            return _inserted(count if at is None else at, len(statements), count)
        case RecordPoint(move=move, at=at) if move is not None:
            return _inserted(count if at is None else at, 1, count)
        case DeleteStatements(first, gone):
            rest = count - first - gone
            return _of(StatementSpan(0, 0, first), StatementSpan(first + gone, first, rest))
        case ReorderStatements(first, moved, to):
            order = [*range(first), *range(first + moved, count)]
            order[to:to] = range(first, first + moved)
            return _of(*_stretches((before, after) for after, before in enumerate(order)))
    return _of(StatementSpan(0, 0, count))


def between(before: Sequence[Hashable], after: Sequence[Hashable]) -> Renumbering:
    """Return the renumbering between two lists of statements.

    A statement is found again where all before it or all behind it is unchanged, or where there is
    one equal statement in each list. Where one of several equal ones was added or removed, it is
    not decidable which: these are not found again.
    """
    least, more = min(len(before), len(after)), len(after) - len(before)
    same = zip(before, after, strict=False)
    head = next((n for n, (one, other) in enumerate(same) if one != other), least)
    same = zip(reversed(before), reversed(after), strict=False)
    tail = next((n for n, (one, other) in enumerate(same) if one != other), least)
    if head + tail >= least:
        # Statements were added or removed in one place, which may be any place of the overlap.
        certain = least - tail if more else head
        behind = min(head + max(-more, 0), len(before)) if more else len(before)
        rest = StatementSpan(behind, behind + more, len(before) - behind)
        return _of(StatementSpan(0, 0, certain), rest)
    pairs = _alone(before, after, range(head, len(before) - tail))
    behind = len(before) - tail
    return _of(
        StatementSpan(0, 0, head), *_stretches(pairs), StatementSpan(behind, behind + more, tail)
    )


def _alone(
    before: Sequence[Hashable], after: Sequence[Hashable], sought: range
) -> Iterator[tuple[int, int]]:
    """Yield the numbers of statements that equal no other in either list."""
    counts, places = Counter(before), {each: number for number, each in enumerate(after)}
    others = Counter(after)
    for number in sought:
        each = before[number]
        if counts[each] == others[each] == 1:
            yield number, places[each]


def _inserted(at: int, new: int, count: int) -> Renumbering:
    return _of(StatementSpan(0, 0, at), StatementSpan(at, at + new, count - at))


def _stretches(pairs: Iterable[tuple[int, int]]) -> Iterator[StatementSpan]:
    """Yield the stretches of pairs of numbers."""
    under_way: StatementSpan | None = None
    for before, after in pairs:
        if under_way is not None:
            first, to, length = under_way
            if (before, after) == (first + length, to + length):
                under_way = StatementSpan(first, to, length + 1)
                continue
            yield under_way
        under_way = StatementSpan(before, after, 1)
    if under_way is not None:
        yield under_way


def _of(*stretches: StatementSpan) -> Renumbering:
    return Renumbering(tuple(each for each in stretches if each.length > 0))
