"""What single faults of a server do on the wire: framing, headers, byte order, replies.

`server_faults.toml` names them, and the checks that must find each.
"""

import asyncio
import struct
from collections.abc import Iterable

from rigs.faults.faulty_servers import (
    BytesChange,
    FaultyLink,
    FaultyService,
    MessageIn,
    count,
    each_frame,
    frame,
    header,
    is_request,
    is_stop,
    little,
    patched,
)

from openpendant.simplemsg import Malformed, Message, MsgType, Ping, Received


def frames_of(data: bytes) -> tuple[list[bytes], bytes]:
    frames = []
    while len(data) >= 4:
        size = 4 + struct.unpack_from("<i", data)[0]
        if not 16 <= size <= len(data):
            break
        frames.append(data[:size])
        data = data[size:]
    return frames, data


def whole_segments_only(link: FaultyLink, data: bytes) -> bytes:
    return data if not frames_of(data)[1] else b""


def first_of_segment(link: FaultyLink, data: bytes) -> bytes:
    frames, _ = frames_of(data)
    return frames[0] if len(frames) > 1 else data


def waits_for_boundary(link: FaultyLink, data: bytes) -> bytes:
    held: bytes = link.memory.get("held", b"") + data
    link.memory["held"] = held if frames_of(held)[1] else b""
    return b"" if link.memory["held"] else held


def _deaf(link: FaultyLink, data: bytes, when: bool) -> bytes:
    """Take no bytes any more once a condition was met."""
    link.memory["deaf"] = link.memory.get("deaf", False) or when
    return b"" if link.memory["deaf"] else data


def _length(data: bytes) -> int:
    return int.from_bytes(data[:4], "little", signed=True) if len(data) >= 4 else 12


def takes_oversized(link: FaultyLink, data: bytes) -> bytes:
    if _length(data) > 1019:
        link.write(frame(MsgType.JOINT_TRAJ_PT, 3, 1))
        return b""
    return data


def answers_http(link: FaultyLink, data: bytes) -> bytes:
    if data.startswith(b"GET "):
        link.write(b"HTTP/1.1 400 Bad Request\r\n\r\n")
    return data


class PatientLink(FaultyLink):
    def check_deadlines(self, now: int) -> None:
        return


class LeakyLink(FaultyLink):
    def eof_received(self) -> bool:
        return True


class FragileLink(FaultyLink):
    def connection_lost(self, error: Exception | None) -> None:
        if self.is_motion and self._connection.partial:
            self.service.stop_listening()
        super().connection_lost(error)


def forgets_slow_frames(link: FaultyLink, data: bytes) -> bytes:
    held: bytes = link.memory.get("held", b"")
    now = link.service.loop_time
    if held and now - link.memory["since"] > 0.3:
        held = b""
    if not held:
        link.memory["since"] = now
    frames, link.memory["held"] = frames_of(held + data)
    return b"".join(frames)


def patch_in(offset: int, wrong: int, right: int, code: int | None = None) -> BytesChange:
    def change(link: FaultyLink, data: bytes) -> bytes:
        if len(data) >= 16 and struct.unpack_from("<i", data, offset)[0] == wrong:
            data = patched(data, offset, right)
            return data if code is None else patched(data, 12, code)
        return data

    return change


def ping_with_body(link: FaultyLink, data: bytes) -> bytes:
    return frame(1, 3, 1, b"\x07" * 8) if header(data)[1] == MsgType.PING else data


def type_zero_is_a_ping(link: FaultyLink, data: bytes) -> bytes:
    if len(data) >= 16 and header(data)[1] == 0:
        link.write(frame(1, 3, 1))
        return b""
    return data


