"""Jog status: the next set-point, what slows or holds the jog, and the direction that leads out.

Owns the words. Plain numbers and names, no text: screens make the sentences, and the server maps
each reason to its verdict. Knows no arithmetic.
"""

from __future__ import annotations

from enum import StrEnum
from typing import NamedTuple


class JogSlowdown(StrEnum):
    """Cause for which a jog is slower than asked, or held."""

    JOINT_LIMIT = "joint-limit"
    """A joint approaches the end of its range."""
    SINGULARITY = "singularity"
    """The arm approaches a place where a direction of the tool is lost."""
    COLLISION = "collision"
    """Two bodies come near each other."""
    WORKSPACE = "workspace"
    """A platform approaches the border of its workspace, or a leg the cone of its anchor."""
    TOOL_SPEED = "tool-speed"
    """The tool centre point has its greatest allowed speed."""
    ELBOW_SPEED = "elbow-speed"
    """The elbow has the greatest speed that the tool may have."""
    JOINT_SPEED = "joint-speed"
    """A joint would have to exceed its velocity limit to keep the line."""
    DIRECTION = "direction"
    """The arm has too few axes for this motion of its tool."""
    REACH = "reach"
    """The line continues beyond what any joint position near this one reaches."""


class JogCause(NamedTuple):
    """A reason with its numbers.

    Attributes:
        reason: what it is.
        value: joint position [rad or m], condition number [1], distance [m], share of the
            workspace [1], or the speed that was asked for [m/s or rad/s].
        limit: bound of the value, in the same unit.
        joint: index of the joint, or -1.
        pair: names of the two bodies, or None.
    """

    reason: JogSlowdown
    value: float
    limit: float
    joint: int = -1
    pair: tuple[str, str] | None = None


class JogEscape(NamedTuple):
    """Direction that leads out of what holds a jog.

    Attributes:
        joints: (n,) a joint jog that leads out, its greatest element ±1; None if none is known.
        reverse: True if the opposite of what was asked leads out too.
        singularity: name of the singularity that it leads out of; empty otherwise.
    """

    joints: tuple[float, ...] | None
    reverse: bool
    singularity: str = ""


class JogSetpoint(NamedTuple):
    """One set-point of a jog.

    Attributes:
        position: (n,) controller-side [rad or m].
        velocity: (n,) [rad/s or m/s].
        acceleration: (n,) mean since the last set-point [rad/s² or m/s²].
        scale: share of the asked speed that is left, 0 to 1; 1 while a ramp is still rising.
        cause: what takes the rest of the speed; None if nothing does.
        at_rest: True if the robot stands still after this set-point.
        retreat: direction that leads out, once a cause holds the robot at rest.
    """

    position: list[float]
    velocity: list[float]
    acceleration: list[float]
    scale: float
    cause: JogCause | None
    at_rest: bool
    retreat: JogEscape | None = None

    @property
    def reason(self) -> JogSlowdown | None:
        """Reason of the cause, without its numbers."""
        return None if self.cause is None else self.cause.reason
