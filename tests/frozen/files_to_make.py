"""Makes the frozen files that are not written by hand, and reads what commands find in them.

By commands, because those are words that stay, wherever the code behind them is.
"""

import contextlib
import gzip
import io
import json
import shutil
import sqlite3
import tempfile
from pathlib import Path
from typing import Any, TypeAlias

from frozen.frozen_files import FILES, READINGS
from rigs.data.stored_documents import noon

from openpendant.motion.frames.frame_file import load_frames
from openpendant.motion.scene.scene_file import load_scene
from openpendant.server.access.accounts import Account, StoredAccounts
from openpendant.server.access.audit import AuditEntry, AuditEvent, Link, write_line
from openpendant.server.access.passwords import ScryptCost, Secret, hash_password
from openpendant.server.programs.language.parser import parse
from openpendant.server.programs.language.program_json import program_to_json
from openpendant.server.scene.document_texts import document_of
from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.recording_format import RecordingDocument, pack_rows
from openpendant.server.store.sqlite_store import SqliteStore, open_store
from openpendant.simplemsg import CommType, JointPosition, Ping, codec_for, joint_array
from openpendant.simplemsg.pendant.roles import Role
from openpendant.tools.cli import main
from openpendant.tools.packets.trace import (
    Entry,
    Event,
    Packet,
    TraceDirection,
    entry_line,
    header_line,
)

PASSWORD = "a long enough password"
ROWS = [(0.01 * n, 0.125 * n, -1.5, 1.5, -1.5, -1.5, 0.25, float(n == 5)) for n in range(12)]
_CHEAP = ScryptCost(n=2**14, r=8, p=1)


def make_files() -> None:
    text = (FILES / "pick.program").read_text("utf-8")
    (FILES / "pick.json").write_text(program_to_json(parse(text)) + "\n", "utf-8")
    with tempfile.TemporaryDirectory() as folder:
        (FILES / "store.db.gz").write_bytes(gzip.compress(_store(Path(folder)), 9, mtime=0))
    (FILES / "audit.jsonl").write_bytes(_audit_log())
    (FILES / "session.trace").write_text(_trace(), "ascii")


def _store(folder: Path) -> bytes:
    """Return the file of a store with documents of all kinds."""
    file = folder / "store.db"
    store = open_store(file, wall_clock=noon)
    _programs(store)
    kind, name = DocumentKind.RECORDING, "arc"
    columns = ("t", *(f"j{joint}" for joint in range(1, 7)), "gap")
    joints = tuple(f"joint {number}" for number in range(1, 7))
    about = RecordingDocument(columns=columns, robot="ur5", joints=joints, finished=False)
    whole = about.model_copy(
        update={"finished": True, "samples": 12, "duration": 0.11, "rate": 100.0, "gaps": 1}
    )
    store.save(kind, name, about.model_dump_json(), expected_revision=0, author="ann")
    store.append_chunk(name, 0, pack_rows(ROWS[:8]))
    store.append_chunk(name, 1, pack_rows(ROWS[8:]))
    store.save(kind, name, whole.model_dump_json(), expected_revision=1, author="ann")
    frames, scene = load_frames(FILES / "frames.json"), load_scene(FILES / "scene.json")
    for kind in (DocumentKind.FRAMES, DocumentKind.TOOLS, DocumentKind.SCENE):
        body = document_of(kind, frames, scene)
        store.save(kind, "cell", body, expected_revision=0, author="bob")
    accounts = StoredAccounts(store, "the start")
    for role, name in ((Role.ADMIN, "ada"), (Role.OPERATOR, "bob")):
        kept = hash_password(Secret(PASSWORD), name.encode().ljust(16, b"."), _CHEAP)
        accounts.add(Account(name=name, role=role, password=kept))
    accounts.set_disabled("bob", True)
    store.close()
    for statement in ("PRAGMA wal_checkpoint(TRUNCATE)", "VACUUM"):
        with sqlite3.connect(file) as connection:
            connection.execute(statement)
        connection.close()
    return file.read_bytes()


