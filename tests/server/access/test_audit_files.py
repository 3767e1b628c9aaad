import contextlib
import errno
import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from openpendant.server.access import audit_file
from openpendant.server.access.audit import AuditEntry, AuditEvent, ChainCheck, read_line

TIME = "2026-01-02T03:04:05.678+00:00"


class SmallDisk:
    def __init__(self, room: int) -> None:
        self.room = room

    def open(self, path: Path) -> audit_file.RawFile:
        return _OnSmallDisk(self, audit_file.open_raw(path))


class _OnSmallDisk:
    def __init__(self, disk: SmallDisk, raw: audit_file.RawFile) -> None:
        self._disk = disk
        self._raw = raw

    def write(self, data: bytes, /) -> int:
        taken = data[: self._disk.room]
        if not taken:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        self._disk.room -= len(taken)
        return self._raw.write(taken) or 0

    def fileno(self) -> int:
        return self._raw.fileno()

    def close(self) -> None:
        self._raw.close()


def stamped(n: int) -> audit_file.Stamped:
    return audit_file.Stamped(AuditEntry(AuditEvent.JOG_BEGAN, n, who="ann"), TIME)


def checked(path: Path) -> ChainCheck:
    check = ChainCheck()
    assert [fault for line in audit_file.read_lines(path) if (fault := check.feed(line))] == []
    assert check.finish() is None
    return check


def events(path: Path) -> list[str]:
    records = [read_line(line) for line in audit_file.read_lines(path)]
    return [record["event"] for record in records if record is not None]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "audit.jsonl"


def write(path: Path, *numbers: int, most_bytes: int = 10**6) -> None:
    file = audit_file.AuditFile(path, most_bytes)
    for n in numbers:
        file.append(stamped(n))
    file.sync()
    file.close()


def test_a_chain_goes_on_after_a_restart(path: Path) -> None:
    write(path, 1, 2)
    write(path, 3)
    assert checked(path).last.number == 3


def test_a_large_file_is_put_aside_and_none_is_overwritten(path: Path) -> None:
    for n in range(4):
        write(path, *range(10 * n, 10 * n + 10), most_bytes=1_000)
    assert len(audit_file.all_files(path)) > 5
    assert checked(path).lines == 40


def test_the_chain_is_found_in_the_older_files_where_the_newest_is_gone(path: Path) -> None:
    write(path, *range(10), most_bytes=500)
    missing = path.read_bytes().count(b"\n")
    path.unlink()
    write(path, 11)
    assert checked(path).last.number == 10 - missing + 1


def test_the_log_is_readable_by_its_owner_only(path: Path) -> None:
    write(path, 1)
    assert path.stat().st_mode & 0o077 == 0


@pytest.mark.parametrize("torn", [b"{", b'{"n":3,"time":"2026', b"\0" * 300, b"x\ny\n", b"x\ny"])
def test_what_a_crash_left_is_closed_off_and_told_of(path: Path, torn: bytes) -> None:
    write(path, 1, 2)
    with path.open("ab") as file:
        file.write(torn)
    write(path, 3)
    assert checked(path).torn > 0
    assert events(path) == ["jog-began", "jog-began", "log-recovered", "jog-began"]


def test_a_crash_at_every_byte_of_a_line_leaves_an_intact_chain(path: Path) -> None:
    write(path, 1, 2)
    whole = path.read_bytes()
    first = whole.index(b"\n") + 1
    for cut in range(first + 1, len(whole), 7):
        path.write_bytes(whole[:cut])
        write(path, 3)
        assert checked(path).last.number in (3, 4)


def test_a_second_writer_is_refused(path: Path) -> None:
    first = audit_file.AuditFile(path)
    with pytest.raises(OSError, match="another process writes this audit log"):
        audit_file.AuditFile(path)
    first.close()
    audit_file.AuditFile(path).close()


@pytest.mark.parametrize("room", range(0, 900, 53))
def test_a_disk_that_fills_up_at_any_byte_leaves_an_intact_chain(path: Path, room: int) -> None:
    disk = SmallDisk(room)
    file = audit_file.AuditFile(path, opener=disk.open)
    written = 0
    for n in range(8):
        disk.room += 10_000 if n == 5 else 0
        with contextlib.suppress(OSError):
            file.append(stamped(n))
            written += 1
    file.close()
    checked(path)
    assert events(path).count("jog-began") == written >= 3


# The thread.


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.002)


def test_what_was_recorded_is_written_by_the_end(path: Path) -> None:
    log = audit_file.AuditLog(path)
    for n in range(50):
        log.record(AuditEntry(AuditEvent.JOG_BEGAN, n, who="ann"))
    log.close()
    assert checked(path).lines == 50


def test_a_flood_is_summed_up_at_the_end(path: Path) -> None:
    log = audit_file.AuditLog(path)
    for n in range(2_000):
        log.record(AuditEntry(AuditEvent.JOG_BEGAN, n, who="ann"))
    log.close()
    assert events(path) == ["jog-began"] * 99 + ["suppressed"]
    checked(path)


@pytest.mark.realtime
def test_a_full_disk_holds_nobody_up_and_the_gap_is_told_of(path: Path) -> None:
    """Promise of issue 5: motion is unaffected, nothing is lost silently."""
    disk = SmallDisk(700)
    log = audit_file.AuditLog(path, most_waiting=40, retry=0.005, opener=disk.open)
    for n in range(10):
        log.record(AuditEntry(AuditEvent.JOG_BEGAN, n, who="ann"))
    until(lambda: log.fault != "")
    assert log.fault == os.strerror(errno.ENOSPC)
    began = time.perf_counter()
    for n in range(10, 110):
        log.record(AuditEntry(AuditEvent.JOG_BEGAN, n, who="ann"))
    assert time.perf_counter() - began < 1.0
    disk.room = 10**6
    until(lambda: log.fault == "")
    log.close()
    checked(path)
    (gap,) = (
        record
        for line in audit_file.read_lines(path)
        if (record := read_line(line)) and record["event"] == "log-gap"
    )
    assert gap["detail"]["reason"] == os.strerror(errno.ENOSPC)
    assert gap["detail"]["lost"] + events(path).count("jog-began") == 110


@pytest.mark.parametrize("kind", ["folder", "pipe", "device"])
def test_what_is_no_regular_file_is_refused_at_the_start(path: Path, kind: str) -> None:
    match kind:
        case "folder":
            path.mkdir()
        case "pipe":
            os.mkfifo(path)
        case "device":
            path.symlink_to("/dev/full")
    with pytest.raises(OSError, match="is no regular file"):
        audit_file.AuditFile(path)


def test_a_folder_that_does_not_exist_is_refused_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        audit_file.AuditLog(tmp_path / "nowhere" / "audit.jsonl")
