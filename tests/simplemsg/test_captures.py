from __future__ import annotations

from collections import defaultdict
from typing import Any

import pytest
from golden_vectors import load

from openpendant.simplemsg import (
    MOTOMAN,
    STANDARD,
    BodyFault,
    ByteOrder,
    Codec,
    Connection,
    Dialect,
    HeaderFault,
    Malformed,
    MessageFault,
    Role,
    codec_for,
)

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


@each_scenario
def test_every_recorded_packet_decodes_and_encodes_to_the_same_bytes(
    scenario: str, dialect: Dialect, packets: Packets
) -> None:
    codec = _codec(scenario, dialect)
    faults: list[type[MessageFault]] = []
    for item in packets:
        frame = bytes.fromhex(item["hex"])
        try:
            assert codec.encode(codec.decode(frame)).hex() == item["hex"], item
        except MessageFault as fault:
            faults.append(type(fault))
    assert faults == BROKEN_ON_PURPOSE.get(scenario, [])


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
