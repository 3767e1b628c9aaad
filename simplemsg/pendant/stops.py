"""The latched software and protective stop: latching, resetting, hearing of it."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Text, Topic, message
from .places import from_server, to_server


class StopKind(IntEnum):
    """Which stop is latched."""

    NONE = 0
    SOFTWARE = 1
    PROTECTIVE = 2


@message(to_server(65014, "software_stop", "Stops the robot and latches; anyone may send it."))
class SoftwareStop(Message):
    """SOFTWARE_STOP: no safety device."""

    request_id: Annotated[int, Int("chosen by the pendant")]
    reason: Annotated[str, Text("shown to others", size=64)]


@message(to_server(65015, "reset_stop", "Unlatches the software stop; moves nothing."))
class ResetStop(Message):
    """RESET_STOP: only the holder of the motion authority may."""

    request_id: Annotated[int, Int("chosen by the pendant")]


@message(from_server(65022, "stop_changed", "A stop was latched or reset."))
class StopChanged(Topic):
    """STOP_CHANGED: to every connection of the cell."""

    stop: Annotated[int, Int("latched stop: 0 none, 1 software, 2 protective", values=StopKind)]
    session: Annotated[int, Int("who did it, 0 for the server itself")]
    client: Annotated[str, Text("name of that pendant")]
    reason: Annotated[str, Text("as given", size=64)]
