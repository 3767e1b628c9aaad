"""Frames as TCP streams in a pcap file, and what tshark makes of them with our dissector."""

import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

import pytest
from rigs.data.pcap_files import ACK, CLIENT, PSH, SERVER, Stamped, ethernet, ipv4, pcap, tcp

PROTOCOL = "openpendant"


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
    """Write segments a millisecond apart, from their client's address or their server's."""
    frames: list[Stamped] = []
    sent: dict[tuple[int, bool], int] = {}
    for number, segment in enumerate(segments):
        mine, theirs = (segment.stream, segment.to_server), (segment.stream, not segment.to_server)
        ends = [(CLIENT, 40_000 + segment.stream % 10_000), (SERVER, segment.port)]
        source, target = ends if segment.to_server else reversed(ends)
        numbers = sent.get(mine, 1), sent.get(theirs, 1)
        data = tcp((source[1], target[1]), *numbers, PSH | ACK, segment.data)
        sent[mine] = numbers[0] + len(segment.data)
        frames.append((number * 1_000_000, ethernet(ipv4(source[0], target[0], data))))
    path.write_bytes(pcap(frames, snaplen=snaplen))


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
