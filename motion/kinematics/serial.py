"""Kinematics of a serial robot: forward kinematics and Jacobians, with or without a tool.

Owns the use of the pinocchio model, which `pinocchio_model` builds, and the tool at the end of a
chain: the tool link of a robot with a tool is the tool centre point. Planning with its kinematics
leads the tool centre point along lines and circles, rotates about it, and returns its poses. Joint
vectors are the controller's; `pinocchio_model` has the map to the model's own. Besides these two
modules only `collision` uses pinocchio; no pinocchio type goes to any other module.

Frames: `base` is the controller's own base frame of the robot file, `root` the chain's root link;
a link is one of the chain, the tool link if None. A joint position is (n,) controller-side [rad or
m], a velocity (n,) [rad/s or m/s]. Limits are never checked; a method without checks wants finite
float64.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import pinocchio as pin

from ..description.limits import JointLimits
from ..description.robot import SerialRobot
from ..description.schema import FixedJoint, JointType, Placement
from ..errors import FrameUnknown
from ..pose import Array, Pose, PoseArray
from .pinocchio_model import base_in_root, model_map, serial_model, turning_joints

FRAMES = ("base", "root")

_SMALLEST_ARM = 0.1  # m


class LinkPoint(NamedTuple):
    """Point that is fixed to a link; `Kinematics.link_point` makes it.

    Attributes:
        frame: number of the link's frame in the model.
        offset: x, y, z in the link's frame [m]; None for its origin.
    """

    frame: int
    offset: tuple[float, float, float] | None


class ToolFrame(NamedTuple):
    """Frame that is fixed to the tool link; `Kinematics.tool_frame` makes it.

    Attributes:
        origin: its origin, as a point of the link.
        placement: in the link's frame, as the model has it; None for the link's frame itself.
    """

    origin: LinkPoint
    placement: Any


ToolPlace: TypeAlias = tuple[tuple[float, float, float], tuple[float, float, float, float]]
"""(3,) position [m] and (4,) quaternion x, y, z, w of norm 1, w not negative."""


class Kinematics:
    """Kinematics of one robot, for one thread: calls share scratch memory.

    Attributes:
        limits: limits of the driven joints, controller side.
        dof: number n of driven joints.
        lower: (n,) least controller-side joint position [rad or m], read-only.
        upper: (n,) greatest controller-side joint position [rad or m], read-only.
        turning: (n,) True if a full revolution of the joint leaves the tool where it was.
        is_direct: True if the model's vector is the controller-side one itself.
        size: a length of the order of the arm's reach [m], to weigh rotations against shifts.

    Raises:
        FrameUnknown: in every method, for a frame or a link that there is not.
        WrongJointCount, NotFinite: in `forward` and `jacobian`, not one finite value per joint.
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
        """Pinocchio model, its world being the base frame; for `collision` alone."""
        return self._model

    def forward(
        self, joint_position: Sequence[float] | Array, frame: str = "base", link: str | None = None
    ) -> Pose:
        """Return the pose of a link."""
        frame_id = self._tool if link is None else self._link(link)
        in_root = self._in_root(frame)
        pin.forwardKinematics(self._model, self._data, self._model_vector(joint_position))
        placement = pin.updateFramePlacement(self._model, self._data, frame_id)
        if in_root:
            placement = self._base * placement
        return Pose.from_matrix(placement.rotation, placement.translation)

    def jacobian(self, joint_position: Sequence[float] | Array, frame: str = "base") -> Array:
        """Return the derivative of the tool link's motion by the joints.

        Returns:
            (6, n): linear velocity of the tool's origin [m/s], then angular velocity [rad/s], per
            unit of controller-side joint velocity.
        """
        in_root = self._in_root(frame)
        _, _, jacobian = self.linearise(self._checked(joint_position))
        if not in_root:
            return jacobian
        rotation = self._base.rotation
        return np.vstack((rotation @ jacobian[:3], rotation @ jacobian[3:]))

    def linearise(self, joint_position: Array) -> tuple[Array, Array, Array]:
        """Return the tool's (3, 3) rotation, (3,) position and Jacobian in the base, unchecked."""
        model, data = self._model, self._data
        pin.computeJointJacobians(model, data, self._expanded(joint_position))
        # The frame placement is not refreshed by the Jacobian calls; a stale one would be read.
        placement = pin.updateFramePlacement(model, data, self._tool)
        full = pin.getFrameJacobian(model, data, self._tool, self._motion_axes)
        # `dot` takes half as long as `@` where the matrices are this small.
        jacobian = full if self.is_direct else full.dot(self._gain)
        return placement.rotation, placement.translation, jacobian

    def place(self, joint_position: Array) -> tuple[Array, Array]:
        """Return the tool's (3, 3) rotation and (3,) position in the base frame, without checks."""
        pin.forwardKinematics(self._model, self._data, self._expanded(joint_position))
        placement = pin.updateFramePlacement(self._model, self._data, self._tool)
        return placement.rotation, placement.translation

    def link_point(
        self, link: str | None = None, offset: Sequence[float] = (0.0, 0.0, 0.0)
    ) -> LinkPoint:
        """Return a point of a link by its (3,) offset in its frame [m], for `point_speeds`."""
        x, y, z = offset
        frame = self._tool if link is None else self._link(link)
        return LinkPoint(frame, (x, y, z) if x or y or z else None)

    def point_speeds(
        self, joint_position: Array, joint_velocity: Array, points: Sequence[LinkPoint]
    ) -> list[float]:
        """Return the speeds of points of the arm [m/s], without checks."""
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
        """Return the places of points of the arm in the base frame [m], without checks."""
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
        """Return pose and speed [m/s] of a frame of the tool in one pass, without checks.

        In plain floats and without a `Pose`: each state message of a cell needs it.
        """
        (speed,) = self.point_speeds(joint_position, joint_velocity, (tool.origin,))
        placement = pin.updateFramePlacement(self._model, self._data, self._tool)
        if tool.placement is not None:
            placement = placement * tool.placement
        x, y, z, a, b, c, w = pin.SE3ToXYZQUATtuple(placement)
        # q and -q are one rotation; adding zero makes -0.0 into 0.0.
        sign = 1.0 if (w or a or b or c) > 0.0 else -1.0
        turn = sign * a + 0.0, sign * b + 0.0, sign * c + 0.0, sign * w + 0.0
        return ((x, y, z), turn), speed

    def places(self, joint_positions: Array, link: str | None = None) -> PoseArray:
        """Return the poses of a link at many joint positions, in the base frame, without checks."""
        frame_id = self._tool if link is None else self._link(link)
        places = PoseArray(
            np.empty((len(joint_positions), 3, 3)), np.empty((len(joint_positions), 3))
        )
        for row, joint_position in enumerate(joint_positions):
            pin.forwardKinematics(self._model, self._data, self._expanded(joint_position))
            placement = pin.updateFramePlacement(self._model, self._data, frame_id)
            places.rotation[row], places.position[row] = placement.rotation, placement.translation
        return places

    def to_base(self, pose: Pose, frame: str) -> Pose:
        """Return a pose given in `base` or `root`, expressed in the base frame."""
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


