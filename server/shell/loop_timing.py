"""Timing of the control loop: when the next tick is due, and which late ticks are logged.

Deadlines are absolute, so that lateness does not add up. A tick that took a little longer than a
period delays the next one by that little, and not by a whole period; what lies further back is not
made up for, because set-points of the past are of no use to a robot.

Owns the rule from when a late tick is worth a line (promise 26), and that the line tells a machine
that was busy elsewhere from a server that computed. Ticks come every few milliseconds, so that a
long time between two events, a `Gap` that the inbox measured, was taken by the former, by what the
loop did behind it, or by a machine that let this process wait. How much processor time went by
meanwhile tells these apart. No clock in here.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

from openpendant.simplemsg.framing import detect_byte_order


class Gap(NamedTuple):
    """A time in which no event started.

    Attributes:
        lasted: how long it was [ns].
        event: what happened at its beginning; empty before the first event.
    """

    lasted: int = 0
    event: str = ""
    link: str | int = ""
    data: bytes = b""


def next_deadline(last: float, now: float, period: float) -> tuple[float, int]:
    """Return when the next tick is due, and how many before it are left out.

    Args:
        last: when the last tick was due [s].
        now: the time after it [s].

    Returns:
        The latest deadline that has passed since, or else the next to come [s]; and the number of
        deadlines passed before that one.
    """
    left_out = max(0, int((now - last) / period) - 1)
    return last + (left_out + 1) * period, left_out


LOGGED_LATENESS_NS = 30_000_000
"""A tick that is later than this is worth a line in the log."""

_ONE_LINE_NS = 1_000_000_000
_COMPUTING = 0.5
"""Share of a delay that this process computed, from which on it held itself up."""

_EVENTS = {
    "planned": "an answer of the planning process",
    "stored": "an answer of the store",
    "checked": "the outcome of a password check",
    "account": "a change of an account",
    "accounts": "accounts that were read anew",
    "tick": "a tick",
}


class LoopLog:
    """The log of late ticks: those above 30 ms, one line a second."""

    def __init__(self, period_ns: int) -> None:
        """Make a log for a loop that ticks every `period_ns`."""
        self._period_ns = period_ns
        self._ticked: int | None = None
        self._computed = 0
        self._told = 0
        self._worst = 0
        self._cause = ""
        self._count = 0

    def tick(self, now: int, computed: int, gap: Gap) -> str:
        """Take note of a tick.

        Args:
            computed: processor time that the loop's thread has had so far [ns].
            gap: the longest time without an event since the tick before.

        Returns:
            The line to log, empty for none.
        """
        before, self._ticked = self._ticked, now
        used, self._computed = computed - self._computed, computed
        whole = 0 if before is None else now - before
        late = whole - self._period_ns
        if late > LOGGED_LATENESS_NS:
            self._count += 1
            if late > self._worst:
                self._worst, self._cause = late, _cause(gap, used, whole)
        if not self._count or (self._told and now - self._told < _ONE_LINE_NS):
            return ""
        times = "once" if self._count == 1 else f"{self._count} times"
        text = (
            f"the control loop was late {times}, by {self._worst / 1e6:.0f} ms at most:"
            f" {self._cause}"
        )
        self._told, self._worst, self._cause, self._count = now, 0, "", 0
        return text


def _cause(gap: Gap, used: int, whole: int) -> str:
    """Return what held a loop for `whole` [ns], of which it computed for `used`."""
    computed = f"{used / 1e6:.0f} ms of processor time in {whole / 1e6:.0f} ms"
    behind = f"{gap.lasted / 1e6:.0f} ms went by behind {event_text(gap)}"
    if used >= _COMPUTING * whole:
        return f"{behind}; the server computed ({computed})"
    return f"{behind}; the machine was busy elsewhere, or a call waited ({computed})"


def event_text(gap: Gap) -> str:
    """Return which event a time without any began with."""
    if gap.event != "in":
        return f"{_EVENTS.get(gap.event, repr(gap.event))}{f' of {gap.link}' if gap.link else ''}"
    order = detect_byte_order(gap.data)
    if order is None or len(gap.data) < 8:
        return f"bytes of {gap.link}"
    (msg_type,) = struct.unpack_from(f"{order.value}i", gap.data, 4)
    return f"bytes of {gap.link}, the first of type {msg_type}"
