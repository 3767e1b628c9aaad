"""Setup of a client's judgement: known values of its controller, and the names of trace events.

Owns what a port is for, and the names of events. Knows no packets.
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
