"""The stop key: a software stop is owed from the press until the server has confirmed it.

Owns when a stop leaves, when it is sent again, and when the screen must say that nobody knows
whether it was heard. A link may be dead for seconds before anything says so; until the verdict or
the news of a latched stop is here, a stop that was pressed counts as not heard.
"""

from __future__ import annotations

from . import words
from .cell_view import CellView
from .commands import SoftwareStop
from .messages import Messages

REASON = "space bar"

ANSWER_NS = 300_000_000
"""A stop that is not confirmed so long after its key was struck is called unconfirmed [ns]."""

AGAIN_NS = 1_000_000_000
"""It is sent again so long after it was sent last, on the same connection too [ns]."""

REMEDY = "use the robot's own hardware stop button"


class StopKey:
    """The stop key of one pendant."""

    def __init__(self, cell: CellView, messages: Messages) -> None:
        """Begin with nothing owed.

        Args:
            cell: what is known of the cell.
            messages: takes what there is to say.
        """
        self._cell = cell
        self._messages = messages
        self._press = 0
        self._since: int | None = None
        self._sent = 0
        self._refusal = ""
        self._is_told = False

    @property
    def is_owed(self) -> bool:
        """Whether a stop was pressed that nobody has confirmed."""
        return self._since is not None

    @property
    def is_awaited(self) -> bool:
        """Whether a stop is owed that was not refused: its verdict may still come."""
        return self.is_owed and not self._refusal

    def struck(self, now: int) -> list[SoftwareStop]:
        """Take a stroke of the key.

        Args:
            now: monotonic time [ns].

        Returns:
            The stop, to be sent at once, logged in or not; nothing without a link, where it is
            sent later.
        """
        self._press += 1
        self._refusal, self._is_told = "", False
        if self._since is None:
            self._since = now
        self._sent = now
        self._tell(now)
        return [SoftwareStop(REASON, self._press)] if self._cell.is_greeted else []

    def linked(self) -> list[SoftwareStop]:
        """Return what must leave first on a new connection: the stop that is owed."""
        if not self.is_owed:
            return []
        self._refusal = ""
        return [SoftwareStop(f"{REASON}, sent again", self._press)]

    def tick(self, now: int) -> list[SoftwareStop]:
        """Let time pass; what becomes doubtful is said once.

        Args:
            now: monotonic time [ns].

        Returns:
            The stop, where it is still owed; a second one does no harm. One that was refused is not
            repeated on the same connection.
        """
        self._tell(now)
        waits = self.is_awaited and self._cell.is_greeted
        if not waits or now - self._sent < AGAIN_NS:
            return []
        self._sent = now
        return self.linked()

    def _tell(self, now: int) -> None:
        if not self._is_told and (doubt := self.doubt(now)):
            self._is_told = True
            self._messages.add(doubt)

    def confirmed(self, press: int) -> None:
        """Take the verdict that the stop of a press was taken; an earlier press is not the last."""
        if press == self._press:
            self._settle()

    def latched(self) -> None:
        """Take the news that a stop is latched, whoever asked for it."""
        self._settle()

    def refused(self, press: int, why: str) -> None:
        """Take the verdict that the stop of a press was refused."""
        if self.is_owed and press == self._press:
            self._refusal = why

    def _settle(self) -> None:
        if self.is_owed and self._is_told:
            self._messages.add("the stop is confirmed")
        self._since, self._refusal, self._is_told = None, "", False

    def doubt(self, now: int) -> str:
        """Return that a stop is not confirmed, why, and what to do; empty where none is in doubt.

        Args:
            now: monotonic time [ns].
        """
        why = "" if self._since is None else self._why(self._since, now)
        return f"STOP NOT CONFIRMED, {REMEDY}: {why}" if why else ""

    def _why(self, since: int, now: int) -> str:
        if not self._cell.is_greeted:
            return f"no link, it leaves again once linked ({self._cell.absence})"
        if self._refusal:
            return self._refusal
        if not self._cell.is_connected:
            return f"sent, and not answered yet ({self._cell.absence})"
        if self._cell.is_silent(now):
            age = self._cell.message_age(now)
            return "no state came yet" if age is None else f"the server is silent for {age:.1f} s"
        if self._cell.is_stale(now):
            return words.staleness(self._cell, now)
        waited = now - since
        return f"no answer for {waited / 1e9:.1f} s" if waited >= ANSWER_NS else ""
