"""Statements that take no time: passed on the way to the next one that does, some at each tick.

Owns where a run is between two statements, whether it stops before one, and how many it passes in
one go. A program may hold thousands of them in a row, and every robot of the server has its turn
in the same tick; so a run passes `MOST_INSTANT_AT_ONCE` and remembers where it was.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum, auto

from ..refusal import Refusal
from .control_flow import ControlFlow, Position
from .dead_ends import flag_not_read, going_round
from .motion_blocks import MOST_INSTANT_AT_ONCE, MOST_INSTANT_STATEMENTS
from .statements import Statement


class Halt(Enum):
    """Why no statement is to be begun now."""

    END = auto()
    BREAKPOINT = auto()
    MORE_NEXT_TICK = auto()


class Passing:
    """The place of a run between two statements.

    Attributes:
        position: the statement that comes next; empty at the end of the run.
        is_leaving: whether that one is begun, or passed, although the run is to stop before it.
    """

    def __init__(
        self, flow: ControlFlow, index: int, stops_at: Callable[[Position], bool], *, leaving: bool
    ) -> None:
        """Stand before a statement of the main program.

        Args:
            flow: the programs.
            index: the statement, from 0.
            stops_at: whether there is a breakpoint at a position.
            leaving: as the attribute.

        Raises:
            BadValue: there is no such statement.
        """
        self.position = flow.start(index)
        self.is_leaving = leaving
        self._flow = flow
        self._stops_at = stops_at
        self._instants = 0

    def come_to(self, position: Position) -> None:
        """Stand behind a statement that took time."""
        self.position, self._instants = position, 0

    def go(self, flags: Mapping[str, bool]) -> Statement | Halt | Refusal:
        """Pass statements until one takes time, or the run is to stop before one.

        Args:
            flags: what was read so far.

        Returns:
            The statement that takes time, at `position`; why there is none to begin now; or why
            the run cannot go on.
        """
        for _ in range(MOST_INSTANT_AT_ONCE):
            if not self.position:
                return Halt.END
            if self._stops_at(self.position) and not self.is_leaving:
                return Halt.BREAKPOINT
            self.is_leaving = False
            statement = self._flow.statement(self.position)
            if not self._flow.is_instant(statement):
                return statement
            behind = self._flow.after(self.position, flags)
            if behind is None:
                return flag_not_read(statement)
            self.position = behind
            self._instants += 1
            if self._instants == MOST_INSTANT_STATEMENTS:
                return going_round()
        return Halt.MORE_NEXT_TICK
