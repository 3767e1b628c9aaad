"""Writes pcap and pcapng files, frame by frame, as the tests need them: also wrong ones."""

import struct
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from ipaddress import IPv4Address, IPv6Address

FIN, SYN, RST, PSH, ACK = 1, 2, 4, 8, 16

CLIENT, SERVER = "10.0.0.1", "10.0.0.2"
SECOND = 1_000_000_000

Stamped = tuple[int, bytes]
"""Time [ns] and captured frame."""


def _address(text: str) -> bytes:
    return IPv6Address(text).packed if ":" in text else IPv4Address(text).packed


def tcp(ports: tuple[int, int], sequence: int, ack: int, flags: int, data: bytes = b"") -> bytes:
    header = struct.pack(
        ">HHIIBBHHH", *ports, sequence % 2**32, ack % 2**32, 5 << 4, flags, 65_535, 0, 0
    )
    return header + data


def ipv4(source: str, destination: str, payload: bytes, fragment: int = 0) -> bytes:
    total = 20 + len(payload)
    head = struct.pack(">BBHHHBBH", 0x45, 0, total, 1, fragment, 64, 6, 0)
    return head + _address(source) + _address(destination) + payload


def ipv6(source: str, destination: str, payload: bytes, extensions: bytes = b"") -> bytes:
    """An IPv6 packet; `extensions` is a hop-by-hop header whose next header is TCP."""
    following = 0 if extensions else 6
    size = len(extensions) + len(payload)
    head = struct.pack(">IHBB", 6 << 28, size, following, 64)
    return head + _address(source) + _address(destination) + extensions + payload


def _ether_type(packet: bytes) -> int:
    return 0x0800 if packet[0] >> 4 == 4 else 0x86DD


def ethernet(packet: bytes, vlans: int = 0) -> bytes:
    tags = b"".join(struct.pack(">HH", 0x8100, 7) for _ in range(vlans))
    return (bytes(12) + tags + struct.pack(">H", _ether_type(packet)) + packet).ljust(60, b"\xee")


def linux_cooked(packet: bytes) -> bytes:
    return struct.pack(">HHH8sH", 0, 1, 6, b"", _ether_type(packet)) + packet


def linux_cooked_2(packet: bytes) -> bytes:
    return struct.pack(">HHIHBB8s", _ether_type(packet), 0, 1, 1, 0, 6, b"") + packet


def loopback(packet: bytes) -> bytes:
    return struct.pack("<I", 2 if packet[0] >> 4 == 4 else 30) + packet


LINKS: dict[int, Callable[[bytes], bytes]] = {
    0: loopback,
    1: ethernet,
    101: bytes,
    108: loopback,
    113: linux_cooked,
    228: bytes,
    276: linux_cooked_2,
}


@dataclass
class Conversation:
    """One TCP connection; each method gives captured Ethernet frames, a millisecond apart."""

    client: tuple[str, int] = (CLIENT, 40_000)
    server: tuple[str, int] = (SERVER, 11_000)
    sequences: list[int] = field(default_factory=lambda: [1_000, 9_000])
    time: int = 5 * SECOND
    wrap: Callable[[bytes], bytes] = ethernet

    def segment(
        self, end: int, data: bytes = b"", flags: int = ACK, at: int | None = None
    ) -> Stamped:
        """A segment of end 0 (client) or 1 (server), at a sequence number of its own if told."""
        ends = (self.client, self.server)
        source, destination = ends[end], ends[1 - end]
        sequence = self.sequences[end] if at is None else at
        segment = tcp((source[1], destination[1]), sequence, self.sequences[1 - end], flags, data)
        ip = ipv6 if ":" in source[0] else ipv4
        self.time += 1_000_000
        if at is None:
            self.sequences[end] += len(data) + bool(flags & (SYN | FIN))
        return self.time, self.wrap(ip(source[0], destination[0], segment))

    def opened(self) -> list[Stamped]:
        return [self.segment(0, flags=SYN), self.segment(1, flags=SYN | ACK), self.segment(0)]

    def closed(self) -> list[Stamped]:
        return [self.segment(0, flags=FIN | ACK), self.segment(1, flags=FIN | ACK), self.segment(0)]

    def asked(self, request: bytes, reply: bytes) -> list[Stamped]:
        return [self.segment(0, request, PSH | ACK), self.segment(1, reply, PSH | ACK)]


def pcap(
    frames: Iterable[Stamped],
    *,
    order: str = "<",
    nanoseconds: bool = False,
    link_type: int = 1,
    snaplen: int = 262_144,
) -> bytes:
    magic = 0xA1B23C4D if nanoseconds else 0xA1B2C3D4
    parts = [struct.pack(f"{order}IHHiIII", magic, 2, 4, 0, 0, snaplen, link_type)]
    for time, frame in frames:
        fraction = time % SECOND // (1 if nanoseconds else 1_000)
        kept = frame[:snaplen]
        head = (time // SECOND, fraction, len(kept), len(frame))
        parts += [struct.pack(f"{order}IIII", *head), kept]
    return b"".join(parts)


def option(code: int, value: bytes, order: str = "<") -> bytes:
    return struct.pack(f"{order}HH", code, len(value)) + value + bytes(-len(value) % 4)


def block(kind: int, body: bytes, order: str = "<") -> bytes:
    body += bytes(-len(body) % 4)
    length = struct.pack(f"{order}I", 12 + len(body))
    return struct.pack(f"{order}I", kind) + length + body + length


def section(order: str = "<") -> bytes:
    body = struct.pack(f"{order}IHHq", 0x1A2B3C4D, 1, 0, -1) + option(4, b"tests", order)
    return block(0x0A0D0D0A, body, order)


def interface(order: str = "<", *, link_type: int = 1, options: bytes = b"") -> bytes:
    return block(1, struct.pack(f"{order}HHI", link_type, 0, 0) + options, order)


def enhanced(stamp: int, frame: bytes, order: str = "<", number: int = 0) -> bytes:
    head = struct.pack(
        f"{order}5I", number, stamp >> 32, stamp & 0xFFFF_FFFF, len(frame), len(frame)
    )
    return block(6, head + frame + bytes(-len(frame) % 4) + option(1, b"seen", order), order)


def simple(frame: bytes, order: str = "<") -> bytes:
    return block(3, struct.pack(f"{order}I", len(frame)) + frame, order)


def pcapng(frames: Iterable[Stamped], *, order: str = "<") -> bytes:
    """A file with nanosecond time stamps."""
    options = option(9, b"\x09", order) + option(0, b"", order)
    parts = [section(order), interface(order, options=options)]
    return b"".join([*parts, *(enhanced(time, frame, order) for time, frame in frames)])
