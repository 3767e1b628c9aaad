from collections.abc import Callable
from dataclasses import replace

import pytest
from rigs.data.case_table import CASE_VARIABLE, every, same
from rigs.data.golden_vectors import FILES, Golden, exact, golden_cases, load

from openpendant.simplemsg import Connection, Message, Opaque, Role
from openpendant.simplemsg.packet_text import packet_from_json, packet_to_json

each_file = pytest.mark.parametrize("file", FILES)

COUNTS = dict(zip(FILES, (205, 204, 204, 204, 142, 142, 142, 18, 18), strict=True))


@each_file
def test_a_file_holds_as_many_packets_as_its_readme_says(file: str) -> None:
    assert len(load(file)) == len(golden_cases(file)) == COUNTS[file]


@each_file
def test_every_packet_decodes_to_exactly_its_fields(file: str) -> None:
    every(golden_cases(file), _decodes_to_its_fields)


def _decodes_to_its_fields(golden: Golden) -> None:
    packet = packet_to_json(golden.codec.decode(golden.frame), golden.codec)
    name = packet.pop("name")
    same(exact(packet), exact(golden.packet))
    assert name
    if golden.entry["source"] == "untyped":
        assert isinstance(golden.codec.decode(golden.frame), Opaque)


@each_file
def test_the_fields_of_every_packet_encode_to_exactly_its_bytes(file: str) -> None:
    every(golden_cases(file), _encodes_to_its_bytes)


def _encodes_to_its_bytes(golden: Golden) -> None:
    message = packet_from_json(golden.packet, golden.codec)
    same(golden.codec.encode(message).hex(), golden.frame.hex())
    same(golden.codec.encode(golden.codec.decode(golden.frame)).hex(), golden.frame.hex())


@each_file
def test_a_connection_finds_every_packet_whole_byte_by_byte_and_before_others(file: str) -> None:
    every(golden_cases(file), _is_found_however_it_comes)


def _is_found_however_it_comes(golden: Golden) -> None:
    frame = golden.frame
    bytewise = [frame[at : at + 1] for at in range(len(frame))]
    for chunks in ([frame], bytewise, [frame + frame[:15]]):
        connection = Connection(
            Role.SERVER, golden.dialect, real_size=golden.real_size, max_frame=65_539
        )
        connection.awaited = 1  # so that a reply counts as asked for
        received = [event for chunk in chunks for event in connection.receive(chunk)]
        assert connection.byte_order is golden.byte_order
        assert connection.fault is None
        (message,) = received
        assert isinstance(message, Message)
        same(golden.codec.encode(message).hex(), frame.hex())


@pytest.mark.parametrize("check", [_decodes_to_its_fields, _encodes_to_its_bytes])
def test_one_wrong_byte_in_a_file_is_told_with_the_id_of_its_packet(
    check: Callable[[Golden], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(CASE_VARIABLE, raising=False)
    cases = dict(golden_cases("motoman-be-f32"))
    spoilt = "motoman-be-f32:motoman_motion_ctrl/cmd200102/1/request"
    digits = cases[spoilt].entry["hex"]
    wrong = digits.replace("3fc00000", "3fc00001")
    assert wrong != digits
    cases[spoilt] = replace(cases[spoilt], entry={**cases[spoilt].entry, "hex": wrong})
    with pytest.raises(AssertionError) as failed:
        every(cases.items(), check)
    head, line = str(failed.value).splitlines()
    assert head.startswith("1 of 142 cases fail")
    assert line.startswith(f"{spoilt}: differs from character ")
