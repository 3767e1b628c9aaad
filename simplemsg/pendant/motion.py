"""Messages that move the robot: to a goal, by jogging, by a stored program; pauses and speed."""

from collections.abc import Sequence
from enum import IntEnum
from typing import Annotated

from ..declaration import (
    Array,
    CountPlace,
    Int,
    Message,
    Real,
    Reals,
    Record,
    Text,
    Topic,
    record,
)
from .places import JOINT_UNIT, from_server, to_server

MAX_WAYPOINTS = 1_600
"""Most waypoints of one path request; a joint path of that length fits the largest frame."""


class Motion(IntEnum):
    """How the tool gets to a pose."""

    PTP = 1
    LIN = 2


class MotionControlAction(IntEnum):
    """What a `MotionControl` request wants of the running motion or program."""

    PAUSE = 1
    RESUME = 2
    PROGRAM_STOP = 3


@to_server(65010, "joint_move", "Moves all joints to a position, in a straight joint line.")
class JointMove(Message):
    """JOINT_MOVE."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    joint_count: Annotated[int, Int("slots that are meant; must be the robot's driven joints")]
    joints: Annotated[tuple[float, ...], Reals("target positions, unused slots 0", JOINT_UNIT)]


@to_server(65011, "pose_move", "Moves the tool to a pose, by PTP or in a straight line.")
class PoseMove(Message):
    """POSE_MOVE."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    motion: Annotated[int, Int("1 PTP, 2 LIN", values=Motion)]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    frame: Annotated[str, Text("frame of the pose: base or root")]
    position: Annotated[tuple[float, ...], Reals("x, y, z of the tool", "m", count=3)]
    orientation: Annotated[tuple[float, ...], Reals("quaternion x, y, z, w", count=4)]


@record
class JointWaypoint(Record):
    """One waypoint of a joint path."""

    joints: Annotated[tuple[float, ...], Reals("joint positions, unused slots 0", JOINT_UNIT)]


@record
class PoseWaypoint(Record):
    """One waypoint of a pose path."""

    position: Annotated[tuple[float, ...], Reals("x, y, z of the tool", "m", count=3)]
    orientation: Annotated[tuple[float, ...], Reals("quaternion x, y, z, w", count=4)]


@to_server(65012, "joint_path", "Moves through joint positions without stopping.")
class JointPath(Message):
    """JOINT_PATH: starts where the robot stands; that point is not in the list."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    joint_count: Annotated[int, Int("slots that are meant; must be the robot's driven joints")]
    waypoints: Annotated[
        Sequence[JointWaypoint],
        Array(
            "the waypoints in order",
            of=JointWaypoint,
            count_name="count",
            count_place=CountPlace.BEFORE,
            most=MAX_WAYPOINTS,
        ),
    ]


@to_server(65013, "pose_path", "Moves the tool through poses.")
class PosePath(Message):
    """POSE_PATH: PTP passes the poses in joint space without stopping, LIN stops at each."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    motion: Annotated[int, Int("1 PTP, 2 LIN", values=Motion)]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    frame: Annotated[str, Text("frame of the poses: base or root")]
    waypoints: Annotated[
        Sequence[PoseWaypoint],
        Array(
            "the waypoints in order",
            of=PoseWaypoint,
            count_name="count",
            count_place=CountPlace.BEFORE,
            most=MAX_WAYPOINTS,
        ),
    ]


@to_server(65041, "home", "Moves all joints to a named position of the robot or the cell.")
class Home(Message):
    """HOME: done at once where the robot stands there; refused where a limit excludes it."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    target: Annotated[str, Text("a named position, such as home or zero; see positions.list")]


@to_server(65018, "set_speed", "Sets the speed override and the cap of the tool speed.")
class SetSpeed(Message):
    """SET_SPEED: acts at once, also on the running motion, which stays on its path."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    override: Annotated[
        float, Real("fraction of the planned speed, 0.001 to 1; 0 pauses what moves")
    ]
    tool_speed: Annotated[
        float, Real("cap of tool and elbow, 0 to leave it as it is; in automatic only 0", "m/s")
    ]


