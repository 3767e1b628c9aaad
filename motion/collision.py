"""What a robot touches: itself, the scene around it, and with what it holds.

Owns the collision model: the shapes of the robot file and of a scene on the pinocchio model, the
pairs that are checked, and how far each pair can approach per unit of joint travel. Beside
`kinematics` the only module that asks pinocchio. Joint vectors are controller-side driven joints
in file order; distances and points are in m, in the base frame.

Checked are all pairs of bodies but these: links of one joint or of consecutive ones, the first and
last link of the wrist of an arm of six axes or more, pairs that the robot file or the scene allows,
and objects that stand with links that stand, which no motion changes. A held object is checked
against everything, the link that holds it too.

A wrist's makers limit its middle joint so that its links do not meet, while our shapes of them are
coarse: on a UR5 they would meet in a quarter of all positions.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from .collision_shapes import link_geometry, object_geometry
from .errors import DuplicateObject, FrameUnknown, UnknownObject
from .kinematics import Array, Kinematics
from .model_map import greatest_travel, model_map
from .scene import Scene, SceneObject

TOUCHING = 1e-6
"""Bodies nearer than this touch [m].

Not 0: coal's check without contact points (3.0.3) ends where the distance falls below the tolerance
of its GJK, 1e-6, and then calls bodies free that overlap by millimetres, unless what it is asked
for is no nearer than that tolerance.
"""


_LEAST_WITH_WRIST = 6  # joints


class Proximity(NamedTuple):
    """How near two bodies are, and the point (3,) of each that is nearest to the other.

    Where they touch, `distance` [m] is negative by the overlap of solids; a mesh, having no inside,
    may show 0.
    """

    distance: float
    first: str
    second: str
    first_point: Array
    second_point: Array

    @property
    def touching(self) -> bool:
        """Whether they touch."""
        return self.distance <= TOUCHING


@dataclass(frozen=True, slots=True)
class _Body:
    """A shape on the model: the joint that carries it, 0 for none, and its bounding ball there."""

    name: str
    geometry: int
    joint: int
    reach: float
    standing: bool


class CollisionModel:
    """A robot and a scene, for one thread: calls share scratch memory.

    Attributes:
        kinematics: the robot.
        scene: what stands around it.
        pairs: (p,) names of the two bodies of each pair that is checked; a body of several shapes
            comes several times.
        sweep: (p, j) how far the two bodies of a pair can move relative to each other per unit of
            travel of each moving joint of the model [m/rad or m/m], an upper bound over all
            positions.
    """

    def __init__(self, kinematics: Kinematics, scene: Scene | None = None) -> None:
        """Build the model.

        Raises:
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
        bodies = [*self._links(), *self._objects()]
        checked = list(self._pairs(bodies))
        for first, second in checked:
            self._geometry.addCollisionPair(pin.CollisionPair(first.geometry, second.geometry))
        self.pairs = tuple((first.name, second.name) for first, second in checked)
        self._travel = greatest_travel(kinematics.robot)
        self.sweep: Array = np.array([self._sweep(*pair) for pair in checked])
        self.sweep = self.sweep.reshape(len(checked), self._model.njoints - 1)
        self._exact = pin.GeometryData(self._geometry)
        self._padded: dict[float, Any] = {}

    def collides(self, joint_position: Sequence[float] | Array) -> bool:
        """Return whether any checked pair touches at a (n,) controller-side position [rad or m].

        Raises:
            WrongJointCount: not one value per driven joint.
            NotFinite: a value is infinite or not a number.
        """
        return self.any_collides(self._checked(joint_position)[np.newaxis])

    def any_collides(self, joint_positions: Array, margin: float = TOUCHING) -> bool:
        """Return whether any of (m, n) positions touches, stopping at the first that does.

        Args:
            joint_positions: (m, n) controller-side, finite float64; not checked, for speed.
            margin: how near counts as touching [m].
        """
        data = self._with_margin(max(margin, TOUCHING))
        return any(
            pin.computeCollisions(self._model, self._data, self._geometry, data, position, True)
            for position in self.model_positions(joint_positions)
        )

    def contacts(self, joint_position: Sequence[float] | Array) -> tuple[Proximity, ...]:
        """Return every two bodies that touch at a (n,) position, deepest overlap first, each once.

        Raises:
            WrongJointCount: not one value per driven joint.
            NotFinite: a value is infinite or not a number.
        """
        distances = self.clearances(self._checked(joint_position))
        found: dict[tuple[str, str], Proximity] = {}
        for pair in np.argsort(distances, kind="stable").tolist():
            if distances[pair] > TOUCHING:
                break
            found.setdefault(self.pairs[pair], self._proximity(pair))
        return tuple(found.values())

    def distance(self, joint_position: Sequence[float] | Array) -> Proximity | None:
        """Return the nearest two bodies at a (n,) position; None where there is nothing to check.

        Raises:
            WrongJointCount: not one value per driven joint.
            NotFinite: a value is infinite or not a number.
        """
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
        """Return what the last call of `clearances` found of a pair."""
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

    def _links(self) -> Iterator[_Body]:
        for link, shapes in self.kinematics.robot.collision.items():
            for shape in shapes:
                placement = pin.SE3(pin.rpy.rpyToMatrix(*shape.rpy), np.array(shape.xyz))
                yield self._body(link, link, placement, link_geometry(shape))

    def _objects(self) -> Iterator[_Body]:
        for each in self.scene.objects:
            if each.link is not None and each.link not in self.kinematics.robot.links:
                raise FrameUnknown(each.link, self.kinematics.robot.links)
            geometry = object_geometry(each.shape)
            yield self._body(each.name, each.link, self._placement(each), geometry)

    def _placement(self, each: SceneObject) -> Any:
        pose = each.pose
        if each.link is None:
            pose = self.kinematics.to_base(pose, each.frame)
        return pin.SE3(pose.rotation, pose.position)

    def _body(self, name: str, link: str | None, placement: Any, geometry: Any) -> _Body:
        joint = 0
        if link is not None:
            frame = self._model.frames[self._model.getFrameId(link)]
            joint, placement = frame.parentJoint, frame.placement * placement
        added = self._geometry.addGeometryObject(
            pin.GeometryObject(f"{name}/{self._geometry.ngeoms}", joint, placement, geometry)
        )
        geometry.computeLocalAABB()
        reach = float(np.linalg.norm(placement.act(geometry.aabb_center))) + geometry.aabb_radius
        held = link is not None and name != link
        return _Body(name, added, joint, reach, standing=joint == 0 and not held)

    def _pairs(self, bodies: Sequence[_Body]) -> Iterator[tuple[_Body, _Body]]:
        links = frozenset(self.kinematics.robot.links)
        pairs = self.kinematics.robot.allowed_collisions
        allowed = {frozenset(pair[:2]) for pair in pairs} | set(map(frozenset, self.scene.allowed))
        for first, second in combinations(bodies, 2):
            if first.name == second.name or {first.name, second.name} in allowed:
                continue
            if first.standing and second.standing:
                continue
            of_links = first.name in links and second.name in links
            if of_links and abs(first.joint - second.joint) <= 1:
                continue
            if of_links and {first.joint, second.joint} == self._wrist:
                continue
            held_together = first.joint == second.joint and not {first.name, second.name} & links
            if not held_together:
                yield first, second

    @property
    def _wrist(self) -> set[int]:
        """The first and last joint of the wrist, counted from 1; none of a shorter arm."""
        last = self._model.njoints - 1
        return {last - 2, last} if last >= _LEAST_WITH_WRIST else set()

    def _sweep(self, first: _Body, second: _Body) -> list[float]:
        """Return the pair's row of `sweep`.

        A point at p on the farther body is moved by a turning joint by at most its distance to the
        axis. Links being rigid, that is at most the lengths of the links between and its own reach.
        """
        near, far = sorted((first, second), key=lambda body: body.joint)
        row = [0.0] * (self._model.njoints - 1)
        lever = far.reach
        for joint in range(far.joint, near.joint, -1):
            moving = self.kinematics.robot.moving[joint - 1]
            row[joint - 1] = 1.0 if moving.prismatic else lever
            lever += float(np.linalg.norm(self._model.jointPlacements[joint].translation))
            if moving.prismatic:
                lever += self._travel[joint - 1]
        return row


def _check_names(scene: Scene, links: Sequence[str]) -> None:
    known = frozenset((*scene.names, *links))
    for name in scene.names:
        if name in links:
            raise DuplicateObject(name)
    for name in sorted({name for pair in scene.allowed for name in pair} - known):
        raise UnknownObject(name, (*scene.names, *links))
