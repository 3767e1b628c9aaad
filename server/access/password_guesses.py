"""What everybody tries first: words, keys beside each other, repetitions, the account's own name.

Owns the rule of NIST SP 800-63B (section 5.1.1.2) that a new password is compared with what is
"commonly used, expected, or compromised": dictionary words, repetitive or sequential characters,
and the names of the service and of the user "and derivatives thereof". It is not a list of a
million leaked passwords but the few words that stand at the top of every such list and in a robot
cell, with what people put around and into them: digits and signs at the ends, `0` for `o`, `$` for
`s`. Knows nothing of hashes and accounts.
"""

from __future__ import annotations

import re
from itertools import pairwise

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
    """Tell whether the character at `end` continues the run that began at `begin`."""
    before, here = text[end - 1], text[end]
    step = ord(here) - ord(before)
    beside = (before, here) in _NEIGHBOURS
    if end - begin == 1:
        return abs(step) <= 1 or beside
    so_far = ord(before) - ord(text[end - 2])
    if step == so_far and abs(step) <= 1:
        return True
    return beside and (text[end - 2], before) in _NEIGHBOURS
