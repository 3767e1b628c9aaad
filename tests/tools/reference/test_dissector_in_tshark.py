"""The dissector in tshark: every field as our codec decodes it, columns, ports; no error in Lua."""

import json
import random
import struct
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from rigs.data.case_table import every
from rigs.data.dissected_fields import differences
from rigs.data.golden_vectors import GOLDEN, load
from rigs.data.tshark_captures import (
    Dissected,
    Segment,
    dissect,
    dissect_parts,
    run_tshark,
    write_parts,
    write_pcap,
)

from openpendant import simplemsg as wire
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.simplemsg.motoman import MotomanGroup, MotomanJointTrajPtFullEx
from openpendant.simplemsg.pendant import Management, SoftwareStop
from openpendant.tools.reference.dissector import PORTS
from openpendant.tools.reference.messages import ALL_MESSAGES
from openpendant.tools.reference.samples import sample
from openpendant.tools.reference.vectors import vector_files

pytestmark = pytest.mark.conformance

EVERYTHING = wire.Dialect("everything", ALL_MESSAGES)
LITTLE = wire.codec_for(wire.STANDARD)
PENDANT_LITTLE = wire.codec_for(wire.PENDANT)

Packet = tuple[bytes, wire.Codec]


def _golden_packets() -> list[Packet]:
    return [(golden.frame, golden.codec) for golden in GOLDEN]


def _captured_packets() -> list[Packet]:
    captures = {
        "capture-industrial-robot-client": wire.STANDARD,
        "capture-motoman-driver": wire.MOTOMAN,
    }
    return [
        (
            bytes.fromhex(item["hex"]),
            wire.codec_for(
                dialect,
                wire.ByteOrder.BIG if "bswap" in item["scenario"] else wire.ByteOrder.LITTLE,
            ),
        )
        for file, dialect in captures.items()
        for item in load(file)
        if item["dir"] != "event"
    ]


def _exported_packets() -> list[Packet]:
    found = []
    for file, text in vector_files().items():
        if not file.endswith(".json"):
            continue
        dialect, order, real = file.removesuffix(".json").split("-")
        byte_order = wire.ByteOrder.LITTLE if order == "le" else wire.ByteOrder.BIG
        codec = wire.codec_for(wire.DIALECTS[dialect], byte_order, int(real[1:]) // 8)
        found += [(bytes.fromhex(entry["hex"]), codec) for entry in json.loads(text)]
    return found


def _each_alone(packets: list[Packet]) -> list[Segment]:
    return [Segment(frame, stream=number % 16) for number, (frame, _) in enumerate(packets)]


def _differences(dissected: list[Dissected], packets: list[Packet]) -> list[tuple[str, str]]:
    return [
        (frame.hex(), found)
        for one, (frame, codec) in zip(dissected, packets, strict=True)
        for found in differences(one, frame, codec)
    ]


PACKETS: dict[str, tuple[Callable[[], list[Packet]], int]] = {
    "golden": (_golden_packets, 1279),
    "captures": (_captured_packets, 300),
    "exported": (_exported_packets, 300),
}
"""What tshark gets, each frame in a segment of its own, and how many there are at least."""

TEXTS = [
    *(b"", b"plain", b"\xc2\x80", b"\xdf\xbf", b"\xe0\xa0\x80", b"\xed\x9f\xbf", b"\xee\x80\x80"),
    *(b"\xef\xbf\xbd", b"\xf0\x90\x80\x80", b"\xf4\x8f\xbf\xbd", b"ended\0\xff"),
]
BROKEN_TEXTS = [
    *(b"\x80", b"\xff", b"\xc2", b"\xe2\x82", b"\xf0\x90\x80", b"\xc0\x80", b"\xc1\xbf"),
    *(b"\xe0\x80\x80", b"\xe0\x9f\xbf", b"\xed\xa0\x80", b"\xed\xbf\xbf", b"\xf0\x8f\xbf\xbf"),
    *(b"\xf4\x90\x80\x80", b"\xf5\x80\x80\x80", b"\xe2\x28\xa1", b"\xc2\xc2\x80", b"\xe2" * 64),
]


def _with_reason(text: bytes) -> bytes:
    frame = PENDANT_LITTLE.encode(SoftwareStop(request_id=1, reason=""))
    return frame[:-64] + text.ljust(64, b"\0")


TEXT_PACKETS: list[Packet] = [(_with_reason(text), PENDANT_LITTLE) for text in TEXTS + BROKEN_TEXTS]

MEANT = range(-1, 6)


def _with_groups(meant: int) -> list[Packet]:
    groups = (MotomanGroup(0, 7, 0.5, *[(0.0,) * 10] * 3),) * 4
    frames = []
    for records in range(1, 5):
        point = MotomanJointTrajPtFullEx(records, 5, groups[:records])
        frame = bytearray(wire.codec_for(wire.MOTOMAN).encode(point))
        struct.pack_into("<i", frame, HEADER_SIZE, meant)
        frames.append((bytes(frame), wire.codec_for(wire.MOTOMAN)))
    return frames


# Segments and frames need not coincide.


def _some_frames() -> list[bytes]:
    return [golden.frame for golden in GOLDEN if golden.file == "standard-le-f32"][:40]


def _cut(stream: bytes, sizes: list[int]) -> list[Segment]:
    segments: list[Segment] = []
    at = 0
    while at < len(stream):
        size = sizes[len(segments) % len(sizes)]
        segments.append(Segment(stream[at : at + size]))
        at += size
    return segments


SIZES = [[1], [7], [3, 50, 1], [1400], [16, 4]]


# All that is read with the usual options, in two runs of tshark.


@pytest.fixture(scope="module")
def recorded(script: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Dissected]]:
    parts = {name: _each_alone(PACKETS[name][0]()) for name in ("golden", "captures")}
    return dissect_parts(script, tmp_path_factory.mktemp("recorded") / "parts.pcap", parts)


