"""What a pendant is told of the controller and may ask of it before it moves the robot."""

from enum import IntEnum
from typing import Annotated

from ..declaration import Int, Message, Topic
from .places import from_server, to_server


class PrepareAction(IntEnum):
    """What is to be done at the controller: all that it needs, or a single step."""

    PREPARE = 1
    RELEASE = 2
    ALARMS = 3
    DRIVES_ON = 4
    DRIVES_OFF = 5


class Preparedness(IntEnum):
    """Whether the controller is prepared to be moved by the server."""

    NO = 0
    YES = 1
    NOT_NEEDED = 2


class ControllerIdentity(IntEnum):
    """Whether the controller is that of the robot that the cell is configured for."""

    UNVERIFIED = 0
    MATCH = 1
    MISMATCH = 2


@to_server(
    65042,
    "prepare",
    "Prepares the controller, or takes a single step of that, where its dialect has one.",
    since=3,
)
class Prepare(Message):
    """PREPARE: with the motion authority; what the robot's drives do because of it is told first.

    A controller that is not known to be emulated refuses the first asking with CONFIRM_FIRST, whose
    value is a token for the second.
    """

    request_id: Annotated[int, Int("chosen by the pendant")]
    action: Annotated[
        int,
        Int(
            "1 prepare, 2 release; single steps: 3 alarms, 4 drives on, 5 drives off",
            values=PrepareAction,
        ),
    ]
    token: Annotated[int, Int("of the verdict CONFIRM_FIRST, 0 at the first asking")]


@from_server(65043, "controller_changed", "What is known of the controller changed.", since=3)
class ControllerChanged(Topic):
    """CONTROLLER_CHANGED: to every connection of the cell; ask `controller.describe` again."""

    prepared: Annotated[int, Int("0 no, 1 yes, 2 not needed", values=Preparedness)]
    identity: Annotated[int, Int("0 unverified, 1 match, 2 mismatch", values=ControllerIdentity)]
    is_emulated: Annotated[int, Int("1 where it is known to be emulated")]
    declaration: Annotated[int, Int("counts the changes of what controller.describe tells, from 1")]
