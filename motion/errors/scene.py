"""The scene is at fault: a name in it, a file of it, or two bodies that touch."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .motion_error import MotionError
from .wording import for_a_screen, in_file


@dataclass(eq=False)
class UnknownObject(MotionError):
    """A scene holds no object of that name, or a named pair means neither an object nor a link."""

    code: ClassVar[str] = "unknown-object"
    name: str
    known: tuple[str, ...]

    def __str__(self) -> str:
        known = ", ".join(self.known) or "none"
        return f"no object or link is called {self.name!r}; known: {known}"


@dataclass(eq=False)
class DuplicateObject(MotionError):
    """A scene already holds an object of that name, or a link of the robot bears it."""

    code: ClassVar[str] = "duplicate-object"
    name: str

    def __str__(self) -> str:
        return f"the name {self.name!r} is taken; accepted: a name of no other object and no link"


@dataclass(eq=False)
class SceneTooLarge(MotionError):
    """More pairs of bodies with an object would have to be checked than are accepted."""

    code: ClassVar[str] = "scene-too-large"
    pairs: int
    limit: int
    objects: int

    def __str__(self) -> str:
        return (
            f"the scene of {self.objects} objects makes {self.pairs} pairs of bodies to check;"
            f" accepted: {self.limit} at most. Remove objects, put one around several, have"
            " fewer held, or allow pairs that need no check to touch"
        )


@dataclass(eq=False)
class SceneFileError(MotionError):
    """A scene file cannot be used; `more` holds the further (field, problem) pairs found."""

    code: ClassVar[str] = "scene-file"
    file: str
    field: str
    problem: str
    more: tuple[tuple[str, str], ...] = ()

    def __str__(self) -> str:
        rest = f" (and {len(self.more)} more)" if self.more else ""
        return in_file(self.file, self.field, self.problem) + rest


@dataclass(eq=False)
class MeshFileError(MotionError):
    """A mesh file cannot be used; `place` is the line or the byte, empty for the whole file."""

    code: ClassVar[str] = "mesh-file"
    file: str
    place: str
    problem: str

    def __str__(self) -> str:
        return in_file(self.file, self.place, self.problem)


@dataclass(eq=False)
class StartInCollision(MotionError):
    """Two bodies touch where a motion is to start; `distance` [m] is negative by their overlap."""

    code: ClassVar[str] = "start-in-collision"
    first: str
    second: str
    distance: float

    def __str__(self) -> str:
        return (
            f"{self.first} and {self.second} touch at the start"
            f" (distance {for_a_screen(self.distance, 'm')});"
            " accepted: a start where nothing touches"
        )


@dataclass(eq=False)
class GoalInCollision(MotionError):
    """Two bodies touch where a motion is to end; `distance` [m] is negative by their overlap."""

    code: ClassVar[str] = "goal-in-collision"
    first: str
    second: str
    distance: float

    def __str__(self) -> str:
        return (
            f"{self.first} and {self.second} touch at the goal"
            f" (distance {for_a_screen(self.distance, 'm')});"
            " accepted: a goal where nothing touches"
        )


@dataclass(eq=False)
class PathInCollision(MotionError):
    """Two bodies touch on the way; `fraction` is how far along the path, 0 to 1."""

    code: ClassVar[str] = "path-in-collision"
    first: str
    second: str
    distance: float
    fraction: float

    def __str__(self) -> str:
        return (
            f"{self.first} and {self.second} touch at {self.fraction:.1%} of the path"
            f" (distance {for_a_screen(self.distance, 'm')});"
            " accepted: a path on which nothing touches"
        )
