"""Setup of a client's judgement: what is known of its controller, trace events, and scenarios.

Owns what a port is for, the names of events, and the list of scenarios, each with one mutation of
correct behaviour. How a mutation is carried out is `controller`'s business. Knows no packets.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from openpendant.motion.description.limits import JointLimits
from openpendant.simplemsg import STANDARD, ByteOrder, Dialect

CONNECTED = "client-connected"
CLIENT_CLOSED = "client-closed-connection"
SERVER_CLOSED = "server-closed-connection"
SERVER_RESET = "server-reset-connection"
CLIENT_RESET = "client-reset-connection"
RESTARTED = "controller-restarted"
TRIGGERED = "trajectory-asked-for"
WRITES_OBSERVED = "writes-observed"
IN_PIECES = "frame-in-pieces"

CLOSERS = {
    CLIENT_CLOSED: "client",
    CLIENT_RESET: "client",
    "reset client": "client",
    SERVER_CLOSED: "server",
    SERVER_RESET: "server",
    "reset server": "server",
}
"""Events that end a connection, in all kinds of traces, with the side that ended it."""


class Purpose(Enum):
    """Purpose of a port."""

    MOTION = "motion"
    STATE = "state"
    IO = "I/O"
    PENDANT = "pendant"


WELL_KNOWN: Mapping[int, Purpose] = {
    11000: Purpose.MOTION,
    12000: Purpose.MOTION,
    50240: Purpose.MOTION,
    11002: Purpose.STATE,
    12002: Purpose.STATE,
    50241: Purpose.STATE,
    11003: Purpose.IO,
    50242: Purpose.IO,
    11010: Purpose.PENDANT,
}
"""Ports of industrial_core, of motoman_driver and of this project."""


@dataclass(frozen=True)
class Setup:
    """Known values of the controller to which the client is connected.

    Attributes:
        dialect: the messages spoken.
        order: the controller's byte order; None reads it from what it sent.
        real_size: bytes of a real, 4 or 8.
        dof: number of joints; None where unknown.
        limits: joint limits, controller side; None where unknown.
        ports: what a port is for, beyond the well-known ones.
    """

    dialect: Dialect = STANDARD
    order: ByteOrder | None = None
    real_size: int = 4
    dof: int | None = None
    limits: JointLimits | None = None
    ports: Mapping[int, Purpose] = field(default_factory=dict)


class Mutation(Enum):
    """The one change that a scenario makes to correct behaviour."""

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
        """True if it changes the answer to a point."""
        return self in _OF_REPLIES

    @property
    def on_state(self) -> bool:
        """True if it sends an additional message on the state connection."""
        return self in _ON_STATE


_OF_REPLIES = {
    Mutation.MERGED,
    Mutation.LATE,
    Mutation.REFUSED,
    Mutation.WRONG_TYPE,
    Mutation.UNREADABLE,
    Mutation.REPLY_LOST,
    Mutation.BUSY,
    Mutation.HEADER_FAILURE,
}
_ON_STATE = {
    Mutation.UNKNOWN_TOPIC_STATE,
    Mutation.UNKNOWN_REQUEST_STATE,
    Mutation.PING_STATE,
    Mutation.STATUS_REQUEST,
}


@dataclass(frozen=True, slots=True)
class Scenario:
    """One scenario.

    Attributes:
        mutation: the change.
        lasts: how long it is watched after the change, at least [s].
        is_motoman: it makes sense for the Motoman dialect only.
    """

    mutation: Mutation
    lasts: float = 2.0
    is_motoman: bool = False

    @property
    def name(self) -> str:
        """Its name on the command line and in reports."""
        return self.mutation.name.lower().replace("_", "-")


SCENARIOS: tuple[Scenario, ...] = (
    Scenario(Mutation.NONE),
    Scenario(Mutation.BYTEWISE),
    Scenario(Mutation.MERGED),
    Scenario(Mutation.LATE, lasts=4.0),
    Scenario(Mutation.REFUSED),
    Scenario(Mutation.WRONG_TYPE),
    Scenario(Mutation.UNREADABLE),
    Scenario(Mutation.REPLY_LOST, lasts=6.0),
    Scenario(Mutation.UNKNOWN_TOPIC_MOTION),
    Scenario(Mutation.UNKNOWN_REQUEST_MOTION),
    Scenario(Mutation.UNKNOWN_TOPIC_STATE),
    Scenario(Mutation.UNKNOWN_REQUEST_STATE),
    Scenario(Mutation.PING_MOTION),
    Scenario(Mutation.PING_STATE),
    Scenario(Mutation.STATUS_REQUEST),
    Scenario(Mutation.CLOSED, lasts=3.0),
    Scenario(Mutation.RESET, lasts=3.0),
    Scenario(Mutation.HALF_OPEN, lasts=6.0),
    Scenario(Mutation.STATE_CLOSED, lasts=3.0),
    Scenario(Mutation.RESTART, lasts=4.0),
    Scenario(Mutation.EMERGENCY_STOP),
    Scenario(Mutation.NOT_POSSIBLE, lasts=3.0),
    Scenario(Mutation.SILENCE, lasts=4.0),
    Scenario(Mutation.BUSY, is_motoman=True),
    Scenario(Mutation.NOT_READY, is_motoman=True),
    Scenario(Mutation.HEADER_FAILURE, is_motoman=True),
)
