"""Frames as TCP streams in a pcap file, and what tshark makes of them with our dissector."""

from __future__ import annotations

import shutil
import struct
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import pytest

PROTOCOL = "openpendant"

_ETHERNET = bytes(12) + b"\x08\x00"
_MILLISECOND = 1_000


@dataclass(frozen=True)
class Segment:
    """One TCP segment with data.

    Attributes:
        stream: number of the connection; segments of one are in order.
        port: port of the server.
    """

    data: bytes
    stream: int = 0
    port: int = 11000
    to_server: bool = True


def write_pcap(path: Path, segments: list[Segment], snaplen: int = 262_144) -> None:
    """Write segments a millisecond apart, as Ethernet, IPv4 and TCP without checksums."""
    out = bytearray(struct.pack("<IHHiIII", 0xA1B2C3D4, 2, 4, 0, 0, snaplen, 1))
    sent: dict[tuple[int, bool], int] = {}
    for number, segment in enumerate(segments):
        mine, theirs = (segment.stream, segment.to_server), (segment.stream, not segment.to_server)
        packet = _packet(segment, sent.get(mine, 1), sent.get(theirs, 1))
        sent[mine] = sent.get(mine, 1) + len(segment.data)
        kept = packet[:snaplen]
        out += struct.pack("<IIII", 1, number * _MILLISECOND % 1_000_000, len(kept), len(packet))
        out += kept
    path.write_bytes(out)


def _packet(segment: Segment, sequence: int, acknowledged: int) -> bytes:
    client, server = (
        (bytes([10, 0, 0, 1]), 40_000 + segment.stream % 10_000),
        (bytes([10, 0, 0, 2]), segment.port),
    )
    source, target = (client, server) if segment.to_server else (server, client)
    push_and_ack = 0x5018
    tcp = struct.pack(
        ">HHIIHHHH", source[1], target[1], sequence, acknowledged, push_and_ack, 65_535, 0, 0
    )
    size = 20 + len(tcp) + len(segment.data)
    ip = struct.pack(">BBHHHBBH", 0x45, 0, size, 0, 0x4000, 64, 6, 0) + source[0] + target[0]
    return _ETHERNET + ip + tcp + segment.data


@dataclass(frozen=True)
class Shown:
    """One field as tshark shows it.

    Attributes:
        name: its filter.
        label: the line in the tree.
    """

    name: str
    show: str
    raw: bytes
    label: str


@dataclass(frozen=True)
class Dissected:
    """One simple-message frame as tshark shows it; fields in the order of the tree."""

    fields: list[Shown]

    def find(self, name: str) -> list[str]:
        return [field.show for field in self.fields if field.name == f"{PROTOCOL}.{name}"]

    def body(self) -> list[Shown]:
        """The fields of the message itself: their filters name it."""
        own = [field for field in self.fields if field.name.startswith(f"{PROTOCOL}.")]
        return [field for field in own if field.name.count(".") > 1]


def require_tshark() -> str:
    """Return where tshark is, or skip the test and say so."""
    tshark = shutil.which("tshark")
    if tshark is None:
        pytest.skip("tshark is not installed, so the Wireshark dissector is not tested here")
    return tshark


def run_tshark(script: Path, pcap: Path, *options: str) -> str:
    """Run tshark with our dissector; fail on any error of Lua or any exception of a dissector."""
    ran = subprocess.run(
        [require_tshark(), "-n", "-r", str(pcap), "-X", f"lua_script:{script}", *options],
        capture_output=True,
        encoding="utf-8",
        errors="replace",
        check=False,
        timeout=60,
    )
    assert ran.returncode == 0, ran.stderr
    assert "Lua" not in ran.stderr, ran.stderr
    assert "Lua Error" not in ran.stdout
    assert "_ws.malformed" not in ran.stdout
    return ran.stdout


def dissect(script: Path, pcap: Path, *options: str) -> list[Dissected]:
    """Return every simple-message frame that tshark finds, in order."""
    return [found for packet in _dissect_each(script, pcap, *options) for found in packet]


def _dissect_each(script: Path, pcap: Path, *options: str) -> list[list[Dissected]]:
    """Return the simple-message frames that tshark finds, by the packet that ends them."""
    printed = run_tshark(script, pcap, "-T", "pdml", "-J", PROTOCOL, *options)
    return [
        [Dissected(list(_fields(proto))) for proto in packet if proto.get("name") == PROTOCOL]
        for packet in ET.fromstring(printed)
    ]


def write_parts(path: Path, parts: Mapping[str, Sequence[Segment]]) -> None:
    """Write several captures as one, each with connections of its own, one after the other.

    One run of tshark reads them all: it takes longer to start than to read any of them.
    """
    segments: list[Segment] = []
    first = 0
    for part in parts.values():
        segments += [replace(segment, stream=first + segment.stream) for segment in part]
        first += 1 + max(segment.stream for segment in part)
    write_pcap(path, segments)


def dissect_parts(
    script: Path, path: Path, parts: Mapping[str, Sequence[Segment]]
) -> dict[str, list[Dissected]]:
    """Return the simple-message frames that tshark finds in each of several captures."""
    write_parts(path, parts)
    packets = _dissect_each(script, path)
    assert len(packets) == sum(map(len, parts.values()))
    each = iter(packets)
    return {
        name: [found for packet in islice(each, len(part)) for found in packet]
        for name, part in parts.items()
    }


def _fields(element: ET.Element) -> Iterator[Shown]:
    for field in element:
        yield Shown(
            field.get("name", ""),
            field.get("show", ""),
            bytes.fromhex(field.get("value", "")),
            field.get("showname", ""),
        )
        yield from _fields(field)
