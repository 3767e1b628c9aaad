"""Messages of control: motion authority, operating mode, enabling device (training), and stops."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Text, Topic
from .places import from_server, to_server


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
    ROLE_LOST = 7


@to_server(65005, "authority", "Requests, releases or takes over the motion authority.")
class Authority(Message):
    """AUTHORITY."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[int, Int("1 request, 2 release, 3 take over by role", values=AuthorityAction)]


@to_server(
    65006,
    "authority_beat",
    "Keeps the motion authority; send one each second while holding it.",
    reply="none",
)
class AuthorityBeat(Topic):
    """AUTHORITY_BEAT: an empty body."""


@from_server(65021, "authority_changed", "The motion authority changed hands.")
class AuthorityChanged(Topic):
    """AUTHORITY_CHANGED: to every connection of the cell."""

    holder: Annotated[int, Int("session that holds it now, 0 for nobody")]
    reason: Annotated[
        int,
        Int(
            "1 granted, 2 released, 3 expired, 4 connection lost, 5 taken over, 6 logged out,"
            " 7 role lost",
            values=AuthorityReason,
        ),
    ]
    client: Annotated[str, Text("name of the new holder's pendant")]


@from_server(65023, "authority_wanted", "Somebody asked for the authority that you hold.")
class AuthorityWanted(Topic):
    """AUTHORITY_WANTED: to its holder alone."""

    session: Annotated[int, Int("who asked")]
    client: Annotated[str, Text("name of that pendant")]


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


@to_server(65017, "set_mode", "Sets the mode of operation; stops what moves.")
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


@from_server(65024, "mode_changed", "The mode of operation changed.")
class ModeChanged(Topic):
    """MODE_CHANGED: to every connection of the cell."""

    mode: Annotated[int, Int("the mode now", values=OperatingMode)]
    session: Annotated[int, Int("who did it, 0 for the controller")]
    client: Annotated[str, Text("name of that pendant")]


@to_server(
    65016,
    "enabling",
    "TRAINING: position of the enabling device; repeat it every 50 ms while it is held.",
    reply="none",
)
class Enabling(Topic):
    """ENABLING (training): no safety device. Silence for the jog deadline counts as released."""

    position: Annotated[int, Int("0 released, 1 held, 2 panic", values=EnablingPosition)]


class StopKind(IntEnum):
    """Which stop is latched."""

    NONE = 0
    SOFTWARE = 1
    PROTECTIVE = 2


@to_server(65014, "software_stop", "Stops the robot and latches; anyone may send it.")
class SoftwareStop(Message):
    """SOFTWARE_STOP: no safety device."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    reason: Annotated[str, Text("shown to others", size=64)]


@to_server(65015, "reset_stop", "Unlatches the software stop; moves nothing.")
class ResetStop(Message):
    """RESET_STOP: only the holder of the motion authority may."""

    request_id: Annotated[int, Int("chosen by the pendant")]


@from_server(65022, "stop_changed", "A stop was latched or reset.")
class StopChanged(Topic):
    """STOP_CHANGED: to every connection of the cell."""

    stop: Annotated[int, Int("latched stop: 0 none, 1 software, 2 protective", values=StopKind)]
    session: Annotated[int, Int("who did it, 0 for the server itself")]
    client: Annotated[str, Text("name of that pendant")]
    reason: Annotated[str, Text("as given", size=64)]
