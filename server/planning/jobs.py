"""Jobs of the planning processes, their answers, and their form in the pipe to such a process.

Owns the fields of each job and answer, and of what they hold: `CertifiedTrajectory`, a trajectory
with the proof that it keeps to the limits; `PoseGoal`, a pose to reach or the tool in the flange;
`PlaybackPlan`, the figures of a playback for its reply; `PlanFacts`, those of a plan that is
looked at before it is executed. `RecordingJob` alone carries samples; `WayCheckJob` checks the
rest of a motion in progress; `KinematicsQuestion` and `ShapesQuestion` plan
nothing. Plain data that can be pickled.

In a job `start` is (n,) where the robot stands, controller side [rad or m]; `tool_speed` the
largest speed of tool and elbow [m/s], None for no cap; `tool` the tool centre point in the flange,
None for the flange itself; `scene` what the way must not touch, the robot itself included, None to
check nothing.

A job goes through the pipe as a question: the length of a pickle, the pickle, and behind it the
samples of a recording, whose size is in the pickle. These may be tens of megabytes, so nothing here
joins or copies them as a whole on the event loop: `planning_process` writes them a piece at a time,
and the loop does other work in between. The samples of a planned motion come back in the same way,
behind the pickle of the answer.
"""

from __future__ import annotations

import pickle
import struct
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import lru_cache
from typing import Any, BinaryIO, Protocol

from openpendant.motion.frames.frame_tree import FrameTree
from openpendant.motion.scene.scene import Scene
from openpendant.motion.trajectory.certificate import Certificate, StraightCertificate
from openpendant.motion.trajectory.ptp import StraightMove
from openpendant.motion.trajectory.trajectory import Trajectory
from openpendant.simplemsg.pendant import Motion
from openpendant.simplemsg.pendant.management.declaration import Request
from openpendant.simplemsg.pendant.management.kinematics import Question
from openpendant.simplemsg.pendant.management.shapes import ShapeQuestion
from openpendant.simplemsg.verdicts import VerdictCode

from ..programs.editing.program_tasks import Done, ProgramRefused, Task
from ..programs.interpreter.dry_run_results import DryRunResult, PointFinding
from ..programs.interpreter.motion_blocks import MotionBlock
from ..programs.interpreter.run_events import Offer
from ..programs.language.linking import Linked
from ..refusal import Refusal
from ..store.recording_format import Extract


@dataclass(frozen=True, slots=True)
class CertifiedTrajectory:
    """Trajectory with the proof that it may be executed.

    Attributes:
        trajectory: the samples, or the few numbers that define all of them.
        certificate: result of the independent checker; stored with an executed motion.
    """

    trajectory: Trajectory | StraightMove
    certificate: Certificate | StraightCertificate


@dataclass(frozen=True, slots=True)
class PoseGoal:
    """Tool pose to reach.

    Attributes:
        position: x, y, z [m].
        orientation: quaternion x, y, z, w; normalised by the planner.
    """

    position: tuple[float, ...]
    orientation: tuple[float, ...]


APPROACH_SPEED = 0.1
"""Greatest speed towards the first sample, of the joints' limits."""

TOLERANCES = (0.002, 0.005, 0.01)
"""Tried in turn where none is asked for: reports of a busy controller come unevenly [rad or m]."""


@dataclass(frozen=True, slots=True)
class RecordingJob:
    """Job: play a recording back.

    Attributes:
        name: of the recording, for refusals.
        samples: its rows in pieces of whole rows, 8-byte little-endian reals; in pieces, because
            they are too many to be handled at once. May start before and end after the part.
        period: time between its reports [s].
        factor: speed relative to the recording.
        tolerance: how far the path may lie from a sample in any joint [rad or m]; None for the
            first of `TOLERANCES` that it can keep.
        begins: first time of the recording that is played [s].
        ends: last time [s]; None for its end.
        repeats: how many times it is played.
        bridge: longest gap that is played across, in a smooth line [s].
    """

    job_id: int
    start: tuple[float, ...]
    name: str
    samples: tuple[bytes, ...] = field(repr=False)
    extract: Extract
    period: float
    factor: float = 1.0
    tolerance: float | None = None
    begins: float = 0.0
    ends: float | None = None
    repeats: int = 1
    bridge: float = 0.25
    tool_speed: float | None = None
    tool: PoseGoal | None = None
    scene: Scene | None = None


