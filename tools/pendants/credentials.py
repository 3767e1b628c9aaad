"""Credentials of a command: trusted certificate, password, pairing code and name of a guest.

Owns the source of a secret: the environment or a prompt, never an argument, which every user of the
machine could read; and that a person is told before it leaves where others can read it.
"""

from __future__ import annotations

import getpass
import os
import ssl
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TextIO

from .connection_errors import SecretUnprotectedWarning, WrongArgument

PASSWORD_VARIABLE = "OPENPENDANT_PASSWORD"
"""Environment variable with the password, for unattended scripts."""


STRICT = "send no password and no pairing code to another machine in clear text: end instead"
"""Help of the option `--strict`."""


@contextmanager
def told_of_unprotected_secrets(tell: Callable[[str], None]) -> Iterator[None]:
    """Give the text of each `SecretUnprotectedWarning` to `tell`, whatever filters say.

    For a process that does one thing: the filters of `warnings` are those of the whole process.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("always", SecretUnprotectedWarning)
        show_other = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if issubclass(category, SecretUnprotectedWarning):
                tell(str(message))
            else:
                show_other(message, category, filename, lineno, file, line)

        warnings.showwarning = show
        yield


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
