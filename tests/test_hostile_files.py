"""Files that mean harm: each is refused in one line, of the right kind, in little time and memory.

`test_endless_files.py` has those without end; this one those that are small, or legal in size, and
would take a parser long, or hold what no terminal should be shown.
"""

import io
import os
import sqlite3
import struct
import time
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from rigs.clock.busy_machine import SCALE

from openpendant.controller_emulator.shell import settings as emulator
from openpendant.controller_emulator.shell.scenario import load_scenario
from openpendant.motion.bounded_file import MOST_KEY_PARTS, toml_of
from openpendant.motion.description.robot import load_robot
from openpendant.motion.description.yaml_file import MAX_NODES, MAX_SCALAR
from openpendant.motion.errors import (
    FrameFileError,
    MeshFileError,
    RobotFileError,
    SceneFileError,
)
from openpendant.motion.frames.frame_file import load_frames
from openpendant.motion.robot_import.dh_file import MAX_ROWS, read_dh_file
from openpendant.motion.robot_import.urdf import read_urdf
from openpendant.motion.scene import mesh_file
from openpendant.motion.scene.mesh_file import read_mesh
from openpendant.motion.scene.scene_file import load_scene
from openpendant.server.access.audit import ChainCheck
from openpendant.server.access.audit_file import read_lines
from openpendant.server.exchange.csv_format import read_points
from openpendant.server.programs.language.program import MOST_POINTS
from openpendant.server.settings import config_file
from openpendant.server.settings.server_settings import make_server_settings
from openpendant.server.store.sqlite_store import open_for_reading, open_store
from openpendant.server.store.store_errors import BadDocument, ForeignFile
from openpendant.tools.packets.console import PacketToolError
from openpendant.tools.packets.faulty.fault_script import load_script
from openpendant.tools.packets.journals.reenactment import rerun
from openpendant.tools.packets.reading.trace_files import read_trace

Reader = Callable[[Path], object]

LONGEST_LINE = 1_000
"""Characters of a refusal, the file's name included."""

MOST_TIME = 5.0 * SCALE
"""Processor time of one file [s]; nearly all take hundredths of it, and each took far more."""

MOST_MEMORY = 200 << 20


def served(path: Path) -> object:
    return make_server_settings(config_file.load_settings(path), str(path))


def emulated(path: Path) -> object:
    return emulator.load_settings(path, {})


def traced(path: Path) -> object:
    return list(read_trace(path))


ROBOT, SCENE = b"schema: robot-facts/1\nkind: serial\n", b"schema: openpendant-scene/1\n"
FRAMES = b'{"schema":"openpendant-frames/1",'
DH = b"# convention: standard\n# angles: degrees\n# lengths: mm\njoint,theta\n"
JOURNAL = (
    b'{"format":"openpendant-journal/1","of":"emulator","version":"0","started":"x","now":1,'
    b'"settings":{}}\n'
)
TRACE = b'{"format":"openpendant-trace/1","started":"x"}\n'
SECTION = struct.pack("<IIIHHq", 0x0A0D0D0A, 28, 0x1A2B3C4D, 1, 0, -1) + struct.pack("<I", 28)


def event(words: str) -> bytes:
    return JOURNAL + b'{"t":1,"hex":"",' + words.encode() + b'}\n{"end":true}\n'


def solid(triangles: int) -> bytes:
    return b"\0" * 80 + struct.pack("<I", triangles) + b"\0" * 50


@dataclass(frozen=True)
class Case:
    """A file, what reads it, and what is said of it."""

    read: Reader
    name: str
    content: bytes
    refusal: type[Exception]
    words: str


def robot(content: bytes, words: str) -> Case:
    return Case(load_robot, "robot.yaml", content, RobotFileError, words)


def scene(content: bytes, words: str) -> Case:
    return Case(load_scene, "scene.yaml", SCENE + content, SceneFileError, words)


def frames(content: bytes, words: str) -> Case:
    return Case(load_frames, "frames.json", content, FrameFileError, words)


def mesh(ending: str, content: bytes, words: str) -> Case:
    return Case(read_mesh, f"mesh.{ending}", content, MeshFileError, words)


def dh(content: bytes, words: str) -> Case:
    return Case(read_dh_file, "table.csv", content, RobotFileError, words)


def urdf(content: bytes, words: str) -> Case:
    return Case(read_urdf, "robot.urdf", content, RobotFileError, words)


def cell(content: bytes, words: str) -> Case:
    return Case(served, "cell.toml", content, config_file.ConfigurationError, words)


def emulation(content: bytes, words: str) -> Case:
    settings = b"[emulator]\n" + content
    return Case(emulated, "cell.toml", settings, emulator.EmulatorSettingsError, words)


