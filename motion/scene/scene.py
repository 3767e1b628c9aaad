"""Scene around a robot as plain data: objects, the links that hold them, and pairs that may touch.

Owns the shapes and the sizes accepted, the rules of adding, moving, attaching and allowing, and the
revision number. A scene is a value: every change returns a new one. `left` is the
change that a program's `detach` makes, in a run and in the dry run alike; `grasping` has that of
`attach`. Knows no file, no robot and no collision library. Lengths in m; poses are position [m] and
quaternion x, y, z, w; shapes stand in their own frame.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeAlias

from ..errors import (
    BadArgument,
    DuplicateObject,
    FrameUnknown,
    NotFinite,
    ObjectHeld,
    ObjectNotHeld,
    UnknownObject,
)
from ..pickled_pieces import PickledPieces, unpickled
from ..pose import Pose
from ..steps import Stepwise
from ..text_pieces import joined, made_once

MAX_OBJECTS = 1000
"""Greatest number of objects of a scene."""

MAX_ALLOWED = 2000
"""Greatest number of pairs of a scene that may touch."""

LEAST_SIZE = 1e-6
"""Smallest edge, radius or scale of a shape [m]."""
GREATEST_SIZE = 1e3
"""Largest edge, radius, length or coordinate [m]."""

Vector: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Box:
    """Cuboid about its centre; `size` holds the full edge lengths [m]."""

    size: Vector

    def __post_init__(self) -> None:
        if len(self.size) != 3:
            raise BadArgument("size of a box", self.size, "three lengths")
        for value in self.size:
            _check_size("size of a box", value)


@dataclass(frozen=True, slots=True)
class Sphere:
    """Ball about its centre; `radius` [m]."""

    radius: float

    def __post_init__(self) -> None:
        _check_size("radius of a sphere", self.radius)


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Cylinder along local z about its centre; `radius` and full `length` [m]."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        _check_size("radius of a cylinder", self.radius)
        _check_size("length of a cylinder", self.length)


@dataclass(frozen=True, slots=True)
class Capsule:
    """Cylinder along local z with round caps; `length` is the straight part [m]."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        _check_size("radius of a capsule", self.radius)
        _check_size("length of a capsule", self.length)


@dataclass(frozen=True, slots=True)
class Mesh:
    """Surface of triangles in an STL or OBJ file; it has no inside.

    Attributes:
        scale: factor to metres along each axis; 0.001 for a file in millimetres.
    """

    file: str
    scale: Vector = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        if not self.file:
            raise BadArgument("file of a mesh", self.file, "the path of an STL or OBJ file")
        if len(self.scale) != 3:
            raise BadArgument("scale of a mesh", self.scale, "three factors")
        for value in self.scale:
            _check_size("scale of a mesh", value)


Shape: TypeAlias = Box | Sphere | Cylinder | Capsule | Mesh


def _check_size(what: str, value: float) -> None:
    if not math.isfinite(value):
        raise NotFinite(what, 0)
    if not LEAST_SIZE <= value <= GREATEST_SIZE:
        raise BadArgument(what, value, f"{LEAST_SIZE:g} to {GREATEST_SIZE:g}")


SCENE_FRAMES = ("base", "root")

NORM_TOLERANCE = 1e-3
"""Greatest deviation of a quaternion's norm from 1: that of rounding to three decimals."""

MAX_NAME = 64

Quaternion: TypeAlias = tuple[float, float, float, float]
Pair: TypeAlias = tuple[str, str]


