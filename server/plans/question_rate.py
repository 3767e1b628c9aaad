"""Rate of questions: how many a connection may ask in a second, and how long it has to wait.

A bucket of tokens: it holds as many as may be asked at once and is filled at a steady rate.
"""

from __future__ import annotations

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal

_SECOND_NS = 1_000_000_000


class QuestionRate:
    """The rate of one kind of question, for each connection by itself."""

    def __init__(self, rate: int, burst: int) -> None:
        """Let each connection ask `rate` times a second, `burst` times at once."""
        self._period_ns = _SECOND_NS // rate
        self._room_ns = self._period_ns * (burst - 1)
        self._free_at: dict[int, int] = {}  # when the bucket of a connection is full again [ns]

    def take(self, session: int, now: int) -> Refusal | None:
        """Count a question; return why it comes too soon, which is then not counted."""
        full_at = max(self._free_at.get(session, 0), now)
        wait = full_at - now - self._room_ns
        if wait > 0:
            rate = _SECOND_NS // self._period_ns
            text = f"more than {rate} of these questions a second; ask again in {wait / 1e9:.3f} s"
            return Refusal(VerdictCode.TOO_OFTEN, text, value=wait / 1e9, limit=float(rate))
        self._free_at[session] = full_at + self._period_ns
        return None

    def forget(self, session: int) -> None:
        """Forget a connection that ended."""
        self._free_at.pop(session, None)
