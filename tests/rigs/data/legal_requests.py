"""Requests that are carried out: of every operation the dearest, in a cell that is full.

Each is made for the server that it is for, because a change names the revision that it is made
from. A new operation needs its row here, unless it has no fields.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cache
from itertools import count, product
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from rigs.data.full_cell import (
    AT_ONCE,
    FRAMES,
    MAIN,
    PRINTED,
    ROOM,
    SMALL,
    TOOLS,
    ball,
    frames_of,
    text_of,
    tools_of,
    waits_of,
)

from openpendant.motion.description.robot import serial_robot
from openpendant.motion.kinematics.ik.ik import solve
from openpendant.motion.kinematics.serial import Kinematics
from openpendant.motion.pose import Pose
from openpendant.motion.scene.scene import MAX_ALLOWED
from openpendant.server.events.management_requests import MOST_AT_ONCE
from openpendant.server.programs.editing.program_tasks import MOST_TEXT_AT_ONCE
from openpendant.server.programs.language.program import MOST_POINTS
from openpendant.server.store.documents import DocumentKind
from openpendant.simplemsg import PENDANT, ByteOrder, Message, codec_for
from openpendant.simplemsg.pendant import Management
from openpendant.simplemsg.pendant.management import OPERATIONS
from openpendant.simplemsg.pendant.management.programs import MOST_STATEMENTS
from openpendant.simplemsg.pendant.management.statements import MOST_INSERTED


class Served(Protocol):
    """What has to be known of the server that a frame is for.

    Attributes:
        most_objects: objects of the scene that the robot takes at once.
        most_frames: user frames that there may be beside the tools and the robot's own.
        most_tools: likewise, tools.
    """

    most_objects: int
    most_frames: int
    most_tools: int

    def revision(self, kind: DocumentKind, name: str = "") -> int:
        """Return the revision that a change has to name; 0 of what there is not.

        Args:
            name: of a program or a recording; empty for a document of the cell.
        """

    def kept(self, name: str) -> str:
        """Return the JSON of a program."""

    def plan(self) -> int:
        """Return the number of a plan that is kept, as long as a plan may be."""

    def somebody(self) -> int:
        """Connect another pendant; return the number of its session."""


LARGEST = 65_000
"""About as large as a body fits a frame [bytes]."""

Make: TypeAlias = Callable[[Served, int], bytes]
"""Returns what is sent in one go, by the number of the try."""


@dataclass(frozen=True, slots=True)
class Row:
    """One row: what is sent in one go, whose turns are timed, and what is needed for it.

    Attributes:
        before: what the same pendant sends before, each once the last one was answered.
        after: likewise behind it, so that it can be tried again.
        is_legal: it is answered without a refusal, as all of `before` and `after` are.
        others: how many other pendants are connected meanwhile.
    """

    make: Make
    before: tuple[Make, ...] = ()
    after: tuple[Make, ...] = ()
    is_legal: bool = False
    others: int = 0


_CODEC = codec_for(PENDANT, ByteOrder.LITTLE)
_FRAMES, _TOOLS, _SCENE = DocumentKind.FRAMES, DocumentKind.TOOLS, DocumentKind.SCENE
_PROGRAM, _RECORDING = DocumentKind.PROGRAM, DocumentKind.RECORDING
_POSITIONS = DocumentKind.POSITIONS
_numbers = count(10)
_POSE = {"position": [0.1, 0.2, 0.3], "orientation": [0.0, 0.0, 0.0, 1.0]}
_REACHED = {"position": [0.4, 0.1, 0.3], "orientation": [0.0, 1.0, 0.0, 0.0]}
_ASIDE = (0.3, -1.5, 1.5, -1.5, -1.5, 0.0)
_BOX = {"type": "box", "size": [0.1, 0.1, 0.1]}
HOME = (0.0, -1.5, 1.5, -1.5, -1.5, 0.0)


def next_id() -> int:
    """Return the number of a request, higher than any before."""
    return next(_numbers)


def frame_of(message: Message) -> bytes:
    return _CODEC.encode(message)


def asked(body: bytes) -> bytes:
    return frame_of(Management(next_id(), body))


def compact(body: object) -> bytes:
    return json.dumps(body, ensure_ascii=False, separators=(",", ":")).encode()


_FEW = 100


def filled(make: Callable[[int], object], size: int) -> bytes:
    """Return JSON that is made of some number of parts and has about so many bytes, not more."""
    few, more = (len(compact(make(parts))) for parts in (_FEW, 2 * _FEW))
    # At most a little too many: later parts are no shorter than the first ones.
    parts = min(size, (size - few) * _FEW // max(more - few, 1) + _FEW + 1)
    while len(body := compact(make(parts))) > size:
        parts = min(parts - 1, parts * size // len(body))
    return body


@cache
def touches() -> list[list[float]]:
    """Return as many joint positions as are taken in which a tool touches one point."""
    kinematics = Kinematics(serial_robot("ur5"))
    tip, point = Pose.from_values([0.0, 0.0, 0.1], [0, 0, 0, 1]), [0.4, 0.1, 0.3]
    found: list[list[float]] = []
    for roll, pitch in product((-24, -8, 8, 24), (-30, -15, 0, 15, 30)):
        turned = _turn(roll, 0).compose(_turn(pitch, 1)).compose(_DOWN)
        at = Pose(np.array(point), turned.quaternion).compose(tip.inverse())
        found.append(solve(kinematics, at, HOME).joint_position.tolist())
    return found


_DOWN = Pose.from_values([0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0])


def _turn(degrees: float, axis: int) -> Pose:
    half = math.radians(degrees) / 2
    turned = [0.0, 0.0, 0.0, math.cos(half)]
    turned[axis] = math.sin(half)
    return Pose.from_values([0.0, 0.0, 0.0], turned)


Fields: TypeAlias = Callable[[Served, int], dict[str, Any]]
"""Returns the fields of a request, by the number of the try."""

Step: TypeAlias = tuple[str, Fields]
"""An operation and its fields."""


class Legal(NamedTuple):
    """A request that is carried out, and those that make it possible once more.

    Attributes:
        before: what the same pendant asks before it, each once the last one was answered.
        after: likewise behind it.
        others: how many other pendants are connected meanwhile.
    """

    fields: Fields
    before: tuple[Step, ...] = ()
    after: tuple[Step, ...] = ()
    others: int = 0


def _plain(**fields: object) -> Fields:
    return lambda server, number: fields


def _revised(kind: DocumentKind, **fields: object) -> Fields:
    """Return the fields of a change of a document of the cell from its revision."""
    return lambda server, number: {**fields, "expected_revision": server.revision(kind)}


def _numbered(kind: DocumentKind, **fields: object) -> Fields:
    """As `_revised`, of something that has a name of its own in each try."""
    made = _revised(kind, **fields)
    return lambda server, number: {"name": f"n{number}"} | made(server, number)


def _of(kind: DocumentKind, name: str, **fields: object) -> Fields:
    """Return the fields of a change of a document from its revision."""
    return lambda server, number: {
        "name": name,
        **fields,
        "expected_revision": server.revision(kind, name),
    }


_MOVE = {"statement": "move", "way": "PTP", "point": "p1"}
_REORDER = {"edit": "reorder", "first": 0, "count": 1_000, "to": 1_000}
_UNDO: Step = ("programs.undo", _of(_PROGRAM, ROOM))
_TOUCHED: Step = ("programs.touch_up", _of(_PROGRAM, MAIN, point="p1"))
_MARKED: Step = ("programs.breakpoints", _plain(name=MAIN, statements=list(range(1_000))))
_EDITED: Step = ("programs.edit", _of(_PROGRAM, ROOM, edit=_REORDER))
_RECORDED: Step = ("recordings.start", lambda server, number: {"name": f"r{number}"})
_STOPPED: Step = ("recordings.stop", _plain())
_PART: Step = (
    "recordings.trim",
    lambda server, number: {"name": "kept", "new_name": f"part {number}"},
)
_AWAY: Step = ("recordings.rename", _of(_RECORDING, "cut off", new_name="away"))
_BACK: Step = ("recordings.rename", _of(_RECORDING, "away", new_name="cut off"))
_BARRED: Step = (
    "access.bar",
    lambda server, number: {"address": f"198.51.{number // 250}.{number % 250}", "minutes": 1_440},
)
_NOTED: Step = ("scene.allow", _revised(_SCENE, first="o1", second="o2"))
_UNNOTED: Step = ("scene.forbid", _revised(_SCENE, first="o1", second="o2"))
_ADDED: Step = (
    "scene.add",
    lambda server, number: {
        "object": {"name": f"n{number}", "shape": _BOX, "position": [9.0, 9.0, 9.0]},
        "expected_revision": server.revision(_SCENE),
    },
)
_GONE: Step = ("scene.remove", _numbered(_SCENE))


def _at_the_tool() -> dict[str, list[float]]:
    """Return a place near the flange and near a tool of 0.1 m, where the robot is at home."""
    robot = serial_robot("ur5")
    beyond = Pose.from_values([0.0, 0.0, 0.05], [0.0, 0.0, 0.0, 1.0])
    place = Kinematics(robot).forward(robot.home_position).compose(beyond)
    return {"position": place.position.tolist()}


_BARE: Step = ("tools.select", _revised(_TOOLS, name=None))
_BROUGHT: Step = ("scene.move", _revised(_SCENE, name="o3", pose=_at_the_tool()))
_TAKEN: Step = ("scene.attach", _revised(_SCENE, name="o3"))
_LEFT: Step = ("scene.detach", _revised(_SCENE, name="o3"))
_FRAMED: Step = ("frames.add", _numbered(_FRAMES, pose=_POSE))
_UNFRAMED: Step = ("frames.remove", _numbered(_FRAMES))
_TOOLED: Step = ("tools.add", _numbered(_TOOLS, tcp=_POSE))
_UNTOOLED: Step = ("tools.remove", _numbered(_TOOLS))
_STOOD: Step = ("positions.save", _numbered(_POSITIONS, joints=HOME))
_KEPT_POSITION: Step = ("positions.save", _revised(_POSITIONS, name="p1", joints=HOME))
_LEFT_POSITION: Step = ("positions.delete", _numbered(_POSITIONS))
_LONG = "n" * 50


def _fresh(name: str, make: Callable[[int], str], size: int) -> Fields:
    """Return the fields of a program that is saved anew, whose text is as long as that."""

    def fields(server: Served, number: int) -> dict[str, Any]:
        count = size // 9
        while len(body := make(count)) > size:
            count -= 1
        return {"name": name, "body": body, "expected_revision": server.revision(_PROGRAM, name)}

    return fields


_LEGAL: Mapping[str, Legal] = {
    "access.sessions": Legal(_plain(), others=180),
    "access.connections": Legal(_plain(), others=180),
    "access.close": Legal(lambda server, number: {"session": server.somebody()}),
    "access.bar": Legal(_BARRED[1], after=(("access.unbar", lambda s, n: _address(s, n)),)),
    "access.unbar": Legal(lambda server, number: _address(server, number), before=(_BARRED,)),
    "users.remove": Legal(_plain(name="otto")),
    "users.set_role": Legal(_plain(name="otto", role="operator")),
    "users.disable": Legal(_plain(name="vera")),
    "users.enable": Legal(_plain(name="vera")),
    "catalogue": Legal(_plain(part="messages")),
    "signals.set": Legal(_plain(output=511, value=True)),
    "robots.load": Legal(_plain(name="ur5")),
    "frames.add": Legal(_FRAMED[1], after=(_UNFRAMED,)),
    "frames.move": Legal(_revised(_FRAMES, name="f1", pose=_POSE)),
    "frames.rename": Legal(
        _revised(_FRAMES, name="f2", new_name="f2 anew"),
        after=(("frames.rename", _revised(_FRAMES, name="f2 anew", new_name="f2")),),
    ),
    "frames.remove": Legal(_UNFRAMED[1], before=(_FRAMED,)),
    "frames.teach": Legal(
        _plain(points=[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 2.0, 0.0]])
    ),
    "frames.transform": Legal(_plain(source="f499", target="tool", pose=_POSE, seconds_ago=10.0)),
    "kinematics.fk": Legal(_plain(frame="f499", tool="t1", all_links=True)),
    "kinematics.jacobian": Legal(_plain(tool="t1")),
    "kinematics.ik": Legal(_plain(pose=_REACHED, branches="turns", scene=True)),
    "shapes.show": Legal(_plain(robot="rail_kr5_arc")),
    "shapes.mesh": Legal(_plain(hash="0" * 64)),
    "tools.add": Legal(_TOOLED[1], after=(_UNTOOLED,)),
    "tools.move": Legal(_revised(_TOOLS, name="t1", tcp=_POSE)),
    "tools.remove": Legal(_UNTOOLED[1], before=(_TOOLED,)),
    "tools.select": Legal(_revised(_TOOLS, name="t1")),
    "tools.calibrate": Legal(lambda server, number: {"positions": touches()}),
    "scene.add": Legal(_ADDED[1], after=(_GONE,)),
    "scene.remove": Legal(_GONE[1], before=(_ADDED,)),
    "scene.move": Legal(_revised(_SCENE, name="o1", pose=_POSE)),
    "scene.allow": Legal(_NOTED[1], after=(_UNNOTED,)),
    "scene.forbid": Legal(_UNNOTED[1], before=(_NOTED,)),
    # A plan as long as a plan may be, whose numbers have all their digits.
    "plans.make": Legal(_plain(goal={"kind": "ptp", "joints": _ASIDE}, label="l" * 64)),
    "plans.samples": Legal(lambda server, number: {"plan": server.plan(), "with_tool": True}),
    "plans.drop": Legal(lambda server, number: {"plan": server.plan()}),
    "positions.save": Legal(_STOOD[1], after=(_LEFT_POSITION,)),
    "positions.rename": Legal(
        _revised(_POSITIONS, name="p1", new_name="p1 anew"),
        before=(_KEPT_POSITION,),
        after=(("positions.delete", _revised(_POSITIONS, name="p1 anew")),),
    ),
    "positions.delete": Legal(_LEFT_POSITION[1], before=(_STOOD,)),
    "programs.create": Legal(
        lambda server, number: {"name": f"made {number}"},
        after=(("programs.delete", lambda s, n: {"name": f"made {n}", "expected_revision": 1}),),
    ),
    "programs.load": Legal(_plain(name=MAIN), before=(_MARKED, _TOUCHED)),
    "programs.history": Legal(_plain(name=MAIN)),
    # What is read on the loop at once, and dearest there.
    "programs.save": Legal(_fresh("waits", lambda n: waits_of("waits", n), MOST_TEXT_AT_ONCE)),
    "programs.check": Legal(
        lambda server, number: {"body": waits_of("waits", (MOST_TEXT_AT_ONCE - 60) // 9)}
    ),
    "programs.delete": Legal(
        lambda server, number: {"name": f"made {number}", "expected_revision": 1},
        before=(("programs.create", lambda server, number: {"name": f"made {number}"}),),
    ),
    "programs.rename": Legal(
        _of(_PROGRAM, MAIN, new_name="moved"),
        before=(_MARKED,),
        after=(("programs.rename", _of(_PROGRAM, "moved", new_name=MAIN)),),
    ),
    "programs.edit": Legal(_of(_PROGRAM, MAIN, edit=_REORDER), before=(_MARKED,)),
    "programs.record": Legal(
        _of(_PROGRAM, ROOM, point="q", move={**_MOVE, "point": "q"}, at=0), after=(_UNDO,)
    ),
    "programs.touch_up": Legal(_TOUCHED[1], before=(_MARKED,)),
    "programs.undo": Legal(_UNDO[1], before=(_EDITED,)),
    "programs.redo": Legal(_of(_PROGRAM, ROOM), before=(_EDITED, _UNDO)),
    "programs.breakpoints": Legal(_MARKED[1], before=(_TOUCHED,)),
    "programs.dry_run": Legal(_plain(name=f"{0:03}{_LONG}")),
    "recordings.list": Legal(_plain(), before=(_AWAY, _BACK)),
    # It was counted before where its revision is the same.
    "recordings.describe": Legal(_plain(name="cut off"), before=(_AWAY, _BACK)),
    "recordings.start": Legal(_RECORDED[1], after=(_STOPPED,)),
    "recordings.stop": Legal(_STOPPED[1], before=(_RECORDED,)),
    "recordings.trim": Legal(_PART[1]),
    "recordings.rename": Legal(_AWAY[1], after=(_BACK,)),
    "recordings.delete": Legal(
        lambda server, number: _of(_RECORDING, f"part {number}")(server, number),
        before=(_PART,),
    ),
    "recordings.play": Legal(_plain(name="kept", repeats=1)),
}
"""By operation; what is not there needs no fields."""


def _address(server: Served, number: int) -> dict[str, Any]:
    return {"address": _BARRED[1](server, number)["address"]}


def _inserted(count: int, **more: object) -> dict[str, Any]:
    return {"edit": "insert", "at": 0, "statements": [_MOVE | more] * count}


_WAIT = {"edit": "insert", "at": 0, "statements": [{"statement": "wait", "duration": 1.0}]}


def _as_large(op: str, make: Callable[[Served, int], dict[str, Any]], size: int) -> Make:
    """Return a request of about so many bytes, of some number of parts."""
    return lambda server, number: asked(
        filled(lambda parts: {"op": op} | make(server, parts), size)
    )


_LINKS = tuple(link for link in serial_robot("ur5").collision if link != "base_link")


def _scene(server: Served, count: int) -> dict[str, Any]:
    """Return objects as many as are checked, then others that the moving links may touch."""
    checked = min(count, server.most_objects)
    others = range(checked, min(count, checked + MAX_ALLOWED // len(_LINKS)))
    content = {
        "schema": "openpendant-scene/1",
        "objects": [ball(at) for at in range(max(checked, others.stop))],
        "allowed": [[f"o{at}", link] for at in others for link in _LINKS],
    }
    return {"content": content, "expected_revision": server.revision(_SCENE)}


def _frames(server: Served, count: int) -> dict[str, Any]:
    content = frames_of(min(count, server.most_frames))
    return {"content": content, "expected_revision": server.revision(_FRAMES)}


def _tools(server: Served, count: int) -> dict[str, Any]:
    content = tools_of(min(count, server.most_tools))
    return {"content": content, "expected_revision": server.revision(_TOOLS)}


def _import_rows() -> dict[str, Row]:
    """Return imports that are as large as a frame, and those that are read on the loop."""

    def again(op: str, make: Callable[[Served, int], dict[str, Any]], most: int) -> Make:
        """Return the import of what was there before."""
        return _as_large(op, lambda server, count: make(server, min(count, most)), LARGEST)

    rows: dict[str, Row] = {}
    kinds = {"scene": (_scene, LARGEST), "frames": (_frames, FRAMES), "tools": (_tools, TOOLS)}
    for kind, (make, most) in kinds.items():
        op = f"{kind}.import"
        few, many = (_as_large(op, make, size) for size in (MOST_AT_ONCE, LARGEST))
        after: tuple[Make, ...] = (again(op, make, most),)
        rows[f"{op}: legal"] = Row(few, after=after)
        rows[f"{op}: legal, largest"] = Row(many, after=after)
    # An answer has no room for more.
    fewer, whole = rows["frames.import: legal"].make, rows["frames.import: legal"].after
    rows["frames.show: legal"] = Row(_step(("frames.show", _plain())), (fewer,), whole)
    # What is carried makes a pair with each of the others.
    fewer = _as_large(
        "scene.import", lambda server, count: _scene(server, server.most_objects * 8 // 9), LARGEST
    )
    whole, taken, left = rows["scene.import: legal"].after, _step(_TAKEN), _step(_LEFT)
    brought = (fewer, _step(_BARE), _step(_BROUGHT))
    rows["scene.attach: legal"] = Row(taken, brought, (left, *whole))
    rows["scene.detach: legal"] = Row(left, (*brought, taken), whole)
    return {name: replace(row, is_legal=True) for name, row in rows.items()}


def _program_rows() -> dict[str, Row]:
    """Return requests about programs that are as large as a frame, or as is done on the loop."""

    def saved(server: Served, count: int) -> dict[str, Any]:
        name = "saved"
        body = text_of(name, count, count)
        return {"name": name, "body": body, "expected_revision": server.revision(_PROGRAM, name)}

    def checked(server: Served, count: int) -> dict[str, Any]:
        return {"body": text_of("checked", count, count)}

    def edited(name: str) -> Make:
        def make(server: Served, count: int) -> dict[str, Any]:
            edit = _inserted(MOST_INSERTED, comment="c" * min(count, 200))
            return _of(_PROGRAM, name, edit=edit)(server, 0)

        return _as_large("programs.edit", make, LARGEST)

    def waiting(name: str) -> Make:
        return _step(("programs.edit", _of(_PROGRAM, name, edit=_WAIT)))

    def undone(name: str) -> Make:
        return _step(("programs.undo", _of(_PROGRAM, name)))

    def in_json(server: Served, number: int) -> dict[str, Any]:
        fields = {"format": "json", "body": server.kept(AT_ONCE)}
        return _of(_PROGRAM, AT_ONCE, **fields)(server, number)

    load = _step(("programs.load", _plain(name=PRINTED)))
    whole = [("programs.save", saved), ("programs.check", checked)]
    rows = {f"{op}: legal, largest": Row(_as_large(op, make, LARGEST)) for op, make in whole}
    rows |= {
        "programs.save: legal, last part of the largest": _last_part(),
        "programs.save: legal, the largest JSON at once": Row(_step(("programs.save", in_json))),
        "programs.edit: legal, largest": Row(edited(ROOM), after=(undone(ROOM),)),
        "programs.edit: legal, largest, of a small program": Row(
            edited(SMALL), after=(undone(SMALL),)
        ),
        "programs.edit: legal, of the largest program at once": Row(
            waiting(AT_ONCE), after=(undone(AT_ONCE),)
        ),
        "programs.load: legal, the largest program at once": Row(
            load, before=(waiting(PRINTED), undone(PRINTED))
        ),
    }
    return {name: replace(row, is_legal=True) for name, row in rows.items()}


def _last_part() -> Row:
    """Return the last part of a program as large as they are taken, once the others were taken."""
    text = text_of(MAIN, MOST_POINTS, MOST_STATEMENTS)
    pieces = [text[at : at + 40_000] for at in range(0, len(text), 40_000)]

    def part(number: int) -> Make:
        return _step(
            (
                "programs.save",
                _of(_PROGRAM, MAIN, body=pieces[number - 1], part=number, parts=len(pieces)),
            )
        )

    *first, last = (part(number) for number in range(1, len(pieces) + 1))
    return Row(last, before=(*first,), is_legal=True)


def _step(step: Step) -> Make:
    op, fields = step
    return lambda server, number: asked(compact({"op": op} | fields(server, number)))


_REFUSED = frozenset({"shapes.mesh"})
"""What this robot has nothing for: no mesh was imported with it."""


def legal_rows() -> dict[str, Row]:
    """Return the requests by a name: operation and shape."""
    rows = _import_rows() | _program_rows()
    for op in OPERATIONS:
        if f"{op}: legal" not in rows:
            fields, before, after, others = _LEGAL.get(op, Legal(_plain()))
            first, then = (tuple(map(_step, each)) for each in (before, after))
            is_legal = op not in _REFUSED
            made = Row(_step((op, fields)), first, then, is_legal=is_legal, others=others)
            rows[f"{op}: legal"] = made
    return rows
