"""Edit history of a program: what a change does to its JSON and to its statements' numbers; undo.

Owns the renumbering of statements, as a value that can be reversed: an edit defines the moves of
its statements; between two texts, a statement is found again only where its place is beyond doubt.

Owns the history's length, and the difference between two texts, found, applied and reversed as one
stretch that is replaced by another (`Splice`). The history holds the changes of each edit to the
JSON of the program and to the numbers of its statements, not programs. So an undo parses and prints
nothing, however large the program is, and all of this may be done on an event loop.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Hashable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from openpendant.simplemsg.pendant.management.statements import (
    DeleteStatements,
    Edit,
    InsertStatements,
    RecordPoint,
    ReorderStatements,
)

from ..language.program_errors import NothingToUndo


class StatementSpan(NamedTuple):
    """Consecutive statements that stay together.

    Attributes:
        before: number of the first before the change, from 0.
        after: its number after the change, from 0.
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


@dataclass(frozen=True, slots=True)
class Splice:
    """Replacement of one stretch of a text by another.

    Attributes:
        start: characters before it, the same in both texts.
    """

    start: int
    removed: str
    inserted: str

    @property
    def size(self) -> int:
        """Number of characters that it holds."""
        return len(self.removed) + len(self.inserted)

    @property
    def reversed(self) -> Splice:
        """Splice from the second text to the first."""
        return Splice(self.start, self.inserted, self.removed)

    def applied(self, text: str) -> str:
        """Return the second text; `text` is the first."""
        return text[: self.start] + self.inserted + text[self.start + len(self.removed) :]


def splice_between(first: str, second: str) -> Splice:
    """Return the shortest splice that leads from one text to another."""
    most = min(len(first), len(second))
    start = _most(most, lambda count: first[:count] == second[:count])
    tail = _most(
        most - start,
        lambda count: first[len(first) - count :] == second[len(second) - count :],
    )
    return Splice(start, first[start : len(first) - tail], second[start : len(second) - tail])


def _most(most: int, holds: Callable[[int], bool]) -> int:
    """Return the greatest count up to `most` that a condition allows which holds for all less."""
    known, limit = 0, most
    while known < limit:
        count = (known + limit + 1) // 2
        if holds(count):
            known = count
        else:
            limit = count - 1
    return known


MOST_UNDO = 100
"""Greatest number of edits that can be undone."""

MOST_UNDO_CHARACTERS = 2 << 20
"""Characters that they may hold together; the last edit can be undone whatever its size."""


@dataclass(frozen=True, slots=True)
class EditStep:
    """Change of a program, which can be reversed.

    Attributes:
        renumbering: its change of the statements' numbers; None if only comparing can find it.
    """

    splice: Splice
    renumbering: Renumbering | None = None

    @property
    def reversed(self) -> EditStep:
        """Reverse change."""
        back = None if self.renumbering is None else self.renumbering.reversed
        return EditStep(self.splice.reversed, back)


@dataclass(frozen=True, slots=True)
class History:
    """Edits of a program that were made, and those that were undone.

    Attributes:
        past: the edits, the oldest first.
        future: the edits that were undone, the last undone first.
    """

    past: tuple[EditStep, ...] = ()
    future: tuple[EditStep, ...] = ()

    def edited(self, step: EditStep) -> History:
        """Return the history after an edit; edits undone before it cannot be redone any more."""
        past = (*self.past, step)[-MOST_UNDO:]
        held = sum(each.splice.size for each in past)
        while len(past) > 1 and held > MOST_UNDO_CHARACTERS:
            held -= past[0].splice.size
            past = past[1:]
        return History(past)

    def undone(self) -> tuple[History, EditStep]:
        """Return the history before the last edit, and the change that leads back.

        Raises:
            NothingToUndo: there is none.
        """
        if not self.past:
            raise NothingToUndo("no edit is left to undo")
        *past, last = self.past
        return History(tuple(past), (last, *self.future)), last.reversed

    def redone(self) -> tuple[History, EditStep]:
        """Return the history after the edit that was undone last, and the change that leads there.

        Raises:
            NothingToUndo: there is none, or an edit was made since.
        """
        if not self.future:
            raise NothingToUndo("no edit is left to redo")
        first, *future = self.future
        return History((*self.past, first), tuple(future)), first
