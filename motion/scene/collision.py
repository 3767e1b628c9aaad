"""Collision model: contacts and distances of a robot, the scene around it and attached objects.

Owns the shapes as coal geometries, their placing on the pinocchio model, the pairs to check, and
the bound of how far each pair can approach per unit of joint travel. The only module that imports
coal; besides it only `kinematics/serial` and `kinematics/pinocchio_model` import pinocchio. Joint
vectors are controller-side driven joints in file order; distances and points are in m, in the base
frame.

The model checks all pairs of bodies except these: links of one joint or of consecutive ones, the
first and last link of the wrist of an arm of six axes or more, pairs that the robot file or the
scene allows, and fixed objects with fixed links, which no motion changes. An attached object is
checked against everything, also against the link that holds it.

A model is made of parts, each a geometry model of its own with at most so many bodies and pairs:
pinocchio's takes time and memory by the square of its bodies. So a model can be built in steps, on
an event loop that does other work in between (`CollisionModel.in_steps`), and takes over from the
model before it each part that a change of the scene leaves as it was. Which pairs make a part
depends on the scene alone, not on the models before; a scene of few bodies is one part. The effort
of a step is counted, not timed, so that a journal that is run again has the same steps.

The wrist is left out because its maker limits the middle joint so that its links do not meet, while
our shapes of them are coarse: on a UR5 they would meet in a quarter of all positions.
"""

from __future__ import annotations

import math
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..description.schema import BoxFacts as LinkBox
from ..description.schema import CapsuleFacts as LinkCapsule
from ..description.schema import HullFacts as LinkHull
from ..description.schema import Shape as LinkShape
from ..errors import DuplicateObject, FrameUnknown, SceneTooLarge, UnknownObject
from ..kinematics.pinocchio_model import greatest_travel, model_map
from ..kinematics.serial import Kinematics
from ..pose import Array
from .hull_file import read_hull
from .mesh_file import read_mesh
from .scene import Box, Capsule, Cylinder, Mesh, Scene, SceneObject, Shape, Sphere

MOST_BODIES = 40
"""Greatest number of bodies of a part."""

MOST_CHECKS = 192
"""Greatest number of pairs of a part."""


class BuildStep(NamedTuple):
    """Step of building, announced before it is made.

    Attributes:
        effort: about how long it will take [µs], by the number of bodies and pairs.
        fits: True once it is known that the scene fits the robot and is not too large.
    """

    effort: float
    fits: bool = False


# About how long it takes on an ordinary machine [µs].
_PER_NAME = 0.2
_PER_BODY = 1.0
_PER_SORTED = 0.2  # pair
_ROWS = 100.0
_PER_CELL = 0.015  # of the table of bodies by bodies
_PER_CUT = 0.6  # pair
_PER_KEPT = 1.2  # pair of a part that is taken over
_PER_JOINED = 0.1  # pair
_PER_PLACED = 25.0  # body
_PER_CHECK = 2.5  # pair
_PER_DISTANCE = 2.5  # pair
_PART = 50.0

_BODIES_A_STEP = 256
_CELLS_A_STEP = 8192
_PAIRS_A_STEP = 512
_PLACED_A_STEP = 16


@dataclass(slots=True)
class _Body:
    """Shape on the model.

    Attributes:
        name: of the link or the object; a link may have several shapes.
        joint: moving joint of the model that carries it, counted from 1; 0 for none.
        is_link: True if it is a shape of the robot.
        is_held: True if a link holds it.
        source: the shape of the link, or the object.
        placed: it on the model, as a pinocchio geometry object; None until it is needed.
        reach: radius of a ball about the origin of its joint that holds it [m], likewise.
    """

    name: str
    joint: int
    is_link: bool
    is_held: bool
    source: LinkShape | SceneObject
    placed: Any = None
    reach: float = 0.0


