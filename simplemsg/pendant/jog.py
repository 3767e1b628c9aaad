"""Jogging: the press with its beats, the step, the way back, and how a press ended."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Real, Reals, Text, Topic, message
from .places import JOINT_UNIT, from_server, to_server


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


@message(to_server(65030, "jog_start", "Begins a jog that lasts as long as its press is beaten."))
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


@message(to_server(65031, "jog_beat", "Keeps a press alive; send one every 50 ms.", reply="none"))
class JogBeat(Topic):
    """JOG_BEAT: one that is late, repeated or of another press does nothing."""

    press: Annotated[int, Int("number of the press")]
    beat: Annotated[int, Int("counts the beats of the press, from 1")]


@message(to_server(65032, "jog_release", "Ends a press: the robot ramps to rest at once."))
class JogRelease(Message):
    """JOG_RELEASE."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    press: Annotated[int, Int("number of the press")]


@message(to_server(65033, "jog_step", "Moves by one increment, in a straight line."))
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


@message(to_server(65034, "jog_undo", "Moves back along the way of the last jog."))
class JogUndo(Message):
    """JOG_UNDO."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the jog speed, above 0, up to 1")]


@message(from_server(65025, "jog_ended", "A press ended and the robot came to rest."))
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
