"""Typed refusals of `motion`: one class per kind, with the numbers as attributes.

Owns the catalogue of codes, the sentence of each refusal, and the phrases that several share:
numbers with units, which people see in millimetres and degrees, and places in files and on paths.
Owns also that a refusal can travel between processes whole. Knows no robot, no wire format and no
library: values arrive as plain numbers, with the unit of the joint they belong to (`rad` for a
revolute joint, `m` for a prismatic one).

Numbers that a user gets beside the sentence have the same three names in every class: `index` is
the joint's place, `value` the number at fault and `limit` what it breaks. They are fields, or
properties beside a field with a name of its own. `MotionError.numbers` returns all three.

The classes stand in the order of what can be at fault: the question, the robot and its file, a
limit of a joint, the motion, the geometry of a path, the frames, the scene, a platform.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, ClassVar, TypeVar, dataclass_transform

NO_INDEX = -1
"""Index of no joint."""

_Error = TypeVar("_Error", bound="MotionError")


@dataclass_transform(eq_default=False)
class MotionError(Exception):
    """A motion question that is refused; `code` is its stable name in the error catalogue.

    Each class that derives from it is a dataclass of its numbers.
    """

    code: ClassVar[str] = "motion-error"

    def __init_subclass__(cls, code: str) -> None:
        cls.code = code
        dataclass(eq=False)(cls)

    @property
    def numbers(self) -> tuple[int, float, float]:
        """Joint index, value and limit, -1 and 0.0 where the kind has none."""
        # This class has no defaults: a derived dataclass would take them for its own fields.
        index = getattr(self, "index", NO_INDEX)
        return index, float(getattr(self, "value", 0.0)), float(getattr(self, "limit", 0.0))

    def __reduce__(self) -> tuple[Any, ...]:
        # Refusals travel from the planning process to the server; the default protocol would call
        # the constructor with `args`, which misses what was passed by keyword.
        return _restore, (type(self), dict(self.__dict__))


def _restore(kind: type[_Error], attributes: dict[str, Any]) -> _Error:
    error = kind.__new__(kind)
    error.__dict__.update(attributes)
    return error


_LONGEST = 80


def shortened(value: object, longest: int = _LONGEST) -> str:
    """Return a value as Python writes it, cut after so many characters; else its kind."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # an integer of thousands of digits, or very deep nesting
        return f"{type(value).__name__} too large to be shown"
    return text if len(text) <= longest else text[: longest - 3] + "..."


def for_a_screen(value: float, unit: str) -> str:
    """Return a number with its unit: metres as millimetres, radians as degrees."""
    match unit:
        case "m":
            return f"{1e3 * value:.3g} mm"
        case "rad":
            return f"{math.degrees(value):.3g}°"
    return f"{value:.3g} {unit}".rstrip()


def on_the_path(fraction: float | None) -> str:
    """Return how far along a path something lies, 0 to 1, to end a clause; nothing for None."""
    return "" if fraction is None else f" at {fraction:.1%} of the path"


def in_file(file: str, place: str, problem: str) -> str:
    """Return a problem behind the file and the place in it, which is empty for the whole file."""
    return f"{file}: {place}: {problem}" if place else f"{file}: {problem}"


class BadArgument(MotionError, code="bad-argument"):
    """An argument is outside what the function accepts, whatever the robot."""

    name: str
    given: object
    accepted: str

    def __str__(self) -> str:
        return f"{self.name} is {shortened(self.given)}; accepted: {self.accepted}"


class NotFinite(MotionError, code="not-finite"):
    """A number is infinite or not a number; `index` is its place in `what`."""

    what: str
    index: int

    def __str__(self) -> str:
        return f"element {self.index} of {self.what} is not a finite number"


class WrongJointCount(MotionError, code="wrong-joint-count"):
    """A joint vector does not have one value per driven joint."""

    got: int
    expected: int

    @property
    def value(self) -> int:
        """How many values were given."""
        return self.got

    @property
    def limit(self) -> int:
        """How many there should be."""
        return self.expected

    def __str__(self) -> str:
        return f"{self.got} joint values were given, the robot has {self.expected} driven joints"