class _PairRule:
    """Rule of which bodies are checked against which."""

    def __init__(
        self, bodies: Sequence[_Body], allowed: Iterable[Sequence[str]], wrist: Sequence[int]
    ) -> None:
        """Take note of the bodies.

        Args:
            allowed: pairs of names that are not checked against one another.
            wrist: first and last joint of the wrist, whose links are not; empty for none.
        """
        self._joint = np.array([body.joint for body in bodies], dtype=np.intp)
        self._is_link = np.array([body.is_link for body in bodies], dtype=bool)
        is_held = np.array([body.is_held for body in bodies], dtype=bool)
        self._stands = (self._joint == 0) & ~is_held
        numbers: dict[str, int] = {}
        names = [numbers.setdefault(body.name, len(numbers)) for body in bodies]
        self._name = np.array(names, dtype=np.intp)
        self._count = len(numbers)
        self._wrist = wrist
        self._allowed: dict[int, list[int]] = {}
        for first, second, *_ in allowed:
            # A link without a shape has no number.
            if first in numbers and second in numbers:
                one, other = numbers[first], numbers[second]
                self._allowed.setdefault(one, []).append(other)
                self._allowed.setdefault(other, []).append(one)
        self.moving: list[int] = np.flatnonzero(~self._stands).tolist()
        """The bodies that do not stand; of two that stand no motion changes anything."""

    def pairs_of(self, bodies: Sequence[int]) -> NDArray[np.intp]:
        """Return the (p, 2) checked pairs of some bodies that do not stand, each pair sorted.

        A pair of two that do not stand comes with the first of them.
        """
        rows = np.array(bodies, dtype=np.intp)
        joint, is_link, name = self._joint, self._is_link, self._name
        own_joint, own_link = joint[rows, np.newaxis], is_link[rows, np.newaxis]
        # Pairs that need no check, first among links, then among objects, then among all.
        unchecked = np.abs(own_joint - joint) <= 1
        if self._wrist:
            first, last = self._wrist
            unchecked |= (own_joint == first) & (joint == last)
            unchecked |= (own_joint == last) & (joint == first)
        unchecked &= own_link & is_link
        unchecked |= (own_joint == joint) & ~(own_link | is_link)
        unchecked |= name[rows, np.newaxis] == name
        if self._allowed:
            may_touch = np.zeros((len(rows), self._count), dtype=bool)
            for row, number in enumerate(name[rows].tolist()):
                may_touch[row, self._allowed.get(number, [])] = True
            unchecked |= may_touch[:, name]
        others = np.arange(len(joint))
        unchecked |= ~self._stands & (others <= rows[:, np.newaxis])
        found = np.argwhere(~unchecked)
        found[:, 0] = rows[found[:, 0]]
        return np.sort(found, axis=1)

    def with_object(self, pairs: NDArray[np.intp]) -> int:
        """Return how many of (p, 2) pairs have an object of the scene."""
        return int((~self._is_link[pairs].all(axis=1)).sum())


def _cut(
    pairs: NDArray[np.intp],
) -> Generator[BuildStep, None, list[list[tuple[int, int]]]]:
    """Cut (p, 2) pairs into parts in steps; return each in its order, one where there are none.

    In the order of the later body: one that is added to the end of a scene changes the last part.
    """
    yield BuildStep(_PER_SORTED * len(pairs), fits=True)
    parts: list[list[tuple[int, int]]] = [[]]
    seen: set[int] = set()
    ordered = pairs[np.lexsort((pairs[:, 0], pairs[:, 1]))].tolist()
    for index in range(0, len(ordered), _PAIRS_A_STEP):
        some = ordered[index : index + _PAIRS_A_STEP]
        yield BuildStep(_PER_CUT * len(some), fits=True)
        for first, second in some:
            seen |= {first, second}
            if len(parts[-1]) == MOST_CHECKS or len(seen) > MOST_BODIES:
                parts.append([])
                seen = {first, second}
            parts[-1].append((first, second))
    return [sorted(part) for part in parts]


def sweep_of(
    joint: NDArray[np.intp],
    reach: Array,
    lengths: Sequence[float],
    travel: Sequence[float],
    prismatic: Sequence[bool],
) -> Array:
    """Return how far the bodies of each pair can move relative to each other: (p, j).

    Per unit of travel of each moving joint [m/rad or m/m], over all positions. A revolute joint
    moves a point on the farther body by at most its distance to the axis. Links being rigid, that
    is at most the lengths of the links between and the body's own radius.

    Args:
        joint: (p, 2) number of the moving joint that carries each body of a pair, 0 for none.
        reach: (p, 2) radius of a ball about the origin of that joint that holds the body [m].
        lengths: (j,) distance of each moving joint from the one before it [m].
        travel: (j,) greatest distance of each moving joint from its zero [rad or m].
        prismatic: (j,) True if it slides.
    """
    near, far = joint.min(axis=1), joint.max(axis=1)
    lever = np.where(joint[:, 1] >= joint[:, 0], reach[:, 1], reach[:, 0])
    sweep = np.zeros((len(joint), len(lengths)))
    for index in range(len(lengths) - 1, -1, -1):
        between = (near <= index) & (index < far)
        sweep[between, index] = 1.0 if prismatic[index] else lever[between]
        lever[between] += lengths[index]
        if prismatic[index]:
            lever[between] += travel[index]
    return sweep


