"""Faults of the wire protocol, told apart by who is to blame.

ProtocolError
├── LocalProtocolError      we were asked to send what may not be sent: a bug on our side
│   └── NotEncodable        a field's value does not fit its type on the wire
└── RemoteProtocolError     the peer sent what may not be sent
    ├── FramingFault        the byte count is lost or out of bounds: the link must be closed
    │   ├── LengthOutOfBounds
    │   └── OrderUndetectable
    └── MessageFault        one frame is wrong, its bounds are not: the link can live on
        ├── HeaderFault
        └── BodyFault
"""

from __future__ import annotations

_SHOWN_LENGTH = 60


def shown(value: object) -> str:
    """Return a value as an error text shows it: at most 60 characters, whatever it is."""
    try:
        text = repr(value)
    except ValueError:  # Python refuses to write integers of thousands of digits
        text = f"a huge {type(value).__name__}"
    return text if len(text) <= _SHOWN_LENGTH else text[: _SHOWN_LENGTH - 1] + "…"


class ProtocolError(Exception):
    """Base of every fault of the wire protocol."""


class LocalProtocolError(ProtocolError):
    """Our own side tried to send something that the protocol forbids."""


class NotEncodable(LocalProtocolError):
    """A message cannot be encoded.

    Attributes:
        field: the value at fault, such as `sequence`, `joints[3]` or `points[0].velocity`.
        value: the value that does not fit; asterisks where it is a secret.
    """

    def __init__(self, message_name: str, field: str, value: object, expected: str) -> None:
        super().__init__(f"{message_name}.{field} is {shown(value)}: expected {expected}")
        self.message_name = message_name
        self.field = field
        self.value = value
        self.expected = expected


class RemoteProtocolError(ProtocolError):
    """The peer sent something that the protocol forbids."""


class FramingFault(RemoteProtocolError):
    """The position in the byte stream cannot be trusted any more; close the link."""


class LengthOutOfBounds(FramingFault):
    """A length prefix lies outside what this connection accepts.

    Attributes:
        length: the declared length, in bytes after the prefix.
        lower: smallest accepted length (the header alone).
        upper: largest accepted length.
    """

    def __init__(self, length: int, lower: int, upper: int) -> None:
        super().__init__(f"declared length {length} is outside {lower} to {upper} bytes")
        self.length = length
        self.lower = lower
        self.upper = upper


class OrderUndetectable(FramingFault):
    """The first four bytes are no plausible length in either byte order."""

    def __init__(self, prefix: bytes) -> None:
        super().__init__(
            f"first bytes {prefix.hex()} are no length from 12 to 65535 in either byte order"
        )
        self.prefix = prefix


class MessageFault(RemoteProtocolError):
    """One frame is wrong inside its bounds; the link itself is sound."""

    def __init__(self, reason: str, msg_type: int, comm_type: int, reply_code: int) -> None:
        super().__init__(reason)
        self.msg_type = msg_type
        self.comm_type = comm_type
        self.reply_code = reply_code


class HeaderFault(MessageFault):
    """The header breaks one of the validity rules (type, communication type, reply code)."""


class BodyFault(MessageFault):
    """The body does not have the layout that the message type declares."""
