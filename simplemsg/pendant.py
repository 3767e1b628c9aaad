"""The messages between pendants and the pendant server (ids 65000 to 65535, free in REP-I0004).

Framing and header are those of the standard messages. Conventions: SI units; quaternions x, y, z,
w; frames always named; text is UTF-8 in fields of fixed size. Every motion request carries a
request id of the pendant's choice and has exactly three outcomes: refused (a failure `Verdict`), or
accepted (a success `Verdict`) and then completed or aborted (an `Outcome`).
"""

from enum import IntEnum, IntFlag
from typing import Annotated

from .codes import ControllerMode, TriState
from .declaration import (
    Array,
    CountPlace,
    Direction,
    Int,
    Message,
    Place,
    Real,
    Reals,
    Record,
    Reply,
    Tail,
    Text,
    Topic,
    message,
    record,
)
from .verdicts import VerdictCode

PROTOCOL_VERSION = 1
"""Version of the pendant messages; hello refuses any other."""

MAX_PENDANT_FRAME = 65_532
"""Largest frame of the pendant port, bytes: the length field stays below 65,536."""

MAX_WAYPOINTS = 1_600
"""Most waypoints of one path request; a joint path of that length fits the largest frame."""

_SOURCE = "openpendant"
_JOINT_UNIT = "rad, m for a linear axis"
_VERDICT = "verdict"


class Motion(IntEnum):
    """How the tool gets to a pose."""

    PTP = 1
    LIN = 2


class AuthorityAction(IntEnum):
    """What an `Authority` request wants."""

    REQUEST = 1
    RELEASE = 2


class AuthorityReason(IntEnum):
    """Why the motion authority changed hands."""

    GRANTED = 1
    RELEASED = 2
    EXPIRED = 3
    CONNECTION_LOST = 4


class OutcomeKind(IntEnum):
    """How an accepted request ended."""

    COMPLETED = 1
    ABORTED = 2


class Activity(IntEnum):
    """What the cell is doing."""

    IDLE = 0
    PLANNING = 1
    MOVING = 2
    STOPPING = 3


class LinkState(IntEnum):
    """The server's connection to the robot controller."""

    DOWN = 0
    UP = 1
    STALE = 2


class StopKind(IntEnum):
    """Which stop is latched."""

    NONE = 0
    SOFTWARE = 1


class StateField(IntFlag):
    """Which values of a `State` are known."""

    POSITION = 2
    VELOCITY = 4
    TOOL = 16


class Capability(IntFlag):
    """What the server offers to this connection."""

    JOINT_MOVE = 1
    POSE_MOVE = 2
    JOINT_PATH = 4
    POSE_PATH = 8
    SOFTWARE_STOP = 16


class OperatorAction(IntEnum):
    """What a person does at an emulated controller (training only)."""

    EMERGENCY_STOP = 1
    RESET = 2


def _request(msg_type: int, name: str, about: str, reply: str = _VERDICT) -> Place:
    return Place(msg_type, name, Direction.TO_SERVER, reply, _SOURCE, about)


def _news(msg_type: int, name: str, about: str) -> Place:
    return Place(msg_type, name, Direction.FROM_SERVER, "none", _SOURCE, about)


@message(_request(65000, "hello", "Opens a conversation; always the first message.", reply="hello"))
class Hello(Message):
    """HELLO request."""

    protocol_version: Annotated[int, Int("version of these messages that the pendant speaks")]
    state_rate: Annotated[float, Real("state messages wanted, 0 for none, else 1 to 125", "Hz")]
    cell: Annotated[str, Text("name of the cell, empty for the only one")]
    client: Annotated[str, Text("name of the pendant, shown to others")]


@message(
    Place(
        65000,
        "hello",
        Direction.FROM_SERVER,
        "none",
        _SOURCE,
        "Welcomes a pendant and announces the limits of the conversation.",
        is_reply=True,
    )
)
class HelloReply(Reply):
    """HELLO reply; a refused hello is answered by a `Verdict` instead."""

    protocol_version: Annotated[int, Int("version of these messages that the server speaks")]
    session: Annotated[int, Int("number of this connection, not 0")]
    capabilities: Annotated[int, Int("bits: what the server offers", values=Capability)]
    max_frame: Annotated[int, Int("largest frame that the server takes", "byte")]
    dof: Annotated[int, Int("driven joints of the robot")]
    tick_rate: Annotated[float, Real("the server's control rate", "Hz")]
    max_state_rate: Annotated[float, Real("fastest state rate", "Hz")]
    authority_timeout: Annotated[float, Real("the authority expires so long after a beat", "s")]
    cell: Annotated[str, Text("name of the cell")]
    robot: Annotated[str, Text("name of the robot")]
    server: Annotated[str, Text("name and version of the server")]