def link_geometry(shape: LinkShape) -> Any:
    """Return the geometry of a link's shape; where it is placed is no part of it.

    Raises:
        MeshFileError: it is a hull whose file cannot be used.
    """
    if isinstance(shape, LinkBox):
        return coal.Box(*shape.size)
    if isinstance(shape, LinkCapsule):
        return coal.Capsule(shape.radius, shape.length)
    if isinstance(shape, LinkHull):
        return _convex(shape)
    return coal.Sphere(shape.radius)


def _convex(shape: LinkHull) -> Any:
    """Return a hull from its points and faces: coal's own way of finding them may end the process.

    It believes that they are a hull, which `read_hull` has checked.
    """
    hull = read_hull(shape.file)
    points, faces = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for point in hull.vertices:
        points.append(point)
    for corners in hull.corners.tolist():
        faces.append(coal.Triangle(*corners))
    return coal.Convex(points, faces)


def object_geometry(shape: Shape) -> Any:
    """Return the geometry of an object's shape; `MeshFileError` if its mesh cannot be read."""
    match shape:
        case Box(size):
            return coal.Box(*size)
        case Sphere(radius):
            return coal.Sphere(radius)
        case Cylinder(radius, length):
            return coal.Cylinder(radius, length)
        case Capsule(radius, length):
            return coal.Capsule(radius, length)
        case Mesh(file, scale):
            return _surface(file, scale)


def _surface(file: str, scale: Sequence[float]) -> Any:
    """Return the triangles of a mesh file as a hierarchy of oriented boxes; it has no inside."""
    vertices, corners = read_mesh(file)
    surface = coal.BVHModelOBBRSS()
    surface.beginModel(len(corners), len(vertices))
    surface.addVertices(vertices * np.array(scale))
    surface.addTriangles(corners)
    surface.endModel()
    return surface


def distance_to_point(shape: Shape, point: Sequence[float] | Array) -> float:
    """Return how far a (3,) point in the frame of a shape is from its body [m]; 0 inside.

    To the rounding of a double for the bodies that are solid. A mesh has no inside, so that its
    distance is that to its surface: within 1e-6 m where its triangles are no thinner than 1 mm and
    no longer than 10 m.

    Raises:
        MeshFileError: the mesh cannot be read.
    """
    asked, found = coal.DistanceRequest(), coal.DistanceResult()
    place = coal.Transform3s(np.eye(3), np.asarray(point, dtype=np.float64))
    here = coal.Transform3s.Identity()
    distance = coal.distance(object_geometry(shape), here, coal.Sphere(0.0), place, asked, found)
    return max(float(distance), 0.0)


TOUCHING = 1e-6
"""Bodies nearer than this touch [m].

Not 0: coal's check without contact points (3.0.3) ends where the distance falls below the tolerance
of its GJK, 1e-6, and then calls bodies free that overlap by millimetres, unless what it is asked
for is no nearer than that tolerance.
"""


_LEAST_WITH_WRIST = 6  # joints


class Proximity(NamedTuple):
    """Distance of two bodies, and the point (3,) of each that is nearest to the other.

    Where they touch, `distance` [m] is negative by the overlap of solids; a mesh has no inside and
    may give 0.
    """

    distance: float
    first: str
    second: str
    first_point: Array
    second_point: Array

    @property
    def touching(self) -> bool:
        """True if the bodies touch."""
        return self.distance <= TOUCHING


