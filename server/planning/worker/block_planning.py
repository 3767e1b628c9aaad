"""Block planning: a certified, collision-checked trajectory from a block of a program's moves.

Owns the present place of a taught point: its joints while these put its tool where its pose says,
else its pose, reached in its own configuration. So a point of a user frame moves with the frame,
and one taught with a tool that was measured again keeps its place. Lines and circles are those of
the tool centre point with which the points were taught. Owns the speeds of the moves.

Owns which of a point's two descriptions makes a segment: a point of the robot's own frames goes to
its joints, which also give the arm's configuration; a point of a user's frame goes to its pose,
because the frame may have moved since. A via point's pose, else the place of its joints, gives a
circle.

Owns the refusal of a contact, for every motion: before it starts, and while it runs in a scene that
changes. All of this runs in the planning process, because it takes milliseconds: a motion of ten
minutes is checked in about 1 s, one of a few seconds in about 10 ms.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TypeAlias

import numpy as np

from openpendant.motion.errors import (
    MotionError,
    NoMotion,
    PathInCollision,
    SegmentRefused,
    StartInCollision,
    ZoneTooLarge,
)
from openpendant.motion.frames.frame_tree import BASE, FLANGE, TOOL, FrameTree
from openpendant.motion.kinematics.ik.configuration import Configuration, Elbow, Shoulder, Wrist
from openpendant.motion.kinematics.ik.ik import solve
from openpendant.motion.kinematics.serial import Kinematics, with_tool
from openpendant.motion.paths.paths import plan_path
from openpendant.motion.paths.segments import (
    Circ,
    Lin,
    Ptp,
    Segment,
    SegmentRule,
    Spline,
    SplineSpace,
    Target,
    ThroughPoint,
)
from openpendant.motion.planning.path_check import first_contact
from openpendant.motion.pose import Array, Pose
from openpendant.motion.scene.collision import CollisionModel
from openpendant.motion.scene.scene import Scene
from openpendant.motion.timing.parameterization import time_path
from openpendant.motion.trajectory.certificate import Certificate, certify
from openpendant.motion.trajectory.joint_curves import Path
from openpendant.motion.trajectory.point_speed import ToolSpeedLimit, reduced_speed, tool_point
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.simplemsg.pendant.management.program_values import (
    ArmConfiguration,
    PointPose,
    TeachPoint,
)
from openpendant.simplemsg.pendant.management.statements import SpeedKind, Way

from ...programs.interpreter.motion_blocks import BlockMove, MotionBlock
from ...programs.language.point_poses import check_consistency, pose_of
from ...programs.language.program_errors import PointInconsistent
from ...refusal import Refusal, refusal_of
from ..jobs import BlockJob, JointVector, PathFree, WayCheckJob

OWN_FRAMES = frozenset({"base", "root"})
"""Frames of the robot, which never move."""

ToBase: TypeAlias = Callable[[PointPose], Pose]
"""Returns the pose of the planner's tool in the base frame for a pose of a tool in a frame."""

Forward: TypeAlias = Callable[[JointVector], Pose]
"""Returns the pose of the planner's tool in the base frame for a joint position."""


def segments_of(block: MotionBlock, to_base: ToBase, forward: Forward) -> list[Segment]:
    """Return the segments of a block, one for each move.

    Args:
        block: the moves; their speeds are not in the segments.

    Raises:
        MotionError: a frame or a tool is unknown.
    """
    return [_segment(move, to_base, forward) for move in block.moves]


def _segment(each: BlockMove, to_base: ToBase, forward: Forward) -> Segment:
    target, zone = _target(each.target, to_base), each.move.zone
    match each.move.way:
        case Way.PTP:
            return Ptp(target, zone=zone)
        case Way.LIN:
            return Lin(target, zone=zone)
        case Way.CIRC:
            via = _target(each.via[0], to_base)
            pose = via if isinstance(via, Pose) else forward(each.via[0].joints)
            return Circ(ThroughPoint(pose.position), target, zone=zone)
        case Way.SPLINE:
            through = [_target(point, to_base) for point in each.via]
            return Spline([*through, target], SplineSpace.JOINTS)


def _target(point: TeachPoint, to_base: ToBase) -> Target:
    if point.pose is None or point.pose.frame in OWN_FRAMES:
        return point.joints
    return to_base(point.pose)


_SAME_PLACE = 1e-6
_SAME_TURN = 1e-5
_KNOT = 1e-9


class BlockFault(Exception):
    """Block that cannot be planned.

    Attributes:
        place: the move at fault, by its place in the block.
    """

    def __init__(self, place: int, error: MotionError) -> None:
        super().__init__(str(error))
        self.place, self.error = place, error

    @property
    def is_standing(self) -> bool:
        """True if the robot already stands at the target, so that there is no fault."""
        return isinstance(self.error, NoMotion)


