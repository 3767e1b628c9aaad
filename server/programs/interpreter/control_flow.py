"""Control flow of a run: its position in the programs, and the next one.

Owns the meaning of loops, conditions and calls. A position is a value, so one may look ahead from
it and discard the result. Knows no motion, no signal and no time.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TypeAlias

from openpendant.simplemsg.pendant.management.program_values import BadValue
from openpendant.simplemsg.pendant.management.statements import (
    Call,
    Comment,
    Else,
    End,
    IfFlag,
    Loop,
    Statement,
)

from ..language.linking import Linked
from ..language.program import Program

Flags: TypeAlias = Mapping[str, bool]

WHOLE_PROGRAM = -1
"""Key of the main program where its passes are counted like those of a loop."""


@dataclass(frozen=True, slots=True)
class Level:
    """Position in one program.

    Attributes:
        index: the next statement, from 0; their number at the end.
        passes: of each loop around it that was entered, the loop's number and the pass, from 1;
            in the main program those of `WHOLE_PROGRAM` come first.
    """

    program: str
    index: int
    passes: tuple[tuple[int, int], ...] = ()


Position: TypeAlias = tuple[Level, ...]
"""The call stack, the running program last; a caller's index is that of its call. Empty at the end
of the run."""


@dataclass(frozen=True, slots=True)
class ControlFlow:
    """Order of the statements of a run.

    Attributes:
        passes: number of passes of the main program; None for ever.
    """

    linked: Linked
    passes: int | None = 1

    def start(self, index: int = 0) -> Position:
        """Return the position before a statement of the main program.

        Loops around it are in their first pass; conditions around it count as true.

        Raises:
            BadValue: there is no such statement.
        """
        program = self.linked.programs[self.linked.main]
        count = len(program.statements)
        if not 0 <= index < max(count, 1):
            accepted = f"0 to {count - 1}" if count else "none, the program is empty"
            text = f"is {index}, counted from 0; accepted: {accepted}"
            raise BadValue("the statement to start from", text)
        passes = tuple(
            (block.opened, 1)
            for block in program.blocks.around(index)
            if isinstance(program.statements[block.opened], Loop)
        )
        level = Level(program.name, index, ((WHOLE_PROGRAM, 1), *passes))
        return self._settled((level,)) if count else ()

    def statement(self, position: Position) -> Statement:
        """Return the next statement; the position is not the end of the run."""
        level = position[-1]
        return self._program(level).statements[level.index]

    def is_instant(self, statement: Statement) -> bool:
        """Return True if a statement only determines the next one."""
        return isinstance(statement, Comment | Loop | End | Else | Call | IfFlag)

    def after(self, position: Position, flags: Flags) -> Position | None:
        """Return the position behind a statement.

        Args:
            position: before the statement; a condition on an input is not followed here.

        Returns:
            The position, empty at the end of the run; None where the flag was never read.
        """
        level = position[-1]
        match self.statement(position):
            case Loop():
                entered = replace(
                    level, index=level.index + 1, passes=(*level.passes, (level.index, 1))
                )
                return self._settled((*position[:-1], entered))
            case End():
                return self._settled((*position[:-1], self._behind_end(level)))
            case Else():
                block = self._program(level).blocks.at[level.index]
                return self._settled((*position[:-1], replace(level, index=block.closed)))
            case IfFlag(flag, value):
                return None if flag not in flags else self.branch(position, flags[flag] is value)
            case Call(program):
                return self._settled((*position, Level(program, 0)))
        return self._settled((*position[:-1], replace(level, index=level.index + 1)))

    def behind(self, position: Position) -> Position:
        """Return the position behind a statement that is no condition on a flag."""
        behind = self.after(position, {})
        if behind is None:
            raise AssertionError("only conditions on flags ask for a flag")
        return behind

    def branch(self, position: Position, holds: bool) -> Position:
        """Return the position in the branch of a condition that holds or does not."""
        level = position[-1]
        block = self._program(level).blocks.at[level.index]
        if holds:
            index = level.index + 1
        elif block.other is None:
            index = block.closed
        else:
            index = block.other + 1
        return self._settled((*position[:-1], replace(level, index=index)))

    def _behind_end(self, level: Level) -> Level:
        program = self._program(level)
        block = program.blocks.at[level.index]
        loop = program.statements[block.opened]
        if not isinstance(loop, Loop):
            return replace(level, index=level.index + 1)
        _, number = level.passes[-1]
        if loop.passes is not None and number >= loop.passes:
            return replace(level, index=level.index + 1, passes=level.passes[:-1])
        passes = (*level.passes[:-1], (block.opened, number + 1))
        return replace(level, index=block.opened + 1, passes=passes)

    def _settled(self, position: Position) -> Position:
        """Leave programs that are at their end; the main one may start again."""
        while position[-1].index == len(self._program(position[-1]).statements):
            if len(position) == 1:
                return self._next_pass(position[0])
            *outer, caller = position[:-1]
            position = (*outer, replace(caller, index=caller.index + 1))
        return position

    def _next_pass(self, level: Level) -> Position:
        _, number = level.passes[0]
        if self.passes is not None and number >= self.passes:
            return ()
        return (Level(level.program, 0, ((WHOLE_PROGRAM, number + 1),)),)

    def _program(self, level: Level) -> Program:
        return self.linked.programs[level.program]