class _Part:
    """Some of the pairs of a model, with a geometry model of their own.

    Models of one robot share it, so that what is in its data is valid until the next call only.

    Attributes:
        names: of its bodies, in their order.
        pairs: names of the two bodies of each pair.
        sweep: as `CollisionModel.sweep`.
        geometry: the pinocchio geometry model.
        exact: data of the distances.
    """

    def __init__(
        self, bodies: Sequence[_Body], inside: Sequence[tuple[int, int]], sweep: Array
    ) -> None:
        """Build the geometry.

        Args:
            bodies: all of them placed.
            inside: indices of the two bodies of each pair, in order.
        """
        self.names = tuple([body.name for body in bodies])
        self.pairs = tuple([(self.names[one], self.names[other]) for one, other in inside])
        self.sweep = sweep
        self._sources = [body.source for body in bodies]
        self._inside = list(inside)
        self.geometry = pin.GeometryModel()
        for number, body in enumerate(bodies):
            # A copy is added; pinocchio wants names that tell the shapes of a link apart.
            body.placed.name = f"{body.name}/{number}"
            self.geometry.addGeometryObject(body.placed)
        checked = np.zeros((len(bodies), len(bodies)), dtype=bool)
        if inside:
            rows, columns = np.array(inside, dtype=np.intp).T
            checked[rows, columns] = True
        self.geometry.setCollisionPairs(checked)
        self.exact = pin.GeometryData(self.geometry)
        self._padded: dict[float, Any] = {}

    def is_of(self, bodies: Sequence[_Body], inside: Sequence[tuple[int, int]]) -> bool:
        """Return True if it is the part of some pairs of bodies, which have the names of its."""
        same = self._inside == inside and len(self._sources) == len(bodies)
        return same and all(
            known is body.source or known == body.source
            for known, body in zip(self._sources, bodies, strict=True)
        )

    def proximity(self, number: int) -> Proximity:
        """Return the distance of a pair that was computed last."""
        result = self.exact.distanceResults[number]
        first, second = result.getNearestPoint1(), result.getNearestPoint2()
        return Proximity(
            float(result.min_distance), *self.pairs[number], np.array(first), np.array(second)
        )

    def with_margin(self, margin: float) -> Any:
        """Return the data for checks that call bodies nearer than this touching [m]."""
        if margin not in self._padded:
            data = pin.GeometryData(self.geometry)
            for request in data.collisionRequests:
                request.security_margin = margin
            self._padded[margin] = data
        return self._padded[margin]


