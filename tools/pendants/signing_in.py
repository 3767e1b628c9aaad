"""What a command of ours needs to come in: whose certificate it trusts, and a password.

Owns where a secret comes from: the environment or a prompt, never an argument, which every user of
the machine could read.
"""

from __future__ import annotations

import getpass
import os
import ssl
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
    return os.environ.get(PASSWORD_VARIABLE) or prompted(f"Password of {user}: ")


def prompted(prompt: str) -> str:
    """Have a secret typed, unseen.

    Raises:
        WrongArgument: nobody is there to type it.
    """
    try:
        return getpass.getpass(prompt)
    except EOFError:
        text = f"nobody typed a password; {PASSWORD_VARIABLE} may hold it"
        raise WrongArgument(text) from None
