"""Room for the plans of all cells of a server: how many there may be, how large, and their numbers.

One for a server: a number belongs to one cell and is never given twice, so that a plan of another
cell is unknown to all others.
"""

from __future__ import annotations

from itertools import count

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal

MOST_OF_SERVER = 128
"""Plans that a server keeps or makes at a time."""

MOST_BYTES = 128 * 1024 * 1024
"""Size of the samples of all plans that a server keeps [bytes]."""


class PlanSpace:
    """Number and size of the plans of a server.

    Attributes:
        plans: how many are being made or kept.
        size: of the samples of those that are kept [bytes].
    """

    def __init__(self) -> None:
        """Begin with no plan."""
        self.plans = 0
        self.size = 0
        self._numbers = count(1)

    def begin(self) -> int:
        """Take the place of a plan that is being made; return its number."""
        self.plans += 1
        return next(self._numbers)

    def keep(self, size: int) -> None:
        """Take room for the samples of a plan that was made [bytes]."""
        self.size += size

    def end(self, size: int) -> None:
        """Give back the place of a plan, and the room of its samples [bytes]."""
        self.plans -= 1
        self.size -= size

    def fault(self, plans: int, size: int) -> Refusal | None:
        """Return why there is no room for so many more plans with samples of a size [bytes]."""
        if self.plans + plans > MOST_OF_SERVER:
            text = f"the server keeps {self.plans} plans; accepted: {MOST_OF_SERVER}"
            return too_many(text, self.plans, MOST_OF_SERVER)
        if self.size + size > MOST_BYTES:
            wanted = self.size + size
            text = f"the samples of all plans would have {wanted} bytes; accepted: {MOST_BYTES}"
            return too_many(text, wanted, MOST_BYTES)
        return None


def too_many(text: str, value: int, limit: int) -> Refusal:
    """Return the refusal of one plan more than there may be."""
    return Refusal(VerdictCode.TOO_MANY_PLANS, text, value=float(value), limit=float(limit))
