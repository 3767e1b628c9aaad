import contextlib
import io
import struct
from collections.abc import Callable

import pytest
from rigs.data.pcap_files import (
    ACK,
    FIN,
    LINKS,
    RST,
    SECOND,
    SYN,
    Conversation,
    Stamped,
    block,
    enhanced,
    ethernet,
    interface,
    ipv4,
    ipv6,
    linux_cooked,
    option,
    pcap,
    pcapng,
    section,
    simple,
    tcp,
)

from openpendant.simplemsg import STANDARD, ByteOrder, GetVersion, Ping, accepted, codec_for
from openpendant.tools.packets.reading.capture_files import MAX_RECORD
from openpendant.tools.packets.reading.pcap_trace import MAX_CONNECTIONS
from openpendant.tools.packets.reading.trace_files import FileKind, TraceFileError, read_trace
from openpendant.tools.packets.trace import Entry, Event, Packet, TraceDirection

LITTLE = codec_for(STANDARD, ByteOrder.LITTLE)
PING, PONG = LITTLE.encode(Ping()), LITTLE.encode(accepted(Ping()))
VERSION = LITTLE.encode(GetVersion())
BIG_PING = codec_for(STANDARD, ByteOrder.BIG).encode(Ping())


def entries(file: bytes) -> list[Entry]:
    return list(read_trace(io.BytesIO(file)))


def packets(file: bytes) -> list[Packet]:
    return [entry for entry in entries(file) if isinstance(entry, Packet)]


def events(file: bytes) -> list[str]:
    return [entry.text for entry in entries(file) if isinstance(entry, Event)]


def sent(file: bytes) -> list[bytes]:
    return [packet.data for packet in packets(file)]


def usual() -> list[Stamped]:
    link = Conversation()
    return [*link.opened(), *link.asked(PING, PONG), *link.asked(VERSION, PONG), *link.closed()]


@pytest.fixture
def link() -> Conversation:
    return Conversation()


def test_requests_and_replies_come_out_with_times_and_directions() -> None:
    first, second, *_ = packets(pcap(usual()))
    assert (first.data, first.direction, first.port, first.connection) == (
        PING,
        TraceDirection.TO_SERVER,
        11_000,
        1,
    )
    assert (second.data, second.direction) == (PONG, TraceDirection.TO_CLIENT)
    assert (first.time, second.time) == (3_000_000, 4_000_000)


def test_opening_and_closing_are_events() -> None:
    opened, client, server = events(pcap(usual()))
    assert opened == "client-connected 10.0.0.1:40000 -> 10.0.0.2:11000"
    assert (client, server) == ("client-closed-connection", "server-closed-connection")


FORMS: dict[str, Callable[[list[Stamped]], bytes]] = {
    "pcap little": lambda frames: pcap(frames),
    "pcap big": lambda frames: pcap(frames, order=">"),
    "pcap nanoseconds": lambda frames: pcap(frames, nanoseconds=True),
    "pcap big nanoseconds": lambda frames: pcap(frames, order=">", nanoseconds=True),
    "pcapng little": lambda frames: pcapng(frames),
    "pcapng big": lambda frames: pcapng(frames, order=">"),
}


@pytest.mark.parametrize("form", FORMS)
def test_every_file_format_gives_the_same_trace(form: str) -> None:
    assert entries(FORMS[form](usual())) == entries(pcap(usual()))


@pytest.mark.parametrize("link_type", LINKS)
@pytest.mark.parametrize("family", [4, 6])
def test_every_link_type_gives_the_same_packets(link_type: int, family: int) -> None:
    link = Conversation(wrap=LINKS[link_type])
    if family == 6:
        link.client, link.server = ("fd00::1", 40_000), ("fd00::2", 11_000)
    frames = [*link.opened(), *link.asked(PING, PONG)]
    assert sent(pcap(frames, link_type=link_type)) == [PING, PONG]


@pytest.mark.parametrize("vlans", [1, 2])
def test_tags_of_virtual_networks_are_passed_over(vlans: int) -> None:
    link = Conversation(wrap=lambda packet: ethernet(packet, vlans))
    assert sent(pcap([*link.opened(), *link.asked(PING, PONG)])) == [PING, PONG]


def test_extension_headers_of_ipv6_are_passed_over() -> None:
    hop_by_hop = struct.pack(">BB6x", 60, 0) + struct.pack(">BB14x", 6, 1)
    payload = tcp((40_000, 11_000), 1, 1, ACK, PING)
    frame = ethernet(ipv6("fd00::1", "fd00::2", payload, hop_by_hop))
    assert sent(pcap([(0, frame)])) == [PING]


