"""Passwords: scrypt hashes with their cost, and the rules that a new password must meet.

Owns the cost, the length of a password and the comparison. Every call of `hash_password` and
`is_password` takes the full cost and so belongs on a worker (`access_backend`), never on the event
loop. Knows nothing of accounts, sessions or attempts.

Owns the rule of NIST SP 800-63B (section 5.1.1.2) that a new password is compared with what is
"commonly used, expected, or compromised": dictionary words, repetitive or sequential characters,
and the names of the service and of the user "and derivatives thereof". Keys beside each other count
as sequential. The list is not a million leaked passwords but the few words that stand at the top of
every such list and in a robot cell, with what people put around and into them: digits and signs at
the ends, `0` for `o`, `$` for `s`.

Owns the protection of a secret, be it a password or a pairing code: whatever prints, formats,
pickles or compares it gets asterisks or an error (promise 30).
"""

from __future__ import annotations

import hashlib
import hmac
import re
import unicodedata
from itertools import pairwise
from typing import Annotated, Final, NoReturn, final

from pydantic import BaseModel, ConfigDict, Field, field_validator

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal

_SHOWN: Final = "********"


@final
class Secret:
    """A text that only `reveal` gives out."""

    __slots__ = ("_text",)

    def __init__(self, text: str) -> None:
        self._text = text

    def reveal(self) -> str:
        """Return the text itself; for hashing and comparing only."""
        return self._text

    def __repr__(self) -> str:
        return f"Secret({_SHOWN})"

    def __str__(self) -> str:
        return _SHOWN

    def __format__(self, format_spec: str) -> str:
        return _SHOWN

    def __reduce__(self) -> NoReturn:
        raise TypeError("a secret is not pickled")


_WORDS = frozenset(
    {
        *("password", "passwort", "kennwort", "motdepasse", "contraseña", "contrasena", "passwd"),
        *("pass", "pwd", "passcode", "passphrase", "secret", "geheim", "private", "default"),
        *("admin", "administrator", "administrador", "root", "superuser", "sysadmin", "system"),
        *("user", "guest", "gast", "test", "tester", "testing", "demo", "temp", "login", "logon"),
        *("welcome", "willkommen", "bienvenue", "hello", "hallo", "letmein", "changeme", "access"),
        *("changeit", "iloveyou", "trustno", "whatever", "master", "shadow", "dragon", "monkey"),
        *("sunshine", "princess", "football", "baseball", "soccer", "hockey", "computer", "super"),
        *("superman", "batman", "starwars", "pokemon", "michael", "jordan", "hunter", "killer"),
        *("internet", "samsung", "google", "microsoft", "windows", "android", "flower", "freedom"),
        *("spring", "summer", "autumn", "winter", "monday", "friday", "january", "december"),
        *("sommer", "herbst", "student", "teacher", "school", "lehrer", "schule", "service"),
        *("openpendant", "pendant", "teachpendant", "robot", "roboter", "robots", "robotics"),
        *("operator", "programmer", "viewer", "production", "factory", "maintenance", "controller"),
    }
)

_ROWS = (
    *("1234567890", "qwertyuiop", "qwertzuiop", "azertyuiop", "asdfghjkl", "zxcvbnm", "yxcvbnm"),
    *("1qaz2wsx3edc4rfv5tgb6yhn7ujm", "1q2w3e4r5t6y7u8i9o0p", "q1w2e3r4t5y6u7i8o9p0"),
)
_NEIGHBOURS = frozenset(
    pair for row in _ROWS for there in (row, row[::-1]) for pair in pairwise(there)
)

_LEAST_RUN = 3
_LEAST_REST = 4
_LEAST_UNIT = 8

_LEETS = tuple(str.maketrans("03457@$€1!", "oeastase" + 2 * one) for one in "il")
_LEFT, _RIGHT = re.compile(r"^[\W\d_]+"), re.compile(r"[\W\d_]+$")
_BETWEEN = re.compile(r"[\W_]+")


def easy_guess(password: str, name: str) -> str | None:
    """Return why a password is easily guessed; None where it is not. It is not in the answer.

    Args:
        password: in Unicode's form NFKC.
        name: the account's, which it must not contain.
    """
    folded = password.casefold()
    unit = _repeated(folded)
    if len(unit) < len(folded) and len(unit) < _LEAST_UNIT:
        return "it is a few characters again and again"
    rest = _without_runs(unit)
    if len(rest) < _LEAST_REST:
        return "it is made of characters that follow each other"
    if not _WORDS.isdisjoint(_readings(unit) | _readings(rest)):
        return "it is one of those that everybody tries first, with a little around it"
    if len(name) > 2 and any(
        name.casefold() in text for text in (folded, *map(folded.translate, _LEETS))
    ):
        return "it contains the account's name"
    return None


def _readings(text: str) -> set[str]:
    """Return the words that somebody may have made a text of."""
    # A digit at an end was put there (`password1`) or stands for a letter (`0penpendant`).
    left, right = _LEFT.sub("", text), _RIGHT.sub("", text)
    bare = {text, left, right, _LEFT.sub("", right)}
    read = bare | {each.translate(leet) for each in bare for leet in _LEETS}
    return read | {_BETWEEN.sub("", each) for each in read}


def _repeated(text: str) -> str:
    """Return the shortest text that, again and again, makes the whole one."""
    # Where a text is first found in itself twice over, but at 0, is the length of its period.
    return text[: (text + text).find(text, 1)]


def _without_runs(text: str) -> str:
    """Return what is left without runs: abc, 321, aaa, qwe."""
    rest: list[str] = []
    begin = 0
    for end in range(1, len(text) + 1):
        if end < len(text) and _goes_on(text, begin, end):
            continue
        if end - begin < _LEAST_RUN:
            rest.append(text[begin:end])
        begin = end
    return "".join(rest)


def _goes_on(text: str, begin: int, end: int) -> bool:
    """Return True if the character at `end` continues the run that starts at `begin`."""
    before, here = text[end - 1], text[end]
    step = ord(here) - ord(before)
    beside = (before, here) in _NEIGHBOURS
    if end - begin == 1:
        return abs(step) <= 1 or beside
    so_far = ord(before) - ord(text[end - 2])
    if step == so_far and abs(step) <= 1:
        return True
    return beside and (text[end - 2], before) in _NEIGHBOURS


SALT_BYTES = 16
DIGEST_BYTES = 32

LEAST_CHARACTERS = 8
MOST_CHARACTERS = 128
MOST_BYTES = 128
"""What the field of the login message holds."""


_MOST_MEMORY = 256 * 1024 * 1024
_FEW_DIFFERENT = 4


class ScryptCost(BaseModel):
    """Cost of one hash; kept with each hash, so that the default may rise later."""

    model_config = ConfigDict(frozen=True, extra="forbid")

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
    """Stored hash of a password."""

    model_config = ConfigDict(frozen=True, extra="forbid")

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
        salt: `SALT_BYTES` random bytes, new ones for each password.
    """
    digest = _scrypt(password, salt, cost)
    return PasswordHash(cost=cost, salt=salt.hex(), digest=digest.hex())


def is_password(password: Secret, kept: PasswordHash) -> bool:
    """Return True if a password matches the stored hash; takes the full cost either way."""
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

    Length and what everybody tries first, no rules of composition: those make
    passwords worse. The password itself is never in the answer.
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
