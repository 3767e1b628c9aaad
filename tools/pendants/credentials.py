"""Credentials of a command: trusted certificate, password, pairing code and name of a guest.

Owns the source of a secret: the environment or a prompt, never an argument, which every user of the
machine could read.
"""

from __future__ import annotations

import getpass
import os
import ssl
import sys
import warnings
from pathlib import Path

from .connection_errors import WrongArgument

PASSWORD_VARIABLE = "OPENPENDANT_PASSWORD"
"""Environment variable with the password, for unattended scripts."""


def tls_context(ca: Path | None) -> ssl.SSLContext | None:
    """Return a TLS context that trusts one certificate alone; None for an unencrypted connection.

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
    """Return the password of an account; None without an account.

    Raises:
        WrongArgument: standard input ended before it was typed.
    """
    if not user:
        return None
    found = os.environ.get(PASSWORD_VARIABLE)
    absent = f"nobody typed a password; {PASSWORD_VARIABLE} may hold it"
    return found or _prompted(f"Password of {user}: ", absent)


def pairing_code() -> str:
    """Prompt for the code of a class without echo; no variable holds it, because it expires soon.

    Raises:
        WrongArgument: standard input ended before it was typed.
    """
    absent = (
        "nobody typed a pairing code, and no variable holds it; a script uses an account, --user"
    )
    return _prompted("Pairing code: ", absent)


def guest_name(suggested: str) -> str:
    """Prompt for the name of a guest if standard input is a terminal.

    Args:
        suggested: the name if none is typed, or there is no terminal.
    """
    if not sys.stdin.isatty():
        return suggested
    print(f"Your name [{suggested}]: ", end="", file=sys.stderr, flush=True)
    return sys.stdin.readline().strip() or suggested


def _prompted(prompt: str, absent: str) -> str:
    """Return a typed secret; raise `WrongArgument(absent)` if none is typed."""
    try:
        with warnings.catch_warnings():
            # Without a terminal the secret comes through a pipe, where nothing is echoed.
            if not sys.stdin.isatty():
                warnings.simplefilter("ignore", getpass.GetPassWarning)
            return getpass.getpass(prompt)
    except EOFError:
        raise WrongArgument(absent) from None
