"""Block structure of a program: its loops and conditions.

Owns the rule of blocks: each is closed by an end of its own, an else belongs to a condition and
comes once, and they nest to a bounded depth. Without recursion, so that a block of any depth can be
refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from .program_errors import BadBlocks
from .statements import Else, End, IfFlag, IfInput, Loop, Move, Statement

DEEPEST_NESTING = 32
"""Greatest depth of nested blocks."""


@dataclass(frozen=True, slots=True)
class Block:
    """Loop or condition; the numbers are of statements, from 0.

    Attributes:
        opened: of its loop or if.
        closed: of its end.
        other: of its else; None without one.
        depth: blocks around it.
    """

    opened: int
    closed: int
    other: int | None
    depth: int


@dataclass(frozen=True, slots=True)
class Blocks:
    """All blocks of a program.

    Attributes:
        at: the block of each statement that opens, divides or closes one.
    """

    at: dict[int, Block]

    def around(self, index: int) -> tuple[Block, ...]:
        """Return the blocks that a statement is inside of, the outermost first."""
        found = {block for block in self.at.values() if block.opened < index <= block.closed}
        return tuple(sorted(found, key=lambda block: block.opened))


def blocks_of(statements: Sequence[Statement]) -> Blocks:
    """Return the blocks of statements.

    Raises:
        BadBlocks: an end or else belongs to nothing, a block is not closed, or is too deep.
    """
    at: dict[int, Block] = {}
    others: dict[int, int] = {}
    opened: list[int] = []
    for index, statement in enumerate(statements):
        match statement:
            case Move():
                pass  # Most statements are, and a long program is asked for its blocks in one go.
            case Loop() | IfInput() | IfFlag():
                if len(opened) == DEEPEST_NESTING:
                    problem = f"the block is number {DEEPEST_NESTING + 1} inside of each other"
                    raise BadBlocks(index, f"{problem}; accepted: up to {DEEPEST_NESTING}")
                opened.append(index)
            case Else():
                if not opened or isinstance(statements[opened[-1]], Loop):
                    raise BadBlocks(index, "else belongs to no if; accepted: else inside an if")
                if opened[-1] in others:
                    raise BadBlocks(index, "the if has an else already; accepted: one")
                others[opened[-1]] = index
            case End():
                if not opened:
                    raise BadBlocks(index, "end closes nothing; accepted: one end for each block")
                first = opened.pop()
                block = Block(first, index, others.get(first), len(opened))
                at[block.opened] = at[block.closed] = block
                if block.other is not None:
                    at[block.other] = block
    if opened:
        raise BadBlocks(opened[-1], "the block is not closed; accepted: an end for it")
    return Blocks(at)


def depths(statements: Sequence[Statement]) -> list[int]:
    """Return the indentation of each statement of a program: the number of blocks around it."""
    result, depth = [], 0
    for before, statement in pairwise((None, *statements)):
        if isinstance(before, Loop | IfInput | IfFlag | Else):
            depth += 1
        if isinstance(statement, Else | End):
            depth -= 1
        result.append(depth)
    return result