@pytest.fixture(name="dissected", scope="module")
def _dissected(
    script: Path, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, list[Dissected]]:
    whole = _some_frames()[10]
    assert len(whole) == 60
    parts = {
        "exported": _each_alone(_exported_packets()),
        "texts": [Segment(frame, port=11010) for frame, _ in TEXT_PACKETS],
        **{f"{n} groups": [Segment(frame) for frame, _ in _with_groups(n)] for n in MEANT},
        **{f"cut {sizes}": _cut(b"".join(_some_frames()), sizes) for sizes in SIZES},
        **{f"{size} bytes": [Segment(whole[:size])] for size in range(1, 60, 3)},
    }
    return dissect_parts(script, tmp_path_factory.mktemp("parts") / "parts.pcap", parts)


@pytest.mark.parametrize(
    ("name", "run"),
    [
        ("golden", "recorded"),
        ("captures", "recorded"),
        ("exported", "dissected"),
    ],
)
def test_every_field_equals_what_our_codec_decodes(
    name: str, run: str, request: pytest.FixtureRequest
) -> None:
    made, least = PACKETS[name]
    packets, dissected = made(), request.getfixturevalue(run)[name]
    assert len(dissected) == len(packets) >= least
    assert _differences(dissected, packets) == []


def test_a_text_is_malformed_exactly_where_it_is_not_utf_8(
    dissected: dict[str, list[Dissected]],
) -> None:
    assert [bool(one.find("body_fault")) for one in dissected["texts"]] == [
        *(False for _ in TEXTS),
        *(True for _ in BROKEN_TEXTS),
    ]
    assert _differences(dissected["texts"], TEXT_PACKETS) == []


def test_groups_are_taken_as_many_as_meant_or_four(dissected: dict[str, list[Dissected]]) -> None:
    def check(meant: int) -> None:
        assert _differences(dissected[f"{meant} groups"], _with_groups(meant)) == []

    every([(str(meant), meant) for meant in MEANT], check)


def test_frames_split_and_merged_by_tcp_are_all_found(
    dissected: dict[str, list[Dissected]],
) -> None:
    packets = [(frame, LITTLE) for frame in _some_frames()]

    def check(sizes: list[int]) -> None:
        found = dissected[f"cut {sizes}"]
        assert len(found) == len(packets)
        assert _differences(found, packets) == []

    every([(str(sizes), sizes) for sizes in SIZES], check)


def test_a_truncated_frame_raises_nothing(dissected: dict[str, list[Dissected]]) -> None:
    short = {name: found for name, found in dissected.items() if name.endswith(" bytes")}
    assert len(short) == 20
    assert {name: found for name, found in short.items() if found} == {}


