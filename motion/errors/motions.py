"""The question is sound and its answer is that no such motion exists."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from .motion_error import MotionError
from .wording import on_the_path

if TYPE_CHECKING:
    from ..pose import Pose


@dataclass(eq=False)
class Unreachable(MotionError):
    """No joint position inside the limits reaches the pose.

    `best_position_error` [m] and `best_rotation_error` [rad] are those of the nearest position
    inside the limits that was found; `fraction` is how far along a path the pose lies, 0 to 1.
    """

    code: ClassVar[str] = "unreachable"
    pose: Pose
    frame: str
    best_position_error: float
    best_rotation_error: float
    restarts: int
    fraction: float | None = None

    def __str__(self) -> str:
        x, y, z = (float(value) for value in self.pose.position)
        where = on_the_path(self.fraction)
        tried = f" of {self.restarts} restarts" if self.restarts else ""
        return (
            f"not reachable: the nearest position{tried} stays {self.best_position_error:.3g} m and"
            f" {self.best_rotation_error:.3g} rad away from the pose at x {x:.3g} m, y {y:.3g} m,"
            f" z {z:.3g} m in {self.frame}{where}"
        )


@dataclass(eq=False)
class BranchChange(MotionError):
    """A tool path needs a joint to jump to another branch; `step` is the jump's size.

    `singularity` names the one it is at, empty if none is near.
    """

    code: ClassVar[str] = "branch-change"
    fraction: float
    joint: str
    step: float
    unit: str = "rad"
    singularity: str = ""

    def __str__(self) -> str:
        where = f", at a {self.singularity} singularity" if self.singularity else ""
        return (
            f"{self.joint} would have to jump by {self.step:.6g} {self.unit}"
            f" at {self.fraction:.1%} of the path{where}; accepted: a path that passes that place"
            " by, or a joint motion past it"
        )


@dataclass(eq=False)
class NotTimeable(MotionError):
    """The timing solver found no motion along the path; `return_code` is its own word for why."""

    code: ClassVar[str] = "not-timeable"
    path_length: float
    return_code: str

    def __str__(self) -> str:
        return (
            f"the path of length {self.path_length:.6g} cannot be timed within the limits"
            f" (solver: {self.return_code})"
        )


@dataclass(eq=False)
class NoMotion(MotionError):
    """The path has no length: the robot already stands at its end."""

    code: ClassVar[str] = "no-motion"

    def __str__(self) -> str:
        return "the robot is already there: the motion has no length"


@dataclass(eq=False)
class NoPathFound(MotionError):
    """A planner ended without a path free of contact.

    `seconds` is the time it took, None where no clock was given; `iterations` is what it counts.
    """

    code: ClassVar[str] = "no-path-found"
    planner: str
    seconds: float | None
    iterations: int

    def __str__(self) -> str:
        took = "" if self.seconds is None else f" and {self.seconds:.3g} s"
        return f"{self.planner} found no path free of contact in {self.iterations} iterations{took}"
