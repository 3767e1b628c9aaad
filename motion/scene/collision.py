"""Collision model: contacts and distances of a robot, the scene around it and attached objects.

Owns the shapes as coal geometries, their placing on the pinocchio model, the pairs to check, and
the bound of how far each pair can approach per unit of joint travel. The only module that imports
coal; besides it only `kinematics/serial` and `kinematics/pinocchio_model` import pinocchio. Joint
vectors are controller-side driven joints in file order; distances and points are in m, in the base
frame.

The model checks all pairs of bodies except these: links of one joint or of consecutive ones, the
first and last link of the wrist of an arm of six axes or more, pairs that the robot file or the
scene allows, and fixed objects with fixed links, which no motion changes. An attached object is
checked against everything, also against the link that holds it. Pairs are chosen for all bodies at
once, because the server's event loop waits for it when a scene changes.

The wrist is left out because its maker limits the middle joint so that its links do not meet, while
our shapes of them are coarse: on a UR5 they would meet in a quarter of all positions.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from ..description.schema import BoxFacts as LinkBox
from ..description.schema import CapsuleFacts as LinkCapsule
from ..description.schema import Shape as LinkShape
from ..errors import DuplicateObject, FrameUnknown, SceneTooLarge, UnknownObject
from ..kinematics.pinocchio_model import greatest_travel, model_map
from ..kinematics.serial import Kinematics
from ..pose import Array
from .mesh_file import read_mesh
from .scene import Box, Capsule, Cylinder, Mesh, Scene, SceneObject, Shape, Sphere


@dataclass(frozen=True, slots=True)
class CollisionBody:
    """Shape on the model.

    Attributes:
        name: of the link or the object; a link may have several shapes.
        joint: moving joint of the model that carries it, counted from 1; 0 for none.
        is_link: True if it is a shape of the robot.
        is_held: True if a link holds it.
    """

    name: str
    joint: int
    is_link: bool
    is_held: bool


def checked_pairs(
    bodies: Sequence[CollisionBody], allowed: Iterable[Sequence[str]], wrist: Sequence[int]
) -> NDArray[np.bool_]:
    """Return which pairs of bodies are checked: (b, b), true above the diagonal only.

    Args:
        allowed: pairs of names that are not checked against one another.
        wrist: first and last joint of the wrist, whose links are not; empty for none.
    """
    joint = np.array([body.joint for body in bodies], dtype=np.intp)
    is_link = np.array([body.is_link for body in bodies], dtype=bool)
    stands = (joint == 0) & ~np.array([body.is_held for body in bodies], dtype=bool)
    numbers: dict[str, int] = {}
    name = np.array([numbers.setdefault(body.name, len(numbers)) for body in bodies], dtype=np.intp)
    # Pairs that need no check, first among links, then among objects, then among all.
    unchecked = np.abs(joint[:, np.newaxis] - joint) <= 1
    if wrist:
        first, last = joint == wrist[0], joint == wrist[1]
        unchecked |= (first[:, np.newaxis] & last) | (last[:, np.newaxis] & first)
    unchecked &= is_link[:, np.newaxis] & is_link
    unchecked |= (joint[:, np.newaxis] == joint) & ~(is_link[:, np.newaxis] | is_link)
    unchecked |= stands[:, np.newaxis] & stands
    unchecked |= name[:, np.newaxis] == name
    unchecked |= _allowed(numbers, allowed)[name[:, np.newaxis], name]
    return np.triu(~unchecked, 1)


def _allowed(numbers: dict[str, int], allowed: Iterable[Sequence[str]]) -> NDArray[np.bool_]:
    """Return which names, by their numbers, may touch."""
    found = np.zeros((len(numbers), len(numbers)), dtype=bool)
    for first, second, *_ in allowed:
        # A link without a shape has no number.
        if first in numbers and second in numbers:
            row, column = numbers[first], numbers[second]
            found[row, column] = found[column, row] = True
    return found


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
    """Return the geometry of a link's shape; where it is placed is no part of it."""
    if isinstance(shape, LinkBox):
        return coal.Box(*shape.size)
    if isinstance(shape, LinkCapsule):
        return coal.Capsule(shape.radius, shape.length)
    return coal.Sphere(shape.radius)


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
        self.kinematics = kinematics
        self.scene = Scene() if scene is None else scene
        self._model = kinematics.model
        self._data = self._model.createData()
        self._gain, self._offset = model_map(kinematics.robot)
        self._plain = np.array_equal(self._gain, np.eye(kinematics.dof)) and not self._offset.any()
        self._geometry = pin.GeometryModel()
        _check_names(self.scene, kinematics.robot.links)
        bodies = tuple(self._bodies())
        allowed = (*kinematics.robot.allowed_collisions, *self.scene.allowed)
        checked = checked_pairs(bodies, allowed, self._wrist)
        self._check_size(bodies, checked, most_pairs)
        reaches = [*self._place_links(), *self._place_objects()]
        self._geometry.setCollisionPairs(checked)
        pairs = np.argwhere(checked)
        self.pairs = tuple((bodies[one].name, bodies[other].name) for one, other in pairs.tolist())
        self.sweep: Array = sweep_of(
            np.array([body.joint for body in bodies], dtype=np.intp)[pairs],
            np.array(reaches)[pairs],
            [float(np.linalg.norm(each.translation)) for each in self._model.jointPlacements[1:]],
            greatest_travel(kinematics.robot),
            [each.prismatic for each in kinematics.robot.moving],
        )
        self._exact = pin.GeometryData(self._geometry)
        self._padded: dict[float, Any] = {}

    def collides(self, joint_position: Sequence[float] | Array) -> bool:
        """Return True if any checked pair touches at a (n,) controller-side position [rad or m]."""
        return self.any_collides(self._checked(joint_position)[np.newaxis])

    def any_collides(self, joint_positions: Array, margin: float = TOUCHING) -> bool:
        """Return True if any of (m, n) positions touches; stops at the first that does.

        Args:
            joint_positions: (m, n) controller-side, finite float64; not checked, for speed.
        """
        data = self._with_margin(max(margin, TOUCHING))
        return any(
            pin.computeCollisions(self._model, self._data, self._geometry, data, position, True)
            for position in self.model_positions(joint_positions)
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

    def clearances(self, joint_position: Array) -> Array:
        """Return the (p,) distance of each pair [m], negative where they overlap; unchecked."""
        pin.computeDistances(
            self._model,
            self._data,
            self._geometry,
            self._exact,
            self.model_positions(joint_position),
        )
        return np.array([result.min_distance for result in self._exact.distanceResults])

    def clearances_of(self, pairs: Iterable[int], joint_position: Array) -> list[float]:
        """Return the distances of some pairs [m], as `clearances` has them; unchecked.

        Args:
            pairs: indices into `pairs`. Each costs a few times less than its share of all.
            joint_position: (n,) controller-side [rad or m].
        """
        position = self.model_positions(joint_position)
        geometry, data = self._geometry, self._exact
        pin.updateGeometryPlacements(self._model, self._data, geometry, data, position)
        return [pin.computeDistance(geometry, data, pair).min_distance for pair in pairs]

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
        result = self._exact.distanceResults[pair]
        first, second = result.getNearestPoint1(), result.getNearestPoint2()
        return Proximity(
            float(result.min_distance), *self.pairs[pair], np.array(first), np.array(second)
        )

    def _with_margin(self, margin: float) -> Any:
        if margin not in self._padded:
            data = pin.GeometryData(self._geometry)
            for request in data.collisionRequests:
                request.security_margin = margin
            self._padded[margin] = data
        return self._padded[margin]

    def _bodies(self) -> Iterator[CollisionBody]:
        """Return the shapes in the order of the geometry model."""
        links = self.kinematics.robot.links
        for link, shapes in self.kinematics.robot.collision.items():
            for _ in shapes:
                yield CollisionBody(link, self._joint(link), is_link=True, is_held=False)
        for each in self.scene.objects:
            if each.link is not None and each.link not in links:
                raise FrameUnknown(each.link, links)
            joint = 0 if each.link is None else self._joint(each.link)
            yield CollisionBody(each.name, joint, is_link=False, is_held=each.link is not None)

    def _joint(self, link: str) -> int:
        """Return the number of the moving joint that carries a link, 0 for none."""
        return int(self._model.frames[self._model.getFrameId(link)].parentJoint)

    def _place_links(self) -> Iterator[float]:
        for link, shapes in self.kinematics.robot.collision.items():
            for shape in shapes:
                placement = pin.SE3(pin.rpy.rpyToMatrix(*shape.rpy), np.array(shape.xyz))
                yield self._place(link, link, placement, link_geometry(shape))

    def _place_objects(self) -> Iterator[float]:
        for each in self.scene.objects:
            geometry = object_geometry(each.shape)
            yield self._place(each.name, each.link, self._placement(each), geometry)

    def _placement(self, each: SceneObject) -> Any:
        pose = each.pose
        if each.link is None:
            pose = self.kinematics.to_base(pose, each.frame)
        return pin.SE3(pose.rotation, pose.position)

    def _place(self, name: str, link: str | None, placement: Any, geometry: Any) -> float:
        """Add a shape; return the radius of a ball about its joint that holds it [m]."""
        joint = 0
        if link is not None:
            frame = self._model.frames[self._model.getFrameId(link)]
            joint, placement = frame.parentJoint, frame.placement * placement
        self._geometry.addGeometryObject(
            pin.GeometryObject(f"{name}/{self._geometry.ngeoms}", joint, placement, geometry)
        )
        geometry.computeLocalAABB()
        centre = placement.act(geometry.aabb_center)
        return float(np.linalg.norm(centre)) + float(geometry.aabb_radius)

    def _check_size(self, bodies: Sequence[CollisionBody], checked: Any, most_pairs: float) -> None:
        """Refuse a model that takes too long, before any of it is built."""
        of_links = [number for number, body in enumerate(bodies) if body.is_link]
        pairs = int(checked.sum()) - int(checked[np.ix_(of_links, of_links)].sum())
        if pairs > most_pairs:
            raise SceneTooLarge(pairs, int(most_pairs), len(self.scene.objects))

    @property
    def _wrist(self) -> tuple[int, ...]:
        """First and last joint of the wrist, counted from 1; empty for a shorter arm."""
        last = self._model.njoints - 1
        return (last - 2, last) if last >= _LEAST_WITH_WRIST else ()


def _check_names(scene: Scene, links: Sequence[str]) -> None:
    known = frozenset((*scene.names, *links))
    for name in scene.names:
        if name in links:
            raise DuplicateObject(name)
    for name in sorted({name for pair in scene.allowed for name in pair} - known):
        raise UnknownObject(name, (*scene.names, *links))
