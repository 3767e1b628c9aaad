"""A trace file of any kind gives entries, or says in one line why it does not."""

import io
import json
from collections.abc import Iterator

from rigs.data.golden_vectors import FOLDER, GOLDEN
from rigs.data.pcap_files import Conversation, linux_cooked, pcap, pcapng

from openpendant.tools.packets.reading.trace_files import TraceFileError, read_trace
from openpendant.tools.packets.trace import Event, Packet, entry_from_json, entry_line, header_line


def TestOneInput(data: bytes) -> None:
    entries: list[Packet | Event] = []
    complaint = ""
    try:
        for entry in read_trace(io.BytesIO(data)):
            assert isinstance(entry, Packet | Event)
            entries.append(entry)
    except TraceFileError as error:
        complaint = str(error)
    assert "\n" not in complaint
    # An entry takes some bytes of the file, so a small file cannot fill the memory.
    assert len(entries) <= len(data)
    for entry in entries[:20]:
        entry_from_json(json.loads(entry_line(entry)))


def seeds() -> Iterator[bytes]:
    frames = [golden.frame for golden in GOLDEN[:6]]
    talk = Conversation()
    captured = talk.opened() + talk.asked(frames[0], frames[1]) + talk.closed()
    yield pcap(captured)
    yield pcap(captured, order=">", nanoseconds=True)
    yield pcapng(captured)
    yield pcapng(captured, order=">")
    cooked = Conversation(wrap=linux_cooked)
    yield pcap(cooked.opened() + cooked.asked(frames[2], frames[3]), link_type=113)
    for name in ("capture-industrial-robot-client", "capture-motoman-driver"):
        items = json.loads((FOLDER / f"{name}.json").read_text("utf-8"))[:8]
        yield json.dumps(items).encode()
        lines = [header_line("2024-01-01T00:00:00+00:00"), *map(json.dumps, items)]
        yield "\n".join(lines).encode()