def packets(read: Reader, content: bytes, words: str) -> Case:
    return Case(read, "file", content, PacketToolError, words)


HEX = b"0x" + b"f" * 200_000
DEEP_KEY = b".".join([b"a"] * 200_000)

CASES = {
    "yaml: 100,000 keys": robot(
        ROBOT + b"".join(b"k%d: 1\n" % number for number in range(100_000)),
        f"holds more than {MAX_NODES} keys",
    ),
    "yaml: 500,000 values": robot(
        ROBOT + b"joints: [" + b"1," * 500_000 + b"]", f"holds more than {MAX_NODES} keys"
    ),
    "yaml: merged mappings": robot(
        ROBOT + b"<<: [" + b"{a: 1}," * 100_000 + b"]", f"holds more than {MAX_NODES} keys"
    ),
    "yaml: base 60": robot(
        ROBOT + b"dof: 1" + b":59" * 330_000, f"990001 characters; accepted: {MAX_SCALAR}"
    ),
    "yaml: a real in base 60": robot(ROBOT + b"dof: 1" + b":59" * 5_000 + b".5", "int too large"),
    "yaml: a hexadecimal bomb": robot(ROBOT + b"dof: 0x" + b"f" * 16_000, "name: is missing"),
    "yaml: a whole number without digits": robot(ROBOT + b'dof: !!int ""', "unreadable value"),
    "yaml: another truth": robot(ROBOT + b"dof: !!bool abc", "unreadable value: \"'abc'\""),
    "yaml: no time": robot(ROBOT + b"dof: !!timestamp abc", "unreadable value"),
    "yaml: a long key twice": robot(b'"' + b"k" * 900 + b'": 1\n"' + b"k" * 900 + b'": 1', "..."),
    "yaml: a program": robot(ROBOT + b'a: !!python/object/apply:os.system ["x"]', "constructor"),
    "yaml: laughs": robot(b"a: &a [1]\nb: [*a,*a]\n", "line 2: uses a YAML alias"),
    "yaml: NUL": robot(b"a: \0\n", "not valid YAML"),
    "yaml: a kind that is none": robot(
        b"schema: robot-facts/1\nkind: 0x" + b"f" * 9_000, "int too"
    ),
    "scene: 300,000 objects": scene(b"objects: [" + b"{}," * 300_000 + b"]", "holds more than"),
    "scene: a shape of a long name": scene(
        b"objects: [{name: a, shape: {type: " + b"x" * 16_000 + b"}}]", "...; accepted: box"
    ),
    "scene: greatest numbers": scene(
        b"objects: [{name: a, shape: {type: sphere, radius: 1.0e+308}}]", "accepted: 1e-06 to 1000"
    ),
    "frames: 250,000 entries": frames(
        FRAMES + b'"frames":[' + b"{}," * 250_000 + b"{}]}", "has 250001 entries; accepted: at most"
    ),
    "frames: a long key twice": frames(
        b'{"' + b"k" * 400_000 + b'":1,"' + b"k" * 400_000 + b'":1}', "kkk: is given twice"
    ),
    "frames: millions of digits": frames(b'{"schema":' + b"9" * 1_000_000 + b"}", "schema: is not"),
    "frames: nested": frames(b"[" * 900_000, "nests too deeply"),
    "frames: no number": frames(
        FRAMES + b'"frames":[{"name":"a","parent":"base","xyz":[NaN,0,0],"quat":[0,0,0,1]}]}',
        "frames[0].xyz[0]: is nan",
    ),
    "frames: a name for a terminal": frames(
        FRAMES
        + b'"frames":[{"name":"\\u001b[2J","parent":"base","xyz":[0,0,0],"quat":[0,0,0,1]}]}',
        "'\\x1b[2J'",
    ),
    "mesh: a count of 4e9": mesh("stl", solid(4_000_000_000), "byte 80: counts 4000000000"),
    "mesh: cut in the middle": mesh("stl", solid(1)[:100], "but the file has 100"),
    "mesh: one line": mesh("obj", b"v 0 0 0\nf" + b" 1" * 600_000, "line 2: is longer than"),
    "mesh: a corner of many digits": mesh(
        "obj", b"v 0 0 0\nf " + b"9" * 900_000 + b" 1 1", "line 2: a corner is not a whole number"
    ),
    "mesh: not UTF-8 far behind": mesh(
        "stl", b"solid\n" + b"x\n" * 1_500_000 + b"\xff", "byte 3000006: is not UTF-8"
    ),
    "dh: 100,000 rows": dh(
        DH + b"j,1\n" * 100_000, f"joints: has 100000 rows; accepted: at most {MAX_ROWS}"
    ),
    "dh: a long declaration twice": dh(
        b"# " + b"k" * 400_000 + b": 1\n# " + b"k" * 400_000 + b": 2\n", "is declared twice"
    ),
    "urdf: laughs": urdf(b'<!DOCTYPE r [<!ENTITY a "aa">]><robot>&a;</robot>', "document type"),
    "urdf: nested": urdf(b"<a>" * 100_000, "nests deeper than 64"),
    "urdf: a long tag": urdf(b"<" + b"a" * 900_000 + b"/>", "accepted: a URDF's <robot>"),
    "urdf: a long type": urdf(
        b'<robot><joint name="j" type="' + b"x" * 900_000 + b'"/></robot>', "joint 'j'.type"
    ),
    "toml: a key of 200,000 parts": cell(DEEP_KEY + b"=1", "more than 8 parts of a dotted key"),
    "toml: a table of 200,000 parts": cell(b"\n[" + DEEP_KEY + b"]", "(at line 2)"),
    "toml: quoted parts": cell(b'"\\""' + b' . "\\""' * 100_000 + b"=1", "more than 8 parts"),
    "toml: a hexadecimal bomb": cell(b"robot=" + HEX, "got int too large to be shown"),
    "toml: a long key": cell(b"k" * 900_000 + b"=1", "kkk: unknown key"),
    "toml: a long value": cell(b'tick_rate="' + b"x" * 900_000 + b'"', "got 'xxx"),
    "toml: 80,000 cells": cell(b"[[cells]]\n" * 80_000, "expected 1 to 64 tables"),
    "emulate: a hexadecimal bomb": emulation(b"buffer=" + HEX, "int too large to be shown"),
    "emulate: a long key": emulation(b"k" * 900_000 + b"=1", "expected one of"),
    "emulate: parts": emulation(DEEP_KEY + b"=1", "more than 8 parts"),
    "emulate: a long value": emulation(b'rate="' + b"\\u0007" * 100_000 + b'"', "\\x07\\x07"),
    "scenario: a hexadecimal bomb": Case(
        load_scenario, "s.toml", b"a=" + HEX, emulator.EmulatorSettingsError, "int too large"
    ),
    "faults: parts": packets(load_script, DEEP_KEY + b"=1", "more than 8 parts"),
    "journal: a time of 4,000 digits": packets(
        rerun, JOURNAL + b'{"t":' + b"9" * 4_000 + b',"on":"tick"}\n{"end":true}\n', "t is no time"
    ),
    "journal: a tick of 5,000 digits": packets(
        rerun, event(f'"on":"tick","link":"{"9" * 5_000}"'), "'tick' is not known here"
    ),
    "journal: a tick of another digit": packets(
        rerun, event('"on":"tick","link":"²"'), "'tick' is not known here"
    ),
    "journal: bytes on a link that is none": packets(
        rerun, event('"on":"in","link":"7"'), "link 7 was never opened"
    ),
    "journal: cut in the header": packets(rerun, JOURNAL[:40], "no journal of `serve --journal`"),
    "trace: greatest time": packets(
        traced, TRACE + b'{"t":1e308,"dir":"client->server","hex":"00"}', "line 2: "
    ),
    "trace: a port of 4,000 digits": packets(
        traced,
        TRACE + b'{"t":1,"dir":"client->server","hex":"00","port":' + b"9" * 4_000 + b"}",
        "port must be 0 to",
    ),
    "capture: a block of no length": packets(
        traced, SECTION + struct.pack("<III", 1, 0, 0), "offset 28: a block of type 1 with 0 bytes"
    ),
    "capture: a block of 2 GB": packets(
        traced, SECTION + struct.pack("<II", 99, 1 << 31), "the file ends inside a block"
    ),
}