@dataclass(frozen=True, slots=True)
class SceneObject:
    """Named body of a scene.

    Attributes:
        position: of its frame [m].
        quaternion: of its frame, x, y, z, w; normalised on the way in.
        frame: `base` or `root`, the frame of the pose unless a link holds the object.
        link: the link that holds it, the pose then being in that link's frame; None if it stands.

    Raises:
        BadArgument: a name, coordinate, size, or a quaternion whose norm is not 1.
        NotFinite: a number is infinite or not a number.
        FrameUnknown: the frame is neither `base` nor `root`.
    """

    name: str
    shape: Shape
    position: Vector = (0.0, 0.0, 0.0)
    quaternion: Quaternion = (0.0, 0.0, 0.0, 1.0)
    frame: str = "base"
    link: str | None = None

    def __post_init__(self) -> None:
        if not (1 <= len(self.name) <= MAX_NAME and self.name.isprintable()):
            raise BadArgument("name", self.name, f"1 to {MAX_NAME} printable characters")
        if self.frame not in SCENE_FRAMES:
            raise FrameUnknown(self.frame, SCENE_FRAMES)
        position = _finite(self.position, 3, f"position of {self.name}")
        if max(map(abs, position)) > GREATEST_SIZE:
            accepted = f"coordinates within {GREATEST_SIZE:g} m"
            raise BadArgument(f"position of {self.name}", position, accepted)
        quaternion = _finite(self.quaternion, 4, f"quaternion of {self.name}")
        norm = math.hypot(*quaternion)
        if not abs(norm - 1.0) <= NORM_TOLERANCE:
            accepted = f"a norm of 1 within {NORM_TOLERANCE:g}; this one is {norm:.6g}"
            raise BadArgument(f"quaternion of {self.name}", quaternion, accepted)
        if abs(norm - 1.0) > 1e-15:
            quaternion = tuple(value / norm for value in quaternion)
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "quaternion", quaternion)

    @property
    def pose(self) -> Pose:
        """Pose of its frame, in `frame` or in the frame of `link`."""
        return Pose.from_values(self.position, self.quaternion)

    def at(self, pose: Pose, frame: str, link: str | None = None) -> SceneObject:
        """Return the same body elsewhere."""
        x, y, z = pose.position.tolist()
        a, b, c, d = pose.quaternion.tolist()
        return replace(self, position=(x, y, z), quaternion=(a, b, c, d), frame=frame, link=link)


