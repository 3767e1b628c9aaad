"""One press of a jog key: hold-to-run, judged by the server's clock (promise 1).

Owns press numbers, beats and the deadline. A press that ended is dead for ever, because numbers
only count up on a connection; a beat that comes twice or in the wrong order counts for nothing.
Knows nothing of where the jog goes.
"""

from __future__ import annotations

from dataclasses import dataclass

from openpendant.simplemsg.pendant import JogEnd
from openpendant.simplemsg.verdicts import VerdictCode

from ...refusal import Refusal

SHORTEST_DEADLINE = 0.05
LONGEST_DEADLINE = 0.25
"""Bounds of the deadline that a press may declare [s]."""


@dataclass(slots=True)
class Press:
    """A key that is held.

    Attributes:
        session: the connection that pressed.
        number: of the press.
        deadline_ns: the press ends so long after its last beat.
        heard: when the last beat came [ns].
        beat: number of the last beat.
        ended: why it ended, None while it is held.
        ended_at: when [ns].
    """

    session: int
    number: int
    deadline_ns: int
    heard: int
    beat: int = 0
    ended: JogEnd | None = None
    ended_at: int = 0

    def take_beat(self, session: int, number: int, beat: int, now: int) -> None:
        """Prolong the press; a beat of another press, or a late, old or repeated one, does not."""
        if self.ended is None and (session, number) == (self.session, self.number):
            if beat > self.beat and not self.is_overdue(now):
                self.beat = beat
                self.heard = now

    def is_overdue(self, now: int) -> bool:
        """Tell whether the deadline has passed without a beat."""
        return now - self.heard >= self.deadline_ns

    def end(self, why: JogEnd, now: int) -> None:
        """End the press; the first reason counts."""
        if self.ended is None:
            self.ended = why
            self.ended_at = now


class PressCounter:
    """The highest press number of each connection; none is taken twice."""

    def __init__(self) -> None:
        self._highest: dict[int, int] = {}

    def begin(self, session: int, number: int, deadline: float, now: int) -> Press | Refusal:
        """Begin a press.

        Args:
            session: the connection.
            number: of the press.
            deadline: declared, s.
            now: monotonic time, ns.

        Returns:
            The press, or why it is refused. A number that was refused for another reason later is
            used up all the same.
        """
        if not SHORTEST_DEADLINE <= deadline <= LONGEST_DEADLINE:
            text = f"deadline {deadline:g} s; accepted: {SHORTEST_DEADLINE:g} to"
            return Refusal(
                VerdictCode.BAD_ARGUMENT,
                f"{text} {LONGEST_DEADLINE:g} s",
                value=deadline,
                limit=LONGEST_DEADLINE,
            )
        highest = self._highest.get(session, 0)
        if number <= highest:
            text = f"press {number}; the next number of this connection is {highest + 1} or higher"
            return Refusal(VerdictCode.PRESS_DEAD, text)
        self._highest[session] = number
        return Press(session, number, round(deadline * 1e9), now)

    def forget(self, session: int) -> None:
        """Forget a connection that ended; its number is never given to another."""
        self._highest.pop(session, None)
