"""No error about a message tells what stands in a field that is declared secret."""

import dataclasses
import json
import struct
from typing import Any

import pytest
from rigs.data.message_samples import SAMPLES

from openpendant.simplemsg import (
    PENDANT,
    BodyFault,
    CommType,
    LocalProtocolError,
    Message,
    NotEncodable,
    codec_for,
)
from openpendant.simplemsg.packet_text import packet_from_json
from openpendant.simplemsg.pendant import Login, PairingReply, SetAccount

CODEC = codec_for(PENDANT)
SECRET = {Login: "secret", SetAccount: "secret", PairingReply: "code"}

UNFIT: dict[str, Any] = {
    "a zero byte": "geheim\0wort",
    "too long": "geheim" * 40,
    "a lone surrogate": "geheim\ud800",
    "bytes": b"geheim",
    "a list": ["geheim"],
    "a number": 7301197,
}

each_message = pytest.mark.parametrize("cls", SECRET, ids=lambda cls: cls.__name__)


def test_every_message_with_a_secret_is_looked_at() -> None:
    declared = {cls: name for cls in SAMPLES for name in cls.FIELDS if cls.is_secret(name)}
    assert declared == SECRET


@each_message
@pytest.mark.parametrize("case", UNFIT)
def test_a_secret_that_does_not_fit_is_not_shown(cls: type[Message], case: str) -> None:
    field, value = SECRET[cls], UNFIT[case]
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
    field = SECRET[cls]
    fields = {name: 0 if name != "name" else "ann" for name in cls.FIELDS} | {field: value}
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