_LINK = "tool_centre_point"

_UPRIGHT = 1e-9
"""Cosine of the pitch below which roll and yaw are about one axis."""


def with_tool(robot: SerialRobot, tcp: Pose) -> SerialRobot:
    """Return a robot with a tool: one more fixed joint, which ends at the tool centre point.

    Joints, limits and base frame are the same, so a joint position is one of both.

    Args:
        robot: the bare robot.
        tcp: the tool centre point in the frame of the robot's tool link.
    """
    link = _LINK
    while link in robot.links:
        link += "_"
    x, y, z = tcp.position.tolist()
    bolted = FixedJoint(
        type=JointType.FIXED,
        name=f"{link}_mount",
        parent=robot.tool_link,
        child=link,
        origin=Placement(xyz=(x, y, z), rpy=_roll_pitch_yaw(tcp.rotation)),
    )
    facts = {
        field.alias or name: getattr(robot, name)
        for name, field in SerialRobot.model_fields.items()
    }
    return SerialRobot(**facts | {"joints": (*robot.joints, bolted), "tool_link": link})


def _roll_pitch_yaw(rotation: Array) -> tuple[float, float, float]:
    """Return the angles about fixed x, y, z, in that order, that make a (3, 3) rotation [rad]."""
    (r00, _, _), (r10, r11, r12), (r20, r21, r22) = rotation.tolist()
    level = math.hypot(r00, r10)
    pitch = math.atan2(-r20, level)
    if level < _UPRIGHT:
        return math.atan2(-r12, r11), pitch, 0.0
    return math.atan2(r21, r22), pitch, math.atan2(r10, r00)
