"""The dearest frames of every operation and message: legal ones at their bounds, and illegal ones.

A new message needs its legal frame here, a new operation in `legal_requests`.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import fields
from typing import Any

from rigs.data.full_cell import frames_of, tools_of
from rigs.data.legal_requests import (
    HOME,
    LARGEST,
    Make,
    Row,
    Served,
    asked,
    compact,
    filled,
    frame_of,
    legal_rows,
    next_id,
)
from rigs.data.message_samples import SAMPLES

from openpendant.motion.frames.frame_tree import MOST_FRAMES
from openpendant.server.events.management_requests import MOST_AT_ONCE, MOST_BEFORE_LOGIN
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg import CommType, Message, MsgType, joint_array
from openpendant.simplemsg.declaration import Direction
from openpendant.simplemsg.pendant import (
    PENDANT_MESSAGES,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    Forwarded,
    JointMove,
    JointPath,
    JointWaypoint,
    Lobby,
    Motion,
    PoseMove,
    PosePath,
    PoseWaypoint,
    SoftwareStop,
)
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.motion import MAX_WAYPOINTS


def _illegal(op: str) -> dict[str, Callable[[int], bytes]]:
    """Return what makes bodies of a size that are refused, each as late and as dear as can be."""
    told = {"op": op}
    of_lists = {each.name for each in fields(OPERATIONS[op])} - {"op"}
    wrong = {f"wrong elements in {name}": _of_wrong(told, name) for name in sorted(of_lists)}
    return {
        **wrong,
        "unknown keys": lambda size: filled(
            lambda n: told | {f"k{at:x}": 0 for at in range(n)}, size
        ),
        "one long key": lambda size: filled(lambda n: told | {"k" * n: 0}, size),
        "objects in a key too many": lambda size: filled(lambda n: told | {"k": [{}] * n}, size),
        "deeply nested": lambda size: compact(told)[:-1] + b',"k":' + b"[" * (size - 60),
        "keys twice": lambda size: compact(told)[:-1] + b',"kk":0' * ((size - 60) // 7) + b"}",
    }


def _of_wrong(told: dict[str, str], name: str) -> Callable[[int], bytes]:
    return lambda size: filled(lambda n: told | {name: ["a"] * n}, size)


def _always(data: bytes) -> Make:
    return lambda server, number: data


def _asked(make: Callable[[int], bytes], size: int) -> Make:
    return lambda server, number: asked(make(size))


def _one_too_many(op: str, key: str, make: Callable[[int], dict[str, Any]]) -> Make:
    """Return what makes a request that is refused once as many frames as may be are placed."""
    kind = DocumentKind(key)

    def body(server: Served, number: int) -> bytes:
        fields = {"expected_revision": server.revision(kind)}
        return filled(lambda n: {"op": op, "content": make(min(n, MOST_FRAMES)), **fields}, LARGEST)

    return lambda server, number: asked(body(server, number))


def _said(make: Callable[[int], Message]) -> Make:
    return lambda server, number: frame_of(make(next_id()))


def operation_rows() -> dict[str, Row]:
    """Return the frames of every operation by a name: operation and shape."""
    rows = legal_rows()
    for op, key, make in (
        ("frames.import", "frames", frames_of),
        ("tools.import", "tools", tools_of),
    ):
        rows[f"{op}: one too many"] = Row(_one_too_many(op, key, make))
    for op in OPERATIONS:
        for size in (MOST_AT_ONCE, LARGEST):
            for shape, body in _illegal(op).items():
                rows[f"{op}: {shape}, {size} bytes"] = Row(_asked(body, size))
    return rows


def stranger_rows() -> dict[str, Row]:
    """Return what somebody sends who has not logged in."""
    rows: dict[str, Row] = {}
    for size in (MOST_BEFORE_LOGIN, LARGEST):
        for shape, body in _illegal("tools.calibrate").items():
            rows[f"{shape}, {size} bytes"] = Row(_asked(body, size))
    return rows | stream_rows()


def first_rows() -> dict[str, Row]:
    """Return what somebody sends before a hello, who may then be closed for it."""
    lobby = frame_of(Lobby(1))
    rows = {
        "a lobby": lobby,
        "lobbies that come too often": lobby * (64 * 1024 // len(lobby)),
        "a forged address": frame_of(SAMPLES[Forwarded]),
        "an address in no text": frame_of(SAMPLES[Forwarded])[:16] + b"\xff" * 164,
        "a lobby in front of a forged address": lobby + frame_of(SAMPLES[Forwarded]),
    }
    return {name: Row(_always(data)) for name, data in rows.items()}


def message_rows() -> dict[str, Row]:
    """Return the frames of every message that pendants send."""
    rows: dict[str, Row] = {}
    for kind in sorted(PENDANT_MESSAGES, key=lambda kind: kind.__name__):
        if kind.PLACE.direction not in (Direction.TO_SERVER, Direction.BOTH):
            continue
        frame = frame_of(SAMPLES[kind])
        rows[f"{kind.__name__}: sample"] = Row(_always(frame))
        short = struct.pack("<i", len(frame) - 8) + frame[4:-4]
        rows[f"{kind.__name__}: cut short"] = Row(_always(short))
        broken = frame[:16] + b"\xff" * (len(frame) - 16)
        rows[f"{kind.__name__}: no number in it"] = Row(_always(broken))
    return rows


def motion_rows() -> dict[str, Row]:
    """Return motions at their bounds, all of which are planned."""
    joints = joint_array(HOME)
    far = joint_array((1.0, -1.0, 1.0, -1.0, -1.0, 1.0))
    # Near each other: how long a way may be that is checked in a full scene is another question.
    near = joint_array((0.01, *HOME[1:]))
    waypoints = tuple(JointWaypoint(near if at % 2 else joints) for at in range(MAX_WAYPOINTS))
    places = tuple(
        PoseWaypoint((0.4, 0.1, 0.3 + at / 10_000), (0.0, 1.0, 0.0, 0.0))
        for at in range(MAX_WAYPOINTS)
    )
    pose = places[0]
    dear: dict[str, Callable[[int], Message]] = {
        "JointMove: far": lambda number: JointMove(number, 1.0, 6, far),
        "JointPath: longest": lambda number: JointPath(number, 1.0, 6, waypoints),
        "PoseMove: straight": lambda number: PoseMove(
            number, Motion.LIN, 1.0, "base", pose.position, pose.orientation
        ),
        "PosePath: longest": lambda number: PosePath(number, Motion.PTP, 1.0, "base", places),
    }
    return {name: Row(_said(make)) for name, make in dear.items()}


def stream_rows() -> dict[str, Row]:
    """Return many frames in one go: more than a read takes."""
    bare = struct.pack("<4i", 12, 99, CommType.REQUEST, 0)
    ping = struct.pack("<4i", 12, MsgType.PING, CommType.REQUEST, 0)
    short_stop = struct.pack("<4i", 12, SoftwareStop.PLACE.msg_type, CommType.REQUEST, 0)
    beat = frame_of(AuthorityBeat())
    stop = frame_of(SoftwareStop(1, "x" * 60))
    ask = frame_of(Authority(1, AuthorityAction.REQUEST))
    why = asked(b'{"op":"why"}')
    many = {
        "bare headers": bare,
        "pings": ping,
        "stops too short for their type": short_stop,
        "stops": stop,
        "beats": beat,
        "requests of the authority": ask,
        "whys": why,
    }
    # What is answered at length would be cut off, as nobody reads here.
    sizes = {name: 16 * 1024 if name == "whys" else 256 * 1024 for name in many}
    streams = {name: frame * (sizes[name] // len(frame)) for name, frame in many.items()}
    return {f"a stream of {name}": Row(_always(data)) for name, data in streams.items()}
