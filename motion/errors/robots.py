"""The robot is at fault: its file, its name or its kind."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .motion_error import MotionError
from .wording import in_file

_FOR_A_PLATFORM = (
    "For a parallel one there are `openpendant robots show`, `draw`, `check`, `fk` and `ik`, and"
    " jogs and paths from Python (docs/motion.md)"
)


@dataclass(eq=False)
class RobotFileError(MotionError):
    """A robot file cannot be used; `more` holds the further (field, problem) pairs found."""

    code: ClassVar[str] = "robot-file"
    file: str
    field: str
    problem: str
    more: tuple[tuple[str, str], ...] = ()

    @property
    def problems(self) -> tuple[tuple[str, str], ...]:
        """Every (field, problem) found, the first one first; an empty field is the whole file."""
        return ((self.field, self.problem), *self.more)

    def __str__(self) -> str:
        rest = f" (and {len(self.more)} more)" if self.more else ""
        return in_file(self.file, self.field, self.problem) + rest


@dataclass(eq=False)
class UnknownRobot(MotionError):
    """The name belongs to no robot of the project and is no file either."""

    code: ClassVar[str] = "unknown-robot"
    name: str
    known: tuple[str, ...]

    def __str__(self) -> str:
        return f"no robot or robot file is called {self.name!r}; known: {', '.join(self.known)}"


@dataclass(eq=False)
class UnsupportedKind(MotionError):
    """The robot is of a kind for which `what` does not exist.

    Attributes:
        name: the robot's.
        kind: its kind, `parallel` for one.
        what: what was asked for, as it stands behind "no".
    """

    code: ClassVar[str] = "unsupported-kind"
    name: str
    kind: str
    what: str

    def __str__(self) -> str:
        refused = f"{self.name} is a {self.kind} robot, and there is no {self.what} for one"
        instead = f". {_FOR_A_PLATFORM}" if self.kind == "parallel" else ""
        return f"{refused}; accepted: a serial robot, see `openpendant robots list`{instead}"
