"""Frames whose body is not taken apart: bare replies, and types that the dialect does not know."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from .codes import CommType, ReplyCode
from .declaration import Message


@dataclass(slots=True)
class HeaderOnly(Message):
    """A reply with an empty body, of any type: the plain "taken" or "not taken".

    Attributes:
        msg_type: type of the request that it answers.
    """

    msg_type: int
    comm_type: int = dataclasses.field(default=CommType.REPLY, kw_only=True)
    reply_code: int = dataclasses.field(default=ReplyCode.SUCCESS, kw_only=True)


@dataclass(slots=True)
class Opaque(Message):
    """A frame of a type that the dialect does not know, or a reply in a vendor's own layout.

    Attributes:
        msg_type: type from the header.
        body: the body as it came, byte order and all.
    """

    msg_type: int
    body: bytes


_UNDECLARED = HeaderOnly, Opaque


def message_type(message: Message) -> int:
    """Return the message type of any message, declared or not."""
    if isinstance(message, _UNDECLARED):
        return message.msg_type
    return message.PLACE.msg_type


def accepted(request: Message) -> HeaderOnly:
    """Return the bare reply that says: the request could be taken."""
    return HeaderOnly(message_type(request), reply_code=ReplyCode.SUCCESS)


def refused(request: Message) -> HeaderOnly:
    """Return the bare reply that says: the request could not be taken."""
    return HeaderOnly(message_type(request), reply_code=ReplyCode.FAILURE)
