"""Password hashes: scrypt, what it costs, and what a password must be like.

Owns the cost, how long a password is, and the comparison. Every call of `hash_password` and
`is_password` takes the full cost and so belongs on a worker (`password_worker`), never on the loop.
Knows nothing of accounts, sessions or attempts.
"""

from __future__ import annotations

import hashlib
import hmac
import unicodedata
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, field_validator

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal
from .password_guesses import easy_guess
from .secret import Secret

SALT_BYTES = 16
DIGEST_BYTES = 32

LEAST_CHARACTERS = 8
MOST_CHARACTERS = 128
MOST_BYTES = 128
"""What the field of the login message holds."""


_MOST_MEMORY = 256 * 1024 * 1024
_FEW_DIFFERENT = 4


class ScryptCost(BaseModel):
    """What one hash costs; kept with each hash, so that the default may rise later."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    n: Annotated[int, Field(ge=2**14, le=2**20)] = 2**15
    """Iterations, a power of two; memory is 128 · n · r bytes, here 32 MiB."""
    r: Annotated[int, Field(ge=8, le=32)] = 8
    """Block size."""
    p: Annotated[int, Field(ge=1, le=16)] = 3
    """Passes one after the other, in the same memory."""

    @field_validator("n")
    @classmethod
    def _is_power_of_two(cls, n: int) -> int:
        if n & (n - 1):
            raise ValueError("n must be a power of two")
        return n

    @property
    def memory(self) -> int:
        """Memory that OpenSSL may take for it [bytes]; a little more than its tables."""
        return 128 * self.r * (self.n + self.p + 2) + 1024 * 1024


DEFAULT_COST = ScryptCost()
"""The cost that OWASP's cheat sheet names for 32 MiB. 240 ms of one core where it was measured, a
machine with 2 shared cores, so at least 50 ms (promise 29) on one four times as fast."""


class PasswordHash(BaseModel):
    """What is kept of a password."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    cost: ScryptCost = DEFAULT_COST
    """What it cost."""
    salt: Annotated[str, Field(pattern=rf"^[0-9a-f]{{{2 * SALT_BYTES}}}$", repr=False)]
    """Random, hexadecimal."""
    digest: Annotated[str, Field(pattern=rf"^[0-9a-f]{{{2 * DIGEST_BYTES}}}$", repr=False)]
    """The result of scrypt, hexadecimal."""

    @field_validator("cost")
    @classmethod
    def _fits_memory(cls, cost: ScryptCost) -> ScryptCost:
        # A store that somebody tampered with must not make the server swap.
        if cost.memory > _MOST_MEMORY:
            raise ValueError(f"needs {cost.memory} bytes of memory; at most {_MOST_MEMORY}")
        return cost


NOBODYS_HASH = PasswordHash(salt="00" * SALT_BYTES, digest="00" * DIGEST_BYTES)
"""Compared with where there is no such account, so that the answer takes as long (promise 29).

No password is known to have this digest, and one that had would not be let in: there is no account.
"""


def hash_password(password: Secret, salt: bytes, cost: ScryptCost = DEFAULT_COST) -> PasswordHash:
    """Return what is to be kept of a password; takes the full cost.

    Args:
        password: the password.
        salt: `SALT_BYTES` random bytes, new ones for each password.
        cost: what it shall cost.
    """
    digest = _scrypt(password, salt, cost)
    return PasswordHash(cost=cost, salt=salt.hex(), digest=digest.hex())


def is_password(password: Secret, kept: PasswordHash) -> bool:
    """Tell whether a password is the one that was kept; takes the full cost either way."""
    digest = _scrypt(password, bytes.fromhex(kept.salt), kept.cost)
    return hmac.compare_digest(digest, bytes.fromhex(kept.digest))


def _scrypt(password: Secret, salt: bytes, cost: ScryptCost) -> bytes:
    # NFKC: the same password typed on another keyboard may come in another composition.
    # Lone surrogates, which JSON can smuggle in, have no UTF-8 and become question marks.
    text = unicodedata.normalize("NFKC", password.reveal()).encode("utf-8", "replace")
    return hashlib.scrypt(
        text, salt=salt, n=cost.n, r=cost.r, p=cost.p, maxmem=cost.memory, dklen=DIGEST_BYTES
    )


def password_fault(password: Secret, name: str) -> Refusal | None:
    """Return why a new password is refused; None where it is taken.

    Length and what everybody tries first (`password_guesses`), no rules of composition: those make
    passwords worse. The password itself is never in the answer.

    Args:
        password: what somebody wants.
        name: the account's name, which the password must not contain.
    """
    text = unicodedata.normalize("NFKC", password.reveal())
    if not LEAST_CHARACTERS <= len(text) <= MOST_CHARACTERS:
        limit = LEAST_CHARACTERS if len(text) < LEAST_CHARACTERS else MOST_CHARACTERS
        problem = (
            f"it has {len(text)} characters; {LEAST_CHARACTERS} to {MOST_CHARACTERS} are taken"
        )
        return _bad(problem, len(text), limit)
    size = len(text.encode("utf-8", "replace"))
    if size > MOST_BYTES:
        problem = f"it has {size} bytes of UTF-8; up to {MOST_BYTES} are taken"
        return _bad(problem, size, MOST_BYTES)
    if not text.isprintable():
        return _bad("it holds a character that cannot be typed or shown")
    folded = text.casefold()
    different = len(set(folded))
    if different < _FEW_DIFFERENT:
        problem = f"it has {different} different characters; at least {_FEW_DIFFERENT} are taken"
        return _bad(problem, different, _FEW_DIFFERENT)
    guess = easy_guess(text, name)
    return None if guess is None else _bad(guess)


def _bad(problem: str, value: int = 0, limit: int = 0) -> Refusal:
    text = f"the password is not taken: {problem}"
    return Refusal(VerdictCode.BAD_PASSWORD, text, value=float(value), limit=float(limit))
