"""Which management requests are recorded with their answers: right ones, and what can be wrong.

Owns the conversations, one a cell: right requests in an order in which each has something to work
on. In front of the first of each operation stand the same request with a key too many, without a
key, with values of another type or out of bounds, and from a role that may not; none of them
changes anything.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from frozen.asked_cell import VISITOR
from frozen.body_file import Body, Happening, Question, Step

SCHEMAS = Path(__file__).parents[2] / "docs" / "generated" / "schemas"
VIEWER, OPERATOR, PROGRAMMER, ADMIN = "viewer", "operator", "programmer", "admin"
ROLES = (VISITOR, VIEWER, OPERATOR, PROGRAMMER, ADMIN)


@dataclass(frozen=True)
class Right:
    """A right request, or one that is wrong in a way that no rule makes up.

    Attributes:
        label: what is special about it.
    """

    op: str
    fields: Mapping[str, Any]
    by: str = PROGRAMMER
    label: str = ""

    def with_fields(self, **fields: Any) -> dict[str, Any]:
        return {"op": self.op, **self.fields, **fields}


def ask(op: str, label: str = "", by: str = PROGRAMMER, /, **fields: Any) -> Right:
    return Right(op, fields, by, label)


def do(**what: Any) -> Happening:
    return Happening(what)


HEAD = """openpendant-program/1
program "{name}" robot ur5
point a joints 0 -1.5 1.5 -1.5 -1.5 0 rad
point b joints 0.125 -1.5 1.5 -1.5 -1.5 0 rad
"""
MAIN = HEAD.format(name="main") + "move PTP a\nloop 2\n  move PTP b speed 50 %\n  call aside\nend\n"
ASIDE = HEAD.format(name="aside") + "move PTP b\nwait 0.5 s\n"
FAR = HEAD.format(name="far") + (
    "point c joints 9 -1.5 1.5 -1.5 -1.5 0 rad\nmove PTP a\nmove PTP c\nset output 99 on\n"
)
AS_JSON = json.dumps(
    {
        "format": "openpendant-program/1",
        "name": "json",
        "robot": "ur5",
        "points": [{"name": "a", "joints": [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]}],
        "statements": [{"statement": "move", "way": "PTP", "point": "a"}],
    }
)
TO_A: dict[str, Any] = {"statement": "move", "way": "PTP", "point": "a"}
STATEMENTS: tuple[dict[str, Any], ...] = (
    TO_A,
    {**TO_A, "way": "LIN", "speed": {"kind": "tool", "value": 0.25}, "zone": 0.01},
    {"statement": "move", "way": "CIRC", "point": "a", "via": ["b"], "dwell": 0.5},
    {"statement": "move", "way": "SPLINE", "point": "a", "via": ["b"], "comment": "a curve"},
    {"statement": "wait", "duration": 1.5},
    {"statement": "wait-input", "signal": 1, "value": True, "timeout": 2.0},
    {"statement": "set-output", "signal": 2, "value": False},
    {"statement": "read-input", "signal": 3, "flag": "there"},
    {"statement": "attach", "scene_object": "part"},
    {"statement": "detach", "scene_object": "part"},
    {"statement": "loop", "passes": 3},
    {"statement": "if-flag", "flag": "there", "value": True},
    {"statement": "call", "program": "aside"},
    {"statement": "else"},
    {"statement": "end"},
    {"statement": "if-input", "signal": 0, "value": False},
    {"statement": "comment", "comment": "nothing"},
    {"statement": "end"},
    {"statement": "end"},
)
WRONG_EDITS: dict[str, dict[str, Any]] = {
    "of no kind": {"edit": "burn"},
    "without a kind": {"first": 0},
    "a statement of no kind": {"edit": "insert", "statements": [{"statement": "fly"}]},
    "a move of no kind": {"edit": "insert", "statements": [{**TO_A, "way": "FLY"}]},
    "a move to no point": {"edit": "insert", "statements": [{**TO_A, "point": "nowhere"}]},
    "a speed of 0": {
        "edit": "insert",
        "statements": [{**TO_A, "speed": {"kind": "fraction", "value": 0.0}}],
    },
    "a zone and a dwell": {"edit": "insert", "statements": [{**TO_A, "zone": 0.1, "dwell": 1.0}]},
    "a circle without a way": {"edit": "insert", "statements": [{**TO_A, "way": "CIRC"}]},
    "a wait that is too long": {
        "edit": "insert",
        "statements": [{"statement": "wait", "duration": 1e9}],
    },
    "a wait below 0": {"edit": "insert", "statements": [{"statement": "wait", "duration": -1.0}]},
    "an end without a begin": {"edit": "insert", "statements": [{"statement": "end"}]},
    "a statement that is not there": {"edit": "delete", "first": 99},
    "a key too many in a statement": {"edit": "insert", "statements": [{**TO_A, "colour": 1}]},
    "a point that is used": {"edit": "delete-point", "name": "a"},
    "a point that is there": {"edit": "rename-point", "name": "a", "new_name": "b"},
    "joints too few": {"edit": "touch-up", "name": "a", "joints": [0.0]},
}
EDITS: tuple[dict[str, Any], ...] = (
    {"edit": "insert", "at": 0, "statements": STATEMENTS},
    {"edit": "replace", "at": 0, "statement": {"statement": "wait", "duration": 0.25}},
    {"edit": "comment", "at": 0, "comment": "a rest"},
    {"edit": "reorder", "first": 0, "count": 1, "to": 1},
    {"edit": "delete", "first": 1, "count": 1},
    {
        "edit": "record-point",
        "point": {
            "name": "c",
            "joints": [0.25, -1.5, 1.5, -1.5, -1.5, 0.0],
            "pose": {
                "position": [0.5, 0.25, 0.125],
                "quaternion": [0.0, 1.0, 0.0, 0.0],
                "frame": "base",
                "tool": "flange",
            },
            "configuration": {"shoulder": "front", "elbow": "up", "wrist": "no-flip"},
            "comment": "taught elsewhere",
        },
        "move": {"way": "PTP", "point": "c"},
    },
    {"edit": "touch-up", "name": "c", "joints": [0.5, -1.5, 1.5, -1.5, -1.5, 0.0]},
    {"edit": "rename-point", "name": "c", "new_name": "d"},
    {"edit": "comment-point", "name": "d", "comment": "moved"},
    {"edit": "reorder-point", "name": "d", "to": 0},
    {"edit": "describe", "comment": "of many kinds"},
)

CELL: list[Right | Happening] = [
    ask("cells"),
    ask("why"),
    ask("why", "of a jog", kind="jog"),
    ask("why", "of one's own", whose="mine"),
    ask("why", "of a program, by who may not", VIEWER, kind="program", whose="mine"),
    ask("why", "of nothing", kind="dance"),
    do(take=PROGRAMMER),
    ask("why", "in control", whose="mine"),
    ask("jog.retreat"),
    ask("snapshot"),
]

PROGRAMS = [
    ask("programs.list"),
    ask("programs.create", name="new"),
    ask("programs.create", "once more", name="new"),
    ask("programs.create", "of a name that is none", name="a/b"),
    ask("programs.create", "of a name that is too long", name="n" * 65),
    ask("programs.create", "without a name", name=""),
    ask("programs.create", "in a frame that is not there", name="lost", frame="nowhere"),
    ask("programs.check", body=ASIDE),
    ask("programs.check", "of no program", body="no program"),
    ask("programs.check", "of a wrong line", body=ASIDE + "move FLY b\n"),
    ask("programs.check", "of another robot", body=ASIDE.replace("ur5", "abb_irb120")),
    ask("programs.check", "out of range", body=ASIDE.replace("0.125", "9.0")),
    ask("programs.check", "of JSON", format="json", body=AS_JSON),
    ask("programs.check", "of text as JSON", format="json", body=ASIDE),
    ask(
        "programs.check",
        "of JSON with a key too many",
        format="json",
        body=AS_JSON[:-1] + ',"x":1}',
    ),
    ask("programs.save", name="aside", body=ASIDE, expected_revision=0),
    ask("programs.save", "once more", name="aside", body=ASIDE, expected_revision=0),
    ask("programs.save", "under another name", name="other", body=ASIDE, expected_revision=0),
    ask("programs.save", "as JSON", name="json", body=AS_JSON, format="json", expected_revision=0),
    ask(
        "programs.save",
        "the first part",
        name="main",
        body=MAIN[:100],
        expected_revision=0,
        part=1,
        parts=2,
    ),
    ask(
        "programs.save",
        "the last part",
        name="main",
        body=MAIN[100:],
        expected_revision=0,
        part=2,
        parts=2,
    ),
    ask(
        "programs.save",
        "a part that is not next",
        name="main",
        body=MAIN,
        expected_revision=1,
        part=3,
        parts=3,
    ),
    ask("programs.save", "of what is refused", name="far", body=FAR, expected_revision=0),
    ask("programs.load", name="main"),
    ask("programs.load", "as JSON", name="main", format="json"),
    ask("programs.load", "a part", name="main", offset=200),
    ask("programs.load", "beyond its end", name="main", offset=100_000),
    ask("programs.load", "another revision", name="main", revision=9),
    ask("programs.load", "of nothing", name="nothing"),
    ask("programs.history", name="main"),
    ask("programs.history", "of nothing", name="nothing"),
    ask("programs.list", "some", first=1),
    *(
        ask(
            "programs.edit",
            f"{at} {edit['edit']}" if at else "",
            name="new",
            expected_revision=1 + at,
            edit=edit,
        )
        for at, edit in enumerate(
            (
                {"edit": "record-point", "point": {"name": "b", "joints": [0.0] * 6}},
                {"edit": "record-point", "point": {"name": "a", "joints": [0.0] * 6}},
                *EDITS,
            )
        )
    ),
    *(
        ask("programs.edit", label, name="main", expected_revision=1, edit=edit)
        for label, edit in WRONG_EDITS.items()
    ),
    ask("programs.load", "after all edits", name="new"),
    ask("programs.undo", name="new", expected_revision=14),
    ask("programs.undo", "from an older one", name="new", expected_revision=14),
    ask("programs.redo", name="new", expected_revision=15),
    ask("programs.redo", "where there is nothing", name="new", expected_revision=16),
    ask("programs.undo", "of nothing", name="nothing", expected_revision=1),
    ask("programs.record", name="main", expected_revision=1, point="here"),
    ask(
        "programs.record",
        "with its move",
        name="main",
        expected_revision=2,
        point="there",
        at=0,
        comment="x",
        move={"way": "PTP", "point": "there"},
    ),
    ask("programs.record", "a point that is there", name="main", expected_revision=3, point="a"),
    ask("programs.touch_up", name="main", expected_revision=3, point="b"),
    ask("programs.touch_up", "of no point", name="main", expected_revision=4, point="nowhere"),
    ask("programs.breakpoints", name="main", statements=[1, 3]),
    ask("programs.breakpoints", "where nothing is", name="main", statements=[99]),
    ask("programs.breakpoints", "of nothing", name="nothing", statements=[0]),
    ask("programs.breakpoints", "none", name="main", statements=[]),
    ask("programs.dry_run", name="aside"),
    ask("programs.dry_run", "of what is refused", name="far"),
    ask("programs.dry_run", "of nothing", name="nothing"),
    ask("programs.dry_run_progress"),
    ask("programs.rename", name="json", new_name="renamed", expected_revision=1),
    ask(
        "programs.rename",
        "to one that is there",
        name="renamed",
        new_name="main",
        expected_revision=1,
    ),
    ask("programs.rename", "to no name", name="renamed", new_name="a/b", expected_revision=1),
    ask("programs.delete", name="renamed", expected_revision=1),
    ask("programs.delete", "once more", name="renamed", expected_revision=1),
    ask("programs.delete", "from another revision", name="main", expected_revision=1),
    ask(
        "programs.edit",
        "out of range",
        name="aside",
        expected_revision=1,
        edit={"edit": "touch-up", "name": "b", "joints": [9.0] * 6},
    ),
    ask("programs.list", "at the end"),
]

RECORDINGS: list[Right | Happening] = [
    ask("recordings.list"),
    do(take=PROGRAMMER),
    ask("recordings.start", name="swing"),
    ask("recordings.start", "while one is under way", name="other"),
    ask("recordings.list", "while one is under way"),
    do(move=[0.125, 0.0, 0.0, 0.0, 0.0, 0.0]),
    ask("recordings.stop"),
    ask("recordings.stop", "once more"),
    ask("recordings.start", "of a name that is taken", name="swing"),
    ask("recordings.start", "of a name that is none", name="a/b"),
    ask("recordings.describe", name="swing"),
    ask("recordings.describe", "of nothing", name="nothing"),
    ask("recordings.trim", name="swing", new_name="part", ends=0.25),
    ask("recordings.trim", "to nothing", name="swing", new_name="none", begins=90.0),
    ask(
        "recordings.trim", "the wrong way round", name="swing", new_name="x", begins=0.5, ends=0.25
    ),
    ask("recordings.trim", "to a name that is taken", name="swing", new_name="part"),
    ask("recordings.rename", name="part", new_name="piece", expected_revision=2),
    ask(
        "recordings.rename",
        "from another revision",
        name="piece",
        new_name="x",
        expected_revision=9,
    ),
    ask("recordings.delete", name="piece", expected_revision=1),
    ask("recordings.delete", "once more", name="piece", expected_revision=1),
    ask("recordings.play", "of nothing", name="nothing"),
    ask("recordings.play", "beyond its end", name="swing", begins=60.0),
    ask("recordings.play", name="swing", factor=2.0, tolerance=0.01),
    ask("recordings.play", "while it is played", name="swing"),
    ask(
        "frames.add",
        "while the robot moves",
        name="t",
        pose={"position": [0, 0, 0]},
        expected_revision=0,
    ),
    ask("scene.attach", "while the robot moves", name="t", expected_revision=0),
]

AHEAD = {"position": [0.5, 0.0, 0.25]}
TURNED = {"position": [0.5, 0.25, 0.125], "orientation": [0.0, 0.0, 1.0, 0.0]}
FRAMES = [
    ask("frames.show"),
    ask("frames.add", name="table", pose=AHEAD, expected_revision=0),
    ask("frames.add", "once more", name="table", pose=AHEAD, expected_revision=1),
    ask("frames.add", "from an older revision", name="bench", pose=AHEAD, expected_revision=0),
    ask("frames.add", "below nothing", name="x", parent="nowhere", pose=AHEAD, expected_revision=1),
    ask("frames.add", "of a name that is none", name="", pose=AHEAD, expected_revision=1),
    ask("frames.add", "of a name that the robot has", name="base", pose=AHEAD, expected_revision=1),
    ask(
        "frames.add",
        "with no quaternion",
        name="x",
        expected_revision=1,
        pose={**AHEAD, "orientation": [0.0, 0.0, 0.0, 0.0]},
    ),
    ask("frames.add", "below it", name="part", parent="table", pose=TURNED, expected_revision=1),
    ask("frames.move", name="part", pose=AHEAD, expected_revision=2),
    ask(
        "frames.move", "below itself", name="table", parent="part", pose=AHEAD, expected_revision=3
    ),
    ask("frames.move", "of nothing", name="nothing", pose=AHEAD, expected_revision=3),
    ask("frames.rename", name="part", new_name="lid", expected_revision=3),
    ask("frames.rename", "to one that is there", name="lid", new_name="table", expected_revision=4),
    ask("frames.transform", source="lid", target="base", pose=TURNED),
    ask("frames.transform", "at a time", source="lid", target="base", seconds_ago=0.0625),
    ask("frames.transform", "before all", source="lid", target="base", seconds_ago=10.0),
    ask("frames.transform", "from nowhere", source="nowhere", target="base"),
    ask("frames.teach", points=[[0, 0, 0], [1, 0, 0], [0, 1, 0]]),
    ask("frames.teach", "of four", points=[[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0.25, 0.125]]),
    ask("frames.teach", "on a line", points=[[0, 0, 0], [1, 0, 0], [2, 0, 0]]),
    ask("frames.remove", "of which another hangs", name="table", expected_revision=4),
    ask("frames.remove", name="lid", expected_revision=4),
    ask("frames.remove", "once more", name="lid", expected_revision=5),
    ask("frames.show", "with one"),
    ask(
        "frames.import",
        expected_revision=5,
        content={
            "schema": "openpendant-frames/1",
            "frames": [{"name": "cell", "parent": "base", "xyz": [0, 0, 1], "quat": [0, 0, 0, 1]}],
            "tools": [],
            "selected_tool": None,
        },
    ),
    ask("frames.import", "of another file", content={"schema": "x"}, expected_revision=6),
    ask("frames.show", "at the end"),
]

# What a calibration finds has all its digits, and machines differ in the last: none is recorded.
AT_ONE_PLACE = [[0.0, -1.5, 1.5, -1.5, -1.5, 0.0]] * 4
TOOLS = [
    ask("tools.add", name="torch", tcp=AHEAD, expected_revision=0),
    ask("tools.add", "once more", name="torch", tcp=AHEAD, expected_revision=1),
    ask("tools.add", "of a name that the robot has", name="flange", tcp=AHEAD, expected_revision=1),
    ask("tools.move", name="torch", tcp=TURNED, expected_revision=1),
    ask("tools.move", "of nothing", name="nothing", tcp=TURNED, expected_revision=2),
    ask("tools.select", name="torch", expected_revision=2),
    ask("tools.select", "of nothing", name="nothing", expected_revision=3),
    ask("tools.remove", "that is selected", name="torch", expected_revision=3),
    ask("tools.select", "none", name=None, expected_revision=3),
    ask("tools.remove", name="torch", expected_revision=4),
    ask("tools.calibrate", positions=AT_ONE_PLACE),
    ask("tools.calibrate", "with too few joints", positions=[[0.0]] * 4),
    ask(
        "tools.import",
        expected_revision=5,
        content={
            "schema": "openpendant-frames/1",
            "frames": [],
            "tools": [{"name": "hook", "xyz": [0, 0, 0.25], "quat": [0, 0, 0, 1]}],
            "selected_tool": "hook",
        },
    ),
    ask("tools.import", "without its content", content={}, expected_revision=6),
]

BOX = {
    "name": "box",
    "shape": {"type": "box", "size": [0.125, 0.125, 0.125]},
    "position": [0, 2, 0],
}
SCENE = [
    ask("scene.show"),
    ask("scene.add", object=BOX, expected_revision=0),
    ask("scene.add", "once more", object=BOX, expected_revision=1),
    ask(
        "scene.add",
        "of no shape",
        object={**BOX, "name": "x", "shape": {"type": "blob"}},
        expected_revision=1,
    ),
    ask(
        "scene.add",
        "of no size",
        expected_revision=1,
        object={**BOX, "name": "x", "shape": {"type": "box", "size": [0, 1, 1]}},
    ),
    ask(
        "scene.add",
        "of a name that the robot has",
        object={**BOX, "name": "base_link"},
        expected_revision=1,
    ),
    ask(
        "scene.add",
        "a sphere",
        expected_revision=1,
        object={
            "name": "ball",
            "shape": {"type": "sphere", "radius": 0.25},
            "position": [0, -2, 0],
        },
    ),
    ask(
        "scene.add",
        "a cylinder",
        expected_revision=2,
        object={
            "name": "post",
            "shape": {"type": "cylinder", "radius": 0.0625, "length": 1.0},
            "position": [2, 0, 0.5],
            "quaternion": [0, 0, 0, 1],
        },
    ),
    ask("scene.move", name="box", pose={"position": [0, 1.5, 0]}, expected_revision=3),
    ask("scene.move", "of nothing", name="nothing", pose=AHEAD, expected_revision=4),
    ask("scene.allow", first="box", second="ball", expected_revision=4),
    ask("scene.allow", "of one body", first="box", second="box", expected_revision=5),
    ask("scene.allow", "of nothing", first="box", second="nothing", expected_revision=5),
    ask("scene.forbid", first="box", second="ball", expected_revision=5),
    ask("scene.attach", name="box", expected_revision=6),
    ask("scene.attach", "to no link", name="ball", link="nowhere", expected_revision=7),
    ask("scene.attach", "of nothing", name="nothing", expected_revision=7),
    ask("scene.detach", name="box", expected_revision=7),
    ask("scene.detach", "once more", name="box", expected_revision=8),
    ask("scene.attach", "once more", name="box", expected_revision=8),
    ask("scene.move", "that is carried", name="box", pose=AHEAD, expected_revision=9),
    ask("scene.remove", name="box", expected_revision=10),
    ask("scene.remove", "once more", name="box", expected_revision=11),
    ask("scene.show", "at the end"),
    ask("scene.import", "of another file", content={"schema": "x"}, expected_revision=11),
    ask(
        "scene.import",
        expected_revision=11,
        content={"schema": "openpendant-scene/1", "objects": [BOX], "allowed": []},
    ),
    ask("scene.nearest"),
]

DEVICES = [
    ask("signals.read"),
    ask("signals.set", output=2, value=True),
    ask("signals.set", "that is not there", output=999, value=True),
    ask("signals.set", "below 0", output=-1, value=True),
    ask("signals.read", "with one on"),
    ask("robots.list"),
    ask("robots.describe"),
    ask("robots.describe", "by name", name="ur5"),
    ask("robots.describe", "of nothing", name="nothing"),
    ask("robots.load", name="ur5"),
    ask("robots.load", "of another", name="abb_irb120"),
    ask("robots.load", "of nothing", name="nothing"),
    ask("trace.clear"),
    ask("trace.show"),
    ask("trace.show", "beyond its end", first=10_000),
]

ACCESS = [
    ask("access.whoami"),
    ask("access.whoami", "of who has not logged in", VISITOR),
    ask("access.whoami", "of a viewer", VIEWER),
    ask("access.whoami", "of an operator", OPERATOR),
    ask("access.whoami", "of an admin", ADMIN),
    ask("access.sessions", "", ADMIN),
    ask("users.list", "", ADMIN),
    ask("users.set_role", "", ADMIN, name="operator", role="viewer"),
    ask("users.set_role", "of nobody", ADMIN, name="nobody", role="viewer"),
    ask("users.set_role", "of no role", ADMIN, name="operator", role="king"),
    ask("users.set_role", "of the last admin", ADMIN, name="admin", role="viewer"),
    ask("users.disable", "", ADMIN, name="viewer"),
    ask("users.disable", "of the last admin", ADMIN, name="admin"),
    ask("users.enable", "", ADMIN, name="viewer"),
    ask("users.remove", "", ADMIN, name="viewer"),
    ask("users.remove", "once more", ADMIN, name="viewer"),
    ask("users.remove", "of the last admin", ADMIN, name="admin"),
    ask("users.list", "at the end", ADMIN),
    ask("access.sessions", "at the end", ADMIN),
    ask("access.logout"),
    ask("access.logout", "once more"),
    ask("access.whoami", "after the logout"),
    ask("snapshot", "after the logout"),
]

UNREADABLE: dict[str, Body] = {
    "nothing": "",
    "a blank": " ",
    "half an object": '{"op":"snapshot"',
    "something behind it": '{"op":"snapshot"} x',
    "null": "null",
    "a list": '["snapshot"]',
    "a number": "7",
    "a text": '"snapshot"',
    "no operation": "{}",
    "an operation that is null": '{"op":null}',
    "an operation that is a number": '{"op":7}',
    "an operation without a name": '{"op":""}',
    "an unknown operation": '{"op":"dance"}',
    "an unknown operation of a topic": '{"op":"frames.dance"}',
    "a topic alone": '{"op":"programs."}',
    "another capital": '{"op":"Snapshot"}',
    "a blank behind its name": '{"op":"snapshot "}',
    "a name of 60 kB": ['{"op":"', ["x", 60_000], '"}'],
    "an operation twice": '{"op":"cells","op":"snapshot","op":"cells"}',
    "blanks around it": ' \n\t{ "op" : "cells" } ',
    "a byte order mark": "\ufeff" + '{"op":"cells"}',
    "NaN": '{"op":"frames.transform","source":"base","target":"base","seconds_ago":NaN}',
    "infinity": '{"op":"frames.transform","source":"base","target":"base","seconds_ago":1e999}',
    "half of a sign": '{"op":"programs.load","name":"\\ud800"}',
    "a zero byte": '{"op":"programs.load","name":"a\\u0000b"}',
    "signs of many scripts": '{"op":"programs.load","name":"Grö\u00dfe 点 \U0001f916"}',
    "an integer of 400 digits": ['{"op":"programs.list","first":', ["9", 400], "}"],
    "an integer as a real": '{"op":"programs.list","first":1.0}',
    "half an integer": '{"op":"programs.list","first":1.5}',
    "an integer as a text": '{"op":"programs.list","first":"1"}',
    "an integer that is true": '{"op":"programs.list","first":true}',
    "no UTF-8": {"hex": b'{"op":"programs.load","name":"\xff\xfe"}'.hex()},
    "UTF-16": {"hex": '{"op":"cells"}'.encode("utf-16").hex()},
    "Latin-1": {"hex": '{"op":"programs.load","name":"Größe"}'.encode("latin-1").hex()},
    "lists 300 deep": [
        '{"op":"scene.import","expected_revision":0,"content":{"a":',
        ["[", 300],
        ["]", 300],
        "}}",
    ],
    "lists 20,000 deep": [
        '{"op":"scene.import","expected_revision":0,"content":{"a":',
        ["[", 20_000],
        ["]", 20_000],
        "}}",
    ],
    "objects 300 deep": [
        '{"op":"frames.import","expected_revision":0,"content":',
        ['{"":', 300],
        "1",
        ["}", 300],
        "}",
    ],
    "objects 12,000 deep": ['{"op":', ['{"":', 12_000], "1", ["}", 12_000], "}"],
    "lists 60,000 deep and no end": [["[", 60_000]],
    "a program of 60 kB": ['{"op":"programs.check","body":"', ["# long\\n", 7_500], '"}'],
    "60 kB of blanks": ['{"op":"cells"', [" ", 60_000], "}"],
    "5,000 keys too many": ['{"op":"cells",', ['"a":1,', 5_000], '"b":2}'],
    "a name of 64 kB": ['{"op":"programs.load","name":"', ["n", 64_000], '"}'],
    "5,000 statements": [
        '{"op":"programs.breakpoints","name":"x","statements":[',
        ["0,", 5_000],
        "0]}",
    ],
}

TOPICS: dict[str, Sequence[Right | Happening]] = {
    "cell": CELL,
    "programs": PROGRAMS,
    "recordings": RECORDINGS,
    "frames": FRAMES,
    "tools": TOOLS,
    "scene": SCENE,
    "devices": DEVICES,
    "access": ACCESS,
}


def steps() -> Iterator[tuple[str, Step]]:
    """Yield all steps with the name of the cell in which they are made."""
    varied: set[str] = set()
    for cell, topic in TOPICS.items():
        for step in topic:
            if isinstance(step, Happening):
                yield cell, step
                continue
            if step.op not in varied and not step.label:
                varied.add(step.op)
                for label, by, body in _wrong(step):
                    yield cell, Question(f"{step.op}: {label}", by, _text(body))
            label = step.label or "right"
            yield cell, Question(f"{step.op}: {label}", step.by, _text(step.with_fields()))
    for label, unreadable in UNREADABLE.items():
        yield "unreadable", Question(f"unreadable: {label}", ADMIN, unreadable)
    for label in ("nothing", "an unknown operation", "an operation that is a number"):
        yield "unreadable", Question(f"unreadable: {label}, by a viewer", VIEWER, UNREADABLE[label])


def _wrong(right: Right) -> Iterator[tuple[str, str, dict[str, Any]]]:
    schema = json.loads((SCHEMAS / f"{right.op}-request.json").read_text("utf-8"))
    below = _below(right.op)
    if below is not None:
        yield f"by who is {below}", below, right.with_fields()
    yield "a key too many", right.by, right.with_fields(colour="red")
    for key in schema.get("required", []):
        if key != "op":
            body = right.with_fields()
            del body[key]
            yield f"without {key}", right.by, body
    for key, about in schema["properties"].items():
        if key == "op":
            continue
        if key in right.fields:
            yield f"{key} of another type", right.by, right.with_fields(**{key: _other(about)})
        for value in _beyond(about):
            yield f"{key} of {value}", right.by, right.with_fields(**{key: value})


def _below(op: str) -> str | None:
    """Return the highest role that may not ask for an operation; None where there is none."""
    # Here, because it loads all of the server.
    from openpendant.tools.reference.operations import published_operations

    role = published_operations()[op].role
    return None if role is None else ROLES[ROLES.index(role.value) - 1]


def _other(about: Mapping[str, Any]) -> Any:
    """Return a value of none of the types that a field has."""
    types = {each.get("type", "object") for each in about.get("anyOf", [about])}
    if "string" in types or "integer" in types:
        return [] if "integer" not in types else "seven"
    return "seven" if types & {"number", "boolean"} else 7


def _beyond(about: Mapping[str, Any]) -> Iterator[Any]:
    """Yield values just beyond the bounds of a field."""
    for each in about.get("anyOf", [about]):
        step = 1 if each.get("type") == "integer" else 0.001
        if "minimum" in each:
            yield each["minimum"] - step
        if "maximum" in each:
            yield each["maximum"] + step
        if "maxItems" in each and each["maxItems"] <= 20:
            items: Mapping[str, Any] = each["items"]
            yield [[0.0] * items.get("minItems", 6)] * (each["maxItems"] + 1)


def _text(body: Mapping[str, Any]) -> str:
    return json.dumps(body, ensure_ascii=False, separators=(",", ":"))
