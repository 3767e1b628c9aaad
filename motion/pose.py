"""Pose: a position and an orientation, and the algebra on them.

Owns the conventions: metres; unit quaternions x, y, z, w with w not negative; roll, pitch, yaw as
R = Rz(yaw) Ry(pitch) Rx(roll). The formulas between quaternions, matrices and angles are those of
J. Diebel, *Representing Attitude: Euler Angles, Unit Quaternions, and Rotation Vectors*, 2006, but
where a function names another source. A pose does not name its frame; the caller that passes one
names the frame beside it. Knows no robot and no kinematics library.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from .errors import BadArgument, NotFinite

Array: TypeAlias = NDArray[np.float64]

_Real: TypeAlias = Any
"""A real, or an array of reals."""

_SMALLEST_QUATERNION = 1e-6
_LARGEST_COORDINATE = 1e6
_NEARLY_PARALLEL = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """Rigid placement; the arrays are the pose's own and read-only.

    Attributes:
        position: (3,) [m].
        quaternion: (4,) x, y, z, w; normalised on the way in, w not negative.

    Raises:
        BadArgument: a wrong number of values, coordinates beyond a million metres, or a
            quaternion too small to have a direction.
        NotFinite: a value is infinite or not a number.
    """

    position: Array
    quaternion: Array

    def __post_init__(self) -> None:
        position = checked_vector(self.position, 3, "position")
        quaternion = checked_vector(self.quaternion, 4, "quaternion")
        # Of so few numbers Python finds the greatest in a tenth of the time that numpy takes.
        if max(map(abs, position.tolist())) > _LARGEST_COORDINATE:
            raise BadArgument("position", position.tolist(), "coordinates within a million metres")
        # Dividing by the largest element first keeps the norm from overflowing.
        scale = max(map(abs, quaternion.tolist()))
        if scale < _SMALLEST_QUATERNION:
            raise BadArgument("quaternion", quaternion.tolist(), "a norm of at least 1e-6")
        quaternion /= scale
        quaternion /= math.sqrt(float(quaternion @ quaternion))
        object.__setattr__(self, "position", _frozen(position))
        object.__setattr__(self, "quaternion", _frozen(_canonical(quaternion)))

    def __reduce__(self) -> tuple[Callable[[bytes], Pose], tuple[bytes]]:
        # As they are, read-only, and in a fifth of the time that two arrays take to be unpickled.
        return _unpickled, (self.position.tobytes() + self.quaternion.tobytes(),)

    @classmethod
    def identity(cls) -> Pose:
        """Return the pose that moves nothing."""
        return cls(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))

    @classmethod
    def from_values(cls, position: Sequence[float], quaternion: Sequence[float]) -> Pose:
        """Return the `Pose` of plain numbers: (3,) position [m] and (4,) quaternion x, y, z, w."""
        return cls(np.array(position, dtype=np.float64), np.array(quaternion, dtype=np.float64))

    @classmethod
    def from_rpy(cls, position: Sequence[float] | Array, rpy: Sequence[float] | Array) -> Pose:
        """Return a pose from a (3,) position [m] and (3,) roll, pitch, yaw [rad].

        Raises:
            BadArgument, NotFinite: a vector is not three finite values.
        """
        half = checked_vector(rpy, 3, "rpy") / 2.0
        (sr, sp, sy), (cr, cp, cy) = np.sin(half), np.cos(half)
        quaternion = np.array(
            [
                sr * cp * cy - cr * sp * sy,
                cr * sp * cy + sr * cp * sy,
                cr * cp * sy - sr * sp * cy,
                cr * cp * cy + sr * sp * sy,
            ]
        )
        return cls(np.asarray(position, dtype=np.float64), quaternion)

    @classmethod
    def from_matrix(cls, rotation: Array, position: Sequence[float] | Array) -> Pose:
        """Return a pose of a (3, 3) rotation matrix and a position [m], or raise `NotFinite`."""
        return cls(np.asarray(position, dtype=np.float64), matrix_to_quaternion(rotation))

    @property
    def rotation(self) -> Array:
        """The (3, 3) rotation matrix."""
        return quaternion_to_matrix(self.quaternion)

    def to_matrix(self) -> Array:
        """Return the (4, 4) homogeneous matrix."""
        (a, b, c), (d, e, f), (g, h, i) = _rotation_rows(*self.quaternion.tolist())
        x, y, z = self.position.tolist()
        # One flat list: numpy reads it in half the time that nested rows take.
        flat = (a, b, c, x, d, e, f, y, g, h, i, z, 0.0, 0.0, 0.0, 1.0)
        return np.array(flat).reshape(4, 4)

    def compose(self, other: Pose) -> Pose:
        """Return the pose of `other`, given in this pose's frame, in this pose's parent frame."""
        return Pose(
            self.position + self.rotation @ other.position,
            quaternion_product(self.quaternion, other.quaternion),
        )

    def compose_all(self, poses: Array) -> Array:
        """Return for many poses what `compose` returns for one.

        Args:
            poses: (m, 7) x, y, z [m] and quaternion x, y, z, w of each in this pose's frame; finite
                and no quaternion near 0, which is not checked.

        Returns:
            (m, 7) likewise in this pose's parent frame; quaternions normalised, w not negative.

        Raises:
            BadArgument: coordinates beyond a million metres.
        """
        x, y, z, w = _normalised(poses[:, 3:]).T
        a, b, c, d = self.quaternion.tolist()
        # As `quaternion_product`.
        product = np.stack(
            (
                d * x + a * w + b * z - c * y,
                d * y - a * z + b * w + c * x,
                d * z + a * y - b * x + c * w,
                d * w - a * x - b * y - c * z,
            ),
            axis=1,
        )
        # A product for each, as one of all would round otherwise.
        turned = np.matmul(self.rotation, poses[:, :3, np.newaxis])[:, :, 0]
        composed = np.hstack((self.position + turned, _normalised(product)))
        is_beyond = np.abs(composed[:, :3]).max(axis=1) > _LARGEST_COORDINATE
        if is_beyond.any():
            first = composed[int(np.argmax(is_beyond)), :3].tolist()
            raise BadArgument("position", first, "coordinates within a million metres")
        return composed

    def inverse(self) -> Pose:
        """Return the inverse of this pose."""
        conjugate = self.quaternion * np.array([-1.0, -1.0, -1.0, 1.0])
        return Pose(-(self.rotation.T @ self.position), conjugate)

    def position_distance(self, other: Pose) -> float:
        """Return the distance between the two origins [m]."""
        return math.dist(self.position, other.position)

    def rotation_distance(self, other: Pose) -> float:
        """Return the angle between the two orientations [rad], 0 to π."""
        return rotation_distance(self.quaternion, other.quaternion)

    def interpolate(self, other: Pose, fraction: float) -> Pose:
        """Return the pose at a fraction of the path to another: straight line and even rotation."""
        position = (1.0 - fraction) * self.position + fraction * other.position
        return Pose(position, slerp(self.quaternion, other.quaternion, fraction))


def _unpickled(data: bytes) -> Pose:
    values = np.frombuffer(data)
    pose = object.__new__(Pose)
    object.__setattr__(pose, "position", values[:3])
    object.__setattr__(pose, "quaternion", values[3:])
    return pose


class PoseArray(NamedTuple):
    """Poses as arrays, (m, 3, 3) and (m, 3) [m], such as the tool's along a curve."""

    rotation: Array
    position: Array


