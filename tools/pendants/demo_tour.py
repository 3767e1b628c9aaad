"""The moves of the demonstration: single joints, a straight line of the tool, a taught path.

Owns which of them a robot is asked for. The tour knows a robot only by what the server tells and
refuses: of the lines and circles on its list it runs the first that the robot can do, from home or
with the arm bent, and says what it leaves out. So it suits six axes, a SCARA that cannot tilt its
tool, and an arm that can do no straight line at all.
"""

from __future__ import annotations

import math
from collections.abc import Awaitable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

from openpendant.simplemsg.pendant import Motion
from openpendant.simplemsg.pendant.management.cell import JointFacts
from openpendant.simplemsg.verdicts import VerdictCode

from .client import MotionHandle, Pose, Refused

SPEED = 0.3
"""Fraction of the joints' largest speed."""

TAUGHT_POSES = 8

JOINT_STEPS = {"rad": math.radians(12), "m": 0.05}
"""Distance of a single joint's move."""

_LEAST_ROOM = 0.4
"""Fraction of a narrow joint's range that a single move takes at most."""

LINE_LENGTHS = (0.08, 0.03)  # m
CIRCLE_RADII = (0.05, 0.02)  # m
BENDS = (0.15, 0.3)
"""Fractions of the room above or below home by which all joints but the first bend the arm: at
home it may be stretched out, where a tool can go along few lines."""

_BENDING = "bending the arm"

_DOWN, _UP = (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)
_FORTH, _BACK = (1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)
_LEFT, _RIGHT = (0.0, 1.0, 0.0), (0.0, -1.0, 0.0)
_LINES = (_DOWN, _UP, _LEFT, _BACK, _FORTH, _RIGHT)
_CIRCLES = ((_UP, _LEFT), (_UP, _FORTH), (_FORTH, _LEFT), (_BACK, _LEFT))

_CANNOT = frozenset(
    {
        VerdictCode.UNREACHABLE,
        VerdictCode.BRANCH_CHANGE,
        VerdictCode.OUT_OF_RANGE,
        VerdictCode.NOT_TIMEABLE,
        VerdictCode.START_IN_COLLISION,
        VerdictCode.GOAL_IN_COLLISION,
        VerdictCode.PATH_IN_COLLISION,
    }
)
"""Refusals that speak of this robot's geometry, so that another move may do."""


class TouringPendant(Protocol):
    """The calls of a pendant in control that the tour needs; see `PendantClient`."""

    def joints(self) -> Sequence[float]:
        """Return the (n,) joint position [rad or m]."""

    def tool_pose(self) -> Pose:
        """Return where the tool is."""

    async def move_joints(self, joints: Sequence[float], *, speed: float) -> MotionHandle:
        """Move to a (n,) joint position."""

    async def move_to_pose(self, pose: Pose, *, motion: Motion, speed: float) -> MotionHandle:
        """Move the tool to a pose."""

    async def follow_poses(self, poses: Sequence[Pose], *, speed: float) -> MotionHandle:
        """Move the tool through poses."""

    async def follow_joints(
        self, waypoints: Sequence[Sequence[float]], *, speed: float
    ) -> MotionHandle:
        """Move through joint positions, each (n,)."""


@dataclass
class TourReport:
    """Results of a tour.

    Attributes:
        motions: name, plan time [s] and motion time [s] of each motion.
    """

    robot: str = ""
    motions: list[dict[str, Any]] = field(default_factory=list)
    poses: int = 0
    left_out: list[str] = field(default_factory=list)


