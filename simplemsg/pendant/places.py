"""Declaration of our own messages in the protocol: one decorator for each direction."""

from typing import dataclass_transform

from ..declaration import Direction, MessageDecorator, Place, message

JOINT_UNIT = "rad, m for a linear axis"
"""Unit of a joint value, as the reference prints it."""

_SOURCE = "openpendant"
_NO_REPLY = "none"


@dataclass_transform()
def to_server(
    msg_type: int, name: str, about: str, reply: str = "verdict", *, since: int = 2
) -> MessageDecorator:
    """Declare a message of a pendant; a topic says `reply="none"`.

    Args:
        since: the first version of the pendant protocol that has it.
    """
    return message(Place(msg_type, name, Direction.TO_SERVER, reply, _SOURCE, about, since=since))


@dataclass_transform()
def from_server(
    msg_type: int, name: str, about: str, *, is_reply: bool = False, since: int = 2
) -> MessageDecorator:
    """Declare a message to a pendant: a notification, or a reply with a body of its own.

    Args:
        since: the first version of the pendant protocol that has it.
    """
    direction = Direction.FROM_SERVER
    place = Place(msg_type, name, direction, _NO_REPLY, _SOURCE, about, is_reply, since=since)
    return message(place)


@dataclass_transform()
def to_controller(msg_type: int, name: str, about: str, reply: str) -> MessageDecorator:
    """Declare a request of the server to a controller."""
    return message(Place(msg_type, name, Direction.TO_CONTROLLER, reply, _SOURCE, about))


@dataclass_transform()
def from_controller(msg_type: int, name: str, about: str) -> MessageDecorator:
    """Declare a controller's reply with a body of its own."""
    direction = Direction.FROM_CONTROLLER
    return message(Place(msg_type, name, direction, _NO_REPLY, _SOURCE, about, is_reply=True))
