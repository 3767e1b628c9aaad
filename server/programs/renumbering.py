"""Which statement of a program is which after a change, by their numbers.

Owns the rule of it, as a value that can be taken back. An edit says what moves where; between two
texts that somebody wrote, a statement is found again only where its place is beyond doubt.
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


class Stretch(NamedTuple):
    """Statements in a row that stay together.

    Attributes:
        before: number of the first before the change, from 0.
        after: its number after the change, from 0.
        length: how many there are.
    """

    before: int
    after: int
    length: int


@dataclass(frozen=True, slots=True)
class Renumbering:
    """The statements that a change leaves, and where they are; all others are gone or new.

    Attributes:
        stretches: what stays together; no statement is in two of them.
    """

    stretches: tuple[Stretch, ...]

    @property
    def reversed(self) -> Renumbering:
        """The way back."""
        return Renumbering(tuple(Stretch(s.after, s.before, s.length) for s in self.stretches))

    def place(self, before: int) -> int | None:
        """Return the number that a statement has after the change; None where it is gone."""
        for stretch in self.stretches:
            if stretch.before <= before < stretch.before + stretch.length:
                return stretch.after + before - stretch.before
        return None

    def places(self, before: Iterable[int]) -> frozenset[int]:
        """Return the numbers after the change of those that are not gone."""
        found = (self.place(each) for each in before)
        return frozenset(each for each in found if each is not None)


def by_edit(edit: Edit, count: int) -> Renumbering:
    """Return what an edit does to the numbers.

    Args:
        edit: one that the program takes. A statement that is replaced keeps its place.
        count: statements before the edit.
    """
    match edit:
        case InsertStatements(statements, at):
            return _inserted(count if at is None else at, len(statements), count)
        case RecordPoint(move=move, at=at) if move is not None:
            return _inserted(count if at is None else at, 1, count)
        case DeleteStatements(first, gone):
            rest = count - first - gone
            return _of(Stretch(0, 0, first), Stretch(first + gone, first, rest))
        case ReorderStatements(first, moved, to):
            order = [*range(first), *range(first + moved, count)]
            order[to:to] = range(first, first + moved)
            return _of(*_stretches((before, after) for after, before in enumerate(order)))
    return _of(Stretch(0, 0, count))


def between(before: Sequence[Hashable], after: Sequence[Hashable]) -> Renumbering:
    """Return which statements of one list are which of another that somebody wrote.

    A statement is found again where all before it or all behind it stayed as it was, or where there
    is one like it in each list. Where one of several alike came or went, nobody knows which it was:
    these are not found again.
    """
    least, more = min(len(before), len(after)), len(after) - len(before)
    same = zip(before, after, strict=False)
    head = next((n for n, (one, other) in enumerate(same) if one != other), least)
    same = zip(reversed(before), reversed(after), strict=False)
    tail = next((n for n, (one, other) in enumerate(same) if one != other), least)
    if head + tail >= least:
        # Statements came or went in one place, which may have been any of the overlap.
        certain = least - tail if more else head
        behind = min(head + max(-more, 0), len(before)) if more else len(before)
        rest = Stretch(behind, behind + more, len(before) - behind)
        return _of(Stretch(0, 0, certain), rest)
    pairs = _alone(before, after, range(head, len(before) - tail))
    behind = len(before) - tail
    return _of(Stretch(0, 0, head), *_stretches(pairs), Stretch(behind, behind + more, tail))


def _alone(
    before: Sequence[Hashable], after: Sequence[Hashable], sought: range
) -> Iterator[tuple[int, int]]:
    """Yield the numbers of those that are like no other in either list."""
    counts, places = Counter(before), {each: number for number, each in enumerate(after)}
    others = Counter(after)
    for number in sought:
        each = before[number]
        if counts[each] == others[each] == 1:
            yield number, places[each]


def _inserted(at: int, new: int, count: int) -> Renumbering:
    return _of(Stretch(0, 0, at), Stretch(at, at + new, count - at))


def _stretches(pairs: Iterable[tuple[int, int]]) -> Iterator[Stretch]:
    """Yield what stays together among pairs of numbers."""
    under_way: Stretch | None = None
    for before, after in pairs:
        if under_way is not None:
            first, to, length = under_way
            if (before, after) == (first + length, to + length):
                under_way = Stretch(first, to, length + 1)
                continue
            yield under_way
        under_way = Stretch(before, after, 1)
    if under_way is not None:
        yield under_way


def _of(*stretches: Stretch) -> Renumbering:
    return Renumbering(tuple(each for each in stretches if each.length > 0))
