"""Why no pendant server was reached, in sentences that say what to do.

Owns the wording from the first attempt to connect until hello is answered; a later loss is told by
the conversation.
"""

from __future__ import annotations

import errno
import socket
import ssl

from .failures import ConnectionLost, NotTrusted, NotUnderstood, Unreachable, WrongArgument

DEFAULT_PORT = 11010
"""The server's pendant port where its configuration says nothing else."""

_WITH_TLS = "--ca FILE, in Python tls="
_PENDANT_PORT = f"a pendant port (default {DEFAULT_PORT})"


def check_port(port: int) -> None:
    """Refuse what is no port.

    Raises:
        WrongArgument: it is no whole number of 1 to 65535.
    """
    if isinstance(port, bool) or not isinstance(port, int) or not 1 <= port <= 65_535:
        raise WrongArgument(f"no port: {port!r}; accepted: a whole number from 1 to 65535")


def unreachable(error: OSError, host: str, port: int, *, tls: bool) -> Unreachable:
    """Return why there is no connection.

    Args:
        error: what the attempt to connect raised.
        host: where to.
        port: likewise.
        tls: the connection was to be encrypted.
    """
    at = f"{host}:{port}"
    if isinstance(error, ssl.SSLCertVerificationError):
        text = f"the certificate of {at} is not trusted: {error.verify_message or error}"
        remedy = f"trust the server's own, or that of who signed it ({_WITH_TLS})"
        return NotTrusted(error.errno, f"{text}; {remedy}")
    if isinstance(error, socket.gaierror):
        why = error.strerror or error
        text = f"no machine is found by the name {host!r}: {why}; check the name"
    elif _is_refused(error):
        text = f"nobody listens at {at}; start a server: openpendant serve --robot NAME"
    elif tls and isinstance(error, ssl.SSLError | ConnectionResetError | ConnectionAbortedError):
        why = error.strerror or str(error) or "it closed the connection"
        text = f"{at} may not speak TLS ({why}): leave --ca out, in Python tls="
    else:
        why = error.strerror or str(error) or type(error).__name__
        text = f"{at} cannot be reached: {why}; check the address and the network"
    return Unreachable(error.errno, text)


def unanswered(error: ConnectionLost, host: str, port: int, *, tls: bool) -> ConnectionLost:
    """Return why a connection ended before its hello was answered; arguments as above."""
    at = f"{host}:{port}"
    if isinstance(error, NotUnderstood):
        return NotUnderstood(f"{at} is not {_PENDANT_PORT}: {error}")
    wants = "a certificate of yours" if tls else f"TLS ({_WITH_TLS})"
    text = f"{at} did not answer the hello ({error}); the server may want {wants}"
    return ConnectionLost(f"{text}, or this is not {_PENDANT_PORT}")


def _is_refused(error: OSError) -> bool:
    if isinstance(error, ConnectionRefusedError):
        return True
    # A name with several addresses: asyncio joins their failures to one text without a number.
    return error.errno is None and f"[Errno {errno.ECONNREFUSED}]" in str(error)
