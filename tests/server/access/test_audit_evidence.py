from __future__ import annotations

import os
from pathlib import Path

import pytest

from openpendant.server.access.audit import (
    AuditEntry,
    AuditEvent,
    ChainCheck,
    Link,
    read_line,
    torn_detail,
    write_line,
)
from openpendant.server.access.audit_file import AuditFile, Stamped

TIME = "2026-01-02T03:04:05.678+00:00"


def entry(number: int) -> AuditEntry:
    return AuditEntry(AuditEvent.JOG_BEGAN, number, who="ann")


def test_a_recovery_excuses_no_other_torn_line_than_the_one_that_it_tells_of() -> None:
    first, link = write_line(entry(1), TIME, Link())
    told = AuditEntry(AuditEvent.LOG_RECOVERED, 2, detail=torn_detail(b'{"n":2,"time'))
    recovered, _ = write_line(told, TIME, link)
    check = ChainCheck()
    assert check.feed(first.rstrip()) is None
    assert check.feed(b'{"n":2,"who":"bob') is None
    assert check.feed(recovered.rstrip()) == "line 2 is torn or was altered"


def test_the_disk_is_told_to_keep_what_was_appended(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "audit.jsonl"
    kept: list[bytes] = []
    fsync = os.fsync

    def watched(descriptor: int) -> None:
        fsync(descriptor)
        if os.path.sameopenfile(descriptor, looking.fileno()):
            kept.append(path.read_bytes())

    log = AuditFile(path)
    log.append(Stamped(entry(1), TIME))
    with path.open("rb") as looking:
        monkeypatch.setattr(os, "fsync", watched)
        log.append(Stamped(entry(2), TIME))
        log.sync()
        monkeypatch.undo()
    log.close()
    (on_disk,) = kept
    records = [read_line(line) for line in on_disk.splitlines()]
    assert [record["at"] for record in records if record] == [1, 2]
