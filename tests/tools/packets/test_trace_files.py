import io
import itertools
import json
import struct
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rigs.data.golden_vectors import FOLDER, load
from rigs.data.pcap_files import Conversation, interface, pcap, pcapng, section

from openpendant.simplemsg import STANDARD, ByteOrder, Ping, codec_for
from openpendant.simplemsg.framing import Cut, Mode, Splitter
from openpendant.tools.packets.reading.tcp_streams import MissingBytes, StreamReassembly
from openpendant.tools.packets.reading.trace_files import (
    MAX_CAPTURE,
    FileKind,
    PeekedStream,
    TraceFileError,
    detect,
    read_trace,
)
from openpendant.tools.packets.trace import (
    MAX_ENTRY,
    Entry,
    Event,
    Packet,
    TraceDirection,
    entry_line,
    entry_to_json,
    header_line,
)

PING = codec_for(STANDARD, ByteOrder.LITTLE).encode(Ping())
CAPTURES = ("capture-industrial-robot-client", "capture-motoman-driver")
ENTRIES: list[Entry] = [
    Event(0, "client-connected", 11_000, 1),
    Packet(1_500_000, TraceDirection.TO_SERVER, PING, 11_000, 1),
    Packet(2_000_000, TraceDirection.TO_CLIENT, b"\1\2", 11_000, 1, "part", is_frame=False),
]
HEADER = header_line("2026-01-01T00:00:00+00:00")
TRACE = "\n".join([HEADER, *map(entry_line, ENTRIES), ""]).encode()
CAPTURE = json.dumps([entry_to_json(entry) for entry in ENTRIES]).encode()


def entries(file: bytes, kind: FileKind | None = None) -> list[Entry]:
    return list(read_trace(io.BytesIO(file), kind))


@pytest.mark.parametrize(
    "file",
    [
        TRACE,
        TRACE.replace(b"\n", b"\r\n"),
        b"\xef\xbb\xbf" + TRACE,
        b"\n\n" + TRACE.split(b"\n", 1)[1],
        TRACE.rstrip(),
        CAPTURE,
        b"\xef\xbb\xbf\n\t " + CAPTURE,
    ],
)
def test_both_json_forms_give_the_entries(file: bytes) -> None:
    assert entries(file) == ENTRIES