@pytest.fixture
def bounded() -> Iterator[None]:
    """Fail where reading took long; what took much memory took long as well."""
    began = time.process_time()
    yield
    assert time.process_time() - began < MOST_TIME


@pytest.mark.usefixtures("bounded")
@pytest.mark.parametrize("which", CASES)
def test_a_hostile_file_is_refused_in_one_line(which: str, tmp_path: Path) -> None:
    case = CASES[which]
    file = tmp_path / case.name
    file.write_bytes(case.content)
    with pytest.raises(case.refusal) as refusal:
        case.read(file)
    told = str(refusal.value)
    assert case.words in told
    assert "\n" not in told
    assert len(told) < LONGEST_LINE + len(str(file))


@pytest.mark.parametrize("ending", ["obj", "stl"])
def test_a_mesh_of_too_many_parts_is_refused_where_it_becomes_too_many(
    ending: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mesh_file, "MAX_TRIANGLES", 100)
    file = tmp_path / f"mesh.{ending}"
    triangle = "f 1 1 1\n" if ending == "obj" else "vertex 0 0 0\n" * 3
    file.write_text("solid\nv 0 0 0\n" + triangle * 100)
    assert len(read_mesh(file).corners) == 100
    file.write_text("solid\nv 0 0 0\n" + triangle * 101 + "f nonsense\nvertex nonsense\n")
    with pytest.raises(MeshFileError, match="begins triangle 101; accepted: 1 to 100"):
        read_mesh(file)


