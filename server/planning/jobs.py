"""Questions to the planning process, and its answers; plain data that can be pickled."""

from __future__ import annotations

from dataclasses import dataclass, field

from openpendant.motion.certificate import Certificate
from openpendant.motion.frames import FrameTree
from openpendant.motion.scene import Scene
from openpendant.motion.trajectory import Trajectory
from openpendant.simplemsg.pendant import Motion

from ..programs.dry_run_results import DryRun, PointVerdict
from ..programs.linking import Linked
from ..programs.motion_blocks import MotionBlock
from ..programs.work import Done, ProgramRefused, Task
from ..refusal import Refusal
from ..world.offered_signals import Offer
from .pose_goal import PoseGoal
from .recording_job import PlaybackAccount, RecordingJob
from .way_check_job import WayCheckJob, WayFree

JointVector = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PoseJob:
    """Move the tool through one pose or several.

    Attributes:
        job_id: number of the job.
        start: (n,) where the robot stands, controller side [rad or m].
        goals: the poses in order.
        frame: name of their frame.
        motion: PTP passes them in joint space without stopping, LIN stops at each.
        speed: fraction of the joints' speed limits.
        tool_speed: largest speed of tool and elbow [m/s]; None for no cap.
        tool: tool centre point in the flange; None for the flange itself.
        scene: what the way must not touch, the robot itself included; None to check nothing.
    """

    job_id: int
    start: JointVector
    goals: tuple[PoseGoal, ...]
    frame: str
    motion: Motion
    speed: float
    tool_speed: float | None = None
    tool: PoseGoal | None = None
    scene: Scene | None = None


@dataclass(frozen=True, slots=True)
class JointPathJob:
    """Move through joint positions without stopping.

    Attributes:
        job_id: number of the job.
        start: (n,) where the robot stands, controller side [rad or m].
        waypoints: (n,) each, start excluded.
        speed: fraction of the joints' speed limits.
        tool_speed: largest speed of tool and elbow [m/s]; None for no cap.
        tool: tool centre point in the flange; None for the flange itself.
        scene: what the way must not touch, the robot itself included; None to check nothing.
    """

    job_id: int
    start: JointVector
    waypoints: tuple[JointVector, ...]
    speed: float
    tool_speed: float | None = None
    tool: PoseGoal | None = None
    scene: Scene | None = None


@dataclass(frozen=True, slots=True)
class RosPoint:
    """One point of a ROS-Industrial trajectory.

    Attributes:
        position: (n,) controller side [rad or m].
        min_duration: least time of the segment that ends here [s]; None where it was not given.
        speed_fraction: largest fraction of the joints' speed limits on that segment.
    """

    position: JointVector
    min_duration: float | None
    speed_fraction: float


@dataclass(frozen=True, slots=True)
class RosPathJob:
    """Follow a ROS-Industrial trajectory, never faster than it was asked.

    Attributes:
        job_id: number of the job.
        start: (n,) where the robot stands, controller side [rad or m].
        points: the points in order.
        approach_speed: fraction of the speed limits for getting to a first point elsewhere.
        approach_tolerance: a first point closer than this to where it stands needs no approach.
        scene: what the way must not touch, the robot itself included; None to check nothing.
    """

    job_id: int
    start: JointVector
    points: tuple[RosPoint, ...]
    approach_speed: float
    approach_tolerance: float
    scene: Scene | None = None


@dataclass(frozen=True, slots=True)
class BlockJob:
    """Run a block of a program's moves without a stop in between.

    Attributes:
        job_id: number of the job.
        start: (n,) where the robot stands, controller side [rad or m].
        block: the moves.
        lines: the line of each move in its program's text, for refusals.
        frames: the named frames and tools.
        speed: fraction of the programmed speeds.
        tool_speed: largest speed of tool and elbow [m/s]; None for no cap.
        scene: what the way must not touch, the robot itself included; None to check nothing.
    """

    job_id: int
    start: JointVector
    block: MotionBlock
    lines: tuple[int, ...]
    frames: FrameTree
    speed: float
    tool_speed: float | None = None
    scene: Scene | None = None


@dataclass(frozen=True, slots=True)
class DryRunJob:
    """Walk through a program without moving, for a slice of time.

    Attributes:
        job_id: number of the job.
        run_id: name of the dry run among all of the server; its slices share what was planned.
        start: (n,) where the robot stands at the start, controller side [rad or m].
        linked: the program with all that it calls.
        frames: the named frames and tools.
        tool_speed: largest speed of tool and elbow [m/s]; None for no cap.
        scene: what the ways must not touch, as it is now; None to check nothing.
        signals: which the controller has.
    """

    job_id: int
    run_id: str
    start: JointVector
    linked: Linked = field(repr=False)
    frames: FrameTree
    tool_speed: float | None = None
    scene: Scene | None = None
    signals: Offer = None


@dataclass(frozen=True, slots=True)
class ProgramJob:
    """Read, print or edit a program that is too large for the event loop; nothing moves.

    Attributes:
        job_id: number of the job.
        task: what to do.
        start: empty, as no robot stands anywhere for it.
    """

    job_id: int
    task: Task
    start: JointVector = ()


MotionJob = PoseJob | JointPathJob | RosPathJob | BlockJob | RecordingJob
Job = MotionJob | DryRunJob | WayCheckJob | ProgramJob


@dataclass(frozen=True, slots=True)
class DryRunSlice:
    """A dry run that is not done; the next slice of the same run goes on.

    Attributes:
        planned: blocks that were planned so far.
    """

    planned: int


@dataclass(frozen=True, slots=True)
class DryRunFound:
    """A dry run that is done.

    Attributes:
        run: what was found about each statement.
        points: whether each point of the main program can be reached.
        refused: how many statements and points cannot, those included that `dry_run_answer` cut
            off.
    """

    run: DryRun
    points: tuple[PointVerdict, ...]
    refused: int = 0


@dataclass(frozen=True, slots=True)
class Planned:
    """The answer to a job.

    Attributes:
        job_id: number of the job.
        result: of a motion, a trajectory with its certificate, or why there is none; of a dry
            run, what was found, or how far it is; of a look along the way, that it is free; of a
            task about a program, what was done, or what is wrong with the program.
        plan_time: wall time that planning took [s].
        playback: of a recording, what was asked and what is possible.
        took: from when a planning process was given the job to when its answer was read [s], which
            is longer where that process, niced as it is, waited for a processor; 0 if not measured.
    """

    job_id: int
    result: (
        tuple[Trajectory, Certificate]
        | Refusal
        | DryRunFound
        | DryRunSlice
        | WayFree
        | Done
        | ProgramRefused
    )
    plan_time: float
    playback: PlaybackAccount | None = None
    took: float = 0.0