@dataclass(frozen=True, slots=True)
class PlaybackPlan:
    """Requested and possible figures of a playback.

    Attributes:
        samples: rows that are played.
        recorded: how long their recording took [s].
        asked: how long playing them once was to take [s].
        possible: how long it takes under the limits [s].
        approach: time of the soft way to the first sample [s]; 0 where the robot stands there.
        total: time of the whole motion, repeats and ways back included [s].
        deviation: greatest distance of a sample from the path, in any joint [rad or m].
        dropped: rows whose time did not advance.
        gaps: gaps that are played across.
        longest_gap: the longest of them [s].
    """

    samples: int
    recorded: float
    asked: float
    possible: float
    approach: float
    total: float
    deviation: float
    dropped: int
    gaps: int
    longest_gap: float

    @property
    def factor(self) -> float:
        """Speed relative to the recording that is possible."""
        return self.recorded / self.possible


@dataclass(frozen=True, slots=True)
class WayCheckJob:
    """Job: check the rest of a motion in progress against a scene that was changed.

    Attributes:
        start: (n,) the first of the positions, controller side [rad or m].
        positions: (m, n) of them in the order of the motion, 8-byte little-endian reals.
    """

    job_id: int
    start: tuple[float, ...]
    positions: bytes = field(repr=False)
    scene: Scene


@dataclass(frozen=True, slots=True)
class PathFree:
    """Answer of a check without contact."""


JointVector = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class PoseJob:
    """Job: move the tool through one pose or several.

    Attributes:
        frame: name of their frame.
        motion: PTP passes them in joint space without stopping, LIN stops at each.
        speed: fraction of the joints' speed limits.
    """

    job_id: int
    start: JointVector
    goals: Sequence[PoseGoal]
    frame: str
    motion: Motion
    speed: float
    tool_speed: float | None = None
    tool: PoseGoal | None = None
    scene: Scene | None = None


@dataclass(frozen=True, slots=True)
class JointPathJob:
    """Job: move through joint positions without stopping.

    Attributes:
        waypoints: (n,) each, start excluded.
        speed: fraction of the joints' speed limits.
    """

    job_id: int
    start: JointVector
    waypoints: Sequence[JointVector]
    speed: float
    tool_speed: float | None = None
    tool: PoseGoal | None = None
    scene: Scene | None = None


@dataclass(frozen=True, slots=True)
class RosPoint:
    """Point of a ROS-Industrial trajectory.

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
    """Job: follow a ROS-Industrial trajectory, never faster than asked.

    Attributes:
        approach_speed: fraction of the speed limits for getting to a first point elsewhere.
        approach_tolerance: a first point closer than this to where it stands needs no approach.
    """

    job_id: int
    start: JointVector
    points: tuple[RosPoint, ...]
    approach_speed: float
    approach_tolerance: float
    scene: Scene | None = None


@dataclass(frozen=True, slots=True)
class BlockJob:
    """Job: run a block of a program's moves without a stop in between.

    Attributes:
        lines: the line of each move in its program's text, for refusals.
        speed: fraction of the programmed speeds.
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
    """Job: walk through a program without moving, for a slice of time.

    Attributes:
        run_id: name of the dry run among all of the server; its slices share what was planned.
        samples: whether the motions are wanted, too; in the journal the answer has them.
    """

    job_id: int
    run_id: str
    start: JointVector
    linked: Linked = field(repr=False)
    frames: FrameTree
    tool_speed: float | None = None
    scene: Scene | None = None
    signals: Offer = None
    samples: bool = field(default=False, repr=False)


@dataclass(frozen=True, slots=True)
class ProgramJob:
    """Job: read, print or edit a program that is too large for the event loop; nothing moves.

    Attributes:
        start: empty, as no robot stands anywhere for it.
    """

    job_id: int
    task: Task
    start: JointVector = ()