def test_a_capture_with_a_short_snap_length_is_shown_as_cut_short(
    script: Path, tmp_path: Path
) -> None:
    write_pcap(tmp_path / "snap.pcap", [Segment(_some_frames()[10])] * 2, snaplen=80)
    for dissected in dissect(script, tmp_path / "snap.pcap"):
        assert dissected.body() == []


# Nothing that a peer may send raises an error in Lua: `run_tshark` looks for one.


each_share = pytest.mark.parametrize("share", [1, pytest.param(8, marks=pytest.mark.soak)])


def _harmed(chance: random.Random, share: int) -> Iterator[bytes]:
    """Frames of a sound length whose header or body is no longer what it was: 700 to a share."""
    frames = [frame for frame, _ in _golden_packets() + _exported_packets() if len(frame) < 1_500]
    for _ in range(500 * share):
        harmed = bytearray(chance.choice(frames))
        for _ in range(chance.randrange(1, 6)):
            harmed[chance.randrange(4, len(harmed))] = chance.choice((0, 1, 0x7F, 0x80, 0xFF))
        yield bytes(harmed)
    for _ in range(200 * share):
        # A header of a known type before a body of any size.
        known = bytearray(chance.choice(frames)[:HEADER_SIZE]) + chance.randbytes(
            chance.randrange(0, 300)
        )
        order = chance.choice("<>")
        struct.pack_into(f"{order}i", known, 0, len(known) - 4)
        yield bytes(known)


def _fitting_codec(frame: bytes) -> wire.Codec:
    """Return a codec of all messages, in the first width of reals that the body fits."""
    little = HEADER_SIZE - 4 <= int.from_bytes(frame[:4], "little") <= 65_535
    byte_order = wire.ByteOrder.LITTLE if little else wire.ByteOrder.BIG
    codecs = [wire.codec_for(EVERYTHING, byte_order, real_size) for real_size in (4, 8)]
    for codec in codecs:
        try:
            if not isinstance(codec.decode(frame), wire.Opaque):
                return codec
        except (wire.HeaderFault, wire.BodyFault):
            continue
    return codecs[0]


@each_share
def test_harmed_frames_are_judged_as_our_codec_judges_them(
    share: int, script: Path, tmp_path: Path
) -> None:
    harmed = list(_harmed(random.Random(1), share))
    segments = [Segment(data, stream=number) for number, data in enumerate(harmed)]
    write_pcap(tmp_path / "harmed.pcap", segments)
    dissected = dissect(script, tmp_path / "harmed.pcap")
    assert len(dissected) == len(harmed)
    assert _differences(dissected, [(frame, _fitting_codec(frame)) for frame in harmed]) == []
    assert all(any(one.find(kind) for one in dissected) for kind in ("header_fault", "body_fault"))


@each_share
def test_random_bytes_in_random_segments_raise_nothing(
    share: int, script: Path, tmp_path: Path
) -> None:
    chance = random.Random(2)
    streams = [
        Segment(chance.randbytes(chance.randrange(1, 200)), stream=chance.randrange(100))
        for _ in range(350 * share)
    ]
    harmed = b"".join(_harmed(chance, share))
    write_pcap(tmp_path / "random.pcap", streams + _cut(harmed, [1, 100, 1_000, 17, 3]))
    run_tshark(script, tmp_path / "random.pcap", "-V")


def _columns(script: Path, pcap: Path, *options: str) -> list[list[str]]:
    printed = run_tshark(
        script, pcap, "-T", "fields", "-e", "_ws.col.Protocol", "-e", "_ws.col.Info", *options
    )
    return [line.split("\t") for line in printed.splitlines()]


def _from(port: int, frame: bytes, *, to_server: bool = True) -> Segment:
    return Segment(frame, port=port, to_server=to_server)


BODY = '{"op": "größer"}'
FIRST_FRAMES = (wire.Status, SoftwareStop)
FOREIGN = (b"GET / HTTP/1.1\r\n\r\n", bytes(64), b"\x10\0\0\0" + b"\x77" * 16)
UNREGISTERED = _from(33_333, struct.pack("<4i", 12, 77, 1, 0))

