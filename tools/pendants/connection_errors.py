"""Errors of the client library, and the error of each refusal and failed connection.

Each error carries the server's reason and numbers. Owns the wording from the first attempt to
connect until the hello reply; `conversation` words a later loss.
"""

from __future__ import annotations

import asyncio
import errno
import json
import socket
import ssl
from typing import Any

from openpendant.simplemsg import Message, ReplyCode
from openpendant.simplemsg.pendant import LobbyReply, Management, Verdict
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode

from ..console import one_line


class PendantError(Exception):
    """Base of what this library raises.

    Its text is one line that a terminal only shows, whatever the server put into it.
    """

    def __str__(self) -> str:
        """Return the text, without what a terminal would act on."""
        return one_line(super().__str__())

    @property
    def explained(self) -> str:
        """Cause and remedy in one line, to be shown to a person."""
        return str(self)


class ConnectionLost(PendantError):
    """The server closed the connection, or it broke."""


class Unanswered(PendantError):
    """The server lives and gave no verdict in time; whether it did what was asked is not known."""


class StateSilent(PendantError):
    """The server lives and sends no states, though it was asked for them."""


class NotUnderstood(ConnectionLost):
    """The server does not know a type of message; so it is no pendant server, or a very old one."""


class Unreachable(PendantError, OSError):
    """No connection: no listener at the port, no such machine, or no TLS.

    Made of the number of the operating system's error, None where it has none, and a sentence.
    """

    def __str__(self) -> str:
        """Return the sentence; the number is in `errno`."""
        return one_line(str(self.args[-1]))


class NotTrusted(Unreachable, ssl.SSLCertVerificationError):
    """The server's certificate is signed by no trusted issuer."""


class MeshDamaged(PendantError):
    """Of a mesh other bytes came than those whose hash was asked for; none of them are kept."""


class WrongArgument(PendantError):
    """A request that cannot even be written: too many joints, no waypoints, a text too long."""


class SecretUnprotected(PendantError):
    """A password or pairing code was not sent, because others could have read it on its way.

    Only a connection that is `strict` raises it; any other warns, `SecretUnprotectedWarning`.
    """


class SecretUnprotectedWarning(UserWarning):
    """A password or pairing code leaves for another machine where others can read it."""


class Refused(PendantError):
    """The server refused a request; nothing moved because of it.

    Attributes:
        code: entry of the catalogue.
        text: one sentence with the numbers, as the server sent it; `str` and `explained` are clean.
        joint: index of the joint at fault, -1 for none.
        value: the value at fault, SI.
        limit: the limit that it breaks, SI.
        cause: what happened, in the words of the catalogue; empty for a code of a newer server.
        remedy: what to do about it; empty likewise.
    """

    def __init__(self, code: int, text: str, joint: int, value: float, limit: float) -> None:
        known = code in set(VerdictCode)
        self.code: VerdictCode | int = VerdictCode(code) if known else code
        self.text = text
        self.joint = joint
        self.value = value
        self.limit = limit
        entry = CATALOGUE[VerdictCode(code)] if known else None
        self.cause = entry.cause if entry else ""
        self.remedy = entry.remedy if entry else ""
        name = VerdictCode(code).name if known else str(code)
        super().__init__(f"{name}: {text or self.cause}")
        if self.remedy:
            self.add_note(f"Remedy: {self.remedy}")

    @property
    def explained(self) -> str:
        """The refusal with its remedy, in one line."""
        return f"{self} -> {self.remedy}" if self.remedy else str(self)


class Aborted(Refused):
    """A started motion was aborted."""


def judged(verdict: asyncio.Future[Message], within: float | None) -> Message:
    """Return the answer to a request, or raise its error.

    Raises:
        Refused: the verdict is a failure, or the answer to a management request is one.
        Unanswered: there is none.
        ConnectionLost: the connection ended.
    """
    if not verdict.done():
        text = f"no verdict within {within:g} s; the request may be carried out all the same"
        raise Unanswered(f"{text}: look at the state before you ask again")
    reply = verdict.result()
    if isinstance(reply, Verdict) and reply.reply_code != ReplyCode.SUCCESS:
        raise Refused(reply.code, reply.text, reply.joint, reply.value, reply.limit)
    if isinstance(reply, Management) and reply.reply_code != ReplyCode.SUCCESS:
        raise _refused(answer_of(reply))
    return reply


