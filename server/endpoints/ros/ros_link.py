"""One connection of a ROS-Industrial client, and what is known of its trajectory.

Plain data; what becomes of it is `trajectory_collection`'s business.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from ...events.effects import Close, Effect
from ..frame_faults import MOST_FAULTS, PeerFaults
from .ros_trajectory import Collection, PointMessage, begins, same_point
from .trajectory_outcomes import Sender


class RosPort(Enum):
    """The two ports of this face."""

    MOTION = "points and stop"
    STATE = "joint positions and status"


@dataclass(slots=True)
class RosLink:
    """One connection of a ROS-I client.

    Attributes:
        port: what it was accepted for.
        session: its number.
        address: the client's address.
        faults: unknown and malformed frames of late.
        collection: points of an unfinished trajectory.
        gap_ends: when the trajectory counts as finished [ns].
        rejecting: a trajectory was discarded; its further points are refused without a new reason.
        overtaken: points of this connection that a STOP behind them has overtaken, not told of yet.
        finished: last point of the last complete trajectory.
        idle_since: since when the link holds the authority without using it [ns].
    """

    port: RosPort
    session: int
    address: str
    faults: PeerFaults = field(default_factory=PeerFaults)
    collection: Collection | None = None
    gap_ends: int | None = None
    rejecting: bool = False
    overtaken: int = 0
    finished: PointMessage | None = None
    idle_since: int | None = None

    def repeats_finished(self, message: PointMessage) -> bool:
        """Tell whether a point ended the last trajectory; one that can begin one is a new one."""
        last = self.finished
        return last is not None and not begins(message) and same_point(last, message)

    @property
    def sender(self) -> Sender:
        """Who sends on it."""
        return Sender(self.session, self.address)

    def drop_points(self) -> None:
        """Forget the points of an unfinished trajectory."""
        self.collection = None
        self.gap_ends = None

    def count_fault(self, now: int) -> list[Effect]:
        """Count an unknown or malformed frame; the connection that sends too many is closed."""
        if not self.faults.add(now):
            return []
        return [Close(self.session, f"{MOST_FAULTS} unknown or malformed requests")]


@dataclass(slots=True)
class OrphanedPoints:
    """Points of a lost connection that wait for it to come back.

    Attributes:
        collection: the points.
        sender: whose they are.
        until: when they are forgotten [ns].
    """

    collection: Collection
    sender: Sender
    until: int


@dataclass(frozen=True, slots=True)
class WaitingTrajectory:
    """A complete trajectory that waits for the robot to stand.

    Attributes:
        sender: whose it is.
        collection: its points.
    """

    sender: Sender
    collection: Collection
