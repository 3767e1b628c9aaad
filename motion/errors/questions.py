"""What was asked is malformed, or needs what is not installed: the caller's fault, on any robot."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .motion_error import MotionError
from .wording import shortened


@dataclass(eq=False)
class BadArgument(MotionError):
    """An argument is outside what the function accepts, whatever the robot."""

    code: ClassVar[str] = "bad-argument"
    name: str
    value: object
    accepted: str

    def __str__(self) -> str:
        return f"{self.name} is {shortened(self.value)}; accepted: {self.accepted}"


@dataclass(eq=False)
class NotFinite(MotionError):
    """A number is infinite or not a number; `index` is its place in `what`."""

    code: ClassVar[str] = "not-finite"
    what: str
    index: int

    def __str__(self) -> str:
        return f"element {self.index} of {self.what} is not a finite number"


@dataclass(eq=False)
class WrongJointCount(MotionError):
    """A joint vector does not have one value per driven joint."""

    code: ClassVar[str] = "wrong-joint-count"
    got: int
    expected: int

    def __str__(self) -> str:
        return f"{self.got} joint values were given, the robot has {self.expected} driven joints"


@dataclass(eq=False)
class PlannerUnavailable(MotionError):
    """No planner of that name can be used here; `known` are those that can."""

    code: ClassVar[str] = "planner-unavailable"
    name: str
    known: tuple[str, ...]

    def __str__(self) -> str:
        return f"no planner {self.name!r} is available; available: {', '.join(self.known)}"


@dataclass(eq=False)
class LibraryMissing(MotionError):
    """What was asked for needs an optional library; `extra` of the package installs it."""

    code: ClassVar[str] = "library-missing"
    library: str
    extra: str

    def __str__(self) -> str:
        return f"{self.library} is not installed; the extra {self.extra!r} of openpendant adds it"
