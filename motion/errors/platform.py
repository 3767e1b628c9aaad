"""A parallel robot's own limits: legs, anchors and the workspace of its platform."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .motion_error import MotionError
from .wording import on_the_path


@dataclass(eq=False)
class PlatformLimit(MotionError):
    """A pose breaks a limit of a parallel robot, short of any leg vector being asked for.

    `rule` names the limit (`stroke`, `base cone`, `platform cone`, `workspace sum`); `joint` and
    `index` the leg, empty and -1 for a rule of the whole platform; `fraction` is how far along a
    path the pose lies, 0 to 1.
    """

    code: ClassVar[str] = "platform-limit"
    rule: str
    joint: str
    value: float
    limit: float
    unit: str
    index: int = -1
    fraction: float | None = None

    def __str__(self) -> str:
        who = f"{self.joint}: " if self.joint else ""
        where = on_the_path(self.fraction)
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"{who}the {self.rule} limit is {self.limit:.6g}{unit},"
            f" the pose needs {self.value:.6g}{unit}{where}"
        )


@dataclass(eq=False)
class NoAssembly(MotionError):
    """No platform pose connected with home has these leg lengths [m].

    `residual` [m] is the greatest leg error of the best pose found, `reason` what it fails by.
    """

    code: ClassVar[str] = "no-assembly"
    lengths: tuple[float, ...]
    residual: float
    reason: str

    def __str__(self) -> str:
        legs = ", ".join(f"{length:.6g}" for length in self.lengths)
        return f"legs of {legs} m hold no platform pose: {self.reason}"