@message(
    _request(
        65001,
        "management",
        "Asks for data that has no fixed layout; the body is one JSON object.",
        reply="management",
    )
)
class Management(Message):
    """MANAGEMENT, request and reply alike."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    body: Annotated[bytes, Tail("one JSON object, UTF-8")]


@message(
    Place(
        65002,
        "verdict",
        Direction.FROM_SERVER,
        "none",
        _SOURCE,
        "Answers a request; the header says accepted (success) or refused (failure).",
    )
)
class Verdict(Reply):
    """VERDICT: the one answer to every request but hello and management."""

    request_id: Annotated[int, Int("of the request")]
    code: Annotated[int, Int("0 accepted, else an entry of the catalogue", values=VerdictCode)]
    joint: Annotated[int, Int("index of the joint at fault, -1 for none")]
    value: Annotated[float, Real("the value at fault, SI")]
    limit: Annotated[float, Real("the limit that it breaks, SI")]
    text: Annotated[str, Text("one sentence with the numbers", size=160)]


@message(_news(65003, "outcome", "Ends an accepted request: completed or aborted."))
class Outcome(Topic):
    """OUTCOME: comes once for each accepted motion request, to the connection that made it."""

    request_id: Annotated[int, Int("of the request")]
    outcome: Annotated[int, Int("1 completed, 2 aborted", values=OutcomeKind)]
    code: Annotated[int, Int("0 completed, else an entry of the catalogue", values=VerdictCode)]
    joint: Annotated[int, Int("index of the joint at fault, -1 for none")]
    value: Annotated[float, Real("the value at fault, SI")]
    limit: Annotated[float, Real("the limit that it breaks, SI")]
    plan_time: Annotated[float, Real("time that planning took", "s")]
    motion_time: Annotated[float, Real("planned duration of the motion", "s")]
    text: Annotated[str, Text("one sentence with the numbers", size=160)]


@message(_request(65004, "subscribe", "Chooses the rate of state messages."))
class Subscribe(Message):
    """SUBSCRIBE."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    state_rate: Annotated[float, Real("state messages wanted, 0 for none, else 1 to 125", "Hz")]


@message(_request(65005, "authority", "Requests or releases the motion authority."))
class Authority(Message):
    """AUTHORITY."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[int, Int("1 request, 2 release", values=AuthorityAction)]


@message(
    Place(
        65006,
        "authority_beat",
        Direction.TO_SERVER,
        "none",
        _SOURCE,
        "Keeps the motion authority; send one each second while holding it.",
    )
)
class AuthorityBeat(Topic):
    """AUTHORITY_BEAT: an empty body."""


@message(_request(65010, "joint_move", "Moves all joints to a position, in a straight joint line."))
class JointMove(Message):
    """JOINT_MOVE."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    joint_count: Annotated[int, Int("slots that are meant; must be the robot's driven joints")]
    joints: Annotated[tuple[float, ...], Reals("target positions, unused slots 0", _JOINT_UNIT)]


@message(_request(65011, "pose_move", "Moves the tool to a pose, by PTP or in a straight line."))
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

    joints: Annotated[tuple[float, ...], Reals("joint positions, unused slots 0", _JOINT_UNIT)]


@record
class PoseWaypoint(Record):
    """One waypoint of a pose path."""

    position: Annotated[tuple[float, ...], Reals("x, y, z of the tool", "m", count=3)]
    orientation: Annotated[tuple[float, ...], Reals("quaternion x, y, z, w", count=4)]


@message(_request(65012, "joint_path", "Moves through joint positions without stopping."))
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


@message(_request(65013, "pose_path", "Moves the tool through poses."))
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


