"""Motions to a goal, and what may be done to one under way: speed, pause, program stop."""

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
    message,
    record,
)
from .places import JOINT_UNIT, to_server

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


@message(
    to_server(65010, "joint_move", "Moves all joints to a position, in a straight joint line.")
)
class JointMove(Message):
    """JOINT_MOVE."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    joint_count: Annotated[int, Int("slots that are meant; must be the robot's driven joints")]
    joints: Annotated[tuple[float, ...], Reals("target positions, unused slots 0", JOINT_UNIT)]


@message(to_server(65011, "pose_move", "Moves the tool to a pose, by PTP or in a straight line."))
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


@message(to_server(65012, "joint_path", "Moves through joint positions without stopping."))
class JointPath(Message):
    """JOINT_PATH: starts where the robot stands; that point is not in the list."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    joint_count: Annotated[int, Int("slots that are meant; must be the robot's driven joints")]
    waypoints: Annotated[
        tuple[JointWaypoint, ...],
        Array(
            "the waypoints in order",
            of=JointWaypoint,
            count_name="count",
            count_place=CountPlace.BEFORE,
            most=MAX_WAYPOINTS,
        ),
    ]


@message(to_server(65013, "pose_path", "Moves the tool through poses."))
class PosePath(Message):
    """POSE_PATH: PTP passes the poses in joint space without stopping, LIN stops at each."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    motion: Annotated[int, Int("1 PTP, 2 LIN", values=Motion)]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    frame: Annotated[str, Text("frame of the poses: base or root")]
    waypoints: Annotated[
        tuple[PoseWaypoint, ...],
        Array(
            "the waypoints in order",
            of=PoseWaypoint,
            count_name="count",
            count_place=CountPlace.BEFORE,
            most=MAX_WAYPOINTS,
        ),
    ]


@message(to_server(65041, "home", "Moves all joints to a named position of the robot."))
class Home(Message):
    """HOME: `zero` is refused where a limit excludes it or the robot would be singular there."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    target: Annotated[str, Text("home or zero")]


@message(to_server(65018, "set_speed", "Sets the speed override and the cap of the tool speed."))
class SetSpeed(Message):
    """SET_SPEED: acts at once, also on the running motion, which stays on its path."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    override: Annotated[
        float, Real("fraction of the planned speed, 0.001 to 1; 0 pauses what moves")
    ]
    tool_speed: Annotated[float, Real("cap of tool and elbow, 0 to leave it as it is", "m/s")]


@message(to_server(65019, "motion_control", "Pauses, resumes or ends the motion or the program."))
class MotionControl(Message):
    """MOTION_CONTROL: a pause stays on the path; a program stop ends what runs, unlatched."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[int, Int("1 pause, 2 resume, 3 program stop", values=MotionControlAction)]
