"""What is known of a client's controller beforehand, and the words in which a trace tells events.

Owns what a port is for, and the names of events. Knows no packets.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from openpendant.motion.limits import JointLimits
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
"""What tells that a connection ended, in all kinds of traces: who ended it."""


class Purpose(Enum):
    """What a port is for."""

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
    """What is known of the controller that the client talks to.

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
