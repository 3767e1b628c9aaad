"""The mode of operation, and the enabling device (training) that the manual modes ask for."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Text, Topic, message
from .places import from_server, to_server


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


@message(to_server(65017, "set_mode", "Sets the mode of operation; stops what moves."))
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


@message(from_server(65024, "mode_changed", "The mode of operation changed."))
class ModeChanged(Topic):
    """MODE_CHANGED: to every connection of the cell."""

    mode: Annotated[int, Int("the mode now", values=OperatingMode)]
    session: Annotated[int, Int("who did it, 0 for the controller")]
    client: Annotated[str, Text("name of that pendant")]


@message(
    to_server(
        65016,
        "enabling",
        "TRAINING: position of the enabling device; repeat it every 50 ms while it is held.",
        reply="none",
    )
)
class Enabling(Topic):
    """ENABLING (training): no safety device. Silence for the jog deadline counts as released."""

    position: Annotated[int, Int("0 released, 1 held, 2 panic", values=EnablingPosition)]
