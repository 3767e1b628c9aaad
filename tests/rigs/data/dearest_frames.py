"""The dearest frames of every operation and message: legal ones at their bounds, and illegal ones.

Each is made for the server that it is for, because a change names the revision that it is made
from. A new operation or message needs its legal frame here.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from dataclasses import fields
from itertools import count
from typing import Any, Protocol, TypeAlias

from rigs.data.message_samples import SAMPLES

from openpendant.server.events.management_requests import MOST_AT_ONCE, MOST_BEFORE_LOGIN
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg import (
    PENDANT,
    ByteOrder,
    CommType,
    Message,
    MsgType,
    codec_for,
    joint_array,
)
from openpendant.simplemsg.declaration import Direction
from openpendant.simplemsg.pendant import (
    PENDANT_MESSAGES,
    Authority,
    AuthorityAction,
    AuthorityBeat,
    JointMove,
    JointPath,
    JointWaypoint,
    Management,
    Motion,
    PoseMove,
    PosePath,
    PoseWaypoint,
    SoftwareStop,
)
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.motion import MAX_WAYPOINTS


class Served(Protocol):
    """What has to be known of the server that a frame is for."""

    def revision(self, kind: DocumentKind) -> int:
        """Return the revision of a document that a change has to name."""


LARGEST = 65_000
"""About as large as a body fits a frame [bytes]."""

Make: TypeAlias = Callable[[Served], bytes]
"""Returns what is sent in one go."""

_CODEC = codec_for(PENDANT, ByteOrder.LITTLE)
_FRAMES, _TOOLS, _SCENE = DocumentKind.FRAMES, DocumentKind.TOOLS, DocumentKind.SCENE
_numbers = count(10)
_POSE = {"position": [0.1, 0.2, 0.3], "orientation": [0.0, 0.0, 0.0, 1.0]}
_BOX = {"type": "box", "size": [0.1, 0.1, 0.1]}
_HOME = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)


def frame_of(message: Message) -> bytes:
    return _CODEC.encode(message)


def asked(body: bytes) -> bytes:
    return frame_of(Management(next(_numbers), body))


def compact(body: object) -> bytes:
    return json.dumps(body, ensure_ascii=False, separators=(",", ":")).encode()


def filled(make: Callable[[int], object], size: int) -> bytes:
    """Return JSON that is made of some number of parts and has about so many bytes, not more."""
    parts = size
    while len(body := compact(make(parts))) > size:
        parts = min(parts - 1, parts * size // len(body))
    return body


def _text(points: int) -> str:
    lines = ["openpendant-program/1", 'program "new" robot ur5']
    lines += [f"point p{n} joints 0 -1.5 1.5 -1.5 -1.5 {n / 10_000} rad" for n in range(points)]
    return "\n".join([*lines, *(f"move PTP p{n}" for n in range(points))]) + "\n"


def _ball(number: int) -> dict[str, Any]:
    return {"name": f"b{number}", "shape": {"type": "sphere", "radius": 0.1}, "position": [9, 9, 9]}


def _legal(op: str, server: Served, again: int) -> dict[str, Any]:
    """Return the fields of a request that is carried out, or is refused as late as can be."""
    frames, tools = server.revision(_FRAMES), server.revision(_TOOLS)
    scene, positions = server.revision(_SCENE), server.revision(DocumentKind.POSITIONS)
    main = {"name": "main", "expected_revision": server.revision(DocumentKind.PROGRAM)}
    move = {"statement": "move", "way": "PTP", "point": "p1"}
    known: dict[str, dict[str, Any]] = {
        "users.remove": {"name": "nobody"},
        "users.set_role": {"name": "otto", "role": "operator"},
        "users.disable": {"name": "vera"},
        "users.enable": {"name": "vera"},
        "signals.set": {"output": 1, "value": True},
        "robots.load": {"name": "ur5"},
        "frames.add": {"name": f"n{again}", "pose": _POSE, "expected_revision": frames},
        "frames.move": {"name": "f1", "pose": _POSE, "expected_revision": frames},
        "frames.rename": {"name": "f2", "new_name": "f2", "expected_revision": frames},
        "frames.remove": {"name": f"n{again}", "expected_revision": frames},
        "frames.teach": {"points": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]},
        "frames.transform": {"source": "f1", "target": "f2", "seconds_ago": 10.0},
        "positions.save": {"name": f"n{again}", "joints": _HOME, "expected_revision": positions},
        "positions.rename": {"name": "none", "new_name": "n", "expected_revision": positions},
        "positions.delete": {"name": f"n{again}", "expected_revision": positions},
        "tools.add": {"name": f"n{again}", "tcp": _POSE, "expected_revision": tools},
        "tools.move": {"name": "t1", "tcp": _POSE, "expected_revision": tools},
        "tools.remove": {"name": f"n{again}", "expected_revision": tools},
        "tools.select": {"name": "t1", "expected_revision": tools},
        "tools.calibrate": {"positions": [[*_HOME[:3], n / 10, -1.5, n / 20] for n in range(20)]},
        "scene.add": {
            "object": {"name": f"n{again}", "shape": _BOX, "position": [9.0, 9.0, 9.0]},
            "expected_revision": scene,
        },
        "scene.remove": {"name": f"n{again}", "expected_revision": scene},
        "scene.move": {"name": "o1", "pose": _POSE, "expected_revision": scene},
        "scene.allow": {"first": "o1", "second": f"o{again + 1}", "expected_revision": scene},
        "scene.forbid": {"first": "o1", "second": f"o{again + 1}", "expected_revision": scene},
        "scene.attach": {"name": "o3", "expected_revision": scene},
        "scene.detach": {"name": "o3", "expected_revision": scene},
        "programs.create": {"name": f"made {again}"},
        "programs.load": {"name": "main"},
        "programs.history": {"name": "main"},
        "programs.delete": {"name": f"made {again}", "expected_revision": 1},
        "programs.rename": {**main, "new_name": f"{0:03}{'n' * 50}"},
        "programs.record": {**main, "point": f"q{again}"},
        "programs.touch_up": {**main, "point": "p1"},
        "programs.undo": main,
        "programs.redo": main,
        "programs.breakpoints": {"name": "main", "statements": list(range(1_000))},
        "programs.dry_run": {"name": "0" * 3 + "n" * 50},
        "programs.dry_run_progress": {},
        "programs.edit": {
            **main,
            "edit": {"edit": "insert", "at": 0, "statements": [move] * 50},
        },
        "recordings.describe": {"name": "none"},
        "recordings.start": {"name": f"r{again}"},
        "recordings.trim": {"name": "none", "new_name": "part"},
        "recordings.rename": {"name": "none", "new_name": "part", "expected_revision": 1},
        "recordings.delete": {"name": "none", "expected_revision": 1},
        "recordings.play": {"name": "none"},
    }
    return known.get(op, {})


def _large(op: str, server: Served) -> bytes | None:
    """Return the body of a request that is as large as a frame, for one that may be."""
    scene, frames = server.revision(_SCENE), server.revision(_FRAMES)
    tools = server.revision(_TOOLS)
    main = {"name": "main", "expected_revision": server.revision(DocumentKind.PROGRAM)}
    placed = {"xyz": [0.1, 0.2, 0.3], "quat": [0.0, 0.0, 0.0, 1.0]}
    schema = "openpendant-frames/1"
    makes: dict[str, Callable[[int], Any]] = {
        "scene.import": lambda n: {
            "content": {
                "schema": "openpendant-scene/1",
                "objects": [_ball(at) for at in range(min(n, 250))],
            },
            "expected_revision": scene,
        },
        "frames.import": lambda n: {
            "content": {
                "schema": schema,
                "frames": [{"name": f"f{at}", "parent": "base", **placed} for at in range(n)],
            },
            "expected_revision": frames,
        },
        "tools.import": lambda n: {
            "content": {
                "schema": schema,
                "tools": [{"name": f"t{at}", **placed} for at in range(n)],
            },
            "expected_revision": tools,
        },
        "programs.save": lambda n: {"name": "new", "body": _text(n), "expected_revision": 9},
        "programs.check": lambda n: {"body": _text(n)},
        "programs.edit": lambda n: {
            **main,
            "edit": {
                "edit": "insert",
                "at": 0,
                "statements": [{"statement": "move", "way": "PTP", "point": "p1"}] * n,
            },
        },
    }
    make = makes.get(op)
    return None if make is None else filled(lambda n: {"op": op} | make(n), LARGEST)


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
    return lambda server: data


def _asked(make: Callable[[int], bytes], size: int) -> Make:
    return lambda server: asked(make(size))


def _asked_legally(op: str) -> Make:
    again = count(1)
    return lambda server: asked(compact({"op": op} | _legal(op, server, next(again))))


def _asked_at_length(op: str) -> Make:
    return lambda server: asked(_large(op, server) or b"")


def _said(make: Callable[[int], Message]) -> Make:
    return lambda server: frame_of(make(next(_numbers)))


def operation_rows() -> dict[str, Make]:
    """Return the frames of every operation by a name: operation and shape."""
    rows: dict[str, Make] = {}
    for op in OPERATIONS:
        rows[f"{op}: legal"] = _asked_legally(op)
        if _is_large(op):
            rows[f"{op}: legal, largest"] = _asked_at_length(op)
        for size in (MOST_AT_ONCE, LARGEST):
            for shape, body in _illegal(op).items():
                rows[f"{op}: {shape}, {size} bytes"] = _asked(body, size)
    return rows


def _is_large(op: str) -> bool:
    return op in (
        "scene.import",
        "frames.import",
        "tools.import",
        "programs.save",
        "programs.check",
        "programs.edit",
    )


def stranger_rows() -> dict[str, Make]:
    """Return what somebody sends who has not logged in."""
    rows: dict[str, Make] = {}
    for size in (MOST_BEFORE_LOGIN, LARGEST):
        for shape, body in _illegal("tools.calibrate").items():
            rows[f"{shape}, {size} bytes"] = _asked(body, size)
    return rows | stream_rows()


def message_rows() -> dict[str, Make]:
    """Return the frames of every message that pendants send."""
    rows: dict[str, Make] = {}
    for kind in sorted(PENDANT_MESSAGES, key=lambda kind: kind.__name__):
        if kind.PLACE.direction not in (Direction.TO_SERVER, Direction.BOTH):
            continue
        frame = frame_of(SAMPLES[kind])
        rows[f"{kind.__name__}: sample"] = _always(frame)
        short = struct.pack("<i", len(frame) - 8) + frame[4:-4]
        rows[f"{kind.__name__}: cut short"] = _always(short)
        broken = frame[:16] + b"\xff" * (len(frame) - 16)
        rows[f"{kind.__name__}: no number in it"] = _always(broken)
    joints = joint_array(_HOME)
    far = joint_array((1.0, -1.0, 1.0, -1.0, -1.0, 1.0))
    # Near each other: how long a way may be that is checked in a full scene is another question.
    near = joint_array((0.01, *_HOME[1:]))
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
    for name, make in dear.items():
        rows[name] = _said(make)
    return rows


def stream_rows() -> dict[str, Make]:
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
    return {f"a stream of {name}": _always(data) for name, data in streams.items()}
