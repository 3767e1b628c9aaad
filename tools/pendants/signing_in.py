"""What a command of ours needs to come in: whose certificate it trusts, and a password.

Owns where a secret comes from: the environment or a prompt, never an argument, which every user of
the machine could read; and what a guest is called.
"""

from __future__ import annotations

import getpass
import os
import ssl
import sys
import warnings
from pathlib import Path

from .failures import WrongArgument

PASSWORD_VARIABLE = "OPENPENDANT_PASSWORD"
"""Environment variable with the password, for a script that nobody sits at."""


def trusted(ca: Path | None) -> ssl.SSLContext | None:
    """Return how to encrypt, trusting a certificate alone; None for a connection in clear text.

    Args:
        ca: the server's certificate, or that of who signed it.

    Raises:
        WrongArgument: the file cannot be read or holds no certificate.
    """
    if ca is None:
        return None
    try:
        return ssl.create_default_context(cafile=str(ca))
    except (OSError, ssl.SSLError) as error:
        raise WrongArgument(f"{ca}: {error}") from None


def password_of(user: str) -> str | None:
    """Return the password of an account; None where no account is named.

    Raises:
        WrongArgument: nobody is there to type it.
    """
    if not user:
        return None
    found = os.environ.get(PASSWORD_VARIABLE)
    absent = f"nobody typed a password; {PASSWORD_VARIABLE} may hold it"
    return found or _prompted(f"Password of {user}: ", absent)


def pairing_code() -> str:
    """Have the code of a class typed, unseen; no variable holds it, because it soon ends.

    Raises:
        WrongArgument: nobody is there to type it.
    """
    absent = (
        "nobody typed a pairing code, and no variable holds it; a script uses an account, --user"
    )
    return _prompted("Pairing code: ", absent)


def guest_name(suggested: str) -> str:
    """Have a guest say what he wants to be called, where there is a terminal to ask him at.

    Args:
        suggested: what he is called where he says nothing, or nobody can be asked.
    """
    if not sys.stdin.isatty():
        return suggested
    print(f"Your name [{suggested}]: ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip() or suggested


def _prompted(prompt: str, absent: str) -> str:
    """Return a secret that somebody types; `absent` is said where nobody does."""
    try:
        with warnings.catch_warnings():
            # Without a terminal the secret comes through a pipe, where nothing is echoed.
            if not sys.stdin.isatty():
                warnings.simplefilter("ignore", getpass.GetPassWarning)
            return getpass.getpass(prompt)
    except EOFError:
        raise WrongArgument(absent) from None
