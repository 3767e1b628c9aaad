"""The typed refusals of `motion`: one class per kind, with the numbers as attributes.

Owns the catalogue of codes and the sentence of each refusal. Knows no robot, no wire format and no
library: values arrive as plain numbers, with the unit of the joint they belong to (`rad` for a
revolute joint, `m` for a prismatic one).

    MotionError
    ├── BadArgument, NotFinite, WrongJointCount, FrameUnknown      the question is malformed
    ├── OutOfRange, TooFast, TooSharp                              a joint limit would be broken
    ├── Unreachable, BranchChange, NotTimeable, NoMotion           no such motion exists
    ├── CertificateRefused                                         the independent check said no
    ├── FrameExists, FrameCycle, FramePredefined, FrameInUse       a change of frames is refused
    ├── NotInHistory, PoorGeometry, FrameFileError                 frames: past, taught, in files
    ├── PlatformLimit, NoAssembly                                  a parallel robot's own limits
    ├── BadCircle, ZoneTooLarge, SegmentRefused                    a path's geometry, or one segment
    └── RobotFileError, UnknownRobot, UnsupportedKind              the robot itself
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

if TYPE_CHECKING:
    from .pose import Pose

_Error = TypeVar("_Error", bound="MotionError")


class CircleFault(Enum):
    """Why points determine no circle."""

    COINCIDENT = "coincident"
    COLLINEAR = "collinear"
    NOT_EQUIDISTANT = "not-equidistant"
    TOO_SMALL = "too-small"
    TOO_LARGE = "too-large"
    NO_NORMAL = "no-normal"


_CIRCLE_FAULTS = {
    CircleFault.COINCIDENT: (
        "two points of the circle are {value} apart; accepted: at least {limit}"
    ),
    CircleFault.COLLINEAR: (
        "the points of the circle lie on one line: one is {value} off the line through the others;"
        " accepted: at least {limit}"
    ),
    CircleFault.NOT_EQUIDISTANT: (
        "the centre is {limit} from the start and {value} from the end; accepted: equal radii"
    ),
    CircleFault.TOO_SMALL: "the radius is {value}; accepted: at least {limit}",
    CircleFault.TOO_LARGE: "the radius is {value}; accepted: at most {limit}",
    CircleFault.NO_NORMAL: (
        "start, centre and end lie within {value} of one line, so the plane of the circle is not"
        " known; accepted: at least {limit}, or a normal of the plane"
    ),
}


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
    """A joint position lies outside its range; `index` is the joint's place, -1 if not known.

    `fraction` is how far along a path it would be there, 0 to 1.
    """

    code: ClassVar[str] = "out-of-range"
    joint: str
    value: float
    lower: float
    upper: float
    unit: str = "rad"
    index: int = -1
    fraction: float | None = None

    def __str__(self) -> str:
        where = "" if self.fraction is None else f" at {self.fraction:.1%} of the path"
        return (
            f"{self.joint} at {self.value!r} {self.unit} is outside its range"
            f" {self.lower!r} to {self.upper!r} {self.unit}{where}"
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
        shown, accepted = (_for_a_screen(value, self.unit) for value in (self.value, self.limit))
        return f"{self.what} is {shown}; accepted: {bound} {accepted}"


@dataclass(eq=False)
class FrameFileError(MotionError):
    """A file of frames and tools cannot be used; `field` is empty for the whole file."""

    code: ClassVar[str] = "frame-file"
    file: str
    field: str
    problem: str

    def __str__(self) -> str:
        place = f"{self.file}: {self.field}" if self.field else self.file
        return f"{place}: {self.problem}"


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
        where = "" if self.fraction is None else f" at {self.fraction:.1%} of the path"
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


@dataclass(eq=False)
class LibraryMissing(MotionError):
    """What was asked for needs an optional library; `extra` of the package installs it."""

    code: ClassVar[str] = "library-missing"
    library: str
    extra: str

    def __str__(self) -> str:
        return f"{self.library} is not installed; pip install 'openpendant[{self.extra}]' adds it"


def _shortened(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _for_a_screen(value: float, unit: str) -> str:
    match unit:
        case "m":
            return f"{1e3 * value:.3g} mm"
        case "rad":
            return f"{math.degrees(value):.3g}°"
    return f"{value:.3g} {unit}".rstrip()


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
class SceneFileError(MotionError):
    """A scene file cannot be used; `more` holds the further (field, problem) pairs found."""

    code: ClassVar[str] = "scene-file"
    file: str
    field: str
    problem: str
    more: tuple[tuple[str, str], ...] = ()

    def __str__(self) -> str:
        place = f"{self.file}: {self.field}" if self.field else self.file
        rest = f" (and {len(self.more)} more)" if self.more else ""
        return f"{place}: {self.problem}{rest}"


@dataclass(eq=False)
class MeshFileError(MotionError):
    """A mesh file cannot be used; `place` is the line or the byte, empty for the whole file."""

    code: ClassVar[str] = "mesh-file"
    file: str
    place: str
    problem: str

    def __str__(self) -> str:
        place = f"{self.file}: {self.place}" if self.place else self.file
        return f"{place}: {self.problem}"


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
            f" (distance {self.distance * 1e3:.3g} mm)"
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
            f" (distance {self.distance * 1e3:.3g} mm)"
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
            f" (distance {self.distance * 1e3:.3g} mm)"
        )


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


@dataclass(eq=False)
class PlannerUnavailable(MotionError):
    """No planner of that name can be used here; `known` are those that can."""

    code: ClassVar[str] = "planner-unavailable"
    name: str
    known: tuple[str, ...]

    def __str__(self) -> str:
        return f"no planner {self.name!r} is available; available: {', '.join(self.known)}"


@dataclass(eq=False)
class BadCircle(MotionError):
    """Points do not determine a circle that can be run along.

    `fault` names the rule; `value` and `limit` are its numbers, [m] each. For a centre that is not
    equally far from both ends they are the radius at the end and that at the start.
    """

    code: ClassVar[str] = "bad-circle"
    fault: CircleFault
    value: float
    limit: float

    def __str__(self) -> str:
        value, limit = _for_a_screen(self.value, "m"), _for_a_screen(self.limit, "m")
        return _CIRCLE_FAULTS[self.fault].format(value=value, limit=limit)


@dataclass(eq=False)
class ZoneTooLarge(MotionError):
    """A corner cannot be rounded as widely as asked.

    `waypoint` is the corner's place among those asked for, from 0; `largest` is the largest zone
    that works there with the other zones as they are, `unit` that of both; `reason` is what
    bounds it.
    """

    code: ClassVar[str] = "zone-too-large"
    waypoint: int
    zone: float
    largest: float
    unit: str
    reason: str

    def __str__(self) -> str:
        return (
            f"the zone of {self.zone:.6g} {self.unit} at waypoint {self.waypoint} is too large:"
            f" {self.reason}; the largest that works is {self.largest:.6g} {self.unit}"
        )


@dataclass(eq=False)
class SegmentRefused(MotionError):
    """One segment of several is refused; `reason` says why, a fraction in it is the segment's.

    `segment` is its place in the list, from 0.
    """

    code: ClassVar[str] = "segment-refused"
    segment: int
    reason: MotionError

    def __str__(self) -> str:
        return f"segment {self.segment}: {self.reason}"
