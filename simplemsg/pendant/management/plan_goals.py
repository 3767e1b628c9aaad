"""Goals of plans as the server reads them: one class for each kind, told apart by `kind`.

What callers give is in `plans`, as JSON objects with the same keys. Poses are of the tool, in a
named frame; joint positions are controller side [rad or m].
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from .declaration import Count, Length, Number, Placed, Real, ToldApart

MOST_READ = 20_000
"""Waypoints that are read of a body; a frame holds no more, and `MAX_WAYPOINTS` are accepted."""

Joints: TypeAlias = Annotated[tuple[Real, ...], Length(1, 64)]
"""A joint position; whether it has as many values as the robot has joints, the server says."""


class Aim:
    """A goal; a key that its kind does not have is refused."""

    __slots__ = ()
    __pydantic_config__: ClassVar[Mapping[str, Any]] = {"extra": "forbid"}


@dataclass(frozen=True, slots=True, kw_only=True)
class PtpAim(Aim):
    """To a joint position, or to a pose, in a straight joint line.

    Attributes:
        branch: which of the joint positions that reach the pose, from 1, the nearest first; None
            for the nearest that the arm finds.
    """

    kind: Literal["ptp"]
    joints: Joints | None = None
    pose: Placed | None = None
    frame: str = "base"
    branch: Annotated[int, Count(1, 10_000)] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LinAim(Aim):
    """To a pose, with the tool on a straight line."""

    kind: Literal["lin"]
    pose: Placed
    frame: str = "base"


@dataclass(frozen=True, slots=True, kw_only=True)
class PathAim(Aim):
    """Through joint positions without stopping, or through poses.

    Attributes:
        way: `ptp` passes the waypoints without stopping, `lin` stops at each pose.
    """

    kind: Literal["path"]
    waypoints: Annotated[tuple[Joints | Placed, ...], Length(1, MOST_READ)]
    frame: str = "base"
    way: Literal["ptp", "lin"] = "ptp"


@dataclass(frozen=True, slots=True, kw_only=True)
class FreeAim(Aim):
    """To a joint position or a pose, around what stands in the cell.

    Attributes:
        planner: one of `planners` of `robots.describe`.
        seed: the same number gives the same path.
        time_limit: longest search [s].
        margin: distance that the search keeps from bodies [m].
    """

    kind: Literal["free"]
    joints: Joints | None = None
    pose: Placed | None = None
    frame: str = "base"
    planner: str = "RRTConnect"
    seed: Annotated[int, Count(0, below=1 << 31)] = 0
    time_limit: Annotated[float, Number(0.05, 5.0, finite=True)] = 5.0
    margin: Annotated[float, Number(0.0, 0.05, finite=True)] = 0.005


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionAim(Aim):
    """To a named position."""

    kind: Literal["position"]
    name: str


PlanGoal: TypeAlias = PtpAim | LinAim | PathAim | FreeAim | PositionAim

AnyGoal: TypeAlias = Annotated[PlanGoal, ToldApart("kind")]
"""A goal as it is read from JSON."""
