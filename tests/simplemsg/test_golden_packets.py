from __future__ import annotations

import pytest
from golden_vectors import FILES, GOLDEN, Golden, exact, load

from openpendant.simplemsg import Connection, Message, Opaque, Role
from openpendant.simplemsg.text import packet_from_json, packet_to_json

each_packet = pytest.mark.parametrize("golden", GOLDEN, ids=lambda golden: golden.id)

COUNTS = dict(zip(FILES, (205, 204, 204, 204, 142, 142, 142, 18, 18), strict=True))


@pytest.mark.parametrize("file", FILES)
def test_a_file_holds_as_many_packets_as_its_readme_says(file: str) -> None:
    assert len(load(file)) == COUNTS[file]


@each_packet
def test_a_packet_decodes_to_exactly_its_fields(golden: Golden) -> None:
    packet = packet_to_json(golden.codec.decode(golden.frame), golden.codec)
    name = packet.pop("name")
    assert exact(packet) == exact(golden.packet)
    assert name
    if golden.entry["source"] == "untyped":
        assert isinstance(golden.codec.decode(golden.frame), Opaque)


@each_packet
def test_the_fields_of_a_packet_encode_to_exactly_its_bytes(golden: Golden) -> None:
    message = packet_from_json(golden.packet, golden.codec)
    assert golden.codec.encode(message).hex() == golden.frame.hex()
    assert golden.codec.encode(golden.codec.decode(golden.frame)).hex() == golden.frame.hex()


@each_packet
def test_a_connection_finds_a_packet_whole_byte_by_byte_and_before_others(golden: Golden) -> None:
    frame = golden.frame
    bytewise = [frame[at : at + 1] for at in range(len(frame))]
    for chunks in ([frame], bytewise, [frame + frame[:15]]):
        connection = _connection(golden)
        received = [event for chunk in chunks for event in connection.receive(chunk)]
        assert connection.byte_order is golden.byte_order
        assert connection.fault is None
        (message,) = received
        assert isinstance(message, Message)
        assert golden.codec.encode(message).hex() == frame.hex()


def _connection(golden: Golden) -> Connection:
    connection = Connection(
        Role.SERVER, golden.dialect, real_size=golden.real_size, max_frame=65_539
    )
    connection.awaited = 1  # so that a reply counts as asked for
    return connection
