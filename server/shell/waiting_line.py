"""Waiting line of one connection: what it sends behind a body that is read beside the loop.

Owns what does not wait: what stops, keeps alive or lets go acts at once, whatever it is behind. And
owns what such a message has overtaken: a STOP everything that waits, the release of a key the press
that it would have ended. That is handed on as overtaken, so that it cannot undo what acted before.
"""

from __future__ import annotations

from collections import deque

from openpendant.simplemsg import Arrival, Overtaken, WaitingStop
from openpendant.simplemsg.pendant import (
    AuthorityBeat,
    Enabling,
    Hello,
    JogBeat,
    JogRelease,
    JogStart,
    SoftwareStop,
)

ACT_AT_ONCE = (JogBeat, AuthorityBeat, Enabling, JogRelease, SoftwareStop)
"""Messages that wait for nothing."""

MOST_WAITING = 1_024
"""Messages in the line; more stay undecoded. As objects small ones take ten times their bytes."""


class WaitingLine:
    """Messages in the order in which they came.

    Attributes:
        is_held: whether the first has to wait.
        size: bytes of their frames.
    """

    def __init__(self) -> None:
        """Let nobody wait."""
        self.is_held = False
        self.size = 0
        self._waiting: deque[Arrival] = deque()

    def __len__(self) -> int:
        """Return how many messages wait."""
        return len(self._waiting)

    @property
    def is_full(self) -> bool:
        """True if no more is to be decoded before some of it was taken."""
        return len(self._waiting) >= MOST_WAITING

    def put(self, received: Arrival) -> bool:
        """Add a message; return False, without adding it, where it acts at once."""
        message = received.received if isinstance(received, Overtaken) else received
        if isinstance(message, ACT_AT_ONCE):
            if isinstance(message, SoftwareStop):
                self.stop()
            elif isinstance(message, JogRelease):
                self._release(message.press)
            return False
        if isinstance(message, WaitingStop) and not message.acted:
            self.stop()
            return False
        self._waiting.append(received)
        return True

    def stop(self) -> None:
        """Mark all that waits as overtaken by a STOP."""
        self._waiting = deque(_overtaken(each) for each in self._waiting)

    def _release(self, press: int) -> None:
        """Mark the press that a released key would have ended."""
        self._waiting = deque(
            Overtaken(each) if isinstance(each, JogStart) and each.press == press else each
            for each in self._waiting
        )

    def take(self) -> Arrival:
        """Return the first message and remove it.

        Raises:
            IndexError: nobody waits.
        """
        received = self._waiting.popleft()
        if not self._waiting:
            self.size = 0
        return received


def _overtaken(received: Arrival) -> Arrival:
    return (
        received if isinstance(received, Overtaken | WaitingStop | Hello) else Overtaken(received)
    )
