"""Jog commands and set-points: joint or tool jogs with speeds and caps, and the answer to them.

Owns the checks of these numbers, and the words for what slows or holds a jog: plain numbers and
names, of which screens make the sentences and the server a verdict. Rates are shares of a cap from
-1 to 1, so that a key and a joystick ask alike. Knows no robot: `jogger` checks the number of
joints.

Owns also the targets of increments, where one press moves the tool by a fixed amount instead of as
long as it is held. What pendants call A, B, C is two things, which have two names here: `turned`
rotates the tool about axes of a frame through the tool centre point, as a held key does;
`with_rpy_changed` adds to the values roll, pitch and yaw, as a pendant does that shows them and
increments one of them. `motion.orientation` has the formulas. The targets are poses for
point-to-point motions. Nothing here moves, and the pendant decides which increments it offers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple, TypeAlias

import numpy as np

from ..errors import BadArgument, NotFinite
from ..orientation import quaternion_of_vector, rpy_increment
from ..pose import Array, Pose, quaternion_product, quaternion_to_matrix
from ..trajectory.point_speed import REDUCED_SPEED


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


Axes: TypeAlias = tuple[float, float, float, float]
"""Unit quaternion x, y, z, w of a frame in the base frame."""

BASE_AXES: Axes = (0.0, 0.0, 0.0, 1.0)

LONGEST_STEP = 0.02
"""Longest tick [s]: that of a server at 50 Hz."""

_NORM_TOLERANCE = 1e-3


@dataclass(frozen=True, slots=True)
class JogCaps:
    """Speed limits of a jog.

    Attributes:
        override: share of all speeds below, above 0 and at most 1; it only lowers.
        joint_fraction: greatest share of each joint's speed limit in a joint jog, 0 to 1.
        tool_speed: greatest speed of the tool centre point, and of the elbow [m/s].
        rotation_speed: greatest rotation speed of the tool in a tool jog [rad/s].
        reduced: manual reduced speed: tool centre point and elbow at 0.25 m/s at most.

    Raises:
        BadArgument: a value is outside its range or not a number.
    """

    override: float = 1.0
    joint_fraction: float = 0.2
    tool_speed: float = REDUCED_SPEED
    rotation_speed: float = 0.5
    reduced: bool = True

    def __post_init__(self) -> None:
        for name in ("override", "joint_fraction"):
            value = getattr(self, name)
            if not 0.0 < value <= 1.0:
                raise BadArgument(name, value, "more than 0 and at most 1")
        for name in ("tool_speed", "rotation_speed"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise BadArgument(name, value, "a finite speed of more than 0")

    @property
    def point_speed(self) -> float:
        """Greatest speed of tool centre point and elbow, in every kind of jog [m/s]."""
        return min(self.tool_speed, REDUCED_SPEED) if self.reduced else self.tool_speed


@dataclass(frozen=True, slots=True)
class JointJog:
    """Jog of one joint or several at once.

    Attributes:
        rates: (n,) share of each joint's jog speed, -1 to 1; 0 for a joint that stands still.

    Raises:
        BadArgument, NotFinite: a share is beyond ±1, or no number.
    """

    rates: tuple[float, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "rates", _shares(self.rates, "the joint rates"))


@dataclass(frozen=True, slots=True)
class ToolJog:
    """Jog of the tool along and about axes that go through the tool centre point.

    Attributes:
        linear: (3,) share of the tool speed along x, y, z of the axes, -1 to 1 each.
        angular: (3,) share of the rotation speed about x, y, z of the axes (A, B, C).
        axes: the jog frame's axes; None for the tool's own, which move with it.
        magnitude: the greater of the lengths of both vectors: 1 is full speed, √3 the most.

    Raises:
        BadArgument: a share is beyond ±1, a vector has not 3 values, or the axes are no rotation.
        NotFinite: a number is infinite or not a number.
    """

    linear: tuple[float, ...] = (0.0, 0.0, 0.0)
    angular: tuple[float, ...] = (0.0, 0.0, 0.0)
    axes: Axes | None = BASE_AXES
    magnitude: float = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        for name in ("linear", "angular"):
            shares = _shares(getattr(self, name), f"the {name} rates")
            if len(shares) != 3:
                raise BadArgument(f"{name} rates", shares, "3 numbers")
            object.__setattr__(self, name, shares)
        if self.axes is not None:
            norm = math.hypot(*self.axes)
            if len(self.axes) != 4 or not abs(norm - 1.0) <= _NORM_TOLERANCE:
                raise BadArgument("axes", self.axes, "a quaternion x, y, z, w of norm 1")
            x, y, z, w = (float(value) / norm for value in self.axes)
            object.__setattr__(self, "axes", (x, y, z, w))
        magnitude = max(math.hypot(*self.linear), math.hypot(*self.angular))
        object.__setattr__(self, "magnitude", magnitude)

    def direction(self) -> tuple[Array, Array]:
        """Return the (3,) linear and angular shares at full speed, along the base frame's axes.

        For the tool's own axes they are along those.
        """
        magnitude = self.magnitude or 1.0
        linear = np.array(self.linear) / magnitude
        angular = np.array(self.angular) / magnitude
        if self.axes is None:
            return linear, angular
        rotation = quaternion_to_matrix(np.array(self.axes))
        return rotation @ linear, rotation @ angular


JogTarget: TypeAlias = JointJog | ToolJog


def _shares(values: Sequence[float], what: str) -> tuple[float, ...]:
    shares = tuple(float(value) for value in values)
    for index, share in enumerate(shares):
        if not math.isfinite(share):
            raise NotFinite(what, index)
        if not -1.0 <= share <= 1.0:
            raise BadArgument(what, share, "-1 to 1")
    return shares


def shifted(pose: Pose, shift: Sequence[float], frame: Pose | None = None) -> Pose:
    """Return a pose moved along the axes of a frame; it keeps its orientation.

    Args:
        pose: of the tool, in the base.
        shift: (3,) along x, y, z of the frame [m].
        frame: the frame in the base; None for the base itself, the pose for the tool's own axes.

    Raises:
        BadArgument, NotFinite: not three finite values.
    """
    way = np.array(_three(shift, "the shift"))
    if frame is not None:
        way = frame.rotation @ way
    return Pose(pose.position + way, pose.quaternion)


def turned(pose: Pose, turn: Sequence[float], frame: Pose | None = None) -> Pose:
    """Return a pose rotated about axes through its own origin: A, B, C as held keys do.

    Args:
        pose: of the tool, in the base.
        turn: (3,) rotation vector along x (A), y (B), z (C) of the frame [rad].
        frame: the frame in the base; None for the base itself, the pose for the tool's own axes.

    Raises:
        BadArgument, NotFinite: not three finite values.
    """
    vector = np.array(_three(turn, "the turn"))
    if frame is not None:
        vector = frame.rotation @ vector
    turned_by = quaternion_of_vector(vector)
    return Pose(pose.position, quaternion_product(turned_by, pose.quaternion))


def with_rpy_changed(pose: Pose, change: Sequence[float], frame: Pose | None = None) -> Pose:
    """Return a pose whose roll, pitch and yaw, as read in a frame, are each changed by an amount.

    Args:
        pose: of the tool, in the base.
        change: (3,) added to roll, pitch and yaw [rad].
        frame: the frame in the base whose roll, pitch and yaw are meant; None for the base.

    Raises:
        BadArgument, NotFinite: not three finite values.
    """
    values = _three(change, "the change")
    if frame is None:
        return rpy_increment(pose, values)
    # Only the frame's axes matter, so the pose is rotated into them and back about its own origin.
    axes = Pose(np.zeros(3), frame.quaternion)
    return axes.compose(rpy_increment(axes.inverse().compose(pose), values))


def _three(values: Sequence[float], what: str) -> list[float]:
    if len(values) != 3:
        raise BadArgument(what, list(values), "3 numbers")
    for index, value in enumerate(values):
        if not math.isfinite(value):
            raise NotFinite(what, index)
    return [float(value) for value in values]