@dataclass(frozen=True, slots=True)
class ReadBody:
    """Job: read what a client asks, which is too large for the event loop; nothing moves.

    Attributes:
        session: the connection that it came on; those of a server take turns.
        body: JSON.
        read: a function of a module, which returns the operation and the request, or what is wrong
            with it; named here because it belongs to a room that this one must not know.
        start: empty, as no robot stands anywhere for it.
    """

    job_id: int
    session: int
    body: bytes = field(repr=False)
    read: Callable[[bytes], tuple[str, Request[Any] | Refusal]] = field(repr=False)
    start: JointVector = ()


@dataclass(frozen=True, slots=True)
class KinematicsQuestion:
    """Job: forward kinematics, a Jacobian or inverse kinematics; nothing moves.

    Attributes:
        session: the connection that asks; those of a server take turns.
        start: (n,) the joint position that is asked about, or the seed.
        frames: where the question names one that is not the robot's own, or a tool.
        tool: the selected tool's centre point in the flange; None for the flange itself.
        scene: where contacts are wanted.
    """

    job_id: int
    session: int
    asked: Question
    start: JointVector
    frames: FrameTree | None = field(default=None, repr=False)
    tool: PoseGoal | None = None
    scene: Scene | None = field(default=None, repr=False)


@dataclass(frozen=True, slots=True)
class FreePath:
    """A motion around what stands in the scene, found by a planner that draws numbers.

    Attributes:
        goal: (n,) joints, or the pose of the tool in base.
        planner: its name.
        seed: the same number gives the same path.
        time_limit: longest search [s].
        margin: distance that the search keeps from bodies [m].
    """

    start: JointVector
    goal: JointVector | PoseGoal
    planner: str
    seed: int
    time_limit: float
    margin: float
    speed: float
    tool_speed: float | None = None
    tool: PoseGoal | None = None


@dataclass(frozen=True, slots=True)
class PlanJob:
    """Job: plan a motion that is looked at before it is executed, if at all.

    Attributes:
        motion: what is planned, without a scene of its own, and with poses as they were given.
        place: the frame of the poses, in base; None for base itself.
        branch: for a motion to one pose in joint space, which of the joint positions that reach it,
            from 1, the nearest to the start first; None for the one that the arm finds.
    """

    job_id: int
    start: JointVector
    motion: PoseJob | JointPathJob | FreePath
    branch: int | None = None
    scene: Scene | None = None
    place: PoseGoal | None = None


@dataclass(frozen=True, slots=True)
class ShapesQuestion:
    """Job: what a robot looks like, or some bytes of a mesh; nothing moves.

    Attributes:
        session: the connection that asks; those of a server take turns.
        start: empty, as no robot stands anywhere for it.
    """

    job_id: int
    session: int
    asked: ShapeQuestion
    start: JointVector = ()


MotionJob = PoseJob | JointPathJob | RosPathJob | BlockJob | RecordingJob
Job = (
    MotionJob
    | PlanJob
    | DryRunJob
    | WayCheckJob
    | ProgramJob
    | ReadBody
    | KinematicsQuestion
    | ShapesQuestion
)


def is_search(job: Job) -> bool:
    """Return True if a job may take seconds: a plan around obstacles."""
    return isinstance(job, PlanJob) and isinstance(job.motion, FreePath)


@dataclass(frozen=True, slots=True, eq=False)
class BodyRead:
    """Answer of `ReadBody`.

    Attributes:
        operation: what the body names; empty for nothing.
    """

    operation: str
    asked: Request[Any] | Refusal


@dataclass(frozen=True, slots=True)
class KinematicsFound:
    """Answer of a question on kinematics.

    Attributes:
        body: the reply, a JSON object; made where it was found, since it may be 40 kB.
    """

    body: str


@dataclass(frozen=True, slots=True)
class ShapesFound:
    """Answer of a question on shapes.

    Attributes:
        body: the reply, a JSON object.
    """

    body: str


@dataclass(frozen=True, slots=True)
class DryRunSlice:
    """Answer of a dry run that is not done; the next slice of the same run continues."""

    planned: int


