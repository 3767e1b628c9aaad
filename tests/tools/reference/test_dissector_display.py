import struct
from pathlib import Path

import pytest
from rigs.data.tshark_captures import (
    Dissected,
    Segment,
    dissect,
    dissect_parts,
    run_tshark,
    write_parts,
    write_pcap,
)

from openpendant.simplemsg import (
    PENDANT,
    STANDARD,
    CommType,
    HeaderOnly,
    JointPosition,
    Message,
    Ping,
    Status,
    codec_for,
)
from openpendant.simplemsg.pendant import Management, SoftwareStop
from openpendant.tools.reference.dissector import PORTS
from openpendant.tools.reference.samples import sample

LITTLE = codec_for(STANDARD)
PENDANT_LITTLE = codec_for(PENDANT)


def _columns(script: Path, pcap: Path, *options: str) -> list[list[str]]:
    printed = run_tshark(
        script, pcap, "-T", "fields", "-e", "_ws.col.Protocol", "-e", "_ws.col.Info", *options
    )
    return [line.split("\t") for line in printed.splitlines()]


def _from(port: int, frame: bytes, *, to_server: bool = True) -> Segment:
    return Segment(frame, port=port, to_server=to_server)


BODY = '{"op": "größer"}'
FIRST_FRAMES = (Status, SoftwareStop)
FOREIGN = (b"GET / HTTP/1.1\r\n\r\n", bytes(64), b"\x10\0\0\0" + b"\x77" * 16)
UNREGISTERED = _from(33_333, struct.pack("<4i", 12, 77, 1, 0))

PARTS: dict[str, list[Segment]] = {
    "stop": [
        _from(11010, PENDANT_LITTLE.encode(SoftwareStop(request_id=7, reason=""))),
        _from(11010, PENDANT_LITTLE.encode(HeaderOnly(65014, reply_code=2)), to_server=False),
    ],
    "two": [
        Segment(LITTLE.encode(Ping()) + LITTLE.encode(Ping(comm_type=CommType.REPLY, reply_code=1)))
    ],
    "status": [Segment(LITTLE.encode(Status(1, 0, 0, -1, 0, 2, 1)))],
    "json": [_from(11010, PENDANT_LITTLE.encode(Management(1, BODY.encode())))],
    **{
        cls.__name__: [_from(33_333, PENDANT_LITTLE.encode(sample(cls)))] * 2
        for cls in FIRST_FRAMES
    },
    **{f"foreign {number}": [_from(33_333, first)] for number, first in enumerate(FOREIGN)},
    "unregistered": [UNREGISTERED],
}
"""Captures that are read with the usual options, in one run of tshark."""


@pytest.fixture(name="dissected", scope="module")
def _dissected(
    script: Path, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, list[Dissected]]:
    return dissect_parts(script, tmp_path_factory.mktemp("parts") / "parts.pcap", PARTS)


def test_the_info_column_names_what_was_asked_and_answered_and_each_frame_of_a_segment(
    script: Path, tmp_path: Path
) -> None:
    write_parts(tmp_path / "info.pcap", {name: PARTS[name] for name in ("stop", "two")})
    assert _columns(script, tmp_path / "info.pcap") == [
        ["SimpleMessage", "software_stop(65014) request request_id=7  "],
        ["SimpleMessage", "software_stop(65014) reply FAILURE  "],
        ["SimpleMessage", "ping(1) request  ping(1) reply SUCCESS  "],
    ]


def test_special_values_have_their_names(dissected: dict[str, list[Dissected]]) -> None:
    (status,) = dissected["status"]
    labels = {one.name.rpartition(".")[2]: one.label for one in status.body()}
    assert labels["in_error"] == "in_error: UNKNOWN (-1)"
    assert labels["mode"] == "mode: AUTO (2)"


def test_a_json_body_is_text(dissected: dict[str, list[Dissected]]) -> None:
    (found,) = dissected["json"]
    assert found.find("management.body") == [BODY]


def test_reals_of_eight_bytes_can_be_demanded(script: Path, tmp_path: Path) -> None:
    write_pcap(tmp_path / "four.pcap", [Segment(LITTLE.encode(sample(JointPosition)))])
    (dissected,) = dissect(script, tmp_path / "four.pcap", "-o", "openpendant.real_size:8 bytes")
    assert dissected.body() == []
    assert len(dissected.find("body_fault") + dissected.find("other_reply")) == 1


# Ports.


def test_every_usual_port_is_registered(script: Path, tmp_path: Path) -> None:
    frame = LITTLE.encode(Ping())
    ports = [11000, 11002, 11010, 12000, 12002, 50240, 50241, 50242]
    assert PORTS == "11000,11002,11010,12000,12002,50240-50242"
    segments = [Segment(frame, stream=port, port=port) for port in ports]
    write_pcap(tmp_path / "ports.pcap", segments)
    rows = _columns(script, tmp_path / "ports.pcap", "--disable-heuristic", "openpendant_tcp")
    assert [row[0] for row in rows] == ["SimpleMessage"] * len(ports)


@pytest.mark.parametrize("cls", FIRST_FRAMES)
def test_a_stream_on_any_port_is_recognised_by_its_first_frame(
    cls: type[Message], dissected: dict[str, list[Dissected]]
) -> None:
    assert len(dissected[cls.__name__]) == 2


@pytest.mark.parametrize("number", range(len(FOREIGN)))
def test_other_protocols_on_other_ports_are_left_alone(
    number: int, dissected: dict[str, list[Dissected]]
) -> None:
    assert dissected[f"foreign {number}"] == []


def test_the_ports_can_be_chosen(
    script: Path, tmp_path: Path, dissected: dict[str, list[Dissected]]
) -> None:
    assert dissected["unregistered"] == []
    write_pcap(tmp_path / "chosen.pcap", [UNREGISTERED])
    assert len(dissect(script, tmp_path / "chosen.pcap", "-o", "openpendant.ports:33333")) == 1