def test_a_file_is_read_by_its_path(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    path.write_bytes(TRACE)
    assert list(read_trace(path)) == ENTRIES


@pytest.mark.parametrize("name", CAPTURES)
def test_a_recorded_capture_is_read_whole(name: str) -> None:
    found = list(read_trace(FOLDER / f"{name}.json"))
    assert [getattr(entry, "data", b"").hex() for entry in found] == [
        item["hex"] for item in load(name)
    ]


@pytest.mark.parametrize(
    ("file", "kind"),
    [
        (TRACE, FileKind.TRACE),
        (CAPTURE, FileKind.CAPTURE),
        (pcap([]), FileKind.PCAP),
        (pcap([], order=">"), FileKind.PCAP),
        (pcapng([]), FileKind.PCAP),
        (b"0c00", FileKind.HEX),
        (b"a1b2c3d4", FileKind.HEX),
        (b"\n\r\n0c00", FileKind.HEX),
        (b"\n", FileKind.HEX),
        (b"\xa1\xb2", FileKind.HEX),
        (b"", FileKind.HEX),
        (b" " * 5_000 + b"{", FileKind.HEX),
    ],
)
def test_the_kind_is_seen_from_the_content(file: bytes, kind: FileKind) -> None:
    found, stream = detect(io.BytesIO(file))
    assert found is kind
    assert stream.read() == file


WRONG: dict[str, tuple[bytes, str]] = {
    "an empty file": (b"", "the file is empty"),
    "binary rubbish": (bytes(range(256)), "neither JSON lines, a capture list, pcap nor pcapng"),
    "another format": (b'{"format": "journal/9"}\n', "line 1: the format is 'journal/9', not"),
    "a cut line": (TRACE[:-10], "line 4: the file ends here: no JSON"),
    "no JSON": (TRACE + b"{]\n", "line 5: no JSON: Expecting property name"),
    "no object": (TRACE + b"7\n", "line 5: an entry is a JSON object"),
    "no direction": (b'{"t": 1}\n', "line 1: dir must be event"),
    "an endless time": (b'{"t": Infinity, "dir": "event"}\n', "line 1: t is no time"),
    "a vast time": (b'{"t": 1%s, "dir": "event"}\n' % (b"0" * 400), "line 1: t"),
    "a vast integer": (b'{"t": 1%s}\n' % (b"0" * 9_000), "line 1: an integer of thousands"),
    "deep nesting": (b'{"t": ' + b"[" * 99_999 + b"\n", "line 1: nested too deeply"),
    "no UTF-8": (TRACE + b"{\xff}\n", "line 5: not UTF-8: byte 0xff at 1"),
    "odd digits": (
        b'{"t": 1, "dir": "client->server", "hex": "abc"}\n',
        "line 1: hex must be pairs of hexadecimal digits",
    ),
    "a line without end": (b"{" + b" " * MAX_ENTRY * 2, f"line 1: longer than {MAX_ENTRY} bytes"),
    "a list of something else": (b"[1]", "entry 1: an entry is a JSON object"),
    "vectors that are no capture": (b'[{"name": "ping", "hex": "0c"}]', "entry 1: t must be"),
    "a cut list": (CAPTURE[:-5], "no JSON: "),
    "a deep list": (b"[" * 99_999, "nested too deeply"),
    "a list that is no UTF-8": (b"[\xff]", "offset 1: not UTF-8"),
    "two lists": (b"[][]", "no JSON: Extra data at line 1, column 3"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_one_error_that_says_where(case: str) -> None:
    file, reason = WRONG[case]
    with pytest.raises(TraceFileError) as caught:
        entries(file)
    assert reason in str(caught.value)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_a_list_is_no_list_when_told_otherwise() -> None:
    with pytest.raises(TraceFileError, match="a capture is a JSON array"):
        entries(b"{}", FileKind.CAPTURE)


def test_the_error_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    path.write_bytes(b"{]")
    with pytest.raises(TraceFileError, match=r"trace\.jsonl: line 1: "):
        list(read_trace(path))


class Endless(io.RawIOBase):
    """A stream that repeats itself for so many bytes, and is never in memory whole."""

    def __init__(self, head: bytes, again: bytes, size: int) -> None:
        self._head, self._again, self._left = head, again, size
        self._ready = head

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        if not self._ready and self._left > 0:
            self._ready = self._again
        chunk = self._ready[: min(len(buffer), max(self._left, 0))]
        self._ready = self._ready[len(chunk) :]
        self._left -= len(chunk)
        buffer[: len(chunk)] = chunk
        return len(chunk)


def _flood() -> dict[str, tuple[bytes, bytes]]:
    link = Conversation()
    opened = pcap(link.opened())
    segment = pcap([link.segment(0, PING * 8)])[24:]
    junk = pcap([link.segment(0, b"\xff" * 900, at=2**31)])[24:]
    line = entry_line(ENTRIES[1]).encode() + b"\n"
    odd = struct.pack("<II", 0x0BAD, 2**32 - 4)
    return {
        "a trace": (HEADER.encode() + b"\n", line * 100),
        "a line without end": (b"{", b" " * 65_536),
        "a capture of one connection": (opened, segment),
        "segments far ahead": (opened, junk),
        "a block without end": (section() + interface() + odd, bytes(65_536)),
    }


FLOODS = _flood()


@pytest.mark.parametrize("size", [1_000_000, pytest.param(20_000_000, marks=pytest.mark.soak)])
@pytest.mark.parametrize("case", FLOODS)
def test_an_endless_stream_needs_bounded_memory(case: str, size: int) -> None:
    stream = io.BufferedReader(Endless(*FLOODS[case], size=size))
    tracemalloc.start()
    try:
        for _ in read_trace(stream):
            pass
    except TraceFileError:
        pass  # where the flood is cut off, or is no trace at all; here only memory counts
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 700_000


def test_a_capture_list_beyond_the_bound_is_refused() -> None:
    stream = io.BufferedReader(Endless(b"[", b" " * 65_536, MAX_CAPTURE + 5))
    with pytest.raises(TraceFileError, match="a capture list of more than 67108864 bytes"):
        list(read_trace(stream))


LEADS = [TRACE, CAPTURE, pcap([]), pcapng([]), section(), b""]


def reads_or_complains_in_one_line(file: bytes) -> None:
    complaint = "none"
    try:
        assert all(isinstance(entry, Packet | Event) for entry in entries(file))
    except TraceFileError as error:
        complaint = str(error)
    assert len(complaint.splitlines()) == 1


@given(st.sampled_from(LEADS), st.binary(max_size=300))
def test_any_bytes_give_entries_or_one_error(lead: bytes, rest: bytes) -> None:
    reads_or_complains_in_one_line(lead + rest)


def _usual() -> bytes:
    link = Conversation()
    return pcap([*link.opened(), *link.asked(PING, PING), *link.closed()])


@given(st.sampled_from([_usual(), pcapng([]), TRACE, CAPTURE]), st.data())
def test_a_damaged_file_gives_entries_or_one_error(file: bytes, data: st.DataObject) -> None:
    damaged = bytearray(file)
    places = st.integers(0, len(file) - 1)
    for place in data.draw(st.lists(places, min_size=1, max_size=8)):
        damaged[place] = data.draw(st.integers(0, 255))
    reads_or_complains_in_one_line(bytes(damaged[: data.draw(st.integers(0, len(damaged)))]))


class Dripping(io.RawIOBase):
    """Gives bytes in portions as a pipe would."""

    def __init__(self, data: bytes, sizes: Iterator[int]) -> None:
        self._data, self._sizes = data, sizes

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        chunk = self._data[: min(len(buffer), next(self._sizes))]
        self._data = self._data[len(chunk) :]
        buffer[: len(chunk)] = chunk
        return len(chunk)


@given(st.sampled_from([_usual(), TRACE, CAPTURE]), st.lists(st.integers(1, 40), min_size=1))
def test_portions_make_no_difference(file: bytes, sizes: list[int]) -> None:
    def forever() -> Iterator[int]:
        while True:
            yield from sizes

    assert list(read_trace(io.BufferedReader(Dripping(file, forever())))) == entries(file)


def test_what_was_peeked_at_is_read_again_from_any_stream() -> None:
    assert io.BufferedReader(PeekedStream(b"ab", io.BytesIO(b"cd"))).read() == b"abcd"


FRAMES = st.lists(st.sampled_from([PING, PING[:9], b"\xff" * 20, b"\0" * 17]), max_size=8)


@given(FRAMES, st.booleans(), st.lists(st.integers(1, 30), min_size=1))
def test_cuts_of_a_stream_do_not_depend_on_its_portions(
    parts: list[bytes], known: bool, sizes: list[int]
) -> None:
    stream = b"".join(parts)
    whole = Splitter(Mode.SEARCHING, in_step=known)
    split = Splitter(Mode.SEARCHING, in_step=known)
    expected = _joined([*whole.feed(stream), *whole.finish()])
    cuts: list[Cut] = []
    at = 0
    while at < len(stream):
        size = sizes[at % len(sizes)]
        cuts += split.feed(stream[at : at + size])
        at += size
    assert _joined([*cuts, *split.finish()]) == expected


def _joined(cuts: list[Cut]) -> list[tuple[bytes, bool]]:
    """Put neighbouring pieces that are no frame together: where they are cut means nothing."""
    joined: list[tuple[bytes, bool]] = []
    for cut in cuts:
        if joined and not cut.is_frame and not joined[-1][1]:
            joined[-1] = (joined[-1][0] + cut.data, False)
        else:
            joined.append((cut.data, cut.is_frame))
    return joined


@given(st.data())
def test_a_stream_survives_any_order_and_overlap_of_its_segments(data: st.DataObject) -> None:
    stream = bytes(range(200))
    first = data.draw(st.sampled_from([0, 7, 2**32 - 100]))
    cuts = sorted(data.draw(st.sets(st.integers(1, 199), max_size=8)))
    edges = [0, *cuts, 200]
    spans = list(itertools.pairwise(edges))
    extra = st.tuples(st.integers(0, 199), st.integers(1, 60))
    spans += [(at, min(200, at + size)) for at, size in data.draw(st.lists(extra, max_size=5))]
    one_way = StreamReassembly()
    one_way.begin(first)
    pieces = []
    for start, end in data.draw(st.permutations(spans)):
        pieces += one_way.take((first + start) % 2**32, stream[start:end], 0)
    assert not any(isinstance(piece, MissingBytes) for piece in pieces)
    assert b"".join(piece for piece in pieces if isinstance(piece, bytes)) == stream