@dataclass(frozen=True, slots=True)
class DryRunFound:
    """Answer of a dry run that is done.

    Attributes:
        points: True if each point of the main program can be reached.
        refused: how many statements and points cannot, those included that were cut off.
    """

    run: DryRunResult
    points: tuple[PointFinding, ...]
    refused: int = 0


@dataclass(frozen=True, slots=True)
class WorstRatio:
    """Greatest value of one quantity in a motion.

    Attributes:
        name: of the joint, or of the point of the arm.
        ratio: to its limit, 1 being on the limit.
        at: when [s].
    """

    name: str
    quantity: str
    ratio: float
    at: float


@dataclass(frozen=True, slots=True)
class LeastClearance:
    """Where on a motion an object of the scene and another body come nearest.

    Attributes:
        distance: how near [m].
        at: when [s].
    """

    distance: float
    first: str
    second: str
    at: float


@dataclass(frozen=True, slots=True)
class PlanFacts:
    """What is told of a plan beside its samples.

    Attributes:
        planner: what found the path.
        seed: of a planner that draws numbers; 0 for others.
        end: the tool at the end, in base.
        margin: least distance of a joint from the end of its range [rad or m].
        nearest: None where the scene has no object.
    """

    planner: str
    seed: int
    end: PoseGoal
    margin: float
    worst: tuple[WorstRatio, ...]
    nearest: LeastClearance | None


class SearchStage(StrEnum):
    """Stage of a plan around obstacles."""

    SEARCHING = "searching"
    SHORTENING = "shortening"
    CHECKING = "checking"


@dataclass(frozen=True, slots=True)
class SearchProgress:
    """Word on a plan that is being made; its answer is still to come.

    Attributes:
        fraction: of the time that the search may take, 0 to 1.
    """

    stage: SearchStage
    fraction: float


@dataclass(frozen=True, slots=True)
class PlanAnswer:
    """Answer to a job.

    Attributes:
        result: of a motion, a trajectory with its certificate, or why there is none; of a dry
            run, its findings, or its progress; of a check of the remaining path, that it is free,
            or why not; of a task about a program, its result, or what is wrong with the program;
            of a body, what was read; of a question on kinematics or shapes, its reply; of a plan,
            meanwhile, how far it has come.
        plan_time: wall time that planning took [s].
        playback: of a recording, what was asked and what is possible.
        facts: of a plan, what is told beside its samples.
        preview: of a dry run whose samples are wanted, its motions one behind the other; None where
            they are too long, or there are none.
        took: from when a planning process was given the job to when its answer was read [s], which
            is longer where that process, niced as it is, waited for a processor; 0 if not measured.
    """

    job_id: int
    result: (
        tuple[Trajectory, Certificate]
        | Refusal
        | DryRunFound
        | DryRunSlice
        | PathFree
        | Done
        | ProgramRefused
        | BodyRead
        | KinematicsFound
        | SearchProgress
        | ShapesFound
    )
    plan_time: float
    playback: PlaybackPlan | None = None
    took: float = 0.0
    facts: PlanFacts | None = None
    preview: tuple[Trajectory, Certificate] | None = None

    @property
    def is_final(self) -> bool:
        """True if no other answer to the job will come."""
        return not isinstance(self.result, SearchProgress)


LENGTH = struct.Struct("<I")
"""Length prefix of each pickle, in both directions."""


def split_question(robot: str, job: Job) -> tuple[bytes, Sequence[bytes]]:
    """Return what is written at once, and the pieces that follow it."""
    pieces: Sequence[bytes] = ()
    if isinstance(job, RecordingJob):
        pieces, job = job.samples, replace(job, samples=())
    large = {name: getattr(job, name, None) for name in ("scene", "frames")}
    packed = {name: _packed(value) for name, value in large.items() if value is not None}
    job = replace(job, **packed) if packed else job
    data = pickle.dumps((robot, job, sum(map(len, pieces))))
    return LENGTH.pack(len(data)) + data, pieces


class _Packed:
    """Scene or frames of a job as bytes, which become the object again where the job is read."""

    __slots__ = ("data",)

    def __init__(self, data: bytes) -> None:
        self.data = data

    def __reduce__(self) -> tuple[Callable[[bytes], Any], tuple[bytes]]:
        return _unpacked, (self.data,)