def test_nanoseconds_are_kept() -> None:
    link = Conversation(time=0)
    frames = [*link.opened(), *link.asked(PING, PONG)]
    frames = [(time + index, frame) for index, (time, frame) in enumerate(frames)]
    assert [packet.time for packet in packets(pcap(frames, nanoseconds=True))] == [
        3_000_003,
        4_000_004,
    ]


def test_the_resolution_and_offset_of_an_interface_count() -> None:
    eighths = option(9, b"\x83") + option(14, struct.pack("<q", 100)) + option(0, b"")
    link = Conversation()
    frames = [frame for _, frame in link.opened() + link.asked(PING, PONG)]
    file = section() + interface(options=eighths)
    file += b"".join(enhanced(8 + index, frame) for index, frame in enumerate(frames))
    assert [packet.time for packet in packets(file)] == [3 * SECOND // 8, 4 * SECOND // 8]


def test_simple_and_unknown_blocks_and_a_second_section_are_read() -> None:
    first, second = Conversation().asked(PING, PONG)
    file = section() + block(0x0BAD, b"whatever") + interface() + simple(first[1])
    file += section(">") + interface(">") + enhanced(0, second[1], ">")
    assert sent(file) == [PING, PONG]


def test_frames_may_be_split_and_coalesced(link: Conversation) -> None:
    stream = (PING + VERSION) * 3
    cuts = [stream[at : at + 11] for at in range(0, len(stream), 11)]
    frames = [*link.opened(), *(link.segment(0, cut) for cut in cuts)]
    assert b"".join(sent(pcap(frames))) == stream
    assert len(packets(pcap(frames))) == 6


def test_segments_out_of_order_are_put_in_order(link: Conversation) -> None:
    opened = link.opened()
    one, two, three = (link.segment(0, data) for data in (PING, VERSION, PONG))
    assert sent(pcap([*opened, three, two, one])) == [PING, VERSION, PONG]


def test_repeated_segments_are_told_once(link: Conversation) -> None:
    opened = link.opened()
    at = link.sequences[0]
    once = link.segment(0, PING)
    again = link.segment(0, PING, at=at)
    frames = [*opened, opened[0], opened[1], once, again, link.segment(1, PONG), again]
    assert sent(pcap(frames)) == [PING, PONG]


def test_overlapping_segments_give_each_byte_once(link: Conversation) -> None:
    opened = link.opened()
    at = link.sequences[0]
    stream = PING + VERSION + PONG
    frames = [
        link.segment(0, stream[:20], at=at),
        link.segment(0, stream[30:], at=at + 30),
        link.segment(0, stream[26:44], at=at + 26),
        link.segment(0, stream[10:40], at=at + 10),
    ]
    assert sent(pcap([*opened, *frames])) == [PING, VERSION, PONG]


def test_a_probe_that_keeps_the_connection_alive_changes_nothing(link: Conversation) -> None:
    frames = [*link.opened(), link.segment(0, PING)]
    frames.append(link.segment(0, b"\0", at=link.sequences[0] - 1))
    assert sent(pcap([*frames, link.segment(0, VERSION)])) == [PING, VERSION]


def test_sequence_numbers_go_round() -> None:
    link = Conversation(sequences=[2**32 - 20, 2**32 - 1])
    frames = [*link.opened(), *link.asked(PING, PONG), *link.asked(VERSION, PONG), *link.closed()]
    assert sent(pcap(frames)) == [PING, PONG, VERSION, PONG]


def lossy() -> list[Stamped]:
    """The capture has no segment with the end of a ping; the receiver has."""
    link = Conversation()
    frames = [*link.opened(), link.segment(0, PING + VERSION[:6])]
    link.segment(0, VERSION[6:] + PING)
    frames += [link.segment(0, VERSION), link.segment(1, PONG)]
    return [*frames, *link.asked(PING, PONG), *link.asked(PING, PONG)]


def test_a_lost_segment_is_told_and_the_stream_found_again() -> None:
    told = [
        (entry.data, entry.is_frame) if isinstance(entry, Packet) else entry.text
        for entry in entries(pcap(lossy()))
    ][1:]
    gap = told.index("26 bytes of the client are missing")
    assert told[0] == (PING, True)
    assert told[gap - 1] == (VERSION[:6], False)
    assert told[gap + 1] == (VERSION, True)


def test_a_lost_segment_does_not_hold_up_the_rest_for_long() -> None:
    times = [packet.time for packet in packets(pcap(lossy()))]
    assert times == sorted(times)
    assert len(packets(pcap(lossy()[:-1]))) == len(times) - 1


def test_without_acknowledgements_a_hole_is_given_up_after_five_seconds(link: Conversation) -> None:
    opened = link.opened()
    link.segment(0, PING)
    late = link.segment(0, VERSION)
    link.time += 6 * SECOND
    after = link.segment(0, PING)
    entry = entries(pcap([*opened, late, after]))[1]
    assert isinstance(entry, Event)
    assert entry.time > 5 * SECOND


def test_after_a_hole_a_frame_is_found_inside_a_segment(link: Conversation) -> None:
    opened = link.opened()
    first = link.segment(0, PING)
    link.segment(0, VERSION)
    middle = link.segment(0, b"\xff" * 33 + VERSION + PING)
    assert sent(pcap([*opened, first, middle]))[1:] == [b"\xff" * 33, VERSION, PING]


def test_a_stream_that_ends_inside_a_frame_says_so(link: Conversation) -> None:
    last = packets(pcap([*link.opened(), link.segment(0, PING + VERSION[:10]), *link.closed()]))[-1]
    assert (last.data, last.is_frame) == (VERSION[:10], False)


def test_a_reset_ends_the_connection(link: Conversation) -> None:
    frames = [*link.opened(), *link.asked(PING, PONG), link.segment(1, flags=RST)]
    assert events(pcap([*frames, link.segment(0, PING)]))[-1] == "server-reset-connection"
    assert len(packets(pcap([*frames, link.segment(0, PING)]))) == 2


def test_data_with_the_last_flag_still_count(link: Conversation) -> None:
    assert sent(pcap([*link.opened(), link.segment(0, PING, FIN | ACK)])) == [PING]


def test_the_same_ports_used_again_are_another_connection(link: Conversation) -> None:
    frames = [*link.opened(), *link.asked(PING, PONG)]
    link.sequences = [500_000, 700_000]
    frames += [*link.opened(), *link.asked(VERSION, PONG)]
    found = packets(pcap(frames))
    assert [packet.connection for packet in found] == [1, 1, 2, 2]
    assert [packet.data for packet in found] == [PING, PONG, VERSION, PONG]


def test_without_its_beginning_a_known_port_tells_the_server() -> None:
    first = packets(pcap(Conversation(client=("10.0.0.1", 5_000)).asked(PING, PONG)))[0]
    assert (first.direction, first.port) == (TraceDirection.TO_SERVER, 11_000)


def test_without_anything_else_the_lower_port_is_the_server() -> None:
    link = Conversation(client=("10.0.0.1", 5_000), server=("10.0.0.2", 6_000))
    first = packets(pcap(link.asked(PING, PONG)))[0]
    assert (first.direction, first.port) == (TraceDirection.TO_CLIENT, 5_000)


def test_who_opened_is_the_client_whatever_the_ports() -> None:
    link = Conversation(client=("10.0.0.1", 5_000), server=("10.0.0.2", 60_000))
    first = packets(pcap([*link.opened(), *link.asked(PING, PONG)]))[0]
    assert (first.direction, first.port) == (TraceDirection.TO_SERVER, 60_000)


def test_each_connection_has_its_own_byte_order() -> None:
    one, other = Conversation(), Conversation(client=("10.0.0.3", 40_000))
    frames = [*one.opened(), *other.opened(), one.segment(0, PING), other.segment(0, BIG_PING)]
    assert sent(pcap(frames)) == [PING, BIG_PING]


def test_other_traffic_is_left_out_and_counted() -> None:
    web = Conversation(server=("10.0.0.9", 80))
    robot = Conversation()
    udp = bytearray(ipv4("10.0.0.1", "10.0.0.2", bytes(40)))
    udp[9] = 17
    frames = [*web.opened(), *web.asked(b"GET / HTTP/1.1\r\n\r\n", b"HTTP/1.1 200 OK\r\n")]
    frames += [(9 * SECOND, ethernet(bytes(udp))), *robot.opened(), *robot.asked(PING, PONG)]
    assert sent(pcap(frames)) == [PING, PONG]
    assert events(pcap(frames))[-1].startswith("connections without any frame: 1, e.g. 10.0.0.1")


def test_strange_bytes_on_a_known_port_are_told(link: Conversation) -> None:
    frames = [*link.opened(), link.segment(0, b"GET / HTTP/1.1\r\n\r\n")]
    assert "what the client sent begins with no frame: 474554" in events(pcap(frames))[1]


def test_fragments_and_cut_headers_are_counted() -> None:
    payload = tcp((40_000, 11_000), 1, 1, ACK, PING)
    cut = ethernet(ipv4("10.0.0.1", "10.0.0.2", payload[:12]))
    piece = ethernet(ipv4("10.0.0.1", "10.0.0.2", payload, fragment=0x2000))
    told = events(pcap([(0, cut), (1, piece), *usual()]))[-1]
    assert told == "frames not read: 1 cut off inside a header, 1 a fragment of an IP packet"


def test_an_interface_of_a_strange_link_type_does_not_hide_the_others() -> None:
    frame = Conversation().segment(0, PING)[1]
    file = section() + interface(link_type=189) + interface(link_type=113)
    file += enhanced(0, b"usb") + enhanced(0, linux_cooked(frame[14:]), number=1)
    assert sent(file) == [PING]
    assert events(file)[-1] == "frames not read: 1 of link type 189"


def test_of_too_many_connections_the_silent_one_is_forgotten_aloud() -> None:
    frames: list[Stamped] = []
    for number in range(MAX_CONNECTIONS + 2):
        link = Conversation(client=("10.0.0.1", 20_000 + number))
        frames += [*link.opened(), link.segment(0, PING + VERSION[:3])]
    told = [text for text in events(pcap(frames)) if text.startswith("forgotten")]
    assert [text.rsplit(" ", 3)[1] for text in told] == ["10.0.0.1:20000", "10.0.0.1:20001"]
    assert len(packets(pcap(frames))) == 2 * (MAX_CONNECTIONS + 2)


def test_a_flood_of_holes_keeps_a_bounded_amount(link: Conversation) -> None:
    frames = link.opened()
    for _ in range(5_000):
        link.sequences[0] += 1
        frames.append(link.segment(0, b"x" * 100))
    assert len([text for text in events(pcap(frames)) if text.endswith("missing")]) == 5_000


WRONG: dict[str, tuple[bytes, str]] = {
    "a strange link type": (pcap(usual(), link_type=105), "link type 105 is not Ethernet"),
    "cut in the file header": (pcap([])[:20], "offset 20: the file ends inside the file header"),
    "cut in a record header": (pcap(usual()) + b"1234", "the file ends inside a record header"),
    "cut in a record": (pcap(usual())[:-3], "the file ends inside a record: 57 of 60 bytes"),
    "a huge record": (
        pcap([]) + struct.pack("<IIII", 0, 0, 2**31, 60),
        f"a record of 2147483648 bytes, more than {MAX_RECORD}",
    ),
    "another version": (pcap([]).replace(b"\2\0\4\0", b"\7\0\0\0"), "pcap version 7.0, not 2.4"),
    "a cut block": (pcapng(usual())[:-7], "the file ends inside a block"),
    "no byte-order magic": (block(0x0A0D0D0A, bytes(16)), "byte-order magic 00000000 is none"),
    "a short block": (section() + struct.pack("<II", 6, 8), "a block of type 6 with 8 bytes"),
    "a crooked block": (section() + struct.pack("<II", 6, 33), "a block of type 6 with 33 bytes"),
    "a huge block": (section() + struct.pack("<II", 6, 2**31), "a block of type 6 with 2147483648"),
    "two lengths": (
        section() + interface()[:-4] + struct.pack("<I", 99),
        "a block of 20 bytes ends as one of 99",
    ),
    "no interface": (section() + enhanced(0, b"x"), "a block of type 6 that is none"),
    "a block that is too short": (section() + block(1, b"1234"), "a block of type 1 that is none"),
    "a frame longer than its block": (
        section() + interface() + block(6, struct.pack("<5I", 0, 0, 0, 500, 500)),
        "a frame of 500 bytes in a block of 32",
    ),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_wrong_file_is_one_error_with_its_offset(case: str) -> None:
    file, reason = WRONG[case]
    with pytest.raises(TraceFileError) as caught:
        entries(file)
    assert reason in str(caught.value)
    assert "offset " in str(caught.value)


def test_what_came_before_the_break_is_given() -> None:
    found: list[bytes] = []
    stream = read_trace(io.BytesIO(pcap(usual())[:-3]))
    with contextlib.suppress(TraceFileError):
        found.extend(entry.data for entry in stream if isinstance(entry, Packet))
    assert found == [PING, PONG, VERSION, PONG]


def test_text_that_is_called_a_capture_is_refused() -> None:
    with pytest.raises(TraceFileError, match="neither pcap nor pcapng"):
        list(read_trace(io.BytesIO(b"hello"), FileKind.PCAP))


def test_a_record_of_no_bytes_is_passed_over() -> None:
    assert sent(pcap([(0, b""), *usual()])) == [PING, PONG, VERSION, PONG]


def test_an_interface_table_is_bounded() -> None:
    with pytest.raises(TraceFileError, match="more than 4096 interfaces"):
        entries(section() + interface() * 4_097)


def test_a_syn_that_comes_after_its_answer_is_no_second_connection(link: Conversation) -> None:
    syn, greeting, ack = link.opened()
    found = packets(pcap([greeting, syn, ack, *link.asked(PING, PONG)]))
    assert [packet.connection for packet in found] == [1, 1]
    assert [packet.direction for packet in found] == [
        TraceDirection.TO_SERVER,
        TraceDirection.TO_CLIENT,
    ]


def test_a_port_scan_is_no_traffic(link: Conversation) -> None:
    assert packets(pcap([link.segment(0, flags=SYN), link.segment(1, flags=RST | ACK)])) == []
