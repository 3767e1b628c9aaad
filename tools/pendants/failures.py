"""What the client library raises; each failure carries the server's reason and numbers."""

from __future__ import annotations

from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode


class PendantError(Exception):
    """Base of what this library raises."""


class ConnectionLost(PendantError):
    """The server closed the connection, or it broke."""


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
        super().__init__(f"{name}: {text}")


class Aborted(Refused):
    """A motion that had begun was aborted."""