_MOST_PACKED = 64
"""Scenes and frames that are kept as bytes: of each cell the ones in force, and some more."""

_PACKED: deque[tuple[object, _Packed]] = deque(maxlen=_MOST_PACKED)


def _packed(value: object) -> Any:
    """Return a scene or frames as bytes, made once, which takes 10 ms at their bounds."""
    # They never change, and each plan asks with the same ones.
    for known, packed in _PACKED:
        if known is value:
            return packed
    packed = _Packed(pickle.dumps(value, pickle.HIGHEST_PROTOCOL))
    _PACKED.append((value, packed))
    return packed


@lru_cache(maxsize=_MOST_PACKED)
def _unpacked(data: bytes) -> Any:
    return pickle.loads(data)


def read_question(pipe: BinaryIO) -> tuple[str, Job] | None:
    """Return robot and job of the next question; None where the pipe ends before. Blocks."""
    head = pipe.read(LENGTH.size)
    if len(head) < LENGTH.size:
        return None
    (length,) = LENGTH.unpack(head)
    data = pipe.read(length)
    if len(data) < length:
        return None
    robot, job, size = pickle.loads(data)
    samples = pipe.read(size)
    if len(samples) < size:
        return None
    if isinstance(job, RecordingJob):
        job = replace(job, samples=(samples,))
    return robot, job


@dataclass(frozen=True, slots=True)
class SplitAnswer:
    """An answer of which the arrays follow, as bytes of these sizes.

    Attributes:
        pickled: the answer without them.
    """

    pickled: bytes
    sizes: tuple[int, ...]

    def joined(self, arrays: Sequence[Any]) -> PlanAnswer:
        """Return the answer with its arrays, which go on using these bytes."""
        planned: PlanAnswer = pickle.loads(self.pickled, buffers=arrays)
        return planned


def split_answer(planned: PlanAnswer | None) -> list[bytes | memoryview]:
    """Return what a planning process writes as its answer, in order; None says that it is warm."""
    arrays: list[pickle.PickleBuffer] = []
    data = pickle.dumps(planned, pickle.HIGHEST_PROTOCOL, buffer_callback=arrays.append)
    pieces = [array.raw() for array in arrays]
    if pieces:
        data = pickle.dumps(SplitAnswer(data, tuple(map(len, pieces))), pickle.HIGHEST_PROTOCOL)
    return [LENGTH.pack(len(data)) + data, *pieces]


Deliver = Callable[[PlanAnswer], None]


class Planner(Protocol):
    """Interface that takes the jobs of a cell and delivers answers later."""

    def submit(self, job: Job, deliver: Deliver) -> None:
        """Plan a job; `deliver` is called with the answer."""

    def withdraw(self, job_id: int) -> None:
        """Withdraw a job: its answer is not needed any more."""


@dataclass(frozen=True, slots=True)
class PlanTask:
    """A job with its receiver, until it is answered.

    Attributes:
        robot: name or file of the robot that it is for.
        cell: number of the cell that it is for; cells take turns.
    """

    robot: str
    job: Job
    deliver: Deliver
    cell: int = 0

    def fail(self) -> None:
        """Answer that no plan will come."""
        self.deliver(PlanAnswer(self.job.job_id, Refusal(VerdictCode.PLANNER_FAILED), 0.0))


class Timer(Protocol):
    """Timer that can be cancelled, such as an `asyncio.TimerHandle`."""

    def cancel(self) -> None:
        """Stop it."""


@dataclass(slots=True)
class TaskInHand:
    """A job that a process is busy with.

    Attributes:
        timer: ends the process where no answer comes.
        given: when the process was given it, by the loop's clock [s].
        patience: runs out some time after that; None until then, and until the process is warm.
    """

    task: PlanTask
    timer: Timer
    given: float = 0.0
    is_withdrawn: bool = False
    patience: Timer | None = None
    is_overdue: bool = False

    def end(self) -> None:
        """Stop the timers."""
        self.timer.cancel()
        if self.patience is not None:
            self.patience.cancel()
