"""Messages of a session: hello, login and pairing, the rate of state, management, and answers."""

from enum import IntEnum, IntFlag
from typing import Annotated

from ..declaration import Int, Message, Real, Reply, Tail, Text, Topic
from ..verdicts import VerdictCode
from .places import from_server, to_server

PROTOCOL_VERSION = 3
"""Newest version of the pendant messages, which our own pendants speak."""

PROTOCOL_VERSIONS = (2, 3)
"""Versions that the server speaks, with each connection that of its hello; others are refused."""

MAX_PENDANT_FRAME = 65_532
"""Largest frame of the pendant port, bytes: the length field stays below 65,536."""


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
    PLANS = 8192
    KINEMATICS = 16384
    SHAPES = 32768
    NOTICES = 65536
    POSITIONS = 131072
    GRASP = 262144
    PREPARE = 1048576


IN_VERSION_2 = Capability(8191)
"""What a connection of version 2 may be offered."""


@to_server(65000, "hello", "Opens a conversation; always the first message.", reply="hello")
class Hello(Message):
    """HELLO request."""

    protocol_version: Annotated[int, Int("version of these messages that the pendant speaks")]
    state_rate: Annotated[float, Real("state messages wanted, 0 for none, else 1 to 125", "Hz")]
    cell: Annotated[str, Text("name of the cell, empty for the only one")]
    client: Annotated[str, Text("name of the pendant, shown to others")]


@from_server(
    65000,
    "hello",
    "Welcomes a pendant and announces the limits of the conversation.",
    is_reply=True,
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


class Notices(IntEnum):
    """Whether a connection is told what others change."""

    UNWANTED = 0
    WANTED = 1


@to_server(
    65051,
    "declare",
    "Says what else a pendant of version 3 wants; the verdict's value is the ramp time.",
    since=3,
)
class Declare(Message):
    """DECLARE: after hello, and again as wishes change; not while this pendant moves the robot."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    enabling_deadline: Annotated[
        float,
        Real(
            "enabling is let go so long after its last sign, 0.05 to 0.25; 0 as the cell",
            "s",
        ),
    ]
    notices: Annotated[
        int, Int("1 if changes of documents and plans are to be told", values=Notices)
    ]
    language: Annotated[str, Text("of the person, as en or de; for the audit log", size=8)]


@to_server(
    65001,
    "management",
    "Asks for data that has no fixed layout; the body is one JSON object.",
    reply="management",
)
class Management(Message):
    """MANAGEMENT, request and reply alike."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    body: Annotated[bytes, Tail("one JSON object, UTF-8")]


@to_server(65004, "subscribe", "Chooses the rate of state messages.")
class Subscribe(Message):
    """SUBSCRIBE."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    state_rate: Annotated[float, Real("state messages wanted, 0 for none, else 1 to 125", "Hz")]


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


@to_server(65007, "login", "Shows who is at the pendant, by password or pairing code.")
class Login(Message):
    """LOGIN: only where the server asks for it; a software stop never does."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    kind: Annotated[int, Int("1 password, 2 pairing code", values=LoginKind)]
    name: Annotated[str, Text("account, or the name of a guest")]
    secret: Annotated[str, Text("password or pairing code", size=128, secret=True)]


@to_server(65008, "set_account", "Adds an account, or gives one another password.")
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


@to_server(
    65009,
    "pairing",
    "Asks for a pairing code of the cell, or ends it and the guests that it let in.",
    reply="pairing; verdict for a refusal and for an end",
)
class Pairing(Message):
    """PAIRING: for admins."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[int, Int("1 issue, 2 withdraw", values=PairingAction)]


@from_server(65009, "pairing", "Tells the pairing code to whoever asked for it.", is_reply=True)
class PairingReply(Reply):
    """PAIRING reply."""

    request_id: Annotated[int, Int("of the request")]
    lifetime: Annotated[int, Int("the code ends so long after this reply", "s")]
    code: Annotated[str, Text("as a teacher shows it", size=8, secret=True)]


class OutcomeKind(IntEnum):
    """How an accepted request ended."""

    COMPLETED = 1
    ABORTED = 2


@from_server(
    65002, "verdict", "Answers a request; the header says accepted (success) or refused (failure)."
)
class Verdict(Reply):
    """VERDICT: the one answer to every request but hello and management."""

    request_id: Annotated[int, Int("of the request")]
    code: Annotated[int, Int("0 accepted, else an entry of the catalogue", values=VerdictCode)]
    joint: Annotated[int, Int("index of the joint at fault, -1 for none")]
    value: Annotated[float, Real("the value at fault, SI")]
    limit: Annotated[float, Real("the limit that it breaks, SI")]
    text: Annotated[str, Text("one sentence with the numbers", size=160)]


@from_server(65003, "outcome", "Ends an accepted request: completed or aborted.")
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