@dataclass(frozen=True, slots=True)
class LegSpeedLimit(ToolSpeedLimit):
    """Speed limit of a point of the arm on one stretch of a path, and none elsewhere.

    Attributes:
        begins: path position of its start.
        ends: path position of its end.
    """

    begins: float = 0.0
    ends: float = 0.0

    def slope(self, path: Path, s: Array) -> Array:
        """Return the (m,) |dp/ds| at path positions s (m,), 0 away from the stretch."""
        # Without zero arguments, because a dataclass with slots is not the class it was written as.
        everywhere = ToolSpeedLimit.slope(self, path, s)
        slack = _KNOT * path.length
        inside = (s >= self.begins - slack) & (s <= self.ends + slack)
        return np.where(inside, everywhere, 0.0)


class Places:
    """Places of points, frames and tools of one cell."""

    def __init__(self, kinematics: Kinematics, frames: FrameTree) -> None:
        self._kinematics = kinematics
        self._frames = frames

    def forward(self, joints: JointVector, frame: str, tool: str) -> Pose:
        """Return where joints put a tool in a frame.

        Raises:
            FrameUnknown: there is no such frame or tool, or the frame moves.
        """
        at_base = self._frames.transform(BASE, frame)
        tip = self._frames.transform(tool, FLANGE)
        return at_base.compose(self._kinematics.forward(joints)).compose(tip)

    def flange(self, pose: PointPose) -> Pose:
        """Return where the flange has to be in the base frame for a pose.

        Raises:
            FrameUnknown: there is no such frame or tool, or the frame moves.
        """
        tip = self._frames.transform(pose.tool, FLANGE)
        return (
            self._frames.transform(pose.frame, BASE).compose(pose_of(pose)).compose(tip.inverse())
        )

    def tool(self, point: TeachPoint | None = None) -> Pose:
        """Return a point's tool in the flange; the selected one for a point without a pose.

        Raises:
            FrameUnknown: there is no such tool.
        """
        tool = TOOL if point is None or point.pose is None else point.pose.tool
        return self._frames.transform(tool, FLANGE)

    def tip(self, point: TeachPoint | None = None) -> tuple[float, ...]:
        """Return x, y, z of a point's tool, as of `tool` [m]."""
        return tuple(self.tool(point).position.tolist())

    def leading(self, moves: Sequence[BlockMove]) -> Kinematics:
        """Return the kinematics whose tool is that of a block, which has but one.

        Raises:
            FrameUnknown: there is no such tool.
        """
        tool = self.tool(next((m.target for m in moves if m.target.pose is not None), None))
        return Kinematics(with_tool(self._kinematics.robot, tool))

    def joints(self, point: TeachPoint) -> JointVector:
        """Return the joints that a point stands for.

        Raises:
            MotionError: its frame or tool is unknown, or its pose cannot be reached.
        """
        if point.pose is None:
            return point.joints
        try:
            check_consistency(
                point,
                self.forward,
                position_tolerance=_SAME_PLACE,
                rotation_tolerance=_SAME_TURN,
            )
        except PointInconsistent:
            solution = solve(
                self._kinematics,
                self.flange(point.pose),
                point.joints,
                configuration=_flags(point.configuration),
            )
            return tuple(solution.joint_position.tolist())
        return point.joints

    def check(self, point: TeachPoint) -> None:
        """Refuse a point that the robot cannot stand at.

        Raises:
            MotionError: its frame or tool is unknown, its pose cannot be reached, or a joint would
                be outside its range.
        """
        self._kinematics.limits.check_position(self.joints(point))

    def resolved(self, move: BlockMove) -> BlockMove:
        """Return a move whose points are said by joints alone.

        Raises:
            MotionError: a point cannot be reached.
        """
        return replace(
            move,
            target=self._settled(move.target),
            via=tuple(self._settled(point) for point in move.via),
        )

    def _settled(self, point: TeachPoint) -> TeachPoint:
        return replace(point, joints=self.joints(point), pose=None)


