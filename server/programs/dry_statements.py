"""What walks find about the statements that do not move: signals, flags and loops.

Owns which of them would end a run whenever it came to them: a signal that the controller does not
have, a flag that no input was read into, a loop that goes round in no time.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, TypeAlias

from ..refusal import Refusal
from .control_flow import Position
from .dead_ends import flag_not_read, going_round
from .dry_run_results import StatementVerdict
from .linking import Linked
from .motion_blocks import MOST_INSTANT_STATEMENTS
from .statements import End, IfFlag, IfInput, Loop, ReadInput, SetOutput, Statement, WaitInput

AbsentSignal: TypeAlias = Callable[[Literal["input", "output"], int], Refusal | None]
"""Tells why there is no such signal; None where there is one."""

Key: TypeAlias = tuple[str, int]
"""Name of a program and number of a statement, from 0."""


class Course:
    """What one walk has passed.

    Attributes:
        is_possible: no condition on a flag was taken against what an earlier one made of it.
    """

    def __init__(self) -> None:
        self.is_possible = True
        self._flags: dict[str, bool | None] = {}
        self._slow = 0
        self._instants = 0
        self._passes: dict[Key, int] = {}

    def is_read(self, flag: str) -> bool:
        """Tell whether an input was read into a flag."""
        return flag in self._flags

    def value(self, flag: str) -> bool | None:
        """Return the value that earlier conditions gave a flag; None where any is possible."""
        return self._flags.get(flag)

    def read(self, flag: str) -> None:
        """An input is read into a flag, so that any value is possible."""
        self._flags[flag] = None

    def decide(self, flag: str, value: bool) -> None:
        """A condition is answered as if a flag had a value."""
        if not self.is_read(flag):
            return
        self.is_possible &= self._flags[flag] in (None, value)
        self._flags[flag] = value

    def begin_pass(self, loop: Key) -> None:
        """A pass of a loop begins."""
        self._passes[loop] = self._slow

    def is_idle(self, loop: Key) -> bool:
        """Tell whether nothing took time since the pass of a loop began."""
        return self._passes.get(loop) == self._slow

    def take_time(self) -> None:
        """A statement took time, or asked."""
        self._slow += 1
        self._instants = 0

    def take_none(self) -> bool:
        """A statement took no time; return whether these were so many that a run would end."""
        self._instants += 1
        return self._instants >= MOST_INSTANT_STATEMENTS


class StatementFindings:
    """What was found about statements that do not move.

    Attributes:
        verdicts: by program and number.
        unchecked: statements with signals, where nobody knows which the controller has.
    """

    def __init__(
        self, linked: Linked, endless: frozenset[Key], absent: AbsentSignal | None
    ) -> None:
        """Find nothing yet.

        Args:
            linked: the programs.
            endless: the loops that a run never leaves.
            absent: knows the signals; None where nobody does.
        """
        self.verdicts: dict[Key, StatementVerdict] = {}
        self.unchecked: set[Key] = set()
        self._linked = linked
        self._endless = endless
        self._absent = absent
        self._flags_read = {
            statement.flag
            for program in linked.programs.values()
            for statement in program.statements
            if isinstance(statement, ReadInput)
        }

    def come_to(self, position: Position, statement: Statement, course: Course) -> None:
        """Look at a statement that a walk comes to."""
        key = position[-1].program, position[-1].index
        match statement:
            case WaitInput(signal) | ReadInput(signal) | IfInput(signal):
                self._look_at_signal(key, statement, "input", signal)
            case SetOutput(signal):
                self._look_at_signal(key, statement, "output", signal)
            case IfFlag(flag):
                # Of a walk that cannot be, only what is so on every walk is told.
                surely = course.is_possible or flag not in self._flags_read
                unread = surely and not course.is_read(flag)
                self._note(key, statement, flag_not_read(statement) if unread else None)
            case Loop():
                self._note(key, statement, None)
                course.begin_pass(key)
            case End():
                self._look_at_pass(key, course)
        if isinstance(statement, ReadInput):
            course.read(statement.flag)

    def pass_instant(self, position: Position, course: Course) -> None:
        """Count a statement that takes no time; too many in a row end a run."""
        if course.take_none() and course.is_possible:
            self._go_round(_loop_around(position), course)

    def _look_at_pass(self, end: Key, course: Course) -> None:
        name, index = end
        loop = name, self._linked.programs[name].blocks.at[index].opened
        if loop in self._endless and course.is_idle(loop) and course.is_possible:
            self._go_round(loop, course)
        course.begin_pass(loop)

    def _go_round(self, key: Key, course: Course) -> None:
        name, index = key
        statement = self._linked.programs[name].statements[index]
        self.verdicts[key] = StatementVerdict(name, index, statement, going_round())
        # A run would end here: what is around it is not at fault, too.
        course.take_time()

    def _look_at_signal(
        self, key: Key, statement: Statement, kind: Literal["input", "output"], signal: int
    ) -> None:
        if self._absent is None:
            self.unchecked.add(key)
        else:
            self._note(key, statement, self._absent(kind, signal))

    def _note(self, key: Key, statement: Statement, refusal: Refusal | None) -> None:
        """Keep the first refusal of a statement, whichever walk and pass found it."""
        before = self.verdicts.get(key)
        first = refusal if before is None else before.refusal or refusal
        self.verdicts[key] = StatementVerdict(*key, statement, first)


def _loop_around(position: Position) -> Key:
    """Return the innermost loop around a position, callers included, or its own statement."""
    for level in reversed(position):
        loops = [loop for loop, _ in level.passes if loop >= 0]
        if loops:
            return level.program, loops[-1]
    return position[-1].program, position[-1].index