SHOWN_PARTS: dict[str, list[Segment]] = {
    "stop": [
        _from(11010, PENDANT_LITTLE.encode(SoftwareStop(request_id=7, reason=""))),
        _from(11010, PENDANT_LITTLE.encode(wire.HeaderOnly(65014, reply_code=2)), to_server=False),
    ],
    "two": [
        Segment(
            LITTLE.encode(wire.Ping())
            + LITTLE.encode(wire.Ping(comm_type=wire.CommType.REPLY, reply_code=1))
        )
    ],
    "status": [Segment(LITTLE.encode(wire.Status(1, 0, 0, -1, 0, 2, 1)))],
    "json": [_from(11010, PENDANT_LITTLE.encode(Management(1, BODY.encode())))],
    **{
        cls.__name__: [_from(33_333, PENDANT_LITTLE.encode(sample(cls)))] * 2
        for cls in FIRST_FRAMES
    },
    **{f"foreign {number}": [_from(33_333, first)] for number, first in enumerate(FOREIGN)},
    "unregistered": [UNREGISTERED],
}
"""Captures that are read with the usual options, in one run of tshark."""


@pytest.fixture(name="shown", scope="module")
def _shown(script: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Dissected]]:
    return dissect_parts(script, tmp_path_factory.mktemp("parts") / "parts.pcap", SHOWN_PARTS)


def test_the_info_column_names_what_was_asked_and_answered_and_each_frame_of_a_segment(
    script: Path, tmp_path: Path
) -> None:
    write_parts(tmp_path / "info.pcap", {name: SHOWN_PARTS[name] for name in ("stop", "two")})
    assert _columns(script, tmp_path / "info.pcap") == [
        ["SimpleMessage", "software_stop(65014) request request_id=7  "],
        ["SimpleMessage", "software_stop(65014) reply FAILURE  "],
        ["SimpleMessage", "ping(1) request  ping(1) reply SUCCESS  "],
    ]


def test_special_values_have_their_names(shown: dict[str, list[Dissected]]) -> None:
    (status,) = shown["status"]
    labels = {one.name.rpartition(".")[2]: one.label for one in status.body()}
    assert labels["in_error"] == "in_error: UNKNOWN (-1)"
    assert labels["mode"] == "mode: AUTO (2)"


def test_a_json_body_is_text(shown: dict[str, list[Dissected]]) -> None:
    (found,) = shown["json"]
    assert found.find("management.body") == [BODY]


def test_reals_of_eight_bytes_can_be_demanded(script: Path, tmp_path: Path) -> None:
    write_pcap(tmp_path / "four.pcap", [Segment(LITTLE.encode(sample(wire.JointPosition)))])
    (shown,) = dissect(script, tmp_path / "four.pcap", "-o", "openpendant.real_size:8 bytes")
    assert shown.body() == []
    assert len(shown.find("body_fault") + shown.find("other_reply")) == 1


# Ports.


def test_every_usual_port_is_registered(script: Path, tmp_path: Path) -> None:
    frame = LITTLE.encode(wire.Ping())
    ports = [11000, 11002, 11010, 12000, 12002, 50240, 50241, 50242]
    assert PORTS == "11000,11002,11010,12000,12002,50240-50242"
    segments = [Segment(frame, stream=port, port=port) for port in ports]
    write_pcap(tmp_path / "ports.pcap", segments)
    rows = _columns(script, tmp_path / "ports.pcap", "--disable-heuristic", "openpendant_tcp")
    assert [row[0] for row in rows] == ["SimpleMessage"] * len(ports)


@pytest.mark.parametrize("cls", FIRST_FRAMES)
def test_a_stream_on_any_port_is_recognised_by_its_first_frame(
    cls: type[wire.Message], shown: dict[str, list[Dissected]]
) -> None:
    assert len(shown[cls.__name__]) == 2


@pytest.mark.parametrize("number", range(len(FOREIGN)))
def test_other_protocols_on_other_ports_are_left_alone(
    number: int, shown: dict[str, list[Dissected]]
) -> None:
    assert shown[f"foreign {number}"] == []


def test_the_ports_can_be_chosen(
    script: Path, tmp_path: Path, shown: dict[str, list[Dissected]]
) -> None:
    assert shown["unregistered"] == []
    write_pcap(tmp_path / "chosen.pcap", [UNREGISTERED])
    assert len(dissect(script, tmp_path / "chosen.pcap", "-o", "openpendant.ports:33333")) == 1
