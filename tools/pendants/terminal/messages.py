"""What the pendant has said to its user: refusals, ends of motions, news.

Owns the order and that the same message in a row is one, counted: a held key that is refused thirty
times a second leaves one line.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

_KEPT = 100


@dataclass(slots=True)
class Messages:
    """The messages of this run, the newest last."""

    _texts: deque[tuple[str, int]] = field(default_factory=lambda: deque(maxlen=_KEPT))

    def add(self, text: str) -> None:
        """Add a message, or count the last one up if it says the same."""
        if self._texts and self._texts[-1][0] == text:
            self._texts[-1] = (text, self._texts[-1][1] + 1)
        else:
            self._texts.append((text, 1))

    @property
    def lines(self) -> tuple[str, ...]:
        """All that is kept, each with how often it came in a row."""
        return tuple(text if n == 1 else f"{text} (×{n})" for text, n in self._texts)

    @property
    def newest(self) -> str:
        """The last message; empty for none."""
        return self._texts[-1][0] if self._texts else ""
