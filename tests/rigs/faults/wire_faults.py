"""Single faults of a server on the wire: framing, headers, byte order, replies.

Each entry breaks one rule of an otherwise correct emulator and names the checks that must find it.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Iterable

from rigs.faults.faulty_servers import (
    AT_USUAL_RATE,
    BytesChange,
    Fault,
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

from openpendant.simplemsg import Malformed, Message, MsgType, Ping, Received, ReplyCode
from openpendant.tools.packets.conformance.check import CheckVerdict, Profile

DEVIATES = CheckVerdict.DEVIATES


def frames_of(data: bytes) -> tuple[list[bytes], bytes]:
    """Cut little-endian frames; return them and what is left."""
    frames = []
    while len(data) >= 4:
        size = 4 + struct.unpack_from("<i", data)[0]
        if not 16 <= size <= len(data):
            break
        frames.append(data[:size])
        data = data[size:]
    return frames, data


def _whole_segments_only(link: FaultyLink, data: bytes) -> bytes:
    return data if not frames_of(data)[1] else b""


def _first_of_segment(link: FaultyLink, data: bytes) -> bytes:
    frames, _ = frames_of(data)
    return frames[0] if len(frames) > 1 else data


def _waits_for_boundary(link: FaultyLink, data: bytes) -> bytes:
    held: bytes = link.memory.get("held", b"") + data
    link.memory["held"] = held if frames_of(held)[1] else b""
    return b"" if link.memory["held"] else held


def _deaf(link: FaultyLink, data: bytes, when: bool) -> bytes:
    """Take no bytes any more once a condition was met."""
    link.memory["deaf"] = link.memory.get("deaf", False) or when
    return b"" if link.memory["deaf"] else data


def _length(data: bytes) -> int:
    return int.from_bytes(data[:4], "little", signed=True) if len(data) >= 4 else 12


def _takes_oversized(link: FaultyLink, data: bytes) -> bytes:
    if _length(data) > 1019:
        link.write(frame(MsgType.JOINT_TRAJ_PT, 3, 1))
        return b""
    return data


def _answers_http(link: FaultyLink, data: bytes) -> bytes:
    if data.startswith(b"GET "):
        link.write(b"HTTP/1.1 400 Bad Request\r\n\r\n")
    return data


class _PatientLink(FaultyLink):
    def check_deadlines(self) -> None:
        return


class _LeakyLink(FaultyLink):
    def eof_received(self) -> bool:
        return True


class _FragileLink(FaultyLink):
    def connection_lost(self, error: Exception | None) -> None:
        if self.is_motion and self._connection.partial:
            self.service.stop_listening()
        super().connection_lost(error)


def _forgets_slow_frames(link: FaultyLink, data: bytes) -> bytes:
    held: bytes = link.memory.get("held", b"")
    now = link.service.loop_time
    if held and now - link.memory["since"] > 0.3:
        held = b""
    if not held:
        link.memory["since"] = now
    frames, link.memory["held"] = frames_of(held + data)
    return b"".join(frames)


FRAMING = (
    Fault("needs a frame in one segment", ("FS02", "FS03"), bytes_in=_whole_segments_only),
    Fault("takes one frame of a segment", ("FS04", "FS05"), bytes_in=_first_of_segment),
    Fault("waits for the end of the next frame", ("FS06",), bytes_in=_waits_for_boundary),
    Fault(
        "needs the body with its header",
        ("FS07",),
        bytes_in=lambda _, data: b"" if len(data) == 16 and header(data)[0] > 12 else data,
    ),
    Fault(
        "hangs at a length of 0",
        ("FS08",),
        bytes_in=lambda link, data: _deaf(link, data, _length(data) == 0),
    ),
    Fault(
        "hangs at a negative length",
        ("FS09",),
        bytes_in=lambda link, data: _deaf(link, data, _length(data) < 0),
    ),
    Fault(
        "hangs at a length below a header",
        ("FS10",),
        bytes_in=lambda link, data: _deaf(link, data, 0 < _length(data) < 12),
    ),
    Fault(
        "waits for two thousand million bytes",
        ("FS11",),
        bytes_in=lambda link, data: _deaf(link, data, _length(data) > 1 << 30),
    ),
    Fault("takes a frame of 4,096 bytes", ("FS12",), bytes_in=_takes_oversized),
    Fault("talks to web browsers", ("FS13",), bytes_in=_answers_http),
    Fault("waits for ever for half a frame", ("FS14",), DEVIATES, link=_PatientLink),
    Fault("loses half a frame", ("FS14",), bytes_in=_whole_segments_only, link=_PatientLink),
    Fault("keeps half-closed links", ("FS15",), link=_LeakyLink),
    Fault("dies of a reset amid a frame", ("FS16",), link=_FragileLink),
    Fault("forgets a frame that takes 0.3 s", ("FS17",), bytes_in=_forgets_slow_frames),
    Fault("takes the first of four frames in one piece", ("FS18",), bytes_in=_first_of_segment),
)


def _patch_in(offset: int, wrong: int, right: int, code: int | None = None) -> BytesChange:
    def change(link: FaultyLink, data: bytes) -> bytes:
        if len(data) >= 16 and struct.unpack_from("<i", data, offset)[0] == wrong:
            data = patched(data, offset, right)
            return data if code is None else patched(data, 12, code)
        return data

    return change


def _ping_with_body(link: FaultyLink, data: bytes) -> bytes:
    return frame(1, 3, 1, b"\x07" * 8) if header(data)[1] == MsgType.PING else data


def _type_zero_is_a_ping(link: FaultyLink, data: bytes) -> bytes:
    if len(data) >= 16 and header(data)[1] == 0:
        link.write(frame(1, 3, 1))
        return b""
    return data


HEADERS = (
    Fault("marks replies as requests", ("HS01",), frame_out=lambda _, f: patched(f, 8, 2)),
    Fault("gives replies the code 0", ("HS02",), frame_out=lambda _, f: patched(f, 12, 0)),
    Fault("gives replies the code 3", ("HS02",), frame_out=lambda _, f: patched(f, 12, 3)),
    Fault(
        "answers everything with a PING", ("HS03", "RS05"), frame_out=lambda _, f: patched(f, 4, 1)
    ),
    Fault(
        "answers points with type 2002",
        ("HS03",),
        DEVIATES,
        frame_out=lambda _, f: patched(f, 4, 2002) if header(f)[1] == 11 else f,
    ),
    Fault("counts the prefix in the length", ("HS04",), frame_out=lambda _, f: patched(f, 0, 16)),
    Fault("has a length one too large", ("HS04",), frame_out=lambda _, f: patched(f, 0, 13)),
    Fault("has a byte behind its replies", ("HS04",), frame_out=lambda _, f: f + b"\0"),
    Fault(
        "marks topics as replies",
        ("HS05",),
        state_out=each_frame(lambda f: patched(patched(f, 8, 3), 12, 1)),
    ),
    Fault("obeys communication type 0", ("HS06",), bytes_in=_patch_in(8, 0, 2)),
    Fault("obeys message type 0", ("HS07",), bytes_in=_type_zero_is_a_ping),
    Fault("takes requests with a reply code", ("HS08",), bytes_in=_patch_in(12, 1, 0)),
    Fault("answers replies", ("HS09",), bytes_in=_patch_in(8, 3, 2, 0)),
    Fault("answers communication type 4", ("HS10",), DEVIATES, bytes_in=_patch_in(8, 4, 2)),
    Fault("gives a PING a body of its own", ("HS11",), frame_out=_ping_with_body),
)


def _state_swapped_later(service: FaultyService, messages: list[Message]) -> list[Message | bytes]:
    is_wrong = count(service.memory, "rounds") % 150 == 149
    frames = map(service._codec.encode, messages)
    return [_flip(f) if is_wrong else f for f in frames]


def _little_only(link: FaultyLink, data: bytes) -> bytes:
    return _deaf(link, data, not 0 <= _length(data) < 65_536)


def _order_of_newest(link: FaultyLink, data: bytes) -> bytes:
    if len(data) >= 4 and "order" not in link.memory:
        link.memory["order"] = link.service.memory["order"] = _length(data) < 65_536
    return data


def _answer_in_newest(link: FaultyLink, data: bytes) -> bytes:
    same = link.service.memory["order"] == link.memory["order"]
    return data if same else _flip(data)


def _flip(data: bytes) -> bytes:
    """Return 4-byte values in the other byte order."""
    return b"".join(data[n : n + 4][::-1] for n in range(0, len(data), 4))


ORDER = (
    Fault("answers big-endian whoever asks", ("BS01",), frame_out=lambda _, f: _flip(f)),
    Fault(
        "changes the order of the state port",
        ("BS02",),
        settings=AT_USUAL_RATE,
        state_out=_state_swapped_later,
    ),
    Fault(
        "speaks big-endian on the state port and little on the other",
        ("BS03",),
        settings={"byte_order": "big"},
        bytes_in=_little_only,
    ),
    Fault(
        "has its reals in the other order",
        ("BS04",),
        state_out=each_frame(lambda f: f[:20] + _flip(f[20:]) if header(f)[1] == 10 else f),
    ),
    Fault("hangs at clients of the other order", ("BS05", "BS07"), bytes_in=_little_only),
    Fault(
        "answers little-endian whoever asks",
        ("BS05",),
        frame_out=lambda _, f: f if _length(f) < 65_536 else _flip(f),
    ),
    Fault(
        "speaks to everybody in the order of the newest client",
        ("BS06",),
        bytes_in=_order_of_newest,
        frame_out=_answer_in_newest,
    ),
)


def _silent_on(kind: int) -> BytesChange:
    return lambda link, f: b"" if header(f)[1] == kind else f


def _late_replies(link: FaultyLink, data: bytes) -> bytes:
    link.later(0.4, lambda: link.write(data))
    return b""


def _answers_topic(kind: int) -> BytesChange:
    def change(link: FaultyLink, data: bytes) -> bytes:
        if len(data) >= 16 and header(data)[1:3] == (kind, 1):
            link.write(frame(kind, 3, 1))
        return data

    return change


def _drops_on_unknown(link: FaultyLink, data: bytes) -> bytes:
    if len(data) >= 16 and header(data)[1] == 9999:
        link.later(0.0, link.abort)
        link.write(frame(9999, 3, 2))
        return b""
    return data


def _drops_on_large_types(link: FaultyLink, data: bytes) -> bytes:
    if len(data) >= 16 and header(data)[1] > 65_535:
        link.abort()
        return b""
    return data


class _StateDeafLink(FaultyLink):
    def data_received(self, data: bytes) -> None:
        if self.is_motion:
            super().data_received(data)
        else:
            self.memory["asked"] = True

    def send_state(self, frames: bytes) -> None:
        if "asked" not in self.memory:
            super().send_state(frames)


def _refuses_idle_stop(link: FaultyLink, received: Received) -> Iterable[Received]:
    is_idle = not link.service.controller.status(link.service.now).in_motion
    if is_stop(received) and is_request(received) and is_idle:
        link.write(frame(11, 3, 2))
        return ()
    return (received,)


def _reversed_replies(link: FaultyLink, data: bytes) -> bytes:
    waiting = link.memory.setdefault("waiting", [])
    waiting.append(data)
    if len(waiting) == 1:
        link.later(0.0, lambda: _flush_reversed(link))
    return b""


def _flush_reversed(link: FaultyLink) -> None:
    link.write(b"".join(reversed(link.memory["waiting"])))
    link.memory["waiting"].clear()


def _body_of_any_size(kind: int) -> MessageIn:
    def change(link: FaultyLink, received: Received) -> Iterable[Received]:
        if isinstance(received, Malformed) and received.msg_type == kind:
            link.write(frame(kind, 3, 1))
            return ()
        return (received,)

    return change


class _TalkativeLink(FaultyLink):
    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        if self.is_motion:
            self.write(frame(MsgType.PING, 2))


def _no_answer_to_full_points(link: FaultyLink, received: Received) -> Iterable[Received]:
    return () if getattr(type(received), "PLACE", Ping.PLACE).msg_type == 14 else (received,)


REPLIES = (
    Fault("does not know PING", ("RS01",), DEVIATES, frame_out=_silent_on(1)),
    Fault(
        "does not know PING, though it must",
        ("RS01",),
        profile=Profile.MINIMUM,
        frame_out=_silent_on(1),
    ),
    Fault(
        "answers PING with failure",
        ("RS01",),
        frame_out=lambda _, f: patched(f, 12, 2) if header(f)[1] == 1 else f,
    ),
    Fault(
        "ignores a PING with a body",
        ("RS02",),
        bytes_in=lambda _, data: b"" if header(data)[:2] == (52, 1) else data,
    ),
    Fault("answers after 0.4 s", ("RS03",), frame_out=_late_replies),
    Fault("answers PING as a topic", ("RS04",), DEVIATES, bytes_in=_answers_topic(1)),
    Fault("does not answer unknown requests", ("RS05", "RS07"), frame_out=_silent_on(9999)),
    Fault(
        "answers unknown requests with success",
        ("RS05", "RS06"),
        frame_out=lambda _, f: patched(f, 12, ReplyCode.SUCCESS),
    ),
    Fault("drops links that send large types", ("RS06",), bytes_in=_drops_on_large_types),
    Fault("drops links that send unknown types", ("RS07",), bytes_in=_drops_on_unknown),
    Fault("answers unknown topics", ("RS08",), bytes_in=_answers_topic(9999)),
    Fault(
        "has a version of two numbers",
        ("RS09",),
        frame_out=lambda _, data: frame(2, 3, 1, little(0, 1)) if header(data)[1] == 2 else data,
    ),
    Fault(
        "answers a STATUS request with type 10",
        ("RS10",),
        frame_out=lambda _, data: patched(data, 4, 10) if header(data)[1] == 13 else data,
    ),
    Fault("stops reporting when asked on the state port", ("RS11",), link=_StateDeafLink),
    Fault("refuses STOP at rest", ("RS12",), message_in=_refuses_idle_stop),
    Fault("answers STOP as a topic", ("RS13",), bytes_in=_answers_topic(11)),
    Fault("answers twice", ("RS14", "RS20"), frame_out=lambda _, f: f + f),
    Fault("answers the newest request first", ("RS15",), frame_out=_reversed_replies),
    Fault("takes points that are too short", ("RS16",), message_in=_body_of_any_size(11)),
    Fault("takes points that are too long", ("RS17",), DEVIATES, message_in=_body_of_any_size(11)),
    Fault("does not answer full points", ("RS18",), message_in=_no_answer_to_full_points),
    Fault("takes trajectories of any count", ("RS19",), message_in=_body_of_any_size(12)),
    Fault("greets its clients", ("RS20",), link=_TalkativeLink),
)

WIRE_FAULTS = (*FRAMING, *HEADERS, *ORDER, *REPLIES)
