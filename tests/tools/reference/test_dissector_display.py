from __future__ import annotations

import struct
from pathlib import Path

import pytest
from tshark_captures import Segment, dissect, run_tshark, write_pcap

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


def test_the_info_column_says_what_was_asked_and_answered(script: Path, tmp_path: Path) -> None:
    stop = SoftwareStop(request_id=7, reason="")
    write_pcap(
        tmp_path / "info.pcap",
        [
            Segment(PENDANT_LITTLE.encode(stop), port=11010),
            Segment(
                PENDANT_LITTLE.encode(HeaderOnly(65014, reply_code=2)), port=11010, to_server=False
            ),
        ],
    )
    assert _columns(script, tmp_path / "info.pcap") == [
        ["SimpleMessage", "software_stop(65014) request request_id=7  "],
        ["SimpleMessage", "software_stop(65014) reply FAILURE  "],
    ]


def test_several_frames_of_a_segment_are_all_named_in_the_info_column(
    script: Path, tmp_path: Path
) -> None:
    two = LITTLE.encode(Ping()) + LITTLE.encode(Ping(comm_type=CommType.REPLY, reply_code=1))
    write_pcap(tmp_path / "two.pcap", [Segment(two)])
    ((_, info),) = _columns(script, tmp_path / "two.pcap")
    assert info == "ping(1) request  ping(1) reply SUCCESS  "


def test_special_values_have_their_names(script: Path, tmp_path: Path) -> None:
    write_pcap(tmp_path / "status.pcap", [Segment(LITTLE.encode(Status(1, 0, 0, -1, 0, 2, 1)))])
    (dissected,) = dissect(script, tmp_path / "status.pcap")
    labels = {one.name.rpartition(".")[2]: one.label for one in dissected.body()}
    assert labels["in_error"] == "in_error: UNKNOWN (-1)"
    assert labels["mode"] == "mode: AUTO (2)"


def test_a_json_body_is_text(script: Path, tmp_path: Path) -> None:
    body = '{"op": "größer"}'
    frame = PENDANT_LITTLE.encode(Management(1, body.encode()))
    write_pcap(tmp_path / "json.pcap", [Segment(frame, port=11010)])
    (dissected,) = dissect(script, tmp_path / "json.pcap")
    assert dissected.find("management.body") == [body]


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


@pytest.mark.parametrize("cls", [Status, SoftwareStop])
def test_a_stream_on_any_port_is_recognised_by_its_first_frame(
    cls: type[Message], script: Path, tmp_path: Path
) -> None:
    frame = PENDANT_LITTLE.encode(sample(cls))
    write_pcap(tmp_path / "any.pcap", [Segment(frame, port=33_333)] * 2)
    assert len(dissect(script, tmp_path / "any.pcap")) == 2


@pytest.mark.parametrize(
    "first", [b"GET / HTTP/1.1\r\n\r\n", bytes(64), b"\x10\0\0\0" + b"\x77" * 16]
)
def test_other_protocols_on_other_ports_are_left_alone(
    first: bytes, script: Path, tmp_path: Path
) -> None:
    write_pcap(tmp_path / "other.pcap", [Segment(first, port=33_333)])
    assert dissect(script, tmp_path / "other.pcap") == []


def test_the_ports_can_be_chosen(script: Path, tmp_path: Path) -> None:
    odd = Segment(struct.pack("<4i", 12, 77, 1, 0), port=33_333)
    write_pcap(tmp_path / "chosen.pcap", [odd])
    assert dissect(script, tmp_path / "chosen.pcap") == []
    assert len(dissect(script, tmp_path / "chosen.pcap", "-o", "openpendant.ports:33333")) == 1
