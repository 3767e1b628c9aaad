import io
import random
import shutil
import subprocess
from pathlib import Path

import pytest
from rigs.data.golden_vectors import GOLDEN
from rigs.data.pcap_files import Conversation, Stamped, pcap

from openpendant.tools.packets.reading.trace_files import read_trace
from openpendant.tools.packets.trace import Packet, TraceDirection

TSHARK = shutil.which("tshark")


def disordered(seed: int, stream: bytes) -> list[Stamped]:
    choose = random.Random(seed)
    link = Conversation(client=("10.0.0.1", 40_000 + seed), sequences=[2**32 - 5_000, 77])
    opened = link.opened()
    base, at = link.sequences[0], 0
    spans: list[tuple[int, int]] = []
    while at < len(stream):
        start = max(0, at - choose.choice([0, 0, 0, 30]))
        at = min(len(stream), at + choose.randint(1, 700))
        spans += [(start, at)] * choose.choice([1, 1, 1, 2])
    late = [index + choose.choice([0, 0, 0, 2.5]) for index in range(len(spans))]
    spans = [span for _, span in sorted(zip(late, spans, strict=True))]
    return [*opened, *(link.segment(0, stream[start:end], at=base + start) for start, end in spans)]


@pytest.mark.realtime
@pytest.mark.skipif(TSHARK is None, reason="tshark is not installed")
def test_streams_are_put_together_as_tshark_does(tmp_path: Path) -> None:
    stream = b"".join(packet.frame for packet in GOLDEN if packet.file == "motoman-le-f32")
    frames = [frame for seed in range(6) for frame in disordered(seed, stream)]
    file = tmp_path / "disorder.pcap"
    file.write_bytes(pcap(frames))
    ours: dict[int, bytes] = {}
    for entry in read_trace(io.BytesIO(file.read_bytes())):
        if isinstance(entry, Packet) and entry.direction is TraceDirection.TO_SERVER:
            ours[entry.connection] = ours.get(entry.connection, b"") + entry.data
    for index in range(6):
        assert ours[index + 1] == _followed(file, index) == stream


def _followed(file: Path, stream: int) -> bytes:
    command = ["tshark", "-r", str(file), "-q", "-z", f"follow,tcp,raw,{stream}"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True)
    lines = done.stdout.split("Node 1:", 1)[1].splitlines()[1:]
    digits = [line.strip() for line in lines if not line.startswith("=")]
    return bytes.fromhex("".join(digits))
