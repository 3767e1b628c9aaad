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

PROTOCOL_VERSION = 2
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
    FORCE = 3


class AuthorityReason(IntEnum):
    """Why the motion authority changed hands."""

    GRANTED = 1
    RELEASED = 2
    EXPIRED = 3
    CONNECTION_LOST = 4
    TAKEN_OVER = 5
    LOGGED_OUT = 6


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
    JOGGING = 4
    PAUSED = 5
    PAUSING = 6


class LinkState(IntEnum):
    """The server's connection to the robot controller."""

    DOWN = 0
    UP = 1
    STALE = 2


class StopKind(IntEnum):
    """Which stop is latched."""

    NONE = 0
    SOFTWARE = 1
    PROTECTIVE = 2


class OperatingMode(IntEnum):
    """The server's own mode of operation; the numbers 1 to 3 are those of OPC UA Robotics."""

    MANUAL_REDUCED = 1
    MANUAL_HIGH = 2
    AUTOMATIC = 3
    RECOVERY = 4


class EnablingPosition(IntEnum):
    """How far the enabling device (training) is pressed; only the middle position enables."""

    RELEASED = 0
    HELD = 1
    PANIC = 2


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


class LoginKind(IntEnum):
    """How a connection shows who it is."""

    PASSWORD = 1
    PAIRING = 2


class AccountRole(IntEnum):
    """What an account may do; each role may do all that the ones before it may."""

    AS_IT_IS = 0
    VIEWER = 1
    OPERATOR = 2
    PROGRAMMER = 3
    ADMIN = 4


class PairingAction(IntEnum):
    """What a `Pairing` request wants."""

    ISSUE = 1
    WITHDRAW = 2


class MotionControlAction(IntEnum):
    """What a `MotionControl` request wants of the running motion or program."""

    PAUSE = 1
    RESUME = 2
    PROGRAM_STOP = 3


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
    JOG = 32
    MODES = 64
    PAUSE = 128
    PROGRAMS = 256
    RECORDING = 512
    LOGIN = 1024
    SIGNALS = 2048
    SCENE = 4096


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


@message(_request(65005, "authority", "Requests, releases or takes over the motion authority."))
class Authority(Message):
    """AUTHORITY."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[int, Int("1 request, 2 release, 3 take over by role", values=AuthorityAction)]


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


@message(_request(65007, "login", "Shows who is at the pendant, by password or pairing code."))
class Login(Message):
    """LOGIN: only where the server asks for it; a software stop never does."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    kind: Annotated[int, Int("1 password, 2 pairing code", values=LoginKind)]
    name: Annotated[str, Text("account, or the name of a guest")]
    secret: Annotated[str, Text("password or pairing code", size=128, secret=True)]


@message(_request(65008, "set_account", "Adds an account, or gives one another password."))
class SetAccount(Message):
    """SET_ACCOUNT: for admins; the verdict comes when the account is saved."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    role: Annotated[
        int,
        Int(
            "of a new account: 1 viewer, 2 operator, 3 programmer, 4 admin; 0 for a new password",
            values=AccountRole,
        ),
    ]
    name: Annotated[str, Text("the account")]
    secret: Annotated[str, Text("its new password", size=128, secret=True)]


@message(
    _request(
        65009,
        "pairing",
        "Asks for a pairing code of the cell, or ends it and the guests that it let in.",
        reply="pairing; verdict for a refusal and for an end",
    )
)
class Pairing(Message):
    """PAIRING: for admins."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[int, Int("1 issue, 2 withdraw", values=PairingAction)]


@message(
    Place(
        65009,
        "pairing",
        Direction.FROM_SERVER,
        "none",
        _SOURCE,
        "Tells the pairing code to whoever asked for it.",
        is_reply=True,
    )
)
class PairingReply(Reply):
    """PAIRING reply."""

    request_id: Annotated[int, Int("of the request")]
    lifetime: Annotated[int, Int("the code ends so long after this reply", "s")]
    code: Annotated[str, Text("as a teacher shows it", size=8, secret=True)]


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


@message(
    Place(
        65016,
        "enabling",
        Direction.TO_SERVER,
        "none",
        _SOURCE,
        "TRAINING: position of the enabling device; repeat it every 50 ms while it is held.",
    )
)
class Enabling(Topic):
    """ENABLING (training): no safety device. Silence for the jog deadline counts as released."""

    position: Annotated[int, Int("0 released, 1 held, 2 panic", values=EnablingPosition)]


@message(_request(65017, "set_mode", "Sets the mode of operation; stops what moves."))
class SetMode(Message):
    """SET_MODE: refused where the controller's own selector rules."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    mode: Annotated[
        int,
        Int(
            "1 manual reduced speed, 2 manual high speed, 3 automatic, 4 recovery",
            values=OperatingMode,
        ),
    ]


@message(_request(65018, "set_speed", "Sets the speed override and the cap of the tool speed."))
class SetSpeed(Message):
    """SET_SPEED: acts at once, also on the running motion, which stays on its path."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    override: Annotated[float, Real("fraction of the planned speed, 0 to 1")]
    tool_speed: Annotated[float, Real("cap of tool and elbow, 0 to leave it as it is", "m/s")]


