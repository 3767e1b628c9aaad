"""Forward kinematics and Jacobians of a serial robot.

Owns the use of the pinocchio model, which `serial_model` builds. Joint vectors come in as the
controller has them; what the model's own are is told by `model_map`. Only `collision` uses
pinocchio besides; no pinocchio type goes to any other module.

Frames: `base` is the controller's own base frame of the robot file, `root` the chain's root link.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from .errors import FrameUnknown
from .limits import JointLimits
from .model_map import model_map, turning_joints
from .pose import Pose
from .robot import SerialRobot
from .serial_model import base_in_root, serial_model
from .tool_curves import Places

Array: TypeAlias = NDArray[np.float64]

FRAMES = ("base", "root")

_SMALLEST_ARM = 0.1  # m


class LinkPoint(NamedTuple):
    """A point that is fixed to a link; `Kinematics.link_point` makes it.

    Attributes:
        frame: number of the link's frame in the model.
        offset: x, y, z in the link's frame [m]; None for its origin.
    """

    frame: int
    offset: tuple[float, float, float] | None


class ToolFrame(NamedTuple):
    """A frame that is fixed to the tool link; `Kinematics.tool_frame` makes it.

    Attributes:
        origin: its origin, as a point of the link.
        placement: in the link's frame, as the model has it; None for the link's frame itself.
    """

    origin: LinkPoint
    placement: Any


ToolPlace: TypeAlias = tuple[tuple[float, float, float], tuple[float, float, float, float]]
"""(3,) position [m] and (4,) quaternion x, y, z, w of norm 1, w not negative."""


class Kinematics:
    """The kinematics of one robot, for one thread: calls share scratch memory.

    Attributes:
        robot: the robot's facts.
        limits: limits of the driven joints, controller side.
        dof: number n of driven joints.
        lower: (n,) least controller-side joint position [rad or m], read-only.
        upper: (n,) greatest controller-side joint position [rad or m], read-only.
        turning: (n,) whether a full turn of the joint leaves the tool where it was.
        is_direct: whether the model's vector is the controller-side one itself.
        size: a length of the order of the arm's reach [m], to weigh turns against shifts.
    """

    def __init__(self, robot: SerialRobot) -> None:
        self.robot = robot
        self.limits: JointLimits = robot.limits
        self.dof = robot.dof
        self.lower = _read_only(np.array(self.limits.lower))
        self.upper = _read_only(np.array(self.limits.upper))
        self.size = _arm_size(robot)
        self._gain, self._offset = model_map(robot)
        self._has_offset = bool(self._offset.any())
        self.is_direct = np.array_equal(self._gain, np.eye(self.dof)) and not self._has_offset
        self.turning = turning_joints(robot, self._gain)
        self._base = base_in_root(robot)
        # The model's world is the base frame, so that the common case needs no change of frame.
        self._model = serial_model(robot, self._base.inverse())
        self._data = self._model.createData()
        self._tool: int = self._model.getFrameId(robot.tool_link)
        self._motion_axes = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED

    @property
    def model(self) -> Any:
        """The pinocchio model, its world being the base frame; for `collision` alone."""
        return self._model

    def forward(
        self,
        joint_position: Sequence[float] | Array,
        frame: str = "base",
        link: str | None = None,
    ) -> Pose:
        """Compute where a link is.

        Args:
            joint_position: (n,) controller-side [rad or m]; limits are not checked.
            frame: `base` or `root`, the frame the pose is expressed in.
            link: a link of the chain; the tool link if None.

        Raises:
            WrongJointCount: not one value per driven joint.
            NotFinite: a value is infinite or not a number.
            FrameUnknown: there is no such frame or link.
        """
        frame_id = self._tool if link is None else self._link(link)
        in_root = self._in_root(frame)
        pin.forwardKinematics(self._model, self._data, self._model_vector(joint_position))
        placement = pin.updateFramePlacement(self._model, self._data, frame_id)
        if in_root:
            placement = self._base * placement
        return Pose.from_matrix(placement.rotation, placement.translation)

    def jacobian(self, joint_position: Sequence[float] | Array, frame: str = "base") -> Array:
        """Compute how the tool link moves with the joints.

        Args:
            joint_position: (n,) controller-side [rad or m]; limits are not checked.
            frame: `base` or `root`, whose axes the velocities are expressed along.

        Returns:
            (6, n): linear velocity of the tool's origin [m/s], then angular velocity [rad/s], per
            unit of controller-side joint velocity.

        Raises:
            WrongJointCount: not one value per driven joint.
            NotFinite: a value is infinite or not a number.
            FrameUnknown: there is no such frame.
        """
        in_root = self._in_root(frame)
        _, _, jacobian = self.linearise(self._checked(joint_position))
        if not in_root:
            return jacobian
        rotation = self._base.rotation
        return np.vstack((rotation @ jacobian[:3], rotation @ jacobian[3:]))

    def linearise(self, joint_position: Array) -> tuple[Array, Array, Array]:
        """Compute tool placement and Jacobian in one pass, in the base frame, without checks.

        Args:
            joint_position: (n,) controller-side [rad or m], finite float64.

        Returns:
            The tool's (3, 3) rotation, its (3,) position [m], and the (6, n) Jacobian as of
            `jacobian`.
        """
        model, data = self._model, self._data
        pin.computeJointJacobians(model, data, self._expanded(joint_position))
        # The frame placement is not refreshed by the Jacobian calls; a stale one would be read.
        placement = pin.updateFramePlacement(model, data, self._tool)
        full = pin.getFrameJacobian(model, data, self._tool, self._motion_axes)
        # `dot` takes half as long as `@` where the matrices are this small.
        jacobian = full if self.is_direct else full.dot(self._gain)
        return placement.rotation, placement.translation, jacobian

    def place(self, joint_position: Array) -> tuple[Array, Array]:
        """Compute the tool's (3, 3) rotation and (3,) position in the base frame, without checks.

        Args:
            joint_position: (n,) controller-side [rad or m], finite float64.
        """
        pin.forwardKinematics(self._model, self._data, self._expanded(joint_position))
        placement = pin.updateFramePlacement(self._model, self._data, self._tool)
        return placement.rotation, placement.translation

    def link_point(
        self, link: str | None = None, offset: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> LinkPoint:
        """Return a point of a link, for `point_speeds`.

        Args:
            link: a link of the chain; the tool link if None.
            offset: (3,) in the link's frame [m].

        Raises:
            FrameUnknown: there is no such link.
        """
        x, y, z = offset
        frame = self._tool if link is None else self._link(link)
        return LinkPoint(frame, (x, y, z) if x or y or z else None)

    def point_speeds(
        self, joint_position: Array, joint_velocity: Array, points: Sequence[LinkPoint]
    ) -> list[float]:
        """Compute how fast points of the arm are [m/s], without checks.

        Args:
            joint_position: (n,) controller-side [rad or m], finite float64.
            joint_velocity: (n,) of it [rad/s or m/s].
            points: whose speeds are wanted.
        """
        if not self.is_direct:
            joint_position = self._expanded(joint_position)
            joint_velocity = self._gain @ joint_velocity
        model, data = self._model, self._data
        pin.forwardKinematics(model, data, joint_position, joint_velocity)
        speeds = []
        for frame, offset in points:
            # Along the link's own axes, where the offset is; a length is the same in all.
            twist = pin.getFrameVelocity(model, data, frame)
            if offset is None:
                u, v, w = twist.linear.tolist()
            else:
                x, y, z = offset
                u, v, w, a, b, c = twist.vector.tolist()
                u, v, w = u + b * z - c * y, v + c * x - a * z, w + a * y - b * x
            speeds.append(math.sqrt(u * u + v * v + w * w))
        return speeds

    def point_places(
        self, joint_position: Sequence[float], points: Sequence[LinkPoint]
    ) -> tuple[tuple[float, ...], ...]:
        """Compute where points of the arm are in the base frame [m], without checks.

        Args:
            joint_position: (n,) controller-side [rad or m], finite.
            points: whose places are wanted.
        """
        model, data = self._model, self._data
        pin.forwardKinematics(model, data, self._expanded(np.array(joint_position)))
        places = []
        for frame, offset in points:
            placement = pin.updateFramePlacement(model, data, frame)
            place = placement.translation
            if offset is not None:
                place = place + placement.rotation.dot(offset)
            places.append(tuple(place.tolist()))
        return tuple(places)

    def tool_frame(self, tcp: Pose) -> ToolFrame:
        """Return a frame of the tool link by its pose there, for `tool_motion`."""
        origin = self.link_point(offset=tcp.position.tolist())
        if origin.offset is None and not any(tcp.quaternion.tolist()[:3]):
            return ToolFrame(origin, None)
        return ToolFrame(origin, pin.SE3(tcp.rotation, tcp.position))

    def tool_motion(
        self, joint_position: Array, joint_velocity: Array, tool: ToolFrame
    ) -> tuple[ToolPlace, float]:
        """Compute place and speed [m/s] of a frame of the tool in one pass, without checks.

        In plain floats and without a `Pose`: each state message of a cell asks for it.

        Args:
            joint_position: (n,) controller-side [rad or m], finite float64.
            joint_velocity: (n,) of it [rad/s or m/s].
            tool: whose place and speed are wanted.
        """
        (speed,) = self.point_speeds(joint_position, joint_velocity, (tool.origin,))
        placement = pin.updateFramePlacement(self._model, self._data, self._tool)
        if tool.placement is not None:
            placement = placement * tool.placement
        x, y, z, a, b, c, w = pin.SE3ToXYZQUATtuple(placement)
        # q and -q are one rotation; adding zero turns -0.0 into 0.0.
        sign = 1.0 if (w or a or b or c) > 0.0 else -1.0
        turn = sign * a + 0.0, sign * b + 0.0, sign * c + 0.0, sign * w + 0.0
        return ((x, y, z), turn), speed

    def places(self, joint_positions: Array, link: str | None = None) -> Places:
        """Compute where a link is at many joint positions, in the base frame, without checks.

        Args:
            joint_positions: (m, n) controller-side [rad or m], finite float64.
            link: a link of the chain; the tool link if None.

        Raises:
            FrameUnknown: there is no such link.
        """
        frame_id = self._tool if link is None else self._link(link)
        places = Places(np.empty((len(joint_positions), 3, 3)), np.empty((len(joint_positions), 3)))
        for row, joint_position in enumerate(joint_positions):
            pin.forwardKinematics(self._model, self._data, self._expanded(joint_position))
            placement = pin.updateFramePlacement(self._model, self._data, frame_id)
            places.rotation[row], places.position[row] = placement.rotation, placement.translation
        return places

    def to_base(self, pose: Pose, frame: str) -> Pose:
        """Express a pose given in `base` or `root` in the base frame.

        Raises:
            FrameUnknown: there is no such frame.
        """
        if not self._in_root(frame):
            return pose
        base = Pose.from_matrix(self._base.rotation, self._base.translation)
        return base.inverse().compose(pose)

    def _in_root(self, frame: str) -> bool:
        if frame not in FRAMES:
            raise FrameUnknown(frame, FRAMES)
        return frame == "root"

    def _link(self, link: str) -> int:
        if link not in self.robot.links:
            raise FrameUnknown(link, self.robot.links)
        frame_id: int = self._model.getFrameId(link)
        return frame_id

    def _checked(self, joint_position: Sequence[float] | Array) -> Array:
        vector = np.asarray(joint_position, dtype=np.float64)
        self.limits.check_finite(vector.tolist(), "the joint position")
        return vector

    def _model_vector(self, joint_position: Sequence[float] | Array) -> Array:
        return self._expanded(self._checked(joint_position))

    def _expanded(self, joint_position: Array) -> Array:
        if self.is_direct:
            return joint_position
        vector: Array = self._gain.dot(joint_position)
        return vector + self._offset if self._has_offset else vector


def rotation_vector(rotation: Array) -> Array:
    """Return the (3,) rotation vector [rad] of a (3, 3) rotation matrix, length 0 to π."""
    vector: Array = pin.log3(rotation)
    return vector


def _arm_size(robot: SerialRobot) -> float:
    lengths = sum(math.hypot(*joint.origin.xyz) for joint in robot.joints)
    return max(_SMALLEST_ARM, lengths / 2.0)


def _read_only(array: Array) -> Array:
    array.flags.writeable = False
    return array