class PlannerUnavailable(MotionError, code="planner-unavailable"):
    """No planner of that name can be used here; `known` are those that can."""

    name: str
    known: tuple[str, ...]

    def __str__(self) -> str:
        return f"no planner {self.name!r} is available; available: {', '.join(self.known)}"


class LibraryMissing(MotionError, code="library-missing"):
    """What was asked for needs an optional library; `extra` of the package installs it."""

    library: str
    extra: str

    def __str__(self) -> str:
        return f"{self.library} is not installed; the extra {self.extra!r} of openpendant adds it"


_FOR_A_PLATFORM = (
    "For a parallel one there are `openpendant robots show`, `draw`, `check`, `fk` and `ik`, and"
    " jogs and paths from Python (docs/motion.md)"
)


class RobotFileError(MotionError, code="robot-file"):
    """A robot file cannot be used; `more` holds the further (field, problem) pairs found."""

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


class UnknownRobot(MotionError, code="unknown-robot"):
    """The name belongs to no robot of the project and is no file either."""

    name: str
    known: tuple[str, ...]

    def __str__(self) -> str:
        near = nearest(self.name, self.known)
        meant = f"did you mean {near}? " if near else ""
        known = ", ".join(self.known)
        return f"no robot or robot file is called {shortened(self.name)}; {meant}known: {known}"


_LONGEST_NAME = 64


def nearest(name: str, known: Sequence[str]) -> str:
    """Return the known name that is most alike a wrong one; empty where none is alike."""
    if not 1 < len(name) <= _LONGEST_NAME:
        return ""
    import difflib  # here, because most commands name no wrong robot

    written = {each.lower(): each for each in known}
    found = difflib.get_close_matches(name.lower(), written, n=1)
    # Who types the maker or the model alone means a name that contains it.
    found += [each for each in written if name.lower() in each]
    return written[found[0]] if found else ""


class UnsupportedKind(MotionError, code="unsupported-kind"):
    """The robot is of a kind for which `what`, as it stands behind "no", does not exist."""

    name: str
    kind: str
    what: str

    def __str__(self) -> str:
        refused = f"{self.name} is a {self.kind} robot, and there is no {self.what} for one"
        instead = f". {_FOR_A_PLATFORM}" if self.kind == "parallel" else ""
        return f"{refused}; accepted: a serial robot, see `openpendant robots list`{instead}"


class OutOfRange(MotionError, code="out-of-range"):
    """A joint position lies outside its range; `index` is the joint's place, -1 if not known.

    `fraction` is how far along a path it would be there, 0 to 1.
    """

    joint: str
    value: float
    lower: float
    upper: float
    unit: str = "rad"
    index: int = NO_INDEX
    fraction: float | None = None

    @property
    def limit(self) -> float:
        """The end of the range that the value lies beyond."""
        return self.lower if self.value < self.lower else self.upper

    def __str__(self) -> str:
        where = on_the_path(self.fraction)
        return (
            f"{self.joint} at {self.value!r} {self.unit} is outside its range"
            f" {self.lower!r} to {self.upper!r} {self.unit}{where}"
        )


class TooFast(MotionError, code="too-fast"):
    """A joint velocity exceeds its limit; `unit` is that of the position."""

    joint: str
    value: float
    limit: float
    unit: str = "rad"
    index: int = NO_INDEX

    def __str__(self) -> str:
        return (
            f"{self.joint} at {self.value!r} {self.unit}/s is faster than its limit"
            f" {self.limit!r} {self.unit}/s"
        )


class TooSharp(MotionError, code="too-sharp"):
    """A joint acceleration exceeds its limit; `unit` is that of the position."""

    joint: str
    value: float
    limit: float
    unit: str = "rad"
    index: int = NO_INDEX

    def __str__(self) -> str:
        return (
            f"{self.joint} accelerating at {self.value!r} {self.unit}/s² exceeds its limit"
            f" {self.limit!r} {self.unit}/s²"
        )


class CertificateRefused(MotionError, code="certificate-refused"):
    """The independent check found a sample that may not leave.

    `check` names the rule, such as `velocity`; `joint`, `value` and `limit` are the offender's;
    `unit` is that of `value`; `time` [s] is the sample's, from the start of the trajectory.
    """

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