@message(_request(65014, "software_stop", "Stops the robot and latches; anyone may send it."))
class SoftwareStop(Message):
    """SOFTWARE_STOP: no safety device."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    reason: Annotated[str, Text("shown to others", size=64)]


@message(_request(65015, "reset_stop", "Unlatches the software stop; moves nothing."))
class ResetStop(Message):
    """RESET_STOP: only the holder of the motion authority may."""

    request_id: Annotated[int, Int("chosen by the pendant")]


@message(_news(65020, "state", "State of the cell, at the rate that the pendant chose."))
class State(Topic):
    """STATE: the newest only; what a slow reader misses is counted in `dropped`."""

    sequence: Annotated[int, Int("counts the cell's state messages; a listener may see gaps")]
    time_s: Annotated[int, Int("the server's monotonic time, whole seconds", "s")]
    time_ns: Annotated[int, Int("the server's monotonic time, rest", "ns")]
    age: Annotated[float, Real("age of the controller's last report, -1 before the first", "s")]
    dropped: Annotated[int, Int("state messages that this connection was too slow for")]
    activity: Annotated[int, Int("0 idle, 1 planning, 2 moving, 3 stopping", values=Activity)]
    request_id: Annotated[int, Int("request that is planned or moving, 0 for none")]
    holder: Annotated[int, Int("session that holds the motion authority, 0 for none")]
    stop: Annotated[int, Int("latched stop: 0 none, 1 software stop", values=StopKind)]
    link: Annotated[int, Int("controller connection: 0 down, 1 up, 2 stale", values=LinkState)]
    drives_powered: Annotated[int, Int("the controller's own, -1 unknown", values=TriState)]
    e_stopped: Annotated[int, Int("the controller's own, -1 unknown", values=TriState)]
    error_code: Annotated[int, Int("the controller's own, 0 for none")]
    in_error: Annotated[int, Int("the controller's own, -1 unknown", values=TriState)]
    in_motion: Annotated[int, Int("the controller's own, -1 unknown", values=TriState)]
    mode: Annotated[
        int, Int("the controller's own: -1 unknown, 1 manual, 2 automatic", values=ControllerMode)
    ]
    motion_possible: Annotated[int, Int("the controller's own, -1 unknown", values=TriState)]
    valid_fields: Annotated[int, Int("bits: 2 positions, 4 velocities, 16 tool", values=StateField)]
    tool_speed: Annotated[float, Real("speed of the tool", "m/s")]
    positions: Annotated[tuple[float, ...], Reals("joint positions", _JOINT_UNIT)]
    velocities: Annotated[tuple[float, ...], Reals("joint velocities", "rad/s, m/s")]
    tool_position: Annotated[tuple[float, ...], Reals("x, y, z of the tool in base", "m", count=3)]
    tool_orientation: Annotated[
        tuple[float, ...], Reals("quaternion x, y, z, w of the tool in base", count=4)
    ]


@message(_news(65021, "authority_changed", "The motion authority changed hands."))
class AuthorityChanged(Topic):
    """AUTHORITY_CHANGED: to every connection of the cell."""

    holder: Annotated[int, Int("session that holds it now, 0 for nobody")]
    reason: Annotated[
        int, Int("1 granted, 2 released, 3 expired, 4 connection lost", values=AuthorityReason)
    ]
    client: Annotated[str, Text("name of the new holder's pendant")]


@message(_news(65022, "stop_changed", "A stop was latched or reset."))
class StopChanged(Topic):
    """STOP_CHANGED: to every connection of the cell."""

    stop: Annotated[int, Int("latched stop: 0 none, 1 software stop", values=StopKind)]
    session: Annotated[int, Int("who did it, 0 for the server itself")]
    client: Annotated[str, Text("name of that pendant")]
    reason: Annotated[str, Text("as given", size=64)]


@message(
    Place(
        65100,
        "operator_event",
        Direction.TO_CONTROLLER,
        "operator_event, header only",
        _SOURCE,
        "TRAINING: what a person does at an emulated controller; a real one refuses it.",
    )
)
class OperatorEvent(Message):
    """OPERATOR_EVENT: an emergency stop or a reset at the emulated controller."""

    action: Annotated[int, Int("1 emergency stop, 2 reset", values=OperatorAction)]


PENDANT_MESSAGES: tuple[type[Message], ...] = (
    Hello,
    HelloReply,
    Management,
    Verdict,
    Outcome,
    Subscribe,
    Authority,
    AuthorityBeat,
    JointMove,
    PoseMove,
    JointPath,
    PosePath,
    SoftwareStop,
    ResetStop,
    State,
    AuthorityChanged,
    StopChanged,
    OperatorEvent,
)