def state_swapped_later(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    is_wrong = count(service.memory, "rounds") % 150 == 149
    frames = map(service._codec.encode, messages)
    return [_flip(f) if is_wrong else f for f in frames]


def little_only(link: FaultyLink, data: bytes) -> bytes:
    return _deaf(link, data, not 0 <= _length(data) < 65_536)


def order_of_newest(link: FaultyLink, data: bytes) -> bytes:
    if len(data) >= 4 and "order" not in link.memory:
        link.memory["order"] = link.service.memory["order"] = _length(data) < 65_536
    return data


def answer_in_newest(link: FaultyLink, data: bytes) -> bytes:
    same = link.service.memory["order"] == link.memory["order"]
    return data if same else _flip(data)


def _flip(data: bytes) -> bytes:
    return b"".join(data[n : n + 4][::-1] for n in range(0, len(data), 4))


def silent_on(kind: int) -> BytesChange:
    return lambda link, f: b"" if header(f)[1] == kind else f


def late_replies(link: FaultyLink, data: bytes) -> bytes:
    link.later(0.4, lambda: link.write(data))
    return b""


def answers_topic(kind: int) -> BytesChange:
    def change(link: FaultyLink, data: bytes) -> bytes:
        if len(data) >= 16 and header(data)[1:3] == (kind, 1):
            link.write(frame(kind, 3, 1))
        return data

    return change


def drops_on_unknown(link: FaultyLink, data: bytes) -> bytes:
    if len(data) >= 16 and header(data)[1] == 9999:
        link.later(0.0, link.abort)
        link.write(frame(9999, 3, 2))
        return b""
    return data


def drops_on_large_types(link: FaultyLink, data: bytes) -> bytes:
    if len(data) >= 16 and header(data)[1] > 65_535:
        link.abort()
        return b""
    return data


class StateDeafLink(FaultyLink):
    def data_received(self, data: bytes) -> None:
        if self.is_motion:
            super().data_received(data)
        else:
            self.memory["asked"] = True

    def send_state(self, frames: bytes, now: int) -> None:
        if "asked" not in self.memory:
            super().send_state(frames, now)


def refuses_idle_stop(link: FaultyLink, received: Received) -> Iterable[Received]:
    is_idle = not link.service.is_moving
    if is_stop(received) and is_request(received) and is_idle:
        link.write(frame(11, 3, 2))
        return ()
    return (received,)


def reversed_replies(link: FaultyLink, data: bytes) -> bytes:
    waiting = link.memory.setdefault("waiting", [])
    waiting.append(data)
    if len(waiting) == 1:
        link.later(0.0, lambda: _flush_reversed(link))
    return b""


def _flush_reversed(link: FaultyLink) -> None:
    link.write(b"".join(reversed(link.memory["waiting"])))
    link.memory["waiting"].clear()


def body_of_any_size(kind: int) -> MessageIn:
    def change(link: FaultyLink, received: Received) -> Iterable[Received]:
        if isinstance(received, Malformed) and received.msg_type == kind:
            link.write(frame(kind, 3, 1))
            return ()
        return (received,)

    return change


class TalkativeLink(FaultyLink):
    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if self.is_motion:
            self.write(frame(MsgType.PING, 2))


def no_answer_to_full_points(link: FaultyLink, received: Received) -> Iterable[Received]:
    return () if getattr(type(received), "PLACE", Ping.PLACE).msg_type == 14 else (received,)


def deaf_from(least: int, most: int) -> BytesChange:
    """Hang at lengths from the one to the other."""
    return lambda link, data: _deaf(link, data, least <= _length(data) <= most)


def drops_bare_header(_: FaultyLink, data: bytes) -> bytes:
    return b"" if len(data) == 16 and header(data)[0] > 12 else data


def drops_long_ping(_: FaultyLink, data: bytes) -> bytes:
    return b"" if header(data)[:2] == (52, 1) else data


def byte_behind(_: FaultyLink, data: bytes) -> bytes:
    return data + b"\0"


def twice(_: FaultyLink, data: bytes) -> bytes:
    return data + data


def flipped(_: FaultyLink, data: bytes) -> bytes:
    return _flip(data)


def always_little(_: FaultyLink, data: bytes) -> bytes:
    return data if _length(data) < 65_536 else _flip(data)


def version_of_two(_: FaultyLink, data: bytes) -> bytes:
    return frame(2, 3, 1, little(0, 1)) if header(data)[1] == 2 else data


topics_as_replies = each_frame(lambda f: patched(patched(f, 8, 3), 12, 1))
reals_flipped = each_frame(lambda f: f[:20] + _flip(f[20:]) if header(f)[1] == 10 else f)
