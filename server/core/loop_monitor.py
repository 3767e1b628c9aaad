"""What a server does that finds its event loop stood still: it latches a stop (promise 26).

Owns the rule on the server's side; the watchdog process, which stops the robot meanwhile, has its
own in `watchdog_protocol`. No clock in here.
"""

from __future__ import annotations

import math

from openpendant.simplemsg.verdicts import VerdictCode

from ..refusal import Refusal


class LoopMonitor:
    """The server's own look at its clock: was the loop away for longer than the watchdog waits?

    Attributes:
        late_from: of an event from then on `lateness` is asked [ns]; of none before the first tick.
    """

    def __init__(self, real_ns: int, emulated_ns: int) -> None:
        """Make a watch that has seen no tick.

        Args:
            real_ns: how long the watchdog waits where the controller may be a real one.
            emulated_ns: the same where it says that it is emulated.
        """
        self._deadlines_ns = real_ns, emulated_ns
        self.late_from: float = math.inf
        self._ticked = 0

    def tick(self, now: int, *, says_emulated: bool) -> None:
        """Take note of a tick.

        Args:
            now: monotonic time, ns.
            says_emulated: whether the controller says that it is emulated, as the watchdog knows.
        """
        self._ticked = now
        self.late_from = now + self._deadlines_ns[says_emulated]

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
        self.tick(now, says_emulated=False)
        return late


def late_refusal(late: int) -> Refusal:
    """Return why a motion is ended by a server that was away for `late` [ns]."""
    text = f"the server did not tick for {late / 1e6:.0f} ms; the robot was stopped"
    return Refusal(VerdictCode.SERVER_LATE, text, value=late / 1e9)
