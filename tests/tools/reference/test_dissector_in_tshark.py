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
    write_pcap,
)

from openpendant.simplemsg import (
    DIALECTS,
    MOTOMAN,
    PENDANT,
    STANDARD,
    BodyFault,
    ByteOrder,
    Codec,
    Dialect,
    HeaderFault,
    Opaque,
    codec_for,
)
from openpendant.simplemsg.framing import HEADER_SIZE
from openpendant.simplemsg.motoman import MotomanGroup, MotomanJointTrajPtFullEx
from openpendant.simplemsg.pendant import SoftwareStop
from openpendant.tools.reference.messages import ALL_MESSAGES
from openpendant.tools.reference.vectors import vector_files

EVERYTHING = Dialect("everything", ALL_MESSAGES)
LITTLE = codec_for(STANDARD)
PENDANT_LITTLE = codec_for(PENDANT)


Packet = tuple[bytes, Codec]


def _golden_packets() -> list[Packet]:
    return [(golden.frame, golden.codec) for golden in GOLDEN]


def _captured_packets() -> list[Packet]:
    captures = {"capture-industrial-robot-client": STANDARD, "capture-motoman-driver": MOTOMAN}
    return [
        (
            bytes.fromhex(item["hex"]),
            codec_for(dialect, ByteOrder.BIG if "bswap" in item["scenario"] else ByteOrder.LITTLE),
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
        byte_order = ByteOrder.LITTLE if order == "le" else ByteOrder.BIG
        codec = codec_for(DIALECTS[dialect], byte_order, int(real[1:]) // 8)
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
        frame = bytearray(codec_for(MOTOMAN).encode(point))
        struct.pack_into("<i", frame, HEADER_SIZE, meant)
        frames.append((bytes(frame), codec_for(MOTOMAN)))
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


# All that is read with the usual options, in one run of tshark.


@pytest.fixture(name="dissected", scope="module")
def _dissected(
    script: Path, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, list[Dissected]]:
    whole = _some_frames()[10]
    assert len(whole) == 60
    parts = {
        **{name: _each_alone(packets()) for name, (packets, _) in PACKETS.items()},
        "texts": [Segment(frame, port=11010) for frame, _ in TEXT_PACKETS],
        **{f"{n} groups": [Segment(frame) for frame, _ in _with_groups(n)] for n in MEANT},
        **{f"cut {sizes}": _cut(b"".join(_some_frames()), sizes) for sizes in SIZES},
        **{f"{size} bytes": [Segment(whole[:size])] for size in range(1, 60, 3)},
    }
    return dissect_parts(script, tmp_path_factory.mktemp("parts") / "parts.pcap", parts)


@pytest.mark.parametrize("name", PACKETS)
def test_every_field_equals_what_our_codec_decodes(
    name: str, dissected: dict[str, list[Dissected]]
) -> None:
    made, least = PACKETS[name]
    packets = made()
    assert len(dissected[name]) == len(packets) >= least
    assert _differences(dissected[name], packets) == []


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


def _fitting_codec(frame: bytes) -> Codec:
    """Return a codec of all messages, in the first width of reals that the body fits."""
    little = HEADER_SIZE - 4 <= int.from_bytes(frame[:4], "little") <= 65_535
    byte_order = ByteOrder.LITTLE if little else ByteOrder.BIG
    codecs = [codec_for(EVERYTHING, byte_order, real_size) for real_size in (4, 8)]
    for codec in codecs:
        try:
            if not isinstance(codec.decode(frame), Opaque):
                return codec
        except (HeaderFault, BodyFault):
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
