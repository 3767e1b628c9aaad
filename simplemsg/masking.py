"""Masking of secrets in bytes that are written down.

Owns that no password, pairing code or secret of a gateway gets into a journal or a recording
(promise 30). Sizes stay, and what is text stays text, so that whoever reads the masked bytes takes
them apart as the real ones were. Secrets are the fields that are declared so, one in a message.
"""

from __future__ import annotations

from typing import Literal

from .codes import ByteOrder
from .declaration import Int, Message, Record, Text
from .framing import HEADER_SIZE, MAX_DETECTABLE_LENGTH, PREFIX_SIZE, detect_byte_order
from .pendant import PENDANT_MESSAGES

_TYPE_ENDS = 2 * PREFIX_SIZE

_WORDS: dict[ByteOrder, Literal["little", "big"]] = {
    ByteOrder.LITTLE: "little",
    ByteOrder.BIG: "big",
}


def _substitute(byte: int) -> int:
    """Return what stands for a byte, so that UTF-8 stays UTF-8 and anything else does not."""
    if byte == 0:
        return 0  # ends a text
    if byte < 0x80:
        return ord("*")
    for first, last, stands in _UTF8_CLASSES:
        if first <= byte <= last:
            return stands
    return 0xFF


_UTF8_CLASSES = (
    (0x80, 0x8F, 0x80),
    (0x90, 0x9F, 0x90),
    (0xA0, 0xBF, 0xA0),
    (0xC2, 0xDF, 0xC2),
    (0xE0, 0xE0, 0xE0),
    (0xE1, 0xEC, 0xE1),
    (0xED, 0xED, 0xED),
    (0xEE, 0xEF, 0xE1),
    (0xF0, 0xF0, 0xF0),
    (0xF1, 0xF3, 0xF1),
    (0xF4, 0xF4, 0xF4),
)
"""Bytes that may stand in the same places of a text: first, last, and the one that is written."""

_MASKED = bytes(map(_substitute, range(256)))


_Span = tuple[int, int]
"""Where a secret begins in a frame, and where it ends."""

_NOWHERE: _Span = (0, 0)


def _secret_of(cls: type[Record]) -> _Span:
    """Return where a message's secret is in its frame; `_NOWHERE` where it has none."""
    at = HEADER_SIZE
    for name, field in cls.FIELDS.items():
        match field:
            case Text() if cls.is_secret(name):
                return at, at + field.size
            case Int():
                at += 4
            case Text():
                at += field.size
            case _:
                return _NOWHERE
    return _NOWHERE


def _layouts() -> dict[int, dict[int, _Span]]:
    """Return by message type, for each declared size of frame, where its secret is."""
    with_secret = {_number(cls) for cls in PENDANT_MESSAGES if _secret_of(cls) != _NOWHERE}
    layouts: dict[int, dict[int, _Span]] = {}
    for cls in PENDANT_MESSAGES:
        if _number(cls) in with_secret:
            layouts.setdefault(_number(cls), {})[_size(cls)] = _secret_of(cls)
    return layouts


def _number(cls: type[Message]) -> int:
    return cls.PLACE.msg_type


def _size(cls: type[Message]) -> int:
    return HEADER_SIZE + sum(
        field.size if isinstance(field, Text) else 4 for field in cls.FIELDS.values()
    )


_LAYOUTS = _layouts()


class SecretMask:
    """Masks the secrets of one direction of a connection, as its bytes come in any portions.

    Attributes:
        is_lost: no frame can be found any more; all that follows is masked.
    """

    def __init__(self) -> None:
        self._head = bytearray()
        self._word: Literal["little", "big"] | None = None
        self._at = 0
        self._size = 0
        self._secret = _NOWHERE
        self.is_lost = False

    def feed(self, data: bytes) -> bytes:
        """Return the next bytes with the secrets in them masked; as many as came."""
        out = bytearray()
        used = 0
        while used < len(data):
            if self.is_lost:
                # No frame can be found any more, so any byte may belong to a secret.
                out += data[used:].translate(_MASKED)
                break
            part = data[used : used + self._portion]
            out += self._masked(part)
            self._pass(part)
            used += len(part)
        return bytes(out)

    @property
    def _portion(self) -> int:
        """Number of bytes that follow until the next decision."""
        if self._at < PREFIX_SIZE:
            return PREFIX_SIZE - self._at
        return (_TYPE_ENDS if self._at < _TYPE_ENDS else self._size) - self._at

    def _masked(self, part: bytes) -> bytes:
        begin, end = (max(at - self._at, 0) for at in self._secret)
        if not end:
            return part
        return part[:begin] + part[begin:end].translate(_MASKED) + part[end:]

    def _pass(self, part: bytes) -> None:
        if self._at < _TYPE_ENDS:
            self._head += part
        self._at += len(part)
        if self._at == PREFIX_SIZE:
            self._read_length()
        elif self._at == _TYPE_ENDS:
            self._read_type()
        elif self._at == self._size:
            self._head.clear()
            self._at = self._size = 0
            self._secret = _NOWHERE

    def _read_length(self) -> None:
        if self._word is None:
            order = detect_byte_order(self._head)
            self._word = None if order is None else _WORDS[order]
        length = 0 if self._word is None else int.from_bytes(self._head, self._word)
        self._size = PREFIX_SIZE + length
        self.is_lost = not HEADER_SIZE <= self._size <= PREFIX_SIZE + MAX_DETECTABLE_LENGTH

    def _read_type(self) -> None:
        assert self._word is not None
        layouts = _LAYOUTS.get(int.from_bytes(self._head[PREFIX_SIZE:], self._word))
        if layouts is not None:
            # A frame of another size than declared may hold the secret anywhere.
            self._secret = layouts.get(self._size, (HEADER_SIZE, self._size))


def masked_body(msg_type: int, body: bytes) -> bytes:
    """Return a body that is not taken apart; all of it masked where it may hold a secret."""
    return body.translate(_MASKED) if msg_type in _LAYOUTS else body


def masked_frame(frame: bytes) -> bytes:
    """Return a frame, or its beginning, with its secret masked; what is no frame as it is."""
    mask = SecretMask()
    masked = mask.feed(frame)
    return frame if mask.is_lost else masked