class Tour:
    """One tour with one robot."""

    def __init__(self, pendant: TouringPendant, joints: Sequence[JointFacts], robot: str) -> None:
        """Make a tour with a pendant in control of a robot with these joints."""
        self._pendant = pendant
        self._facts = joints
        self.report = TourReport(robot=robot)
        self.doing = "connecting"

    async def run(self) -> None:
        """Run the whole tour.

        Raises:
            PendantError: a move was aborted, or refused for another reason than the robot's
                geometry, or the connection ended.
        """
        home = list(self._pendant.joints())
        steps = await self._single_joints(home)
        if not await self._tool_moves(home):
            self._leave_out("a straight line of the tool: no such line is in its reach")
            await self._taught_positions(home, steps)
        self.doing = "done"

    async def _single_joints(self, home: list[float]) -> list[float]:
        """Move each joint away, then all back; return the (n,) steps that were possible."""
        steps = [0.0] * len(home)
        for index, joint in enumerate(self._facts):
            for step in _steps(joint, home[index]):
                target = [*home[:index], home[index] + step, *home[index + 1 :]]
                begun = self._pendant.move_joints(target, speed=SPEED)
                if await self._can(f"joint {joint['name']}", begun):
                    steps[index] = step
                    break
            else:
                self._leave_out(f"joint {joint['name']} alone: neither way is free from home")
        if any(steps):
            await self._do("back", self._pendant.move_joints(home, speed=SPEED))
        return steps

    async def _tool_moves(self, home: list[float]) -> bool:
        """Run a line and a taught path from home, or else with the arm bent."""
        for stance in (home, *_bent(self._facts, home)):
            if stance != home:
                begun = self._pendant.move_joints(stance, speed=SPEED)
                if not await self._can(_BENDING, begun):
                    continue
            start = self._pendant.tool_pose()
            goal = await self._straight_line(start)
            if goal is not None:
                await self._taught_poses(start, goal)
                return True
        if self.report.motions and self.report.motions[-1]["name"] == _BENDING:
            await self._do("back", self._pendant.move_joints(home, speed=SPEED))
        return False

    async def _straight_line(self, start: Pose) -> Pose | None:
        """Move the tool along the first line that the robot can do, and back; return its end."""
        for length in LINE_LENGTHS:
            for direction in _LINES:
                goal = _shifted(start, direction, length)
                line = self._pendant.move_to_pose(goal, motion=Motion.LIN, speed=SPEED)
                if await self._can("straight line", line):
                    back = self._pendant.move_to_pose(start, motion=Motion.LIN, speed=SPEED)
                    await self._do("straight line back", back)
                    return goal
        return None

    async def _taught_poses(self, start: Pose, line_end: Pose) -> None:
        """Run through poses without stopping: on the first circle that can be done.

        A robot that can do none runs to the end of its line and back.
        """
        for radius in CIRCLE_RADII:
            for first, second in _CIRCLES:
                poses = circle(start, first, second, radius)
                name = f"path of {len(poses)} taught poses"
                if await self._can(name, self._pendant.follow_poses(poses, speed=SPEED)):
                    self.report.poses = len(poses)
                    return
        self._leave_out("a circle of the tool: none is in its reach")
        poses = [line_end, start]
        self.report.poses = len(poses)
        begun = self._pendant.follow_poses(poses, speed=SPEED)
        await self._do(f"path of {len(poses)} taught poses", begun)

    async def _taught_positions(self, home: list[float], steps: Sequence[float]) -> None:
        """Run through joint positions near home, within the single moves that were possible."""
        if not any(steps):
            self._leave_out("a taught path: no joint may move from home")
            return
        phases = [2.0 * math.pi * number / TAUGHT_POSES for number in range(1, TAUGHT_POSES + 1)]
        path = [
            [
                at + step * (1.0 - math.cos(phase * (1 + index % 2))) / 2.0
                for index, (at, step) in enumerate(zip(home, steps, strict=True))
            ]
            for phase in phases
        ]
        self.report.poses = len(path)
        begun = self._pendant.follow_joints(path, speed=SPEED)
        await self._do(f"path of {len(path)} taught joint positions", begun)

    async def _can(self, name: str, begun: Awaitable[MotionHandle]) -> bool:
        """Run a motion unless the robot's geometry forbids it; return whether it was run."""
        self.doing = name
        try:
            motion = await begun
        except Refused as refused:
            if refused.code not in _CANNOT:
                raise
            return False
        await self._arrive(name, motion)
        return True

    async def _do(self, name: str, begun: Awaitable[MotionHandle]) -> None:
        """Run a motion that has to be possible."""
        self.doing = name
        await self._arrive(name, await begun)

    async def _arrive(self, name: str, motion: MotionHandle) -> None:
        result = await motion.done()
        self.report.motions.append(
            {"name": name, "plan_time": result.plan_time, "motion_time": result.motion_time}
        )

    def _leave_out(self, what: str) -> None:
        self.report.left_out.append(what)


def circle(
    start: Pose, first: Sequence[float], second: Sequence[float], radius: float
) -> list[Pose]:
    """Return poses on a circle that passes a pose and comes back to it.

    Args:
        start: the pose; all the others have its orientation.
        first: (3,) unit vector from the centre to the start.
        second: (3,) unit vector of travel at the start.
        radius: of the circle [m].
    """
    poses = []
    for number in range(1, TAUGHT_POSES + 1):
        angle = 2.0 * math.pi * number / TAUGHT_POSES
        out = _shifted(start, first, radius * (math.cos(angle) - 1.0))
        poses.append(_shifted(out, second, radius * math.sin(angle)))
    return poses


def _steps(joint: JointFacts, home: float) -> Iterator[float]:
    """Yield how far to move a joint from home: up if there is room, then down."""
    size = min(JOINT_STEPS[joint["unit"]], _LEAST_ROOM * (joint["upper"] - joint["lower"]))
    if joint["upper"] - home >= size:
        yield size
    if home - joint["lower"] >= size:
        yield -size


def _bent(joints: Sequence[JointFacts], home: Sequence[float]) -> Iterator[list[float]]:
    """Yield joint positions with the arm bent, each (n,): all joints but the first, by little."""
    for bend in BENDS:
        position = [home[0]]
        for joint, at in zip(joints[1:], home[1:], strict=True):
            above, below = joint["upper"] - at, at - joint["lower"]
            position.append(at + bend * above if above >= below else at - bend * below)
        yield position


def _shifted(pose: Pose, direction: Sequence[float], distance: float) -> Pose:
    """Return a pose moved along a (3,) unit vector [m]."""
    x, y, z = (at + distance * part for at, part in zip(pose.position, direction, strict=True))
    return Pose((x, y, z), pose.orientation, pose.frame)
