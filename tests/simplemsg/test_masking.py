"""Secrets in bytes that are written down (promise 30), and in errors about a message."""

import dataclasses
import json
import struct
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.message_samples import SAMPLES

from openpendant.simplemsg import (
    PENDANT,
    BodyFault,
    ByteOrder,
    Codec,
    CommType,
    LocalProtocolError,
    Message,
    NotEncodable,
    Opaque,
    codec_for,
)
from openpendant.simplemsg.declaration import Text
from openpendant.simplemsg.masking import SecretMask, masked_frame
from openpendant.simplemsg.packet_text import packet_from_json, packet_to_json
from openpendant.simplemsg.pendant import (
    Forwarded,
    Login,
    Management,
    Pairing,
    PairingReply,
    SetAccount,
    SoftwareStop,
)

SECRET = "canary äöü"
WITH_SECRETS: tuple[Message, ...] = (
    Login(7, 1, "ann", SECRET),
    SetAccount(8, 2, "ann", SECRET),
    PairingReply(9, 900, "ABC-DEF"),
    Forwarded("web", SECRET, "192.0.2.7", 1),
)
WITHOUT: tuple[Message, ...] = (
    Pairing(3, 1),
    SoftwareStop(4, "canary is a fine reason"),
    Management(5, b'{"op": "snapshot"}'),
)

orders = pytest.mark.parametrize("order", ByteOrder)


def codec(order: ByteOrder) -> Codec:
    return codec_for(PENDANT, order, 4)


@orders
@pytest.mark.parametrize("message", WITH_SECRETS, ids=lambda each: type(each).__name__)
def test_masked_frames_keep_size_and_all_but_the_secret(message: Message, order: ByteOrder) -> None:
    frame = codec(order).encode(message)
    masked = masked_frame(frame)
    assert len(masked) == len(frame)
    (secret,) = filter(message.is_secret, message.FIELDS)
    assert set(str(getattr(codec(order).decode(masked), secret))) >= {"*"}
    assert b"canary" not in masked
    assert b"ABC" not in masked
    assert masked[: -len(frame) + 24] == frame[: -len(frame) + 24]


@orders
@pytest.mark.parametrize("message", WITHOUT, ids=lambda each: type(each).__name__)
def test_a_frame_without_a_secret_stays_as_it_is(message: Message, order: ByteOrder) -> None:
    frame = codec(order).encode(message)
    assert masked_frame(frame) == frame


@orders
@given(cuts=st.lists(st.integers(0, 600), max_size=8))
def test_it_does_not_matter_in_what_portions_bytes_come(order: ByteOrder, cuts: list[int]) -> None:
    frames = [codec(order).encode(message) for message in (*WITH_SECRETS, *WITHOUT)]
    stream = b"".join(frames)
    mask, ends = SecretMask(), [*sorted(cuts), len(stream)]
    pieces = [stream[a:b] for a, b in zip([0, *ends], ends, strict=False)]
    masked = b"".join(mask.feed(piece) for piece in pieces)
    assert masked == b"".join(masked_frame(frame) for frame in frames)


@given(secret=st.binary(max_size=40))
def test_masked_bytes_are_text_exactly_where_the_real_ones_were(secret: bytes) -> None:
    """A repetition has to find the same frames malformed, or it would answer otherwise."""
    frame = codec(ByteOrder.LITTLE).encode(Login(7, 1, "ann", ""))
    start = len(frame) - 128
    real = frame[:start] + secret.ljust(128, b"\0")
    assert _is_text(masked_frame(real)[start:]) == _is_text(real[start:])


def _is_text(data: bytes) -> bool:
    try:
        data.decode()
    except UnicodeDecodeError:
        return False
    return True


@orders
def test_what_stands_around_a_secret_in_a_frame_stays(order: ByteOrder) -> None:
    told = Forwarded("web", SECRET, "192.0.2.7", 1)
    masked = codec(order).decode(masked_frame(codec(order).encode(told)))
    assert isinstance(masked, Forwarded)
    assert (masked.gateway, masked.address, masked.is_encrypted) == ("web", "192.0.2.7", 1)
    assert set(masked.secret) >= {"*"}


def test_masking_twice_changes_nothing() -> None:
    frame = codec(ByteOrder.LITTLE).encode(Login(7, 1, "ann", SECRET + "€😀"))
    assert masked_frame(masked_frame(frame)) == masked_frame(frame)


