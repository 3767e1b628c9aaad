"""The client's single motions: joint moves, poses, paths, home, and stored programs."""

from __future__ import annotations

from collections.abc import Sequence

from openpendant.simplemsg.pendant import (
    Home,
    JointMove,
    JointPath,
    JointWaypoint,
    Motion,
    PoseMove,
    PosePath,
    PoseWaypoint,
    ProgramRun,
    RunKind,
)

from .failures import WrongArgument
from .joint_values import slots
from .motions import MotionHandle, Pose
from .session import PendantSession


class Moves(PendantSession):
    """Motions; each returns once it was accepted and has begun, and its `done` tells the end."""

    async def move_joints(self, joints: Sequence[float], *, speed: float = 0.1) -> MotionHandle:
        """Move all joints in a straight joint line.

        Args:
            joints: (n,) target, controller side [rad, m for a linear axis].
            speed: fraction of the joints' largest speed, above 0, up to 1.

        Returns:
            The motion, accepted and begun; await its `done`.

        Raises:
            Refused: out of range, wrong joint count, not in control, robot busy, …
            WrongArgument: more joints than a message has room for.
            ConnectionLost: the connection ended.
        """
        target = slots(joints)
        return await self._begin(
            lambda request_id: JointMove(
                request_id=request_id, speed=speed, joint_count=len(joints), joints=target
            )
        )

    async def move_to_pose(
        self, pose: Pose, *, motion: Motion = Motion.PTP, speed: float = 0.1
    ) -> MotionHandle:
        """Move the tool to a pose, by PTP or in a straight line (`Motion.LIN`).

        Raises:
            Refused: unreachable, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        return await self._begin(
            lambda request_id: PoseMove(
                request_id=request_id,
                motion=motion,
                speed=speed,
                frame=pose.frame,
                position=pose.position,
                orientation=pose.orientation,
            )
        )

    async def follow_joints(
        self, waypoints: Sequence[Sequence[float]], *, speed: float = 0.1
    ) -> MotionHandle:
        """Move through joint positions without stopping; where the robot stands is implied.

        Raises:
            Refused: out of range, not in control, robot busy, …
            WrongArgument: no waypoints, or waypoints of different lengths.
            ConnectionLost: the connection ended.
        """
        counts = {len(point) for point in waypoints}
        if len(counts) != 1:
            raise WrongArgument(f"the waypoints of one path hold {sorted(counts)} joints each")
        path = tuple(JointWaypoint(joints=slots(point)) for point in waypoints)
        return await self._begin(
            lambda request_id: JointPath(
                request_id=request_id, speed=speed, joint_count=counts.pop(), waypoints=path
            )
        )

    async def follow_poses(
        self, poses: Sequence[Pose], *, motion: Motion = Motion.PTP, speed: float = 0.1
    ) -> MotionHandle:
        """Move the tool through poses: PTP passes them without stopping, LIN stops at each.

        Raises:
            WrongArgument: no poses, or poses in several frames.
            Refused: a pose is unreachable, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        frames = {pose.frame for pose in poses}
        if len(frames) != 1:
            raise WrongArgument(f"the poses of one path need one frame, not {sorted(frames)}")
        path = tuple(
            PoseWaypoint(position=pose.position, orientation=pose.orientation) for pose in poses
        )
        return await self._begin(
            lambda request_id: PosePath(
                request_id=request_id,
                motion=motion,
                speed=speed,
                frame=frames.pop(),
                waypoints=path,
            )
        )

    async def home(self, target: str = "home", *, speed: float = 0.1) -> MotionHandle:
        """Move all joints to a named position of the robot, `home` or `zero`.

        Raises:
            Refused: the robot may not stand there, not in control, robot busy, …
            ConnectionLost: the connection ended.
        """
        return await self._begin(
            lambda request_id: Home(request_id=request_id, speed=speed, target=target)
        )

    async def run_program(
        self,
        name: str,
        *,
        run: RunKind = RunKind.ALL,
        line: int = 0,
        loops: int = 1,
        speed: float = 1.0,
        revision: int = 0,
    ) -> MotionHandle:
        """Run a stored program, or one step of it; `done` tells when that has ended.

        Args:
            name: of the program.
            run: all of it, or one step forward or backward.
            line: line to begin at; 0 for where it stands, or the first.
            loops: how often; 0 for until it is stopped.
            speed: fraction of the programmed speeds, above 0, up to 1.
            revision: the only one that may be run, as the pendant shows it, from 1; 0 for the
                newest. In a run that is paused: the one that it began with; 0 for whichever.

        Returns:
            The run, accepted and begun.

        Raises:
            Refused: REVISION_CONFLICT, another revision is kept, or is under way; nobody knows the
                program, it cannot run from there, not in control, …
            ConnectionLost: the connection ended.
        """
        return await self._begin(
            lambda request_id: ProgramRun(
                request_id=request_id,
                run=run,
                line=line,
                loops=loops,
                revision=revision,
                speed=speed,
                program=name,
            )
        )
