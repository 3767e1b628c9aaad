"""What a jog tells back: the next set-point, what holds it back, and which way leads out.

Owns the words. Plain numbers and names, no text: whoever shows them makes the sentences, and the
server maps each reason to its verdict. Knows no arithmetic.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple


class JogReason(StrEnum):
    """What makes a jog slower than it was asked, or holds it."""

    JOINT_LIMIT = "joint-limit"
    """A joint nears the end of its range."""
    SINGULARITY = "singularity"
    """The arm nears a place where a direction of the tool is lost."""
    COLLISION = "collision"
    """Two bodies come near."""
    WORKSPACE = "workspace"
    """A platform nears the border of its workspace, or a leg the cone of its anchor."""
    TOOL_SPEED = "tool-speed"
    """The tool centre point is as fast as it may be."""
    ELBOW_SPEED = "elbow-speed"
    """The elbow is as fast as the tool may be."""
    JOINT_SPEED = "joint-speed"
    """A joint would have to turn faster than it can to keep the line."""
    DIRECTION = "direction"
    """The arm has too few axes to move its tool so."""
    REACH = "reach"
    """The line goes on where no joint position near this one reaches."""


class JogCause(NamedTuple):
    """A reason with its numbers.

    Attributes:
        reason: what it is.
        value: joint position [rad or m], condition number [1], distance [m], share of the
            workspace [1], or the speed that was asked for [m/s or rad/s].
        limit: what the value may be.
        joint: which joint, or -1.
        pair: names of the two bodies, or None.
    """

    reason: JogReason
    value: float
    limit: float
    joint: int = -1
    pair: tuple[str, str] | None = None


class Retreat(NamedTuple):
    """Which way leads out of what holds a jog.

    Attributes:
        joints: (n,) a joint jog that leads out, its greatest element ±1; None if none is known.
        reverse: whether the opposite of what was asked leads out too.
        singularity: name of the singularity that it leads out of; empty otherwise.
    """

    joints: tuple[float, ...] | None
    reverse: bool
    singularity: str = ""


class JogStep(NamedTuple):
    """One set-point.

    Attributes:
        position: (n,) controller-side [rad or m].
        velocity: (n,) [rad/s or m/s].
        acceleration: (n,) mean since the last set-point [rad/s² or m/s²].
        scale: what is left of the asked speed, 0 to 1; a ramp that is still running up counts 1.
        cause: what takes the rest; None where nothing does.
        at_rest: whether the robot stands after this set-point.
        retreat: which way leads out, once a cause holds the robot at rest.
    """

    position: list[float]
    velocity: list[float]
    acceleration: list[float]
    scale: float
    cause: JogCause | None
    at_rest: bool
    retreat: Retreat | None = None

    @property
    def reason(self) -> JogReason | None:
        """What takes the rest of the speed, without its numbers."""
        return None if self.cause is None else self.cause.reason