@message(_request(65019, "motion_control", "Pauses, resumes or ends the motion or the program."))
class MotionControl(Message):
    """MOTION_CONTROL: a pause stays on the path; a program stop ends what runs, unlatched."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[int, Int("1 pause, 2 resume, 3 program stop", values=MotionControlAction)]


@message(_request(65030, "jog_start", "Begins a jog that lasts as long as its press is beaten."))
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


@message(
    Place(
        65031,
        "jog_beat",
        Direction.TO_SERVER,
        "none",
        _SOURCE,
        "Keeps a press alive; send one every 50 ms.",
    )
)
class JogBeat(Topic):
    """JOG_BEAT: one that is late, repeated or of another press does nothing."""

    press: Annotated[int, Int("number of the press")]
    beat: Annotated[int, Int("counts the beats of the press, from 1")]


@message(_request(65032, "jog_release", "Ends a press: the robot ramps to rest at once."))
class JogRelease(Message):
    """JOG_RELEASE."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    press: Annotated[int, Int("number of the press")]


@message(_request(65033, "jog_step", "Moves by one increment, in a straight line."))
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


@message(_request(65034, "jog_undo", "Moves back along the way of the last jog."))
class JogUndo(Message):
    """JOG_UNDO."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the jog speed, above 0, up to 1")]


@message(_request(65040, "program_run", "Runs a stored program, or one step of it."))
class ProgramRun(Message):
    """PROGRAM_RUN: the outcome comes when the program, or the step, has ended."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    run: Annotated[int, Int("1 all, 2 step forward, 3 step backward", values=RunKind)]
    line: Annotated[int, Int("line to begin at, 0 for where it stands or the first")]
    loops: Annotated[int, Int("how often, 0 for until it is stopped")]
    speed: Annotated[float, Real("fraction of the programmed speeds, above 0, up to 1")]
    program: Annotated[str, Text("name of the program", size=64)]