def _programs(store: SqliteStore) -> None:
    kind = DocumentKind.PROGRAM
    for name in ("pick", "place"):
        body = program_to_json(parse((FILES / f"{name}.program").read_text("utf-8")))
        store.save(kind, name, body, expected_revision=0, author="ann")
    changed = json.loads(store.load(kind, "pick").body)
    changed["statements"] = changed["statements"][:1]
    body = json.dumps(changed, ensure_ascii=False)
    store.save(kind, "pick", body, expected_revision=1, author="Größe")
    store.save(kind, "gone", body.replace("pick", "gone"), expected_revision=0, author="bob")
    store.delete(kind, "gone", expected_revision=1, author="ann")


def _audit_log() -> bytes:
    at, source = 1_000_000_000, "192.0.2.7"
    entries = [
        AuditEntry(AuditEvent.SERVER_STARTED, at, detail={"version": "0.1.0"}),
        AuditEntry(AuditEvent.CONNECTED, 2 * at, source=source, session=1, cell="cell"),
        AuditEntry(AuditEvent.LOGIN_FAILED, 3 * at, "", "", source, 1, "cell", {"known": True}),
        AuditEntry(AuditEvent.LOGIN, 4 * at, "ada", "admin", source, 1, "cell"),
        AuditEntry(AuditEvent.STOP, 5 * at, "ada", "admin", source, 1, "cell", {"reason": "ü\x7f"}),
        AuditEntry(AuditEvent.REFUSED, 6 * at, "ada", "admin", source, 1, "cell", {"code": 42}),
        AuditEntry(AuditEvent.LOG_GAP, 7 * at, detail={"lost": 3}),
        AuditEntry(AuditEvent.SERVER_STOPPED, 8 * at, detail={"version": "0.1.0"}),
    ]
    lines, last = b"", Link()
    for entry in entries:
        line, last = write_line(entry, noon(), last)
        lines += line
    return lines


def _trace() -> str:
    codec = codec_for()
    ping = codec.encode(Ping(comm_type=CommType.REQUEST))
    position = codec.encode(JointPosition(7, joint_array((0.5, -1.25))))
    entries: list[Entry] = [
        Event(0, "client-connected", 11_000, 1),
        Packet(1_500_000, TraceDirection.TO_SERVER, ping, 11_000, 1),
        Packet(2_500_000, TraceDirection.TO_CLIENT, position, 11_002, 2),
        Packet(3_000_000, TraceDirection.TO_CLIENT, b"\1\2", 11_000, 1, "part", is_frame=False),
        Event(4_000_000, "client-closed", 11_000, 1),
    ]
    return "".join(f"{line}\n" for line in [header_line(noon()), *map(entry_line, entries)])


Reading: TypeAlias = dict[str, Any]
"""A command, its exit code, what it prints, and the files that it writes."""


def copy_files(folder: Path) -> None:
    """Copy the frozen files, because reading a store makes files beside it."""
    for file in FILES.iterdir():
        if file.suffix == ".gz":
            (folder / file.stem).write_bytes(gzip.decompress(file.read_bytes()))
        elif file.name != "readings.json":
            shutil.copy(file, folder)


def readings() -> list[Reading]:
    """Read the files by the commands whose readings are kept; a new one is added there alone."""
    found = []
    for kept in json.loads(READINGS.read_text("utf-8")):
        command = kept["command"].split()
        before = set(Path().iterdir())
        output, errors = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            code = main(command)
        told = {"prints": output.getvalue(), "tells": errors.getvalue()}
        reading = {"command": kept["command"], "code": code, **told}
        if command[:2] == ["store", "export"]:
            (written,) = set(Path().iterdir()) - before
            reading["writes"] = {written.name: written.read_text("utf-8")}
        found.append(reading)
    return found


def as_text(found: list[Reading]) -> str:
    return json.dumps(found, indent=1, ensure_ascii=False) + "\n"
