"""What became of the trajectories of ROS-I clients, told to clients that read no failure reply.

Owns the newest reason, which stands in STATUS; the one log line of each trajectory that was refused
or broken off; and for how long its client is told no joint positions. The stock action node looks
at no error: it ends a goal only where it arrives, or where it hears of no position for 1 s.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from openpendant.simplemsg.verdicts import VerdictCode

from ...events.cell_events import MotionEnded, MotionRefused, MotionRequest
from ...events.effects import Effect, LogLine
from ...refusal import Refusal

_MOST_KNOWN = 64
"""Of more addresses those that look on no more are forgotten."""


@dataclass(frozen=True, slots=True)
class Sender:
    """Whose trajectory it is.

    Attributes:
        session: number of the motion connection.
        address: of the client.
    """

    session: int
    address: str


@dataclass(slots=True)
class HandedOn:
    """A trajectory that is planned or moved.

    Attributes:
        request: under which the cell knows it.
        sender: whose it is.
        points: how many it has.
        is_unwanted: its own client stopped it, or sent another.
    """

    request: MotionRequest
    sender: Sender
    points: int
    is_unwanted: bool = False


@dataclass(slots=True)
class NewestReason:
    """Why the last trajectory was refused or broken off.

    Attributes:
        code: the verdict.
    """

    code: VerdictCode
    _beside: VerdictCode | None = None
    _is_told: bool = field(default=False)

    def beside(self, standing: VerdictCode | None) -> VerdictCode:
        """Return the newer of this reason and of what keeps the robot from moving now.

        Args:
            standing: the condition that is broken now; None for none.
        """
        if not self._is_told or standing is None:
            # What came up in the same turn is a consequence: the latch of the stop that ended it.
            self._is_told, self._beside = True, standing
        return self.code if standing is None or standing is self._beside else standing


class RosOutcomes:
    """What is told of trajectories that did not come to their end.

    Attributes:
        newest: why the last one was refused or broken off; None once the next one is taken.
        handed_on: the trajectory that is planned or moved; None for none.
    """

    def __init__(self, silence: float) -> None:
        """Tell of none.

        Args:
            silence: how long its client is told no joint positions [s].
        """
        self.newest: NewestReason | None = None
        self.handed_on: HandedOn | None = None
        self._silence_ns = round(silence * 1e9)
        self._silent: dict[str, int] = {}
        self._seen: dict[str, int] = {}  # when each address was told positions last

    # What happens.

    def hand_on(self, request: MotionRequest, sender: Sender, points: int) -> None:
        """Take note of a trajectory that goes to the planner."""
        self.handed_on = HandedOn(request, sender, points)

    def begins(self, sender: Sender) -> None:
        """Take note of a new trajectory that may move the robot; its client sees again."""
        self._silent.pop(sender.address, None)
        self.unwanted(sender.session)

    def unwanted(self, session: int) -> None:
        """Take note that a client ends what it has sent before by its own wish."""
        if self.handed_on is not None and self.handed_on.sender.session == session:
            self.handed_on.is_unwanted = True

    def is_of(self, session: int) -> bool:
        """Tell whether what is planned or moved is of a connection."""
        return self.handed_on is not None and self.handed_on.sender.session == session

    def ended(self, news: MotionRefused | MotionEnded, now: int) -> list[Effect]:
        """Take note that what was handed on ended, or was refused by the planner."""
        known = self.handed_on
        if known is None or known.request != news.request:
            return []
        self.handed_on = None
        refusal = news.refusal
        if refusal is None or refusal.code is VerdictCode.NO_MOTION:
            # A trajectory that ends where the robot stands is no error.
            self.newest = None
            return []
        done = known.points - news.waypoints_left if isinstance(news, MotionEnded) else 0
        points = (done, known.points)
        return self.tell(known.sender, points, refusal, now, is_wanted=known.is_unwanted)

    def tell(
        self,
        sender: Sender,
        points: tuple[int, int],
        refusal: Refusal,
        now: int,
        *,
        is_wanted: bool = False,
    ) -> list[Effect]:
        """Tell of a trajectory that was refused or broken off; to be called once for each.

        Args:
            sender: whose it was.
            points: how many of its points the robot had passed, and how many had come.
            refusal: why.
            now: monotonic time, ns.
            is_wanted: its own client ended it, which is no error.
        """
        if not is_wanted:
            self.newest = NewestReason(refusal.code)
            if self._silence_ns:
                # From when it saw last, so that no row of refusals keeps a client blind.
                seen = self._seen.get(sender.address, now)
                self._silent[sender.address] = seen + self._silence_ns
        done, known = points
        whose = f"ROS-I trajectory of {sender.address} (session {sender.session})"
        what = f"{'broken off' if done else 'refused'}, {done} of {known} points done"
        code = refusal.code
        return [LogLine(f"{whose} {what}: {code.name} ({code:d}): {refusal.sentence}")]

    # What is told.

    def sees(self, address: str, now: int) -> bool:
        """Tell whether an address is told joint positions now, which it then is."""
        if self._silent.get(address, now) > now:
            return False
        self._seen[address] = now
        return True

    def tick(self, now: int) -> None:
        """Forget whom nothing is kept from any more, and who has not looked for long."""
        if self._silent:
            self._silent = {who: until for who, until in self._silent.items() if until > now}
        if len(self._seen) > _MOST_KNOWN:
            self._seen = {who: at for who, at in self._seen.items() if now - at < self._silence_ns}
