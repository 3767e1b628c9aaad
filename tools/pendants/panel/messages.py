"""Messages of the pendant to its user: refusals, ends of motions, events.

Owns their order, and that repetitions of one message become one line with a count: a held key that
is refused thirty times a second leaves one line. A message is one line, whatever a server put in.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

from ...console import one_line

_KEPT = 100
_LONGEST = 1_000


@dataclass(slots=True)
class Messages:
    """The messages of this run, the newest last.

    Attributes:
        on_new: called with each message that does not repeat the last one.
    """

    on_new: Callable[[str], None] | None = None
    _texts: deque[tuple[str, int]] = field(default_factory=lambda: deque(maxlen=_KEPT))

    def add(self, text: str) -> None:
        """Add a message, or increment the count of the last one if it is the same."""
        text = one_line(text, "?", _LONGEST)
        if self._texts and self._texts[-1][0] == text:
            self._texts[-1] = (text, self._texts[-1][1] + 1)
        else:
            self._texts.append((text, 1))
            if self.on_new is not None:
                self.on_new(text)

    @property
    def lines(self) -> tuple[str, ...]:
        """All kept messages, each with the number of its repetitions in a row."""
        return tuple(text if n == 1 else f"{text} (×{n})" for text, n in self._texts)

    @property
    def newest(self) -> str:
        """The last message; empty for none."""
        return self._texts[-1][0] if self._texts else ""
