"""Question rates: how many questions on kinematics a connection, and the server, may be asked.

A page that drags a ghost of the robot asks as fast as it likes; here it is told to wait, in the
same turn, so that no question of it costs anybody else anything (promise 40).

Pure: `now` is an argument.
"""

from __future__ import annotations

from ..access.token_bucket import SessionRates, TokenBucket, too_often
from ..refusal import Refusal

PER_SECOND = 10
"""Questions of a connection in one second."""

BURST = 5
"""Questions of a connection at once after a quiet time."""

_EARLY = 1
"""Tokens that a question may owe which counts as a whole burst, a tenth of a second: asked at an
even rate, every one that came a moment early would be refused."""

OF_SERVER_PER_SECOND = 400
"""Questions of all connections together in one second."""

OF_SERVER_BURST = 200
"""Questions of all connections together at once: 30 pages that were just opened, and some more."""


class QuestionRates:
    """The rates of all connections of a server."""

    def __init__(self) -> None:
        """Know no connection yet."""
        self._of_server = TokenBucket(OF_SERVER_PER_SECOND, OF_SERVER_BURST)
        self._of_session = SessionRates(PER_SECOND, BURST)

    def take(self, session: int, weight: int, now: int) -> Refusal | None:
        """Count a question of a connection, or say why it is refused; such a one counts nothing.

        Args:
            weight: how many it counts as, at most `BURST`.
        """
        own = self._of_session.of(session)
        spare = -_EARLY if weight == BURST else 0
        wait = own.wait(now, spare, weight)
        if wait:
            return too_often(f"{PER_SECOND} questions a second and connection", wait, PER_SECOND)
        wait = self._of_server.take(now, tokens=weight)
        if wait:
            whose = f"{OF_SERVER_PER_SECOND} questions a second of all connections"
            return too_often(whose, wait, OF_SERVER_PER_SECOND)
        own.take(now, spare, weight)
        return None

    def forget(self, session: int) -> None:
        """Forget a connection that ended."""
        self._of_session.forget(session)