def test_a_login_of_another_size_is_masked_as_a_whole() -> None:
    """Whoever built it wrongly may have put the password anywhere."""
    frame = codec(ByteOrder.LITTLE).encode(Opaque(65007, b"canary" * 5, comm_type=2))
    assert b"canary" not in masked_frame(frame)
    assert masked_frame(frame)[:16] == frame[:16]


def test_what_follows_a_length_that_no_frame_has_is_masked() -> None:
    mask = SecretMask()
    assert b"canary" not in mask.feed(b"GET /?canary HTTP/1.1\r\n") + mask.feed(b"canary")


@pytest.mark.parametrize("message", WITH_SECRETS, ids=lambda each: type(each).__name__)
def test_no_message_shows_its_secret(message: Message) -> None:
    shown = repr(message) + str(packet_to_json(message, codec(ByteOrder.LITTLE)))
    assert "canary" not in shown
    assert "ABC" not in shown
    assert "********" in shown


def test_a_login_that_is_not_taken_apart_does_not_show_it_either() -> None:
    body = codec(ByteOrder.LITTLE).encode(Login(7, 1, "ann", SECRET))[16:]
    packet = Opaque(65007, body, comm_type=2)
    assert b"canary".hex() not in str(packet_to_json(packet, codec_for()))


CODEC = codec_for(PENDANT)
SECRETS = {Forwarded: "secret", Login: "secret", SetAccount: "secret", PairingReply: "code"}

UNFIT: dict[str, Any] = {
    "a zero byte": "geheim\0wort",
    "too long": "geheim" * 40,
    "a lone surrogate": "geheim\ud800",
    "bytes": b"geheim",
    "a list": ["geheim"],
    "a number": 7301197,
}

each_message = pytest.mark.parametrize("cls", SECRETS, ids=lambda cls: cls.__name__)


def test_every_message_with_a_secret_is_looked_at() -> None:
    declared = {cls: name for cls in SAMPLES for name in cls.FIELDS if cls.is_secret(name)}
    assert declared == SECRETS


@each_message
@pytest.mark.parametrize("case", UNFIT)
def test_a_secret_that_does_not_fit_is_not_shown(cls: type[Message], case: str) -> None:
    field, value = SECRETS[cls], UNFIT[case]
    message = dataclasses.replace(SAMPLES[cls], **{field: value})
    with pytest.raises(NotEncodable) as caught:
        CODEC.encode(message)
    size = cls.FIELDS[field].size  # type: ignore[attr-defined]
    name = f"{cls.PLACE.name}.{field}"
    expected = f"expected up to {size} bytes of UTF-8 without a zero byte"
    assert str(caught.value) == f"{name} is '********': {expected}"
    assert not _shows(vars(caught.value))


def _shows(told: object) -> bool:
    return any(part in repr(told) for part in ("geheim", "7301197"))


@each_message
@pytest.mark.parametrize("value", [7301197, ["geheim"], {"geheim": 1}], ids=str)
def test_a_secret_that_is_no_text_is_not_shown(cls: type[Message], value: Any) -> None:
    field = SECRETS[cls]
    of_text = {name for name, each in cls.FIELDS.items() if isinstance(each, Text)}
    fields = {name: "ann" if name in of_text else 0 for name in cls.FIELDS} | {field: value}
    comm = int(CommType.REPLY if cls.PLACE.is_reply else CommType.REQUEST)
    header = {"msg_type": cls.PLACE.msg_type, "comm_type": comm, "reply_code": comm // 3}
    packet = json.loads(json.dumps({**header, "fields": fields}))
    with pytest.raises(LocalProtocolError, match=rf"{field} must be a string") as caught:
        packet_from_json(packet, CODEC)
    assert not _shows(str(caught.value))


@pytest.mark.parametrize("cls", [Login, SetAccount])
def test_no_byte_of_a_secret_that_is_no_utf_8_is_told(cls: type[Message]) -> None:
    """Sent back in a verdict, such a text would get into the journal."""
    body = bytes(40) + "geh\xe4im".encode("latin-1").ljust(128, b"\0")
    header = struct.pack("<4i", 12 + len(body), cls.PLACE.msg_type, CommType.REQUEST, 0)
    with pytest.raises(BodyFault) as caught:
        CODEC.decode(header + body)
    assert str(caught.value) == f"{cls.PLACE.name}: a text is not UTF-8"