@message(_request(65041, "home", "Moves all joints to a named position of the robot."))
class Home(Message):
    """HOME: `zero` is refused where a limit excludes it or the robot would be singular there."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    speed: Annotated[float, Real("fraction of the joints' largest speed, above 0, up to 1")]
    target: Annotated[str, Text("home or zero")]


@message(_news(65020, "state", "State of the cell, at the rate that the pendant chose."))
class State(Topic):
    """STATE: the newest only; what a slow reader misses is counted in `dropped`."""

    sequence: Annotated[int, Int("counts the cell's state messages; a listener may see gaps")]
    time_s: Annotated[int, Int("the server's monotonic time, whole seconds", "s")]
    time_ns: Annotated[int, Int("the server's monotonic time, rest", "ns")]
    age: Annotated[float, Real("age of the controller's last report, -1 before the first", "s")]
    dropped: Annotated[int, Int("state messages that this connection was too slow for")]
    activity: Annotated[int, Int("what the cell does; 6: about to be paused", values=Activity)]
    request_id: Annotated[int, Int("request that is planned or moving, 0 for none")]
    holder: Annotated[int, Int("session that holds the motion authority, 0 for none")]
    stop: Annotated[int, Int("latched stop: 0 none, 1 software, 2 protective", values=StopKind)]
    operating_mode: Annotated[int, Int("the server's own mode", values=OperatingMode)]
    enabling: Annotated[
        int, Int("the authority's enabling device (training)", values=EnablingPosition)
    ]
    override: Annotated[float, Real("speed override, 0 to 1")]
    tool_speed_cap: Annotated[float, Real("cap of tool and elbow, 0 for none", "m/s")]
    jog_scale: Annotated[float, Real("part of the asked jog speed that is driven, 0 to 1")]
    jog_reason: Annotated[int, Int("why it is less than 1", values=JogReason)]
    jog_joint: Annotated[int, Int("joint at fault, -1 for none")]
    program_state: Annotated[int, Int("what the program is doing", values=ProgramState)]
    program_line: Annotated[int, Int("its current line, 0 for none")]
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
        int,
        Int(
            "1 granted, 2 released, 3 expired, 4 connection lost, 5 taken over, 6 logged out",
            values=AuthorityReason,
        ),
    ]
    client: Annotated[str, Text("name of the new holder's pendant")]


@message(_news(65022, "stop_changed", "A stop was latched or reset."))
class StopChanged(Topic):
    """STOP_CHANGED: to every connection of the cell."""

    stop: Annotated[int, Int("latched stop: 0 none, 1 software, 2 protective", values=StopKind)]
    session: Annotated[int, Int("who did it, 0 for the server itself")]
    client: Annotated[str, Text("name of that pendant")]
    reason: Annotated[str, Text("as given", size=64)]


@message(_news(65023, "authority_wanted", "Somebody asked for the authority that you hold."))
class AuthorityWanted(Topic):
    """AUTHORITY_WANTED: to its holder alone."""

    session: Annotated[int, Int("who asked")]
    client: Annotated[str, Text("name of that pendant")]


@message(_news(65024, "mode_changed", "The mode of operation changed."))
class ModeChanged(Topic):
    """MODE_CHANGED: to every connection of the cell."""

    mode: Annotated[int, Int("the mode now", values=OperatingMode)]
    session: Annotated[int, Int("who did it, 0 for the controller")]
    client: Annotated[str, Text("name of that pendant")]


@message(_news(65025, "jog_ended", "A press ended and the robot came to rest."))
class JogEnded(Topic):
    """JOG_ENDED: to the connection that pressed, just before the outcome."""

    press: Annotated[int, Int("number of the press")]
    reason: Annotated[int, Int("why it ended", values=JogEnd)]
    stop_time: Annotated[float, Real("from the end of the press to rest, as sent", "s")]
    joint_distance: Annotated[float, Real("farthest that a joint went in that time", "rad, m")]
    tool_distance: Annotated[float, Real("way of the tool in that time", "m")]
    positions: Annotated[tuple[float, ...], Reals("where the joints stand", _JOINT_UNIT)]


@message(_news(65026, "program_report", "A program came to another line, paused or ended."))
class ProgramReport(Topic):
    """PROGRAM_REPORT: to every connection of the cell."""

    state: Annotated[int, Int("what it is doing", values=ProgramState)]
    line: Annotated[int, Int("its current line, 0 for none")]
    loop: Annotated[int, Int("which run of it this is, from 1")]
    program: Annotated[str, Text("name of the program", size=64)]
    text: Annotated[str, Text("one sentence, empty for none", size=160)]


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


@message(
    Place(
        65110,
        "read_signals",
        Direction.TO_CONTROLLER,
        "read_signals",
        _SOURCE,
        "Asks for sixteen digital inputs and outputs; on the motion or the state connection.",
    )
)
class ReadSignals(Message):
    """READ_SIGNALS request."""

    first: Annotated[int, Int("number of the first signal: 0, 16, 32, …")]


@message(
    Place(
        65110,
        "read_signals",
        Direction.FROM_CONTROLLER,
        "none",
        _SOURCE,
        "Sixteen digital inputs and outputs, and how many of each there are.",
        is_reply=True,
    )
)
class ReadSignalsReply(Reply):
    """READ_SIGNALS reply; bit 0 is the signal `first`."""

    first: Annotated[int, Int("number of the first signal, as asked")]
    inputs: Annotated[int, Int("bits: the inputs", mask=0xFFFF)]
    outputs: Annotated[int, Int("bits: the outputs", mask=0xFFFF)]
    input_count: Annotated[int, Int("inputs in all")]
    output_count: Annotated[int, Int("outputs in all")]


@message(
    Place(
        65111,
        "write_outputs",
        Direction.TO_CONTROLLER,
        "write_outputs, header only",
        _SOURCE,
        "Sets some of sixteen digital outputs; refused where there is no such output.",
    )
)
class WriteOutputs(Message):
    """WRITE_OUTPUTS: all of the masked outputs, or none."""

    first: Annotated[int, Int("number of the first signal: 0, 16, 32, …")]
    mask: Annotated[int, Int("bits: the outputs that are set", mask=0xFFFF)]
    values: Annotated[int, Int("bits: their values", mask=0xFFFF)]


@message(
    Place(
        65112,
        "set_inputs",
        Direction.TO_CONTROLLER,
        "set_inputs, header only",
        _SOURCE,
        "TRAINING: sets inputs of an emulated controller, as its cabling would.",
    )
)
class SetInputs(Message):
    """SET_INPUTS: all of the masked inputs, or none."""

    first: Annotated[int, Int("number of the first signal: 0, 16, 32, …")]
    mask: Annotated[int, Int("bits: the inputs that are set", mask=0xFFFF)]
    values: Annotated[int, Int("bits: their values", mask=0xFFFF)]


PENDANT_MESSAGES: tuple[type[Message], ...] = (
    Hello,
    HelloReply,
    Management,
    Verdict,
    Outcome,
    Subscribe,
    Authority,
    AuthorityBeat,
    Login,
    SetAccount,
    Pairing,
    PairingReply,
    JointMove,
    PoseMove,
    JointPath,
    PosePath,
    SoftwareStop,
    ResetStop,
    Enabling,
    SetMode,
    SetSpeed,
    MotionControl,
    JogStart,
    JogBeat,
    JogRelease,
    JogStep,
    JogUndo,
    ProgramRun,
    Home,
    State,
    AuthorityChanged,
    StopChanged,
    AuthorityWanted,
    ModeChanged,
    JogEnded,
    ProgramReport,
    OperatorEvent,
    ReadSignals,
    ReadSignalsReply,
    WriteOutputs,
    SetInputs,
)
