"""Registration of our own messages in the protocol: one function for each direction."""

from ..declaration import Direction, Place

JOINT_UNIT = "rad, m for a linear axis"
"""Unit of a joint value, as the reference prints it."""

_SOURCE = "openpendant"
_NO_REPLY = "none"


def to_server(msg_type: int, name: str, about: str, reply: str = "verdict") -> Place:
    """Place a message of a pendant; a topic says `reply="none"`."""
    return Place(msg_type, name, Direction.TO_SERVER, reply, _SOURCE, about)


def from_server(msg_type: int, name: str, about: str, *, is_reply: bool = False) -> Place:
    """Place a message to a pendant: a notification, or a reply with a body of its own."""
    direction = Direction.FROM_SERVER
    return Place(msg_type, name, direction, _NO_REPLY, _SOURCE, about, is_reply=is_reply)


def to_controller(msg_type: int, name: str, about: str, reply: str) -> Place:
    """Place a request of the server to a controller."""
    return Place(msg_type, name, Direction.TO_CONTROLLER, reply, _SOURCE, about)


def from_controller(msg_type: int, name: str, about: str) -> Place:
    """Place a controller's reply with a body of its own."""
    direction = Direction.FROM_CONTROLLER
    return Place(msg_type, name, direction, _NO_REPLY, _SOURCE, about, is_reply=True)