_ONE_BY_ONE = 16


def composed(poses: Sequence[Pose]) -> Pose:
    """Return the last of a chain of poses, each given in the frame of the one before, in the first.

    As `compose` does one by one; a long chain is multiplied in pairs, all pairs at once, since each
    call of numpy costs as much as hundreds of products: 1,000 poses would take 15 ms of an event
    loop one by one.
    """
    if len(poses) <= _ONE_BY_ONE:
        pose = Pose.identity()
        for upper in reversed(poses):
            pose = upper.compose(pose)
        return pose
    chain = _matrices(poses)
    while len(chain) > 1:
        paired = len(chain) // 2 * 2
        chain = np.concatenate((chain[:paired:2] @ chain[1:paired:2], chain[paired:]))
    return Pose.from_matrix(chain[0, :3, :3], chain[0, :3, 3])


def _matrices(poses: Sequence[Pose]) -> Array:
    """Return the (m, 4, 4) homogeneous matrices of poses."""
    rows = _rotation_rows(*np.array([pose.quaternion for pose in poses]).T)
    matrices = np.zeros((len(poses), 4, 4))
    for row, values in enumerate(rows):
        for column, value in enumerate(values):
            matrices[:, row, column] = value
    matrices[:, :3, 3] = [pose.position for pose in poses]
    matrices[:, 3, 3] = 1.0
    return matrices


def slerp(start: Array, goal: Array, fraction: float) -> Array:
    """Return the unit quaternion between two, w not negative, by the lesser angle at constant rate.

    Source: K. Shoemake, *Animating Rotation with Quaternion Curves*, SIGGRAPH 1985.

    Args:
        start: (4,) x, y, z, w at fraction 0.
        goal: (4,) x, y, z, w at fraction 1.
    """
    near = goal if float(start @ goal) >= 0.0 else -goal
    angle = rotation_distance(start, near) / 2.0
    if angle < _NEARLY_PARALLEL:
        blend = (1.0 - fraction) * start + fraction * near
    else:
        blend = math.sin((1.0 - fraction) * angle) * start + math.sin(fraction * angle) * near
    return _canonical(blend / math.sqrt(float(blend @ blend)))