@to_server(65019, "motion_control", "Pauses, resumes or ends the motion or the program.")
class MotionControl(Message):
    """MOTION_CONTROL: a pause stays on the path; a program stop ends what runs, unlatched."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[int, Int("1 pause, 2 resume, 3 program stop", values=MotionControlAction)]


class JogSpace(IntEnum):
    """What the values of a jog mean."""

    JOINTS = 1
    TOOL = 2


class JogReason(IntEnum):
    """Why a jog is slower than asked, or stands."""

    NONE = 0
    JOINT_LIMIT = 1
    SINGULARITY = 2
    COLLISION = 3
    TOOL_SPEED = 4
    JOINT_SPEED = 5
    WORKSPACE = 6
    ELBOW_SPEED = 7
    DIRECTION = 8
    REACH = 9


class JogEnd(IntEnum):
    """Why a press ended."""

    RELEASED = 1
    SILENT = 2
    CONNECTION_LOST = 3
    REPLACED = 4
    STOPPED = 5


@to_server(65030, "jog_start", "Begins a jog that lasts as long as its press is beaten.")
class JogStart(Message):
    """JOG_START: a press. The verdict comes at once, the outcome when the robot stands again."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    press: Annotated[int, Int("number of the press, higher than any before on this connection")]
    state_sequence: Annotated[int, Int("sequence of a state message that came of late")]
    deadline: Annotated[float, Real("the jog ends so long after a beat, 0.05 to 0.25", "s")]
    space: Annotated[int, Int("1 joints, 2 tool", values=JogSpace)]
    frame: Annotated[str, Text("tool jog: frame of the axes; base, tool or a named one")]
    value_count: Annotated[int, Int("slots that are meant: driven joints, or 6 for the tool")]
    values: Annotated[
        tuple[float, ...],
        Reals("-1 to 1: parts of the jog speed; tool: x, y, z, then about x, y, z", ""),
    ]


@to_server(65031, "jog_beat", "Keeps a press alive; send one every 50 ms.", reply="none")
class JogBeat(Topic):
    """JOG_BEAT: one that is late, repeated or of another press does nothing."""

    press: Annotated[int, Int("number of the press")]
    beat: Annotated[int, Int("counts the beats of the press, from 1")]


@to_server(65032, "jog_release", "Ends a press: the robot ramps to rest at once.")
class JogRelease(Message):
    """JOG_RELEASE."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    press: Annotated[int, Int("number of the press")]


@to_server(65033, "jog_step", "Moves by one increment, in a straight line.")
class JogStep(Message):
    """JOG_STEP: joints by rad or m, the tool by m along and rad about the axes of a frame."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the jog speed, above 0, up to 1")]
    space: Annotated[int, Int("1 joints, 2 tool", values=JogSpace)]
    frame: Annotated[str, Text("tool step: frame of the axes; base, tool or a named one")]
    value_count: Annotated[int, Int("slots that are meant: driven joints, or 6 for the tool")]
    values: Annotated[
        tuple[float, ...], Reals("increments; tool: x, y, z, then about x, y, z", "rad, m")
    ]


@to_server(65034, "jog_undo", "Moves back along the way of the last jog.")
class JogUndo(Message):
    """JOG_UNDO."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the jog speed, above 0, up to 1")]


@from_server(65025, "jog_ended", "A press ended and the robot came to rest.")
class JogEnded(Topic):
    """JOG_ENDED: to the connection that pressed, just before the outcome."""

    press: Annotated[int, Int("number of the press")]
    reason: Annotated[int, Int("why it ended", values=JogEnd)]
    stop_time: Annotated[
        float, Real("from the end of the press to rest or a new press, as sent", "s")
    ]
    joint_distance: Annotated[float, Real("farthest that a joint went in that time", "rad, m")]
    tool_distance: Annotated[float, Real("way of the tool in that time", "m")]
    positions: Annotated[tuple[float, ...], Reals("where the joints stand", JOINT_UNIT)]


class RunKind(IntEnum):
    """How much of a program is run."""

    ALL = 1
    STEP_FORWARD = 2
    STEP_BACKWARD = 3


class ProgramState(IntEnum):
    """What the program is doing."""

    NONE = 0
    RUNNING = 1
    PAUSED = 2
    AT_BREAKPOINT = 3
    STEPPED = 4


@to_server(65040, "program_run", "Runs a stored program, or one step of it.")
class ProgramRun(Message):
    """PROGRAM_RUN: the outcome comes when the program, or the step, has ended."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    run: Annotated[int, Int("1 all, 2 step forward, 3 step backward", values=RunKind)]
    line: Annotated[int, Int("line to begin at, 0 for the first; 0 on a paused program resumes it")]
    loops: Annotated[int, Int("how often, 0 for until it is stopped; to resume: as begun")]
    revision: Annotated[int, Int("revision to run, 0 for the newest or that under way")]
    speed: Annotated[float, Real("fraction of the programmed speeds, above 0, up to 1")]
    program: Annotated[str, Text("name of the program", size=64)]


@from_server(65026, "program_report", "A program came to another line, paused or ended.")
class ProgramReport(Topic):
    """PROGRAM_REPORT: to every connection of the cell."""

    state: Annotated[int, Int("what it is doing", values=ProgramState)]
    line: Annotated[int, Int("its current line, 0 for none")]
    loop: Annotated[int, Int("which run of it this is, from 1")]
    revision: Annotated[int, Int("revision of that program in this run")]
    program: Annotated[str, Text("name of the program", size=64)]
    text: Annotated[str, Text("one sentence, empty for none", size=160)]