class PoseUnreachable(MotionError, code="unreachable"):
    """No joint position inside the limits reaches the pose.

    `position` [m] is the pose's, in `frame`; `best_position_error` [m] and `best_rotation_error`
    [rad] are those of the nearest position inside the limits that was found; `fraction` is how far
    along a path the pose lies, 0 to 1.
    """

    position: tuple[float, float, float]
    frame: str
    best_position_error: float
    best_rotation_error: float
    restarts: int
    fraction: float | None = None

    @property
    def value(self) -> float:
        """The worse of both residuals: a pose may be out of reach by its turn alone."""
        return max(self.best_position_error, self.best_rotation_error)

    def __str__(self) -> str:
        x, y, z = self.position
        where = on_the_path(self.fraction)
        tried = f" of {self.restarts} restarts" if self.restarts else ""
        return (
            f"not reachable: the nearest position{tried} stays {self.best_position_error:.3g} m and"
            f" {self.best_rotation_error:.3g} rad away from the pose at x {x:.3g} m, y {y:.3g} m,"
            f" z {z:.3g} m in {self.frame}{where}"
        )


class BranchChange(MotionError, code="branch-change"):
    """A tool path needs a joint to jump to another branch; `step` is the jump's size.

    `singularity` names the one it is at, empty if none is near.
    """

    fraction: float
    joint: str
    step: float
    unit: str = "rad"
    singularity: str = ""

    @property
    def value(self) -> float:
        """The size of the jump."""
        return self.step

    def __str__(self) -> str:
        where = f", at a {self.singularity} singularity" if self.singularity else ""
        return (
            f"{self.joint} would have to jump by {self.step:.6g} {self.unit}"
            f" at {self.fraction:.1%} of the path{where}; accepted: a path that passes that place"
            " by, or a joint motion past it"
        )


class NotTimeable(MotionError, code="not-timeable"):
    """The timing solver found no motion along the path; `return_code` is its own word for why.

    Attributes:
        lasts_too_long: there is one, which would last longer than an hour.
    """

    path_length: float
    return_code: str
    lasts_too_long: bool = False

    @property
    def value(self) -> float:
        """The length of the path."""
        return self.path_length

    def __str__(self) -> str:
        return (
            f"the path of length {self.path_length:.6g} cannot be timed within the limits"
            f" (solver: {self.return_code})"
        )


class NoMotion(MotionError, code="no-motion"):
    """The path has no length: the robot already stands at its end."""

    def __str__(self) -> str:
        return "the robot is already there: the motion has no length"


class NoPathFound(MotionError, code="no-path-found"):
    """A planner ended without a path free of contact.

    `seconds` is the time it took, None where no clock was given; `iterations` is what it counts.
    """

    planner: str
    seconds: float | None
    iterations: int

    def __str__(self) -> str:
        took = "" if self.seconds is None else f" and {self.seconds:.3g} s"
        return f"{self.planner} found no path free of contact in {self.iterations} iterations{took}"


class CircleFault(Enum):
    """The reason why points determine no circle."""

    COINCIDENT = "coincident"
    COLLINEAR = "collinear"
    NOT_EQUIDISTANT = "not-equidistant"
    TOO_SMALL = "too-small"
    TOO_LARGE = "too-large"
    NO_NORMAL = "no-normal"


_CIRCLE_FAULTS = {
    CircleFault.COINCIDENT: (
        "two points of the circle are {measured} apart; accepted: at least {bound}"
    ),
    CircleFault.COLLINEAR: (
        "the points of the circle lie on one line: one is {measured} off the line through the"
        " others; accepted: at least {bound}"
    ),
    CircleFault.NOT_EQUIDISTANT: (
        "the centre is {bound} from the start and {measured} from the end; accepted: equal radii"
    ),
    CircleFault.TOO_SMALL: "the radius is {measured}; accepted: at least {bound}",
    CircleFault.TOO_LARGE: "the radius is {measured}; accepted: at most {bound}",
    CircleFault.NO_NORMAL: (
        "start, centre and end lie within {measured} of one line, so the plane of the circle is not"
        " known; accepted: at least {bound}, or a normal of the plane"
    ),
}


