"""What the client library raises; each failure carries the server's reason and numbers."""

from __future__ import annotations

import ssl

from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode


class PendantError(Exception):
    """Base of what this library raises."""

    @property
    def explained(self) -> str:
        """What happened and what to do about it, in one line, to be shown to a person."""
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
    """There is no connection: nobody listens there, no such machine, or no TLS.

    Made of the number of the operating system's error, None where it has none, and a sentence.
    """

    def __str__(self) -> str:
        """Return the sentence; the number is in `errno`."""
        return str(self.args[-1])


class NotTrusted(Unreachable, ssl.SSLCertVerificationError):
    """Nobody whom we trust vouches for the server's certificate."""


class WrongArgument(PendantError):
    """A request that cannot even be written: too many joints, no waypoints, a text too long."""


class Refused(PendantError):
    """The server refused a request; nothing moved because of it.

    Attributes:
        code: entry of the catalogue.
        text: one sentence with the numbers.
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
    """A motion that had begun was aborted."""