@dataclass(frozen=True, slots=True)
class Scene:
    """Objects, and pairs of bodies that may touch.

    Attributes:
        objects: in the order they were added.
        allowed: pairs of names, each sorted, that are not checked against one another: two
            objects, or an object and a link of the robot.
        revision: number of changes made.

    Raises:
        DuplicateObject: two objects bear one name.
        UnknownObject: an allowed pair, or what a method is to change, is no object of the scene.
        BadArgument: an allowed pair names the same twice; or there are too many objects or pairs.
    """

    objects: tuple[SceneObject, ...] = ()
    allowed: frozenset[Pair] = frozenset()
    revision: int = 0
    _pickles: PickledPieces[SceneObject] | None = field(
        default=None, init=False, repr=False, compare=False
    )
    _texts: tuple[str, ...] | None = field(default=None, init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        _check_count("objects", len(self.objects), MAX_OBJECTS)
        _check_count("allowed pairs", len(self.allowed), MAX_ALLOWED)
        names = {each.name for each in self.objects}
        if len(names) < len(self.objects):
            raise DuplicateObject(_first_twice(self.objects))
        # One that comes from another scene is in order, and is the same frozen set.
        if not all(len(pair) == 2 and pair[0] < pair[1] for pair in self.allowed):
            object.__setattr__(self, "allowed", frozenset(_pair(*pair) for pair in self.allowed))
        unknown = [pair for pair in self.allowed if not (pair[0] in names or pair[1] in names)]
        if unknown:
            raise UnknownObject(min(unknown)[0], tuple(sorted(names)))

    def __reduce__(self) -> tuple[Callable[..., Scene], tuple[object, ...]]:
        if self._pickles is None:
            for _ in self.pickle_steps(None):
                pass
        assert self._pickles is not None
        return _restored, (self._pickles.pickles, self.allowed, self.revision)

    def pickle_steps(self, before: Scene | None) -> Stepwise[None]:
        """Pickle the objects in steps, and keep that.

        Args:
            before: a scene of which what is the same is kept.
        """
        known = None if before is None else before._pickles
        pickles = yield from PickledPieces.steps(self.objects, known)
        object.__setattr__(self, "_pickles", pickles)

    def __repr__(self) -> str:
        return "".join(self.text_pieces())

    def text_pieces(self) -> Iterator[str]:
        """Return the text of `repr` in pieces of a millisecond or less each, made once."""
        return made_once(self, self._make_texts())

    def _make_texts(self) -> Iterator[str]:
        yield "Scene(objects=("
        yield from joined(self.objects, repr)
        yield f"{',' if len(self.objects) == 1 else ''}), allowed=frozenset("
        if self.allowed:
            # A set of texts has another order in each process, and a journal is run again in
            # another.
            yield "{"
            yield from joined(sorted(self.allowed), repr)
            yield "}"
        yield f"), revision={self.revision!r})"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the objects."""
        return tuple([each.name for each in self.objects])

    def get(self, name: str) -> SceneObject:
        """Return an object, or raise `UnknownObject`."""
        for each in self.objects:
            if each.name == name:
                return each
        raise UnknownObject(name, self.names)

    def add(self, added: SceneObject) -> Scene:
        """Return the scene with one more object; `DuplicateObject` if the name is taken."""
        return self._changed(objects=(*self.objects, added))

    def move(self, name: str, pose: Pose, frame: str = "base") -> Scene:
        """Return the scene with an object standing elsewhere; a link that held it lets go.

        Raises:
            FrameUnknown: the frame is neither `base` nor `root`.
        """
        return self._replaced(self.get(name).at(pose, frame))

    def remove(self, name: str) -> Scene:
        """Return the scene without an object, and without the allowed pairs that name it."""
        gone = self.get(name)
        return self._changed(
            objects=tuple(each for each in self.objects if each is not gone),
            allowed=frozenset(pair for pair in self.allowed if name not in pair),
        )

    def attach(self, name: str, link: str, link_pose: Pose, touching: Iterable[str] = ()) -> Scene:
        """Return the scene with an object held by a link, where it is now.

        Args:
            link: the link of the robot that takes it, such as the tool link.
            link_pose: pose of that link, in the frame of the object's pose.
            touching: links and objects it may touch from now on, such as the hand that holds it.

        Raises:
            ObjectHeld: a link holds the object already.
        """
        taken = self.get(name)
        if taken.link is not None:
            raise ObjectHeld(name, taken.link)
        held = taken.at(link_pose.inverse().compose(taken.pose), "base", link)
        pairs = frozenset(_pair(name, other) for other in touching)
        attached = self._replaced(held)
        return replace(attached, allowed=attached.allowed | pairs)

    def detach(self, name: str, link_pose: Pose, frame: str = "base") -> Scene:
        """Return the scene with a held object standing where it is now.

        The allowed pairs stay until they are forbidden, because a hand that lets go still touches.

        Args:
            link_pose: pose of the link that holds it, in `frame`.
            frame: `base` or `root`, the frame of the object's pose from now on.

        Raises:
            ObjectNotHeld: no link holds the object.
        """
        held = self.get(name)
        if held.link is None:
            raise ObjectNotHeld(name)
        return self._replaced(held.at(link_pose.compose(held.pose), frame))

    def allow(self, first: str, second: str) -> Scene:
        """Return the scene in which two bodies may touch: two objects, or an object and a link.

        Raises:
            UnknownObject: neither is an object of the scene.
            BadArgument: both are the same.
        """
        return self._changed(allowed=self.allowed | {_pair(first, second)})

    def forbid(self, first: str, second: str) -> Scene:
        """Return the scene in which two bodies may no longer touch, or raise `BadArgument`."""
        pair = _pair(first, second)
        if pair not in self.allowed:
            raise BadArgument("pair", pair, "a pair that is allowed to touch")
        return self._changed(allowed=self.allowed - {pair})

    def _replaced(self, new: SceneObject) -> Scene:
        return self._changed(
            objects=tuple([new if each.name == new.name else each for each in self.objects])
        )

    def _changed(
        self, objects: tuple[SceneObject, ...] | None = None, allowed: frozenset[Pair] | None = None
    ) -> Scene:
        return Scene(
            self.objects if objects is None else objects,
            self.allowed if allowed is None else allowed,
            self.revision + 1,
        )


def _restored(pickles: Sequence[bytes], allowed: frozenset[Pair], revision: int) -> Scene:
    return Scene(unpickled(pickles), allowed, revision)


def _check_count(what: str, count: int, most: int) -> None:
    if count > most:
        raise BadArgument(f"number of {what} of a scene", count, f"at most {most:,}")


def _first_twice(objects: Iterable[SceneObject]) -> str:
    counts = Counter(each.name for each in objects)
    return next(name for name, count in counts.items() if count > 1)


def _pair(first: str, second: str) -> Pair:
    if first == second:
        raise BadArgument("pair", (first, second), "two different names")
    return (first, second) if first < second else (second, first)


def _finite(values: Sequence[float], count: int, what: str) -> tuple[float, ...]:
    if len(values) != count:
        raise BadArgument(what, values, f"{count} numbers")
    for index, value in enumerate(values):
        if not math.isfinite(value):
            raise NotFinite(what, index)
    return tuple(float(value) for value in values)


def left(scene: Scene, name: str, flange: str, link_pose: Callable[[str], Pose]) -> Scene:
    """Return the scene after an object is left where it is.

    Args:
        flange: the link that tools are bolted to, for an object that no link carries.
        link_pose: returns the pose of a link in the base frame.

    Raises:
        MotionError: there is no such object, or nobody carries it.
    """
    return scene.detach(name, link_pose(scene.get(name).link or flange))
