"""The audit log's lines: who did what and when, each carrying the hash of the one before.

Owns what an entry holds, how it is written so that nothing in it can be mistaken for another line
or for a terminal's command, and how a chain of lines is checked. Pure: `audit_file` owns the file
and the thread. It never sees a password, a code or a hash of one.

The chain shows that a line was altered, removed or put in between. It has no key: whoever can write
the whole file can write another whole chain, so a hash noted elsewhere is the stronger proof.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

FIRST_PREVIOUS = "0" * 64
"""What stands for the hash before the first line."""

_MOST_DETAILS = 16
_LONGEST_TEXT = 160

LONGEST_LINE = 64 * 1024
"""No line is longer [bytes]: few details, each cut, and an escaped sign takes at most 12."""

Detail = str | int | float | bool


class AuditEvent(StrEnum):
    """Event of the audit log."""

    SERVER_STARTED = "server-started"
    SERVER_STOPPED = "server-stopped"
    CONNECTED = "connected"
    DECLARED = "declared"
    """What a connection wants beyond its hello: DECLARE of the protocol."""
    DISCONNECTED = "disconnected"
    LOGIN = "login"
    LOGIN_FAILED = "login-failed"
    LOCKED_OUT = "locked-out"
    LOGINS_SLOWED = "logins-slowed"
    """So many wrong passwords came from an address that its logins go last, one a second."""
    LOGOUT = "logout"
    ROLE_CHANGED = "role-changed"
    PAIRING_ISSUED = "pairing-issued"
    PAIRING_WITHDRAWN = "pairing-withdrawn"
    PAIRED = "paired"
    ACCOUNT_CHANGED = "account-changed"
    CONNECTION_CLOSED = "connection-closed"
    ADDRESS_BARRED = "address-barred"
    ADDRESS_UNBARRED = "address-unbarred"
    FORWARD_REFUSED = "forward-refused"
    """A connection stated wrongly for whom it speaks; says how many did since the last such line.
    """
    AUTHORITY_TAKEN = "authority-taken"
    AUTHORITY_FORCED = "authority-forced"
    AUTHORITY_ENDED = "authority-ended"
    JOG_BEGAN = "jog-began"
    JOG_ENDED = "jog-ended"
    MOTION_BEGAN = "motion-began"
    MOTION_ENDED = "motion-ended"
    PROGRAM_BEGAN = "program-began"
    PROGRAM_ENDED = "program-ended"
    DOCUMENT_CHANGED = "document-changed"
    MOVED_UNCOMMANDED = "moved-uncommanded"
    """The robot moved, and nobody had commanded it here."""
    STOP = "stop"
    RESET = "reset"
    MODE = "mode"
    CHANGE_ASKED = "change-asked"
    """Frames, tools, scene, outputs, recordings or programs; what was kept is noted besides."""
    REFUSED = "refused"
    SUPPRESSED = "suppressed"
    """Lines beyond the limit, counted instead of written."""
    LOG_GAP = "log-gap"
    """The disk took nothing for a while; says how many entries were lost."""
    LOG_RECOVERED = "log-recovered"
    """What stands before this line is torn; carries the SHA-256 of it."""


@dataclass(frozen=True, slots=True)
class AuditEntry:
    """One thing that somebody did.

    Attributes:
        at: monotonic time [ns].
        who: name of the account or guest; empty for nobody in particular.
        session: number of the connection, 0 for none.
        cell: name of the cell, empty for all.
        detail: numbers and short texts; cut where they are long.
    """

    event: AuditEvent
    at: int
    who: str = ""
    role: str = ""
    source: str = ""
    session: int = 0
    cell: str = ""
    detail: Mapping[str, Detail] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Link:
    """State of a chain.

    Attributes:
        number: of the last line, 0 for none.
    """

    number: int = 0
    digest: str = FIRST_PREVIOUS


def write_line(entry: AuditEntry, time: str, last: Link) -> tuple[bytes, Link]:
    """Return an entry as a line that ends in a line feed, and where the chain stands then.

    Args:
        time: wall-clock time, ISO 8601 in UTC; clocks jump, so `at` is kept too.
    """
    record = {
        "n": last.number + 1,
        "time": time,
        "at": entry.at,
        "event": entry.event.value,
        "who": _cut(entry.who),
        "role": _cut(entry.role),
        "source": _cut(entry.source),
        "session": entry.session,
        "cell": _cut(entry.cell),
        "detail": {
            _cut(key): _plain(value) for key, value in list(entry.detail.items())[:_MOST_DETAILS]
        },
        "previous": last.digest,
    }
    # ASCII only, so control characters of every kind stand escaped; JSON alone would let DEL pass.
    body = json.dumps(record, ensure_ascii=True, separators=(",", ":")).replace("\x7f", "\\u007f")
    digest = hashlib.sha256(body.encode()).hexdigest()
    return f'{body[:-1]},"hash":"{digest}"}}\n'.encode(), Link(last.number + 1, digest)


def _cut(text: str) -> str:
    return text if len(text) <= _LONGEST_TEXT else text[: _LONGEST_TEXT - 1] + "…"


def _plain(value: Detail) -> Detail:
    match value:
        case str():
            return _cut(value)
        case float() if not math.isfinite(value):
            return str(value)  # JSON has no such numbers
    return value


def read_line(line: bytes) -> dict[str, Any] | None:
    """Return the record of a whole line; None if the line is torn, altered or not of a log.

    Args:
        line: without its line feed.
    """
    body, separator, ending = line.rpartition(b',"hash":"')
    if not separator or not ending.endswith(b'"}'):
        return None
    body += b"}"
    if hashlib.sha256(body).hexdigest().encode() != ending[:-2]:
        return None
    try:
        record = json.loads(body)
    except (ValueError, RecursionError):
        return None
    if not isinstance(record, dict) or not isinstance(record.get("n"), int):
        return None
    record["hash"] = ending[:-2].decode()
    return record


def _is_whole(line: bytes) -> bool:
    """Return True if a line is complete JSON, which no crash and no full disk leaves behind."""
    try:
        json.loads(line)
    except (ValueError, RecursionError):
        return False
    return True


def torn_detail(torn: bytes) -> dict[str, Detail]:
    """Return what a LOG_RECOVERED entry says of the torn line before it."""
    return {"torn_bytes": len(torn), "torn_sha256": hashlib.sha256(torn).hexdigest()}


class _Damaged:
    """Damaged lines one after the other, of which no more is kept than is asked about them.

    Attributes:
        lines: how many there are.
        is_any_whole: one of them is complete JSON.
    """

    def __init__(self) -> None:
        """Begin with none."""
        self.lines = 0
        self.is_any_whole = False
        self._bytes = 0
        self._hash = hashlib.sha256()

    def add(self, line: bytes) -> None:
        """Take the next one, without its line feed."""
        if self.lines:
            self._bytes += 1
            self._hash.update(b"\n")
        self.lines += 1
        self._bytes += len(line)
        self._hash.update(line)
        self.is_any_whole = self.is_any_whole or _is_whole(line)

    @property
    def detail(self) -> dict[str, Detail]:
        """What a LOG_RECOVERED entry says of them."""
        return {"torn_bytes": self._bytes, "torn_sha256": self._hash.hexdigest()}


class ChainCheck:
    """Checks lines one after the other.

    Attributes:
        torn: torn lines that a later line accounts for.
    """

    def __init__(self, *, from_the_middle: bool = False) -> None:
        """Start before the first line; with `from_the_middle` any line may be the first."""
        self.last = Link()
        self.lines = 0
        self.torn = 0
        self._is_open = from_the_middle
        self._damaged = _Damaged()

    def feed(self, line: bytes) -> str | None:
        """Check the next line.

        Args:
            line: without its line feed.

        Returns:
            What is wrong, None where nothing is. Damaged lines are reported once the next whole
            line does not account for them.
        """
        self.lines += 1
        record = read_line(line)
        if record is None:
            self._damaged.add(line)
            return None
        fault = self._account(record) or self._follow(record)
        self.last = Link(record["n"], record["hash"])
        self._is_open = False
        return fault

    def finish(self) -> str | None:
        """Return what is wrong with the last lines, if nothing accounted for them."""
        if not self._damaged.lines:
            return None
        first = self.lines - self._damaged.lines + 1
        self._damaged = _Damaged()
        return f"line {first} is torn or was altered"

    def _account(self, record: Mapping[str, Any]) -> str | None:
        """Clear torn lines that this record accounts for; else return that they are damaged."""
        damaged = self._damaged
        if not damaged.lines:
            return None
        self._damaged = _Damaged()
        is_recovery = record.get("event") == AuditEvent.LOG_RECOVERED
        right = record.get("detail") == damaged.detail
        if is_recovery and right and not damaged.is_any_whole:
            self.torn += damaged.lines
            return None
        first = self.lines - damaged.lines
        return f"line {first} is torn or was altered"

    def _follow(self, record: Mapping[str, Any]) -> str | None:
        if self._is_open:
            return None
        number, previous = record["n"], record.get("previous")
        if number == self.last.number + 1 and previous == self.last.digest:
            return None
        expected = self.last.number + 1
        if number != expected:
            return f"line {self.lines}: entry {number} stands where {expected} belongs"
        return f"line {self.lines}: entry {number} does not follow the one before it"
