"""A change of the frames is refused, or a frame as taught, recorded or stored is at fault."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .motion_error import MotionError
from .wording import for_a_screen, in_file


@dataclass(eq=False)
class FrameUnknown(MotionError):
    """A pose is asked for in, or of, a frame the robot does not have."""

    code: ClassVar[str] = "unknown-frame"
    name: str
    known: tuple[str, ...]

    def __str__(self) -> str:
        return f"no frame is called {self.name!r}; known: {', '.join(self.known)}"


@dataclass(eq=False)
class FrameExists(MotionError):
    """A frame or tool is to be named as another already is."""

    code: ClassVar[str] = "frame-exists"
    name: str

    def __str__(self) -> str:
        return f"a frame is called {self.name!r} already; accepted: a name not in use"


@dataclass(eq=False)
class FrameCycle(MotionError):
    """A frame is to hang from itself, or from one that hangs from it."""

    code: ClassVar[str] = "frame-cycle"
    name: str
    parent: str

    def __str__(self) -> str:
        return (
            f"{self.name!r} cannot hang from {self.parent!r}, which hangs from {self.name!r};"
            " accepted: a parent outside the branch"
        )


@dataclass(eq=False)
class FramePredefined(MotionError):
    """A frame that belongs to the robot is to be changed; `action` is the change asked for."""

    code: ClassVar[str] = "frame-predefined"
    name: str
    action: str

    def __str__(self) -> str:
        return f"{self.name!r} belongs to the robot and cannot be {self.action}"


@dataclass(eq=False)
class FrameInUse(MotionError):
    """A frame is to be removed while others hang from it, or a tool while it is selected."""

    code: ClassVar[str] = "frame-in-use"
    name: str
    users: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.name!r} cannot be removed: {', '.join(self.users)} would lose its place"


@dataclass(eq=False)
class NotInHistory(MotionError):
    """A frame's pose is asked for at a time [ns] that its history does not cover.

    `oldest` and `newest` [ns] are the bounds of the history, None where nothing is recorded.
    """

    code: ClassVar[str] = "not-in-history"
    frame: str
    time: int
    oldest: int | None
    newest: int | None

    def __str__(self) -> str:
        if self.oldest is None or self.newest is None:
            return f"no pose of {self.frame!r} is known yet"
        return (
            f"where {self.frame!r} was at {self.time / 1e9:.9g} s is not known;"
            f" accepted: {self.oldest / 1e9:.9g} to {self.newest / 1e9:.9g} s"
        )


@dataclass(eq=False)
class PoorGeometry(MotionError):
    """Taught points or poses do not determine what they are to define.

    `value` and `limit` are in `unit`; `least` says whether the limit is a lower bound.
    """

    code: ClassVar[str] = "poor-geometry"
    what: str
    value: float
    limit: float
    unit: str
    least: bool = True

    def __str__(self) -> str:
        bound = "at least" if self.least else "at most"
        shown, accepted = (for_a_screen(value, self.unit) for value in (self.value, self.limit))
        return f"{self.what} is {shown}; accepted: {bound} {accepted}"


@dataclass(eq=False)
class FrameFileError(MotionError):
    """A file of frames and tools cannot be used; `field` is empty for the whole file."""

    code: ClassVar[str] = "frame-file"
    file: str
    field: str
    problem: str

    def __str__(self) -> str:
        return in_file(self.file, self.field, self.problem)
