"""What a server does that finds its event loop stood still: it latches a stop (promise 26).

Owns the rule on the server's side; the watchdog process, which stops the robot meanwhile, has its
own in `watchdog`. No clock in here.
"""

from __future__ import annotations

import math

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal


class TickWatch:
    """The server's own look at its clock: was the loop away for longer than the watchdog waits?

    Attributes:
        late_from: of an event from then on `lateness` is asked [ns]; of none before the first tick.
    """

    def __init__(self, deadline_ns: int) -> None:
        """Make a watch that has seen no tick."""
        self._deadline_ns = deadline_ns
        self.late_from: float = math.inf
        self._ticked = 0

    def tick(self, now: int) -> None:
        """Take note of a tick."""
        self._ticked = now
        self.late_from = now + self._deadline_ns

    def stopped(self) -> None:
        """Take note that the watchdog has stopped the robots, whatever the clock says here.

        It measures when beats arrive, so of a delay close to the deadline it may judge otherwise.
        """
        self.late_from = -math.inf

    def lateness(self, now: int) -> int:
        """Return for how long the loop was away [ns], and take note that this was found out.

        To be asked before anything is done about an event from `late_from` on: the first one after
        a freeze is as likely an answer of the controller as a tick, and no set-point may leave
        because of it.
        """
        late = now - self._ticked
        self.tick(now)
        return late


def late_refusal(late: int) -> Refusal:
    """Return why a motion is ended by a server that was away for `late` [ns]."""
    text = f"the server did not tick for {late / 1e6:.0f} ms; the robot was stopped"
    return Refusal(VerdictCode.SERVER_LATE, text, value=late / 1e9)
