"""What the scripted controller does to a client: one change from right behaviour a scenario.

Owns the list of scenarios. How a change is carried out is `controller`'s business.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Twist(Enum):
    """The one thing that a scenario changes."""

    NONE = "nothing"
    BYTEWISE = "replies come byte by byte"
    MERGED = "a reply and a PING request come in one piece"
    LATE = "a reply comes after 2 s"
    REFUSED = "a point is refused"
    WRONG_TYPE = "a point is answered by a reply of type PING"
    UNREADABLE = "a point is answered with reply code 0"
    REPLY_LOST = "a reply never comes"
    UNKNOWN_TOPIC_MOTION = "an unknown topic on the motion connection"
    UNKNOWN_REQUEST_MOTION = "an unknown request on the motion connection"
    UNKNOWN_TOPIC_STATE = "an unknown topic on the state connection"
    UNKNOWN_REQUEST_STATE = "an unknown request on the state connection"
    PING_MOTION = "a PING request on the motion connection"
    PING_STATE = "a PING request on the state connection"
    STATUS_REQUEST = "STATUS as a request on the state connection"
    CLOSED = "the motion connection is closed in the middle of a trajectory"
    RESET = "the motion connection is reset in the middle of a trajectory"
    HALF_OPEN = "the motion connection goes dumb, but stays open"
    STATE_CLOSED = "the state connection is closed in the middle of a trajectory"
    RESTART = "the controller goes away and comes back after 1 s"
    EMERGENCY_STOP = "an emergency stop in motion"
    NOT_POSSIBLE = "motion is not possible from the start"
    SILENCE = "no reports for 3 s in motion"
    BUSY = "a point is answered BUSY three times (Motoman)"
    NOT_READY = "readiness is denied (Motoman)"
    HEADER_FAILURE = "a reply fails in its header and succeeds in its body (Motoman)"

    @property
    def of_replies(self) -> bool:
        """Whether the answer to a point is what changes."""
        return self in _OF_REPLIES

    @property
    def on_state(self) -> bool:
        """Whether something is sent besides on the state connection."""
        return self in _ON_STATE


_OF_REPLIES = {
    Twist.MERGED,
    Twist.LATE,
    Twist.REFUSED,
    Twist.WRONG_TYPE,
    Twist.UNREADABLE,
    Twist.REPLY_LOST,
    Twist.BUSY,
    Twist.HEADER_FAILURE,
}
_ON_STATE = {
    Twist.UNKNOWN_TOPIC_STATE,
    Twist.UNKNOWN_REQUEST_STATE,
    Twist.PING_STATE,
    Twist.STATUS_REQUEST,
}


@dataclass(frozen=True, slots=True)
class Scenario:
    """One scenario.

    Attributes:
        twist: what is changed.
        lasts: how long it is watched after the change, at least [s].
        is_motoman: it makes sense for the Motoman dialect only.
        needs_state: it makes sense with a state connection only.
    """

    twist: Twist
    lasts: float = 2.0
    is_motoman: bool = False
    needs_state: bool = False

    @property
    def name(self) -> str:
        """Its name on the command line and in reports."""
        return self.twist.name.lower().replace("_", "-")


SCENARIOS: tuple[Scenario, ...] = (
    Scenario(Twist.NONE),
    Scenario(Twist.BYTEWISE),
    Scenario(Twist.MERGED),
    Scenario(Twist.LATE, lasts=4.0),
    Scenario(Twist.REFUSED),
    Scenario(Twist.WRONG_TYPE),
    Scenario(Twist.UNREADABLE),
    Scenario(Twist.REPLY_LOST, lasts=6.0),
    Scenario(Twist.UNKNOWN_TOPIC_MOTION),
    Scenario(Twist.UNKNOWN_REQUEST_MOTION),
    Scenario(Twist.UNKNOWN_TOPIC_STATE, needs_state=True),
    Scenario(Twist.UNKNOWN_REQUEST_STATE, needs_state=True),
    Scenario(Twist.PING_MOTION),
    Scenario(Twist.PING_STATE, needs_state=True),
    Scenario(Twist.STATUS_REQUEST, needs_state=True),
    Scenario(Twist.CLOSED, lasts=3.0),
    Scenario(Twist.RESET, lasts=3.0),
    Scenario(Twist.HALF_OPEN, lasts=6.0),
    Scenario(Twist.STATE_CLOSED, lasts=3.0, needs_state=True),
    Scenario(Twist.RESTART, lasts=4.0),
    Scenario(Twist.EMERGENCY_STOP, needs_state=True),
    Scenario(Twist.NOT_POSSIBLE, lasts=3.0, needs_state=True),
    Scenario(Twist.SILENCE, lasts=4.0, needs_state=True),
    Scenario(Twist.BUSY, is_motoman=True),
    Scenario(Twist.NOT_READY, is_motoman=True),
    Scenario(Twist.HEADER_FAILURE, is_motoman=True),
)