class BadCircle(MotionError, code="bad-circle"):
    """Points do not determine a circle that can be run along.

    `fault` names the rule; `measured` and `bound` are its numbers, [m] each. For a centre that is
    not equally far from both ends they are the radius at the end and that at the start.
    """

    fault: CircleFault
    measured: float
    bound: float

    def __str__(self) -> str:
        measured, bound = for_a_screen(self.measured, "m"), for_a_screen(self.bound, "m")
        return _CIRCLE_FAULTS[self.fault].format(measured=measured, bound=bound)


class ZoneTooLarge(MotionError, code="zone-too-large"):
    """A corner cannot be rounded as widely as asked.

    `waypoint` is the corner's place among those asked for, from 0; `largest` is the largest zone
    that works there with the other zones as they are, `unit` that of both; `reason` is what
    bounds it.
    """

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


class SegmentRefused(MotionError, code="segment-refused"):
    """One segment of several is refused; `reason` says why, a fraction in it is the segment's.

    `segment` is its place in the list, from 0.
    """

    segment: int
    reason: MotionError

    def __str__(self) -> str:
        return f"segment {self.segment}: {self.reason}"


class FrameUnknown(MotionError, code="unknown-frame"):
    """A pose is asked for in, or of, a frame the robot does not have."""

    name: str
    known: tuple[str, ...]

    def __str__(self) -> str:
        return f"no frame is called {self.name!r}; known: {', '.join(self.known)}"


class FrameExists(MotionError, code="frame-exists"):
    """A frame or tool is to be named as another already is."""

    name: str

    def __str__(self) -> str:
        return f"a frame is called {self.name!r} already; accepted: a name not in use"


class FrameCycle(MotionError, code="frame-cycle"):
    """A frame is to hang from itself, or from one that hangs from it."""

    name: str
    parent: str

    def __str__(self) -> str:
        return (
            f"{self.name!r} cannot hang from {self.parent!r}, which hangs from {self.name!r};"
            " accepted: a parent outside the branch"
        )


class FramePredefined(MotionError, code="frame-predefined"):
    """A frame that belongs to the robot is to be changed; `action` is the change asked for."""

    name: str
    action: str

    def __str__(self) -> str:
        return f"{self.name!r} belongs to the robot and cannot be {self.action}"


class FrameInUse(MotionError, code="frame-in-use"):
    """A frame is to be removed while others hang from it, or a tool while it is selected."""

    name: str
    users: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.name!r} cannot be removed: {', '.join(self.users)} would lose its place"


class NotInHistory(MotionError, code="not-in-history"):
    """A frame's pose is asked for at a time [ns] that its history does not cover.

    `oldest` and `newest` [ns] are the bounds of the history, None where nothing is recorded.
    """

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


class PoorGeometry(MotionError, code="poor-geometry"):
    """Taught points or poses do not determine what they are to define.

    `measured` and `bound` are in `unit`; `least` says whether the bound is a lower one.
    """

    what: str
    measured: float
    bound: float
    unit: str
    least: bool = True

    def __str__(self) -> str:
        side = "at least" if self.least else "at most"
        measured, bound = (for_a_screen(size, self.unit) for size in (self.measured, self.bound))
        return f"{self.what} is {measured}; accepted: {side} {bound}"


class FrameFileError(MotionError, code="frame-file"):
    """A file of frames and tools cannot be used; `field` is empty for the whole file."""

    file: str
    field: str
    problem: str

    def __str__(self) -> str:
        return in_file(self.file, self.field, self.problem)


class UnknownObject(MotionError, code="unknown-object"):
    """A scene holds no object of that name, or a named pair means neither an object nor a link."""

    name: str
    known: tuple[str, ...]

    def __str__(self) -> str:
        known = ", ".join(self.known) or "none"
        return f"no object or link is called {self.name!r}; known: {known}"


class NothingGripped(MotionError, code="nothing-gripped"):
    """An object is farther from the grasp point of a tool than the tool reaches.

    Attributes:
        name: of the object.
        tool: the tool, `flange` for the bare flange, or the link.
        value: distance from the grasp point to the nearest point of the object [m].
        limit: the reach [m].
    """

    name: str
    tool: str
    value: float
    limit: float

    def __str__(self) -> str:
        distance, reach = 1e3 * self.value, 1e3 * self.limit
        # To the nanometre where a tenth of a millimetre would look as if it were within reach.
        shown = f"{distance:.1f}" if round(distance, 1) > reach else f"{distance:.6f}"
        return f"{self.tool} is {shown} mm from {self.name}; reach {reach:g} mm"