def test_vertices_and_lines_of_a_mesh_are_bounded_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "mesh.obj"
    monkeypatch.setattr(mesh_file, "MAX_VERTICES", 3)
    file.write_text("v 0 0 0\n" * 4 + "v nonsense\n")
    with pytest.raises(MeshFileError, match="line 4: is vertex 4; accepted: 3"):
        read_mesh(file)
    monkeypatch.setattr(mesh_file, "MAX_LINES", 3)
    file.write_text("#\n" * 4)
    with pytest.raises(MeshFileError, match="line 4: is one more than the 3 lines"):
        read_mesh(file)


def test_a_text_mesh_takes_little_more_memory_than_its_numbers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "mesh.obj"
    file.write_bytes(b"v 0 0 0\n" * 1_000 + b"#\n" * 50_000 + b"f 1 2 3\n" * 1_000)
    monkeypatch.setattr(mesh_file, "MAX_BYTES", file.stat().st_size)  # is set aside for a moment
    tracemalloc.start()
    try:
        read_mesh(file)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    # As a list its lines alone would take fifty bytes each, twenty-five times the file.
    assert peak < 10 * file.stat().st_size


def test_legal_dotted_keys_are_read_and_dots_in_texts_are_none() -> None:
    key = ".".join(["a"] * MOST_KEY_PARTS)
    content = f'{key} = 1\nb = "192.0.2.1, 192.0.2.2, ..........."\n# 1.5, 2.5 ... etc.\n'
    read: Any = toml_of(content.encode())
    for _ in range(MOST_KEY_PARTS):
        read = read["a"]
    assert read == 1
    with pytest.raises(ValueError, match="dotted key"):
        toml_of(f"{key}.a = 1".encode())


SCHEMES = {
    "trigger": "CREATE TRIGGER gone AFTER INSERT ON revision BEGIN DELETE FROM revision; END",
    "view": "CREATE VIEW endless AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x FROM n)"
    " SELECT x FROM n",
}


@pytest.mark.parametrize("kind", SCHEMES)
@pytest.mark.parametrize("opened", [open_store, open_for_reading])
def test_a_store_with_code_in_it_is_refused_and_left_as_it_is(
    kind: str, opened: Callable[[Path], object], tmp_path: Path
) -> None:
    file = tmp_path / "store.db"
    open_store(file).close()
    with closing(sqlite3.connect(file)) as hostile:
        hostile.execute(SCHEMES[kind])
        hostile.commit()
    before = file.read_bytes()
    with pytest.raises(ForeignFile, match=rf"has the {kind} '(gone|endless)', which no store has"):
        opened(file)
    assert file.read_bytes() == before


@pytest.mark.parametrize("kind", ["pipe", "device", "folder"])
def test_an_audit_log_that_is_no_file_is_refused_without_waiting(kind: str, tmp_path: Path) -> None:
    file = tmp_path / "audit.jsonl"
    if kind == "pipe":
        os.mkfifo(file)
    elif kind == "device":
        file.symlink_to("/dev/zero")
    else:
        file.mkdir()
    with pytest.raises(OSError, match=r"not a regular file|Is a directory"):
        next(read_lines(file))


def test_what_is_damaged_in_an_audit_log_is_counted_and_not_kept() -> None:
    check = ChainCheck()
    line = b"\0" * 65_536
    tracemalloc.start()
    try:
        for _ in range(100):
            check.feed(bytes(line))
            check.feed(line + b"x")
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 10 * len(line)
    assert check.finish() == "line 1 is torn or was altered"


def test_a_table_of_points_ends_where_no_program_has_more() -> None:
    table = b"name\n" + b"p\n" * MOST_POINTS
    assert len(read_points(io.BytesIO(table), "points.csv")) == MOST_POINTS
    with pytest.raises(BadDocument, match=f"accepted: at most {MOST_POINTS} points"):
        read_points(io.BytesIO(table + b"p\n" * 3), "points.csv")