def rotation_distance(first: Array, second: Array) -> float:
    """Return the angle between two unit quaternions, both (4,) x, y, z, w [rad], 0 to π.

    Small angles are exact too: tan(θ/4) = |p - q| / |p + q|, from the chord of half the angle.
    """
    # The arc cosine of the dot product would lose half the digits near zero.
    same = second if float(first @ second) >= 0.0 else -second
    difference, total = first - same, first + same
    return 4.0 * math.atan2(
        math.sqrt(float(difference @ difference)), math.sqrt(float(total @ total))
    )


def quaternion_product(left: Array, right: Array) -> Array:
    """Return the rotation `left` after `right`; both (4,) x, y, z, w."""
    ax, ay, az, aw = left.tolist()
    bx, by, bz, bw = right.tolist()
    return np.array(
        [
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
            aw * bw - ax * bx - ay * by - az * bz,
        ]
    )


def quaternion_to_matrix(quaternion: Array) -> Array:
    """Return the (3, 3) rotation matrix of a unit quaternion x, y, z, w."""
    return np.array(_rotation_rows(*quaternion.tolist()))


def _rotation_rows(x: _Real, y: _Real, z: _Real, w: _Real) -> tuple[tuple[_Real, ...], ...]:
    """Return the rows of a unit quaternion's matrix, or of many at once."""
    return (
        (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )


def matrix_to_quaternion(rotation: Array) -> Array:
    """Return the (4,) unit quaternion x, y, z, w of a (3, 3) rotation matrix, w not negative.

    Source: S. W. Shepperd, *Quaternion from Rotation Matrix*, J. Guidance and Control 1, 1978.
    """
    (a, b, c), (d, e, f), (g, h, i) = np.asarray(rotation, dtype=np.float64).tolist()
    # Divided by the element with the greatest square, so that no digits are lost near π.
    squares = (1.0 + a - e - i, 1.0 - a + e - i, 1.0 - a - e + i, 1.0 + a + e + i)
    match squares.index(max(squares)):
        case 0:
            raw = (squares[0], b + d, c + g, h - f)
        case 1:
            raw = (b + d, squares[1], f + h, c - g)
        case 2:
            raw = (c + g, f + h, squares[2], d - b)
        case _:
            raw = (h - f, c - g, d - b, squares[3])
    x, y, z, w = raw
    norm = math.copysign(math.sqrt(x * x + y * y + z * z + w * w), _leading(raw))
    return np.array((x / norm + 0.0, y / norm + 0.0, z / norm + 0.0, w / norm + 0.0))


def _leading(quaternion: Sequence[float]) -> float:
    """Return the first element of w, x, y, z that is not 0; its sign is the quaternion's."""
    x, y, z, w = quaternion
    return w or x or y or z


def _canonical(quaternion: Array) -> Array:
    # q and -q are one rotation; adding zero makes -0.0 into 0.0.
    return (quaternion if _leading(quaternion.tolist()) > 0.0 else -quaternion) + 0.0


def _normalised(quaternions: Array) -> Array:
    """Return (m, 4) quaternions as a `Pose` has them."""
    scaled = quaternions / np.abs(quaternions).max(axis=1, keepdims=True)
    scaled /= np.sqrt(np.matmul(scaled[:, np.newaxis, :], scaled[:, :, np.newaxis])[:, :, 0])
    x, y, z, w = scaled.T
    leading = np.where(w != 0.0, w, np.where(x != 0.0, x, np.where(y != 0.0, y, z)))
    signed: Array = np.where(leading[:, np.newaxis] > 0.0, scaled, -scaled) + 0.0
    return signed


def checked_vector(values: Sequence[float] | Array, count: int, what: str) -> Array:
    """Return the caller's numbers as a (count,) array of its own.

    Args:
        what: their name in errors.

    Raises:
        BadArgument, NotFinite: not so many finite values.
    """
    vector = np.array(values, dtype=np.float64)
    if vector.shape != (count,):
        raise BadArgument(what, vector.tolist(), f"{count} numbers")
    finite = [math.isfinite(value) for value in vector.tolist()]
    if not all(finite):
        raise NotFinite(what, finite.index(False))
    return vector


def _frozen(array: Array) -> Array:
    array.flags.writeable = False
    return array