class ObjectHeld(MotionError, code="object-held"):
    """A link was to take an object that one holds already."""

    name: str
    link: str

    def __str__(self) -> str:
        return f"{self.link} holds {self.name!r} already; accepted: an object that stands"


class ObjectNotHeld(MotionError, code="object-not-held"):
    """An object was to be let go that no link holds."""

    name: str

    def __str__(self) -> str:
        return f"nothing holds {self.name!r}, it stands; accepted: an object that a link holds"


class DuplicateObject(MotionError, code="duplicate-object"):
    """A scene already holds an object of that name, or a link of the robot bears it."""

    name: str

    def __str__(self) -> str:
        return f"the name {self.name!r} is taken; accepted: a name of no other object and no link"


class SceneTooLarge(MotionError, code="scene-too-large"):
    """More pairs of bodies with an object would have to be checked than are accepted."""

    pairs: int
    limit: int
    objects: int

    @property
    def value(self) -> int:
        """The pairs there would be."""
        return self.pairs

    def __str__(self) -> str:
        return (
            f"the scene of {self.objects} objects makes {self.pairs} pairs of bodies to check;"
            f" accepted: {self.limit} at most. Remove objects, put one around several, have"
            " fewer held, or allow pairs that need no check to touch"
        )


class SceneFileError(MotionError, code="scene-file"):
    """A scene file cannot be used; `more` holds the further (field, problem) pairs found."""

    file: str
    field: str
    problem: str
    more: tuple[tuple[str, str], ...] = ()

    def __str__(self) -> str:
        rest = f" (and {len(self.more)} more)" if self.more else ""
        return in_file(self.file, self.field, self.problem) + rest


class MeshFileError(MotionError, code="mesh-file"):
    """A mesh file cannot be used; `place` is the line or the byte, empty for the whole file."""

    file: str
    place: str
    problem: str

    def __str__(self) -> str:
        return in_file(self.file, self.place, self.problem)


class StartInCollision(MotionError, code="start-in-collision"):
    """Two bodies touch where a motion is to start; `distance` [m] is negative by their overlap."""

    first: str
    second: str
    distance: float

    def __str__(self) -> str:
        return (
            f"{self.first} and {self.second} touch at the start"
            f" (distance {for_a_screen(self.distance, 'm')});"
            " accepted: a start where nothing touches"
        )


class GoalInCollision(MotionError, code="goal-in-collision"):
    """Two bodies touch where a motion is to end; `distance` [m] is negative by their overlap."""

    first: str
    second: str
    distance: float

    def __str__(self) -> str:
        return (
            f"{self.first} and {self.second} touch at the goal"
            f" (distance {for_a_screen(self.distance, 'm')});"
            " accepted: a goal where nothing touches"
        )


class PathInCollision(MotionError, code="path-in-collision"):
    """Two bodies touch on the way; `fraction` is how far along the path, 0 to 1."""

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


class PlatformLimit(MotionError, code="platform-limit"):
    """A pose breaks a limit of a parallel robot, short of any leg vector being asked for.

    `rule` names the limit (`stroke`, `base cone`, `platform cone`, `workspace sum`); `joint` and
    `index` the leg, empty and -1 for a rule of the whole platform; `fraction` is how far along a
    path the pose lies, 0 to 1.
    """

    rule: str
    joint: str
    value: float
    limit: float
    unit: str
    index: int = NO_INDEX
    fraction: float | None = None

    def __str__(self) -> str:
        who = f"{self.joint}: " if self.joint else ""
        where = on_the_path(self.fraction)
        unit = f" {self.unit}" if self.unit else ""
        return (
            f"{who}the {self.rule} limit is {self.limit:.6g}{unit},"
            f" the pose needs {self.value:.6g}{unit}{where}"
        )


class NoAssembly(MotionError, code="no-assembly"):
    """No platform pose connected with home has these leg lengths [m].

    `residual` [m] is the greatest leg error of the best pose found, `reason` what it fails by.
    """

    lengths: tuple[float, ...]
    residual: float
    reason: str

    def __str__(self) -> str:
        legs = ", ".join(f"{length:.6g}" for length in self.lengths)
        return f"legs of {legs} m hold no platform pose: {self.reason}"
