"""Messages of a session: hello, the rate of state, and management."""

from enum import IntFlag
from typing import Annotated

from ..declaration import Int, Message, Real, Reply, Tail, Text, message
from .places import from_server, to_server

PROTOCOL_VERSION = 2
"""Version of the pendant messages; hello refuses any other."""

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


@message(
    to_server(65000, "hello", "Opens a conversation; always the first message.", reply="hello")
)
class Hello(Message):
    """HELLO request."""

    protocol_version: Annotated[int, Int("version of these messages that the pendant speaks")]
    state_rate: Annotated[float, Real("state messages wanted, 0 for none, else 1 to 125", "Hz")]
    cell: Annotated[str, Text("name of the cell, empty for the only one")]
    client: Annotated[str, Text("name of the pendant, shown to others")]


@message(
    from_server(
        65000,
        "hello",
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
    to_server(
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


@message(to_server(65004, "subscribe", "Chooses the rate of state messages."))
class Subscribe(Message):
    """SUBSCRIBE."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    state_rate: Annotated[float, Real("state messages wanted, 0 for none, else 1 to 125", "Hz")]
