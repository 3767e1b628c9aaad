"""What real peers sent, and where we read it otherwise than the C++ library does."""

import re
import struct
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from rigs.data.golden_vectors import exact, load

from openpendant.simplemsg import (
    MOTOMAN,
    STANDARD,
    BodyFault,
    ByteOrder,
    Codec,
    Connection,
    Dialect,
    HeaderFault,
    HeaderOnly,
    Malformed,
    Message,
    MessageFault,
    Opaque,
    Role,
    codec_for,
)
from openpendant.simplemsg.declaration import Array, Field, Int, Record, Tail
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.simplemsg.layout import WireForm
from openpendant.simplemsg.packet_text import packet_to_json

CAPTURES: dict[str, Dialect] = {
    "capture-industrial-robot-client": STANDARD,
    "capture-motoman-driver": MOTOMAN,
}

BROKEN_ON_PURPOSE: dict[str, list[type[MessageFault]]] = {
    "stream_invalid_reply_header": [HeaderFault, HeaderFault],
    "state_bad_frames": [BodyFault, HeaderFault, HeaderFault, HeaderFault],
}
"""What the scripted controller got wrong, in order, to see what the client does."""

Packets = list[dict[str, Any]]


def _scenarios() -> list[tuple[str, Dialect, Packets]]:
    found = []
    for file, dialect in CAPTURES.items():
        packets: dict[str, Packets] = defaultdict(list)
        for item in load(file):
            if item["dir"] != "event":
                packets[item["scenario"]].append(item)
        found += [(scenario, dialect, items) for scenario, items in packets.items()]
    return found


def _codec(scenario: str, dialect: Dialect) -> Codec:
    return codec_for(dialect, ByteOrder.BIG if "bswap" in scenario else ByteOrder.LITTLE)


each_scenario = pytest.mark.parametrize(
    ("scenario", "dialect", "packets"), _scenarios(), ids=lambda value: str(value)[:60]
)


def _as_received(frame: bytes, message: Message, byte_order: ByteOrder) -> bytes:
    """Return a frame of 4-byte reals without the bits that the declaration masks."""
    if isinstance(message, HeaderOnly | Opaque):
        return frame
    kept = bytearray(frame)
    at = HEADER_SIZE
    form = WireForm(byte_order.value, "f")
    for field, value in _single_fields(message):
        size = form.structure({"field": field}).size if not isinstance(field, Tail) else len(value)
        if isinstance(field, Int) and field.mask is not None:
            word = struct.Struct(f"{byte_order.value}I")
            word.pack_into(kept, at, word.unpack_from(frame, at)[0] & field.mask)
        at += size
    return bytes(kept)


def _single_fields(record: Record) -> Iterator[tuple[Field, Any]]:
    for name, field in record.FIELDS.items():
        value = getattr(record, name)
        if not isinstance(field, Array):
            yield field, value
            continue
        for inner in value:
            yield from _single_fields(inner)


@each_scenario
def test_every_recorded_packet_encodes_to_the_same_bytes_but_for_masked_bits(
    scenario: str, dialect: Dialect, packets: Packets
) -> None:
    codec = _codec(scenario, dialect)
    faults: list[type[MessageFault]] = []
    for item in packets:
        frame = bytes.fromhex(item["hex"])
        try:
            message = codec.decode(frame)
        except MessageFault as fault:
            faults.append(type(fault))
            continue
        expected = _as_received(frame, message, codec.byte_order)
        assert codec.encode(message).hex() == expected.hex(), item
    assert faults == BROKEN_ON_PURPOSE.get(scenario, [])


def test_only_the_real_client_with_two_groups_sent_rubbish_bits() -> None:
    differing = set()
    for scenario, dialect, packets in _scenarios():
        codec = _codec(scenario, dialect)
        frames = (bytes.fromhex(item["hex"]) for item in packets if dialect is MOTOMAN)
        differing |= {
            (scenario, each[4:8]) for each in frames if codec.encode(codec.decode(each)) != each
        }
    assert differing == {("motoman_two_groups", (2016).to_bytes(4, "little"))}


@each_scenario
def test_what_the_recorded_client_sent_is_never_malformed(
    scenario: str, dialect: Dialect, packets: Packets
) -> None:
    by_link: dict[tuple[int, int], Connection] = {}
    for item in packets:
        if item["dir"] != "client->server":
            continue
        link = (item["port"], item["conn"])
        connection = by_link.setdefault(link, Connection(Role.SERVER, dialect))
        (received,) = connection.receive(bytes.fromhex(item["hex"]))
        assert not isinstance(received, Malformed)
        assert connection.fault is None
    orders = {connection.byte_order for connection in by_link.values()}
    assert orders <= {_codec(scenario, dialect).byte_order}


ENTRIES = load("decode-behaviour-le-f32")
REFERENCE = Path(__file__).parents[2] / "docs" / "simplemsg.md"
HEADING = "## Where this differs from the C++ library"


def _listed_deviations() -> set[str]:
    section = REFERENCE.read_text(encoding="utf-8").split(HEADING, 1)[1].split("\n## ", 1)[0]
    return set(re.findall(r"^\| `([a-z_]+/[^`]+)` \|", section, flags=re.MULTILINE))


def _decode(entry: dict[str, Any]) -> Message | MessageFault:
    try:
        return codec_for().decode(bytes.fromhex(entry["hex"]))
    except MessageFault as fault:
        return fault


def _behaves_like_the_library(entry: dict[str, Any]) -> bool:
    """Compare acceptance of the header, acceptance of the body, and the values read."""
    decoded, typed = _decode(entry), entry["typed_decode"]
    if not entry["message_accepted"]:
        return isinstance(decoded, HeaderFault)
    if typed is False:
        return isinstance(decoded, BodyFault)
    if isinstance(decoded, MessageFault) or isinstance(decoded, Opaque) != (typed is None):
        return False
    if not isinstance(typed, dict):
        return True
    return exact(packet_to_json(decoded, codec_for())["fields"]) == exact(typed)


def test_the_deviating_inputs_are_exactly_those_that_the_documentation_lists() -> None:
    deviating = {entry["name"] for entry in ENTRIES if not _behaves_like_the_library(entry)}
    assert deviating == _listed_deviations()


@pytest.mark.parametrize(
    "entry",
    [entry for entry in ENTRIES if entry["name"].startswith("joint_position/extra")],
    ids=lambda entry: entry["name"],
)
def test_a_body_that_is_too_long_is_refused_with_both_sizes(entry: dict[str, Any]) -> None:
    with pytest.raises(BodyFault, match="the body has 48 bytes, not 44"):
        codec_for().decode(bytes.fromhex(entry["hex"]))