class CollisionModel:
    """Robot and scene for collision checks, for one thread: calls share scratch memory.

    Attributes:
        pairs: (p,) names of the two bodies of each pair that is checked; a body of several shapes
            comes several times.
        sweep: (p, j) greatest distance that the two bodies of a pair can move relative to each
            other per unit of travel of each moving joint of the model [m/rad or m/m], an upper
            bound over all positions.

    Raises:
        WrongJointCount, NotFinite: in the methods that take a single position.
    """

    pairs: tuple[tuple[str, str], ...]
    sweep: Array
    _data: Any
    _gain: Array
    _offset: Array
    _plain: bool
    _lengths: list[float]
    _travel: list[float]
    _prismatic: list[bool]

    def __init__(
        self, kinematics: Kinematics, scene: Scene | None = None, *, most_pairs: float = math.inf
    ) -> None:
        """Build the model.

        Args:
            most_pairs: greatest number of pairs with an object of the scene.

        Raises:
            SceneTooLarge: more pairs would have to be checked.
            DuplicateObject: an object bears the name of a link.
            UnknownObject: an allowed pair or a held object names what is neither object nor link.
            MeshFileError: a mesh cannot be read.
        """
        self._begin(kinematics, Scene() if scene is None else scene, None)
        for _ in self._build(most_pairs, None):
            pass

    @classmethod
    def in_steps(
        cls,
        kinematics: Kinematics,
        scene: Scene,
        *,
        most_pairs: float = math.inf,
        before: CollisionModel | None = None,
    ) -> Generator[BuildStep, None, CollisionModel]:
        """Build the model in steps, each announced before it is made; return it at the end.

        Args:
            before: a model of the same robot in another scene, from which is taken over what is
                the same; it may be used meanwhile and afterwards, in the same thread.

        Raises:
            MotionError: as in `__init__`; after a step that `fits`, `MeshFileError` only.
        """
        model = cls.__new__(cls)
        model._begin(kinematics, scene, before)
        yield from model._build(most_pairs, before)
        return model

    def _begin(self, kinematics: Kinematics, scene: Scene, before: CollisionModel | None) -> None:
        self.kinematics = kinematics
        self.scene = scene
        self._model = kinematics.model
        robot = kinematics.robot
        if before is not None:
            # Of the robot alone; the data are scratch memory that each call fills anew.
            self._data = before._data
            self._gain, self._offset, self._plain = before._gain, before._offset, before._plain
            self._lengths, self._travel = before._lengths, before._travel
            self._prismatic = before._prismatic
            return
        self._data = self._model.createData()
        self._gain, self._offset = model_map(robot)
        self._plain = np.array_equal(self._gain, np.eye(kinematics.dof)) and not self._offset.any()
        placements = self._model.jointPlacements[1:]
        self._lengths = [float(np.linalg.norm(each.translation)) for each in placements]
        self._travel = greatest_travel(robot)
        self._prismatic = [each.prismatic for each in robot.moving]

    def _build(
        self, most_pairs: float, before: CollisionModel | None
    ) -> Generator[BuildStep, None, None]:
        robot, scene = self.kinematics.robot, self.scene
        yield BuildStep(_PER_NAME * (len(scene.objects) + 2 * len(scene.allowed)))
        _check_names(scene, robot.links)
        known = {} if before is None else before._objects
        self._links: list[_Body] = list(self._link_bodies()) if before is None else before._links
        self._objects: dict[str, _Body] = {}
        for index in range(0, len(scene.objects), _BODIES_A_STEP):
            objects = scene.objects[index : index + _BODIES_A_STEP]
            yield BuildStep(_PER_BODY * len(objects))
            for each in objects:
                body = known.get(each.name)
                if body is None or body.source is not each:  # which few are
                    body = self._object_body(each, known)
                self._objects[each.name] = body
        bodies = [*self._links, *self._objects.values()]
        allowed = (*robot.allowed_collisions, *scene.allowed)
        yield BuildStep(_PER_NAME * (len(bodies) + len(allowed)))
        rule = _PairRule(bodies, allowed, self._wrist)
        found = [np.empty((0, 2), dtype=np.intp)]
        count = 0
        rows = max(_CELLS_A_STEP // max(len(bodies), 1), 1)
        for index in range(0, len(rule.moving), rows):
            some = rule.moving[index : index + rows]
            yield BuildStep(_ROWS + _PER_CELL * len(some) * len(bodies))
            pairs = rule.pairs_of(some)
            count += rule.with_object(pairs)
            if count <= most_pairs:
                found.append(pairs)
        if count > most_pairs:
            raise SceneTooLarge(count, int(most_pairs), len(scene.objects))
        checked = np.concatenate(found)
        parts = yield from _cut(checked)
        kept = {} if before is None else {part.names: part for part in before._parts}
        self._parts: list[_Part] = []
        for part in parts:
            yield from self._add_part(part, bodies, kept)
        yield BuildStep(_PER_JOINED * len(checked), fits=True)
        self._join_parts()

    def _add_part(
        self,
        pairs: list[tuple[int, int]],
        bodies: Sequence[_Body],
        kept: Mapping[tuple[str, ...], _Part],
    ) -> Generator[BuildStep, None, None]:
        """Take over the part of some pairs, or build it."""
        used = sorted({*chain.from_iterable(pairs)})
        local = {number: index for index, number in enumerate(used)}
        inside = [(local[first], local[second]) for first, second in pairs]
        own = [bodies[number] for number in used]
        same = kept.get(tuple([body.name for body in own]))
        if same is not None and same.is_of(own, inside):
            yield BuildStep(_PER_KEPT * len(inside), fits=True)
            self._parts.append(same)
            return
        missing = [body for body in own if body.placed is None]
        for index in range(0, len(missing), _PLACED_A_STEP):
            some = missing[index : index + _PLACED_A_STEP]
            yield BuildStep(_PER_PLACED * len(some), fits=True)
            for body in some:
                self._place(body)
        yield BuildStep(_PART + _PER_CHECK * len(inside), fits=True)
        self._parts.append(_Part(own, inside, self._sweep_of(own, inside)))

    def _sweep_of(self, bodies: Sequence[_Body], pairs: Sequence[tuple[int, int]]) -> Array:
        numbers = np.array(pairs, dtype=np.intp).reshape(-1, 2)
        return sweep_of(
            np.array([body.joint for body in bodies], dtype=np.intp)[numbers],
            np.array([body.reach for body in bodies])[numbers],
            *(self._lengths, self._travel, self._prismatic),
        )

    def _join_parts(self) -> None:
        """Number the pairs of all parts."""
        parts = self._parts
        self.pairs = tuple(chain.from_iterable(part.pairs for part in parts))
        self.sweep = parts[0].sweep if len(parts) == 1 else np.vstack([one.sweep for one in parts])
        # For each pair its part, and its number there.
        self._in_part = [(part, number) for part in parts for number in range(len(part.pairs))]

    def parts_to_drop(self) -> list[object]:
        """Return all that takes long to be freed, a millisecond or less each, to be dropped apart.

        What another model shares, or this one still needs, is not freed by that.
        """
        objects = list(self._objects.values())
        pieces = range(0, len(objects), _BODIES_A_STEP)
        return [*self._parts, *(objects[first : first + _BODIES_A_STEP] for first in pieces)]

    def collides(self, joint_position: Sequence[float] | Array) -> bool:
        """Return True if any checked pair touches at a (n,) controller-side position [rad or m]."""
        return self.any_collides(self._checked(joint_position)[np.newaxis])

    def any_collides(self, joint_positions: Array, margin: float = TOUCHING) -> bool:
        """Return True if any of (m, n) positions touches; stops at the first that does.

        Args:
            joint_positions: (m, n) controller-side, finite float64; not checked, for speed.
        """
        least = max(margin, TOUCHING)
        padded = [(part.geometry, part.with_margin(least)) for part in self._parts]
        return any(
            pin.computeCollisions(self._model, self._data, geometry, data, position, True)
            for position in self.model_positions(joint_positions)
            for geometry, data in padded
        )

    def contacts(self, joint_position: Sequence[float] | Array) -> tuple[Proximity, ...]:
        """Return every two bodies that touch at a (n,) position, deepest overlap first."""
        distances = self.clearances(self._checked(joint_position))
        found: dict[tuple[str, str], Proximity] = {}
        for pair in np.argsort(distances, kind="stable").tolist():
            if distances[pair] > TOUCHING:
                break
            found.setdefault(self.pairs[pair], self._proximity(pair))
        return tuple(found.values())

    def distance(self, joint_position: Sequence[float] | Array) -> Proximity | None:
        """Return the nearest two bodies at a (n,) position; None without pairs."""
        distances = self.clearances(self._checked(joint_position))
        return self._proximity(int(np.argmin(distances))) if self.pairs else None

    def distance_in_steps(
        self, joint_position: Sequence[float] | Array
    ) -> Generator[BuildStep, None, Proximity | None]:
        """Find what `distance` returns in steps, each announced before it is made.

        The model may be used for something else between two steps.
        """
        position = self.model_positions(self._checked(joint_position))
        least: Proximity | None = None
        for part in self._parts:
            yield BuildStep(_PER_DISTANCE * len(part.pairs), fits=True)
            if not part.pairs:
                continue
            pin.computeDistances(self._model, self._data, part.geometry, part.exact, position)
            distances = [result.min_distance for result in part.exact.distanceResults]
            nearest = distances.index(min(distances))
            if least is None or distances[nearest] < least.distance:
                least = part.proximity(nearest)
        return least

    def clearances(self, joint_position: Array) -> Array:
        """Return the (p,) distance of each pair [m], negative where they overlap; unchecked."""
        model, data, parts = self._model, self._data, self._parts
        position = self.model_positions(joint_position)
        pin.computeDistances(model, data, parts[0].geometry, parts[0].exact, position)
        for part in parts[1:]:
            # The joints are where they belong already; the shapes of each part follow them.
            pin.updateGeometryPlacements(model, data, part.geometry, part.exact)
            pin.computeDistances(part.geometry, part.exact)
        return np.array(
            [result.min_distance for part in parts for result in part.exact.distanceResults]
        )

    def clearances_of(self, pairs: Iterable[int], joint_position: Array) -> list[float]:
        """Return the distances of some pairs [m], as `clearances` has them; unchecked.

        Args:
            pairs: indices into `pairs`. Each costs a few times less than its share of all.
            joint_position: (n,) controller-side [rad or m].
        """
        position = self.model_positions(joint_position)
        if len(self._parts) > 1:
            return self._clearances_in_parts(pairs, position)
        geometry, data = self._parts[0].geometry, self._parts[0].exact
        pin.updateGeometryPlacements(self._model, self._data, geometry, data, position)
        return [pin.computeDistance(geometry, data, pair).min_distance for pair in pairs]

    def _clearances_in_parts(self, pairs: Iterable[int], position: Array) -> list[float]:
        model, data = self._model, self._data
        pin.forwardKinematics(model, data, position)
        placed: set[_Part] = set()
        distances: list[float] = []
        for pair in pairs:
            part, number = self._in_part[pair]
            if part not in placed:
                placed.add(part)
                pin.updateGeometryPlacements(model, data, part.geometry, part.exact)
            found = pin.computeDistance(part.geometry, part.exact, number)
            distances.append(found.min_distance)
        return distances

    def model_positions(self, joint_positions: Array) -> Array:
        """Return the model's (…, j) moving joints of controller-side (…, n) positions."""
        if self._plain:
            return joint_positions
        positions: Array = joint_positions @ self._gain.T + self._offset
        return positions

    def model_rates(self, joint_rates: Array) -> Array:
        """Return the (j,) rates of the model's moving joints for controller-side (n,) rates."""
        if self._plain:
            return joint_rates
        rates: Array = self._gain @ joint_rates
        return rates

    def _checked(self, joint_position: Sequence[float] | Array) -> Array:
        vector = np.asarray(joint_position, dtype=np.float64)
        self.kinematics.limits.check_finite(vector.tolist(), "the joint position")
        return vector

    def _proximity(self, pair: int) -> Proximity:
        """Return the result of the last call of `clearances` for a pair."""
        part, number = self._in_part[pair]
        return part.proximity(number)

    def _link_bodies(self) -> Iterator[_Body]:
        for link, shapes in self.kinematics.robot.collision.items():
            for shape in shapes:
                yield _Body(link, self._joint(link), is_link=True, is_held=False, source=shape)

    def _object_body(self, each: SceneObject, known: Mapping[str, _Body]) -> _Body:
        """Return the body of an object, the known one where it is the same."""
        before = known.get(each.name)
        if before is not None and (before.source is each or before.source == each):
            return before
        links = self.kinematics.robot.links
        if each.link is not None and each.link not in links:
            raise FrameUnknown(each.link, links)
        joint = 0 if each.link is None else self._joint(each.link)
        return _Body(each.name, joint, is_link=False, is_held=each.link is not None, source=each)

    def _joint(self, link: str) -> int:
        """Return the number of the moving joint that carries a link, 0 for none."""
        return int(self._model.frames[self._model.getFrameId(link)].parentJoint)

    def _place(self, body: _Body) -> None:
        """Put a shape on the model."""
        shape = body.source
        if isinstance(shape, SceneObject):
            geometry, pose, link = object_geometry(shape.shape), shape.pose, shape.link
            if link is None:
                pose = self.kinematics.to_base(pose, shape.frame)
            placement = pin.SE3(pose.rotation, pose.position)
        else:
            geometry, link = link_geometry(shape), body.name
            placement = pin.SE3(pin.rpy.rpyToMatrix(*shape.rpy), np.array(shape.xyz))
        if link is not None:
            placement = self._model.frames[self._model.getFrameId(link)].placement * placement
        geometry.computeLocalAABB()
        centre = placement.act(geometry.aabb_center)
        body.reach = float(np.linalg.norm(centre)) + float(geometry.aabb_radius)
        body.placed = pin.GeometryObject(body.name, body.joint, placement, geometry)

    @property
    def _wrist(self) -> tuple[int, ...]:
        """First and last joint of the wrist, counted from 1; empty for a shorter arm."""
        last = self._model.njoints - 1
        return (last - 2, last) if last >= _LEAST_WITH_WRIST else ()


def _check_names(scene: Scene, links: Sequence[str]) -> None:
    names = scene.names
    twice = frozenset(links).intersection(names)
    if twice:
        raise DuplicateObject(next(name for name in names if name in twice))
    known = frozenset((*names, *links))
    for name in sorted({name for pair in scene.allowed for name in pair} - known):
        raise UnknownObject(name, (*names, *links))
