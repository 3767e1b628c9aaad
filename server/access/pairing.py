"""Pairing codes: temporary access for guests without accounts.

A teacher asks for a code and shows it; whoever types it becomes a guest: an operator of that one
cell, under the name that he gives, for as long as his connection lasts. Owns codes, their end and
how they are typed. Pure: `now` and the source of randomness are arguments. How often somebody may
guess is `lockout`'s rule, who may ask for a code `roles`', what guests are called `admission`'s.
"""

from __future__ import annotations

import hmac
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from .lockout import SECOND_NS
from .passwords import Secret

ALPHABET = "ABCDEFGHJKMNPQRTUVWXY346789"
"""Without 0 and O, 1 and I and L, 2 and Z, 5 and S, which are mistaken for one another."""

LENGTH = 6
"""27⁶ codes, 387 millions; 5 tries a minute at first and then fewer find one of them in an hour
with a chance of 1 in 10 millions."""

LIFETIME_NS = 15 * 60 * SECOND_NS
MOST_WRONG = 200
"""So many wrong codes, of whatever sources, end every code: many places are guessing together."""


class Chooser(Protocol):
    """Source of codes: `secrets.SystemRandom()`, or `random.Random(1)` in a test."""

    def choice(self, seq: Sequence[str], /) -> str:
        """Return one element, each as likely as the others."""


@dataclass(frozen=True, slots=True)
class PairingCode:
    """A code that is valid now.

    Attributes:
        cell: the cell whose operator it makes.
        text: the code, as `shown` writes it; never logged.
        expires: end of its validity [ns].
    """

    cell: str
    text: Secret = field(repr=False)
    issuer: str
    expires: int

    @property
    def shown(self) -> str:
        """The code as a teacher shows it: two groups of three."""
        code = self.text.reveal()
        return f"{code[: LENGTH // 2]}-{code[LENGTH // 2 :]}"


Confirm = Callable[[str, bool], bool]
"""Takes a cell and whether its code was typed; returns that, or the recorded value in a replay."""


def _as_it_is(cell: str, is_typed: bool) -> bool:
    return is_typed


class PairingCodes:
    """The codes of all cells, at most one for each."""

    def __init__(self, lifetime_ns: int = LIFETIME_NS, confirm: Confirm = _as_it_is) -> None:
        """Have no code yet.

        Args:
            confirm: notes what was typed without the code, so that a run can be repeated.
        """
        self._lifetime_ns = lifetime_ns
        self._confirm = confirm
        self._codes: dict[str, PairingCode] = {}
        self._wrong = 0

    def issue(self, cell: str, issuer: str, now: int, chooser: Chooser) -> PairingCode:
        """Make a code for a cell; an earlier one of that cell ends."""
        self._drop_expired(now)
        if not self._codes:
            self._wrong = 0
        taken = {code.text.reveal() for code in self._codes.values()}
        text = _draw(chooser)
        while text in taken:
            text = _draw(chooser)
        code = PairingCode(cell, Secret(text), issuer, now + self._lifetime_ns)
        self._codes[cell] = code
        return code

    def withdraw(self, cell: str) -> bool:
        """End a cell's code; return True if there was one."""
        return self._codes.pop(cell, None) is not None

    def redeem(self, typed: Secret, now: int) -> PairingCode | None:
        """Return the valid code that a text stands for; None where there is none.

        Capitals, spaces and hyphens do not matter. Every code is compared whatever the outcome.
        """
        self._drop_expired(now)
        wanted = _as_typed(typed.reveal())
        found = None
        for code in self._codes.values():
            is_typed = hmac.compare_digest(code.text.reveal().encode(), wanted)
            if self._confirm(code.cell, is_typed):
                found = code
        if found is None:
            self._wrong += 1
            if self._wrong >= MOST_WRONG:
                self._codes.clear()
        return found

    def _drop_expired(self, now: int) -> None:
        for cell in [cell for cell, code in self._codes.items() if now >= code.expires]:
            del self._codes[cell]


def _draw(chooser: Chooser) -> str:
    return "".join(chooser.choice(ALPHABET) for _ in range(LENGTH))


def _as_typed(text: str) -> bytes:
    kept = (sign for sign in text[:64].upper() if sign not in " -")
    return "".join(kept).encode("utf-8", "replace")