def answer_of(reply: Management | LobbyReply) -> dict[str, Any]:
    """Return the JSON object of an answer.

    Raises:
        NotUnderstood: it is none.
    """
    try:
        answer = json.loads(reply.body)
    except (ValueError, RecursionError):
        answer = None
    if not isinstance(answer, dict):
        raise NotUnderstood("the server's answer is no JSON object; is it a pendant server?")
    return answer


def _refused(answer: dict[str, Any]) -> Refused:
    """Return the refusal that the answer to a management request tells.

    Raises:
        NotUnderstood: it tells none.
    """
    code, joint = answer.get("code", 0), answer.get("joint", -1)
    text = answer.get("text", "")
    numbers = [answer.get("value", 0.0), answer.get("limit", 0.0)]
    if not (isinstance(text, str) and all(isinstance(each, int) for each in (code, joint))):
        raise NotUnderstood("the server refused without a code and a text that are such")
    if not all(isinstance(each, int | float) for each in numbers):
        raise NotUnderstood("the server refused with a value or limit that is no number")
    return Refused(code, text, joint, *numbers)


DEFAULT_PORT = 11010
"""The server's pendant port where its configuration says nothing else."""

WITH_TLS = "--ca FILE, in Python tls="
"""How TLS is asked for."""

_PENDANT_PORT = f"a pendant port (default {DEFAULT_PORT})"


def check_port(port: int) -> None:
    """Raise an error if a port is invalid.

    Raises:
        WrongArgument: it is not an integer from 1 to 65535.
    """
    if isinstance(port, bool) or not isinstance(port, int) or not 1 <= port <= 65_535:
        raise WrongArgument(f"no port: {port!r}; accepted: a whole number from 1 to 65535")


def server_address(text: str) -> tuple[str, int] | None:
    """Return host and port of `HOST`, `HOST:PORT`, `[HOST]:PORT` or a bare IPv6 address.

    Without a port it is the default one. None where the text is none of these.
    """
    host, port = text, str(DEFAULT_PORT)
    if text.startswith("["):
        host, _, rest = text[1:].partition("]")
        port = rest.removeprefix(":") or port
    elif text.count(":") == 1:
        host, _, port = text.partition(":")
    if not host or not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65_535):
        return None
    return host, int(port)


def unreachable(error: OSError, host: str, port: int, *, tls: bool) -> Unreachable:
    """Return the error of a failed attempt to connect."""
    at = f"{host}:{port}"
    if isinstance(error, ssl.SSLCertVerificationError):
        text = f"the certificate of {at} is not trusted: {error.verify_message or error}"
        remedy = f"trust the server's own, or that of who signed it ({WITH_TLS})"
        return NotTrusted(error.errno, f"{text}; {remedy}")
    if isinstance(error, socket.gaierror):
        why = error.strerror or error
        text = f"no machine is found by the name {host!r}: {why}; check the name"
    elif _is_refused(error):
        text = f"nobody listens at {at}; start a server: openpendant serve --robot NAME"
    elif tls and isinstance(error, ssl.SSLError | ConnectionResetError | ConnectionAbortedError):
        why = error.strerror or str(error) or "it closed the connection"
        text = f"{at} may not speak TLS ({why}): check the port, and that the server has a"
        text += " certificate ([tls] of its configuration); passwords need TLS on a network"
    else:
        why = error.strerror or str(error) or type(error).__name__
        text = f"{at} cannot be reached: {why}; check the address and the network"
    return Unreachable(error.errno, text)


def unanswered(error: ConnectionLost, host: str, port: int, *, tls: bool) -> ConnectionLost:
    """Return why a connection ended before its hello was answered; arguments as above."""
    at = f"{host}:{port}"
    if isinstance(error, NotUnderstood):
        return NotUnderstood(f"{at} is not {_PENDANT_PORT}: {error}")
    wants = "a certificate of yours" if tls else f"TLS ({WITH_TLS})"
    text = f"{at} did not answer the hello ({error}); the server may want {wants}"
    return ConnectionLost(f"{text}, or this is not {_PENDANT_PORT}")


def _is_refused(error: OSError) -> bool:
    if isinstance(error, ConnectionRefusedError):
        return True
    # A name with several addresses: asyncio joins their failures to one text without a number.
    return error.errno is None and f"[Errno {errno.ECONNREFUSED}]" in str(error)
