"""The typed refusals of `motion`: one class per kind, with the numbers as attributes.

Owns the catalogue of codes and the sentence of each refusal. Knows no robot, no wire format and no
library: values arrive as plain numbers, with the unit of the joint they belong to (`rad` for a
revolute joint, `m` for a prismatic one).

    MotionError
    ├── BadArgument, NotFinite, WrongJointCount, FrameUnknown      the question is malformed
    ├── OutOfRange, TooFast, TooSharp                              a joint limit would be broken
    ├── Unreachable, BranchChange, NotTimeable, NoMotion           no such motion exists
    ├── CertificateRefused                                         the independent check said no
    └── RobotFileError, UnknownRobot, UnsupportedKind              the robot itself
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

if TYPE_CHECKING:
    from .pose import Pose

_Error = TypeVar("_Error", bound="MotionError")


def _restore(kind: type[_Error], attributes: dict[str, Any]) -> _Error:
    error = kind.__new__(kind)
    error.__dict__.update(attributes)
    return error


class MotionError(Exception):
    """A motion question that is refused; `code` is its stable name in the error catalogue."""

    code: ClassVar[str] = "motion-error"

    def __reduce__(self) -> tuple[Any, ...]:
        # Refusals travel from the planning process to the server; the default protocol would call
        # the constructor with `args`, which misses what was passed by keyword.
        return _restore, (type(self), dict(self.__dict__))


@dataclass(eq=False)
class BadArgument(MotionError):
    """An argument is outside what the function accepts, whatever the robot."""

    code: ClassVar[str] = "bad-argument"
    name: str
    value: object
    accepted: str

    def __str__(self) -> str:
        return f"{self.name} is {_shortened(self.value)}; accepted: {self.accepted}"


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
class FrameUnknown(MotionError):
    """A pose is asked for in, or of, a frame the robot does not have."""

    code: ClassVar[str] = "unknown-frame"
    name: str
    known: tuple[str, ...]

    def __str__(self) -> str:
        return f"no frame is called {self.name!r}; known: {', '.join(self.known)}"


@dataclass(eq=False)
class OutOfRange(MotionError):
    """A joint position lies outside its range; `index` is the joint's place, -1 if not known."""

    code: ClassVar[str] = "out-of-range"
    joint: str
    value: float
    lower: float
    upper: float
    unit: str = "rad"
    index: int = -1

    def __str__(self) -> str:
        return (
            f"{self.joint} at {self.value!r} {self.unit} is outside its range"
            f" {self.lower!r} to {self.upper!r} {self.unit}"
        )


@dataclass(eq=False)
class TooFast(MotionError):
    """A joint velocity exceeds its limit; `unit` is that of the position."""

    code: ClassVar[str] = "too-fast"
    joint: str
    value: float
    limit: float
    unit: str = "rad"
    index: int = -1

    def __str__(self) -> str:
        return (
            f"{self.joint} at {self.value!r} {self.unit}/s is faster than its limit"
            f" {self.limit!r} {self.unit}/s"
        )


@dataclass(eq=False)
class TooSharp(MotionError):
    """A joint acceleration exceeds its limit; `unit` is that of the position."""

    code: ClassVar[str] = "too-sharp"
    joint: str
    value: float
    limit: float
    unit: str = "rad"
    index: int = -1

    def __str__(self) -> str:
        return (
            f"{self.joint} accelerating at {self.value!r} {self.unit}/s² exceeds its limit"
            f" {self.limit!r} {self.unit}/s²"
        )


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
        where = "" if self.fraction is None else f" at {self.fraction:.1%} of the path"
        tried = f" of {self.restarts} restarts" if self.restarts else ""
        return (
            f"not reachable: the nearest position{tried} stays {self.best_position_error:.3g} m and"
            f" {self.best_rotation_error:.3g} rad away from the pose at x {x:.3g} m, y {y:.3g} m,"
            f" z {z:.3g} m in {self.frame}{where}"
        )


@dataclass(eq=False)
class BranchChange(MotionError):
    """A tool path needs a joint to jump to another branch; `step` is the jump's size."""

    code: ClassVar[str] = "branch-change"
    fraction: float
    joint: str
    step: float
    unit: str = "rad"

    def __str__(self) -> str:
        return (
            f"{self.joint} would have to jump by {self.step:.6g} {self.unit}"
            f" at {self.fraction:.1%} of the path"
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
class CertificateRefused(MotionError):
    """The independent check found a sample that may not leave.

    `check` names the rule, such as `velocity`; `joint`, `value` and `limit` are the offender's;
    `unit` is that of `value`; `time` [s] is the sample's, from the start of the trajectory.
    """

    code: ClassVar[str] = "certificate-refused"
    check: str
    joint: str
    value: float
    limit: float
    time: float
    unit: str = "rad"

    def __str__(self) -> str:
        return (
            f"the trajectory fails the {self.check} check: {self.joint} has {self.value!r}"
            f" {self.unit} at {self.time:.6g} s, the limit is {self.limit!r} {self.unit}"
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
        place = f"{self.file}: {self.field}" if self.field else self.file
        rest = f" (and {len(self.more)} more)" if self.more else ""
        return f"{place}: {self.problem}{rest}"


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
    """The robot is of a kind for which `what` does not exist."""

    code: ClassVar[str] = "unsupported-kind"
    name: str
    kind: str
    what: str

    def __str__(self) -> str:
        return f"{self.name} is a {self.kind} robot; only a serial one has {self.what}"


def _shortened(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."