def plan_block(
    kinematics: Kinematics,
    start: JointVector,
    block: MotionBlock,
    frames: FrameTree,
    speed: float,
    cap: float | None,
) -> tuple[Trajectory, Certificate]:
    """Plan and certify the moves of a block from where the robot stands.

    Args:
        start: (n,) controller side [rad or m].
        speed: fraction of the programmed speeds.
        cap: largest speed of tool and elbow [m/s]; None for no cap.

    Raises:
        BlockFault: a move cannot be made.
    """
    places = Places(kinematics, frames)
    moves: list[BlockMove] = []
    for place, move in enumerate(block.moves):
        try:
            moves.append(places.resolved(move))
        except MotionError as error:
            raise BlockFault(place, error) from error
    try:
        tooled = places.leading(block.moves)
        segments = segments_of(MotionBlock(tuple(moves)), places.flange, tooled.forward)
        (path,) = plan_path(tooled, start, segments)
        caps = _speed_limits(kinematics, places, block.moves, path, speed, cap)
        rules = [SegmentRule(speed_fraction=_fraction(move)) for move in _by_leg(block.moves, path)]
        limits = kinematics.limits
        trajectory = time_path(path, limits, speed=speed, segments=rules, tool_speed=caps)
        # The limit of a leg does not hold on the whole path, so samples alone are not held to it.
        plain = [each for each in caps if not isinstance(each, LegSpeedLimit)]
        return trajectory, certify(trajectory, limits, start=start, tool_speed=plain)
    except SegmentRefused as error:
        raise BlockFault(error.segment, error.reason) from error
    except ZoneTooLarge as error:
        raise BlockFault(error.waypoint, error) from error
    except MotionError as error:
        raise BlockFault(0, error) from error


def plan_block_job(
    kinematics: Kinematics, job: BlockJob
) -> tuple[Trajectory, Certificate] | Refusal:
    """Return the certified trajectory of a job's block, or the refusal of the move at fault."""
    try:
        return plan_block(kinematics, job.start, job.block, job.frames, job.speed, job.tool_speed)
    except BlockFault as fault:
        if fault.is_standing:
            return refusal_of(fault.error)
        return placed_refusal(fault, job.block.moves[fault.place], job.lines[fault.place])


def placed_refusal(fault: BlockFault, move: BlockMove, line: int) -> Refusal:
    """Return the refusal of a move, with program, line and point named."""
    refusal = refusal_of(fault.error)
    where = f"{move.program}, line {line}, point {move.target.name}"
    return replace(refusal, text=f"{where}: {refusal.sentence}")


def _by_leg(moves: Sequence[BlockMove], path: Path) -> list[BlockMove]:
    """Return the move of each way between two waypoints; a spline is one move through several."""
    legs = len(path.waypoint_knots) - 1
    return list(moves) if legs == len(moves) else [moves[0]] * legs


def _fraction(move: BlockMove) -> float:
    speed = move.move.speed
    return speed.value if speed.kind is SpeedKind.FRACTION else 1.0


def _speed_limits(
    kinematics: Kinematics,
    places: Places,
    moves: Sequence[BlockMove],
    path: Path,
    speed: float,
    cap: float | None,
) -> list[ToolSpeedLimit]:
    """Return the cap of the mode on every tool of the block, and the tool speeds of its moves."""
    found: list[ToolSpeedLimit] = []
    if cap is not None:
        tips = [places.tip(), *(places.tip(move.target) for move in moves)]
        for tip in dict.fromkeys(tips):
            found += reduced_speed(kinematics, cap, tool=tip)
    ends = path.knots[path.waypoint_knots]
    for place, move in enumerate(_by_leg(moves, path)):
        asked = move.move.speed
        if asked.kind is SpeedKind.TOOL:
            point = tool_point(kinematics, places.tip(move.target))
            begins, end = float(ends[place]), float(ends[place + 1])
            found.append(
                LegSpeedLimit("tool", point, asked.value * speed, "m/s", begins=begins, ends=end)
            )
    return found


def _flags(configuration: ArmConfiguration | None) -> Configuration | None:
    if configuration is None:
        return None
    return Configuration(
        Shoulder(configuration.shoulder),
        Elbow(configuration.elbow),
        Wrist(configuration.wrist),
        # The nearest to the taught joints is meant, wherever a moved frame has put the pose.
        turns=None,
    )


def collision_on(kinematics: Kinematics, positions: Array, scene: Scene) -> Refusal | None:
    """Return why a motion may not be made; None where nothing touches on its way.

    Args:
        positions: (m, n) its samples, controller side; straight lines join them [rad or m].

    Raises:
        MotionError: the scene does not fit the robot.
    """
    contact = first_contact(collision_model(kinematics, scene), positions)
    if contact is None:
        return None
    if contact.fraction == 0.0:
        return refusal_of(StartInCollision(contact.first, contact.second, contact.distance))
    return refusal_of(
        PathInCollision(contact.first, contact.second, contact.distance, contact.fraction)
    )


def check_running(kinematics: Kinematics, job: WayCheckJob) -> Refusal | PathFree:
    """Return True if the rest of a motion that runs is free in a scene that has changed."""
    positions = np.frombuffer(job.positions, dtype="<f8").reshape(-1, kinematics.dof)
    return collision_on(kinematics, positions, job.scene) or PathFree()


@lru_cache(maxsize=8)
def collision_model(kinematics: Kinematics, scene: Scene) -> CollisionModel:
    """Return the model of a robot in a scene, built at the first look; the last ones are kept.

    Raises:
        MotionError: the scene does not fit the robot.
    """
    return CollisionModel(kinematics, scene)
