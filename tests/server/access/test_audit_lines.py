"""The audit log, its lines and its files, and the process log (promise 30)."""

import contextlib
import errno
import io
import json
import logging
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from promises.promise_table import figure
from rigs.cells.expectations import known

from openpendant.server.access.audit import (
    LONGEST_LINE,
    AuditEntry,
    AuditEvent,
    ChainCheck,
    Link,
    read_line,
    torn_detail,
    write_line,
)
from openpendant.server.access.audit_file import (
    AuditFile,
    AuditLog,
    RawFile,
    Stamped,
    all_files,
    open_raw,
    read_lines,
)
from openpendant.server.access.lockout import SECOND_NS
from openpendant.server.access.process_log import MOST_LINES, LimitedHandler, LineLimit, printable

TIME = "2026-01-02T03:04:05.678+00:00"


def jog(number: int) -> AuditEntry:
    return AuditEntry(AuditEvent.JOG_BEGAN, number, who="ann")


def lines(count: int = 5, last: Link | None = None) -> list[bytes]:
    link, written = last or Link(), []
    for n in range(count):
        line, link = write_line(jog(n), TIME, link)
        written.append(line.removesuffix(b"\n"))
    return written


def faults(chain: list[bytes]) -> list[str]:
    check = ChainCheck()
    found = [check.feed(line) for line in chain] + [check.finish()]
    return [fault for fault in found if fault is not None]


def test_a_line_says_who_did_what_when_and_follows_the_one_before() -> None:
    entry = AuditEntry(
        AuditEvent.MOTION_BEGAN, 7, "ann", "admin", "192.0.2.1", 3, "cell", {"motion": 12}
    )
    line, link = write_line(entry, TIME, Link(41, "ab" * 32))
    record = json.loads(line)
    assert record.pop("hash") == link.digest
    assert record == {
        "n": 42,
        "time": TIME,
        "at": 7,
        "event": "motion-began",
        "who": "ann",
        "role": "admin",
        "source": "192.0.2.1",
        "session": 3,
        "cell": "cell",
        "detail": {"motion": 12},
        "previous": "ab" * 32,
    }


@pytest.mark.parametrize(
    "change",
    [
        lambda chain: [*chain[:2], chain[2].replace(b"ann", b"bob"), *chain[3:]],
        lambda chain: [*chain[:2], *chain[3:]],
        lambda chain: [*chain[:2], chain[3], chain[2], *chain[4:]],
        lambda chain: [*chain[:2], chain[2], chain[2], *chain[3:]],
        lambda chain: chain[1:],
        lambda chain: [*chain[:-1], chain[-1][:-20]],
        lambda chain: [*chain[:2], b"", *chain[2:]],
        lambda chain: [*chain[:2], lines(3)[2].replace(b'"at":2', b'"at":9'), *chain[3:]],
        lambda chain: [*chain[:3], *lines(2, Link(3, "00" * 32))],
    ],
    ids=["edit", "gap", "swap", "twice", "head", "torn", "blank", "number", "other chain"],
)
def test_every_change_of_a_chain_is_noticed(change: Callable[[list[bytes]], list[bytes]]) -> None:
    assert faults(lines()) == []
    assert faults(change(lines())) != []


@given(st.integers(0, 4), st.integers(0, 10_000), st.integers(1, 255))
def test_every_changed_byte_is_noticed(row: int, place: int, flip: int) -> None:
    chain = lines()
    line = bytearray(chain[row])
    line[place % len(line)] ^= flip
    chain[row] = bytes(line)
    assert faults(chain) != []


def test_a_whole_line_that_was_altered_is_not_excused_by_a_recovery() -> None:
    chain = lines()
    altered = chain[-1].replace(b"ann", b"bob")
    entry = AuditEntry(AuditEvent.LOG_RECOVERED, 0, detail=torn_detail(altered))
    recovered, _ = write_line(entry, TIME, Link(4, known(read_line(chain[-2]))["hash"]))
    assert faults([*chain[:-1], altered, recovered.removesuffix(b"\n")]) != []


@given(st.text(), st.dictionaries(st.text(), st.text() | st.floats() | st.integers(), max_size=30))
def test_no_text_can_break_a_line_or_command_a_terminal(who: str, detail: dict[str, str]) -> None:
    line, _ = write_line(AuditEntry(AuditEvent.REFUSED, 0, who=who, detail=detail), TIME, Link())
    assert line.endswith(b"\n")
    assert all(0x20 <= byte < 0x7F for byte in line[:-1])
    assert len(line) <= LONGEST_LINE
    assert read_line(line[:-1]) is not None
    assert printable(who).isprintable()


@given(st.binary(max_size=200))
def test_what_is_no_line_is_no_record(line: bytes) -> None:
    assert read_line(line) is None


# How much of a flood is written.


def flood(limit: LineLimit, entries: list[AuditEntry]) -> list[AuditEntry]:
    written = []
    for entry in entries:
        summary = limit.summary(entry.at)
        written += [] if summary is None else [summary]
        written += [entry] if limit.take(entry) else []
    last = limit.summary(entries[-1].at + SECOND_NS)
    return [*written, *([] if last is None else [last])]


@pytest.mark.parametrize("rate", [150, 1_000, 10_000])
def test_at_most_100_lines_in_any_second_and_none_uncounted(rate: int) -> None:
    entries = [
        AuditEntry(AuditEvent.JOG_BEGAN, n * SECOND_NS // rate, who=f"name {n % 50}")
        for n in range(3 * rate)
    ]
    written = flood(LineLimit(), entries)
    times = [entry.at for entry in written]
    for first, beyond in zip(times, times[MOST_LINES:], strict=False):
        assert beyond - first >= SECOND_NS
    summaries = [entry for entry in written if entry.event is AuditEvent.SUPPRESSED]
    counted = sum(int(entry.detail["lines"]) for entry in summaries)
    assert counted + len(written) - len(summaries) == len(entries)


@pytest.mark.parametrize("event", [AuditEvent.LOGIN_FAILED, AuditEvent.DECLARED])
def test_a_flood_that_anybody_can_make_does_not_hide_a_motion(event: AuditEvent) -> None:
    limit = LineLimit()
    noise = [AuditEntry(event, n, source="192.0.2.1") for n in range(5_000)]
    motion = AuditEntry(AuditEvent.MOTION_BEGAN, 5_000, who="ann")
    written = flood(limit, [*noise, motion])
    assert motion in written
    assert written[-1].detail[f"event {event.value}"] == 5_000 - 49


def test_a_quiet_log_has_no_summary() -> None:
    entries = [AuditEntry(AuditEvent.STOP, n * SECOND_NS) for n in range(100)]
    assert flood(LineLimit(), entries) == entries


def test_a_recovery_excuses_no_other_torn_line_than_the_one_that_it_tells_of() -> None:
    first, link = write_line(jog(1), TIME, Link())
    told = AuditEntry(AuditEvent.LOG_RECOVERED, 2, detail=torn_detail(b'{"n":2,"time'))
    recovered, _ = write_line(told, TIME, link)
    check = ChainCheck()
    assert check.feed(first.rstrip()) is None
    assert check.feed(b'{"n":2,"who":"bob') is None
    assert check.feed(recovered.rstrip()) == "line 2 is torn or was altered"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "audit.jsonl"


def test_the_disk_keeps_what_was_appended(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept: list[bytes] = []
    fsync = os.fsync

    def watched(descriptor: int) -> None:
        fsync(descriptor)
        if os.path.sameopenfile(descriptor, looking.fileno()):
            kept.append(path.read_bytes())

    log = AuditFile(path)
    log.append(Stamped(jog(1), TIME))
    with path.open("rb") as looking:
        monkeypatch.setattr(os, "fsync", watched)
        log.append(Stamped(jog(2), TIME))
        log.sync()
        monkeypatch.undo()
    log.close()
    (on_disk,) = kept
    records = [read_line(line) for line in on_disk.splitlines()]
    assert [record["at"] for record in records if record] == [1, 2]


class Logged:
    def __init__(self) -> None:
        self.now = 0
        self.stream = io.StringIO()
        self.handler = LimitedHandler(self.stream, lambda: self.now)
        self.log = logging.Logger("tested", logging.INFO)
        self.log.addHandler(self.handler)

    @property
    def lines(self) -> list[str]:
        return self.stream.getvalue().splitlines()


@pytest.fixture
def logged() -> Iterator[Logged]:
    made = Logged()
    yield made
    made.handler.close()


@pytest.mark.parametrize("rate", [50, 150, 1_000, 10_000])
def test_promise_30_at_most_100_lines_in_any_second_and_none_uncounted(
    logged: Logged, rate: int
) -> None:
    at: list[int] = []
    for number in range(3 * rate):
        logged.now = number * SECOND_NS // rate
        written = logged.stream.tell()
        logged.log.info("line %d", number)
        at += [logged.now] * logged.stream.getvalue()[written:].count("\n")
    logged.handler.close()
    most = max(sum(begin <= each < begin + SECOND_NS for each in at) for begin in at)
    assert most <= figure(30, "lines").count
    left_out = [int(line.split(": ")[1].split()[0]) for line in logged.lines if "left out" in line]
    assert sum("line " in line for line in logged.lines) + sum(left_out) == 3 * rate


@pytest.mark.parametrize(
    "text", ["\n2026-01-01 ERROR forged", "\x1b[2J", "\r", "\u2028", "\x00", "\u202e", "\x9b31m"]
)
def test_promise_30_what_a_peer_says_breaks_no_line_and_commands_no_terminal(
    logged: Logged, text: str
) -> None:
    logged.log.info("a client called %s", text)
    assert len(logged.lines) == 1
    assert logged.stream.getvalue()[:-1].isprintable()


def test_the_lines_of_a_traceback_are_indented_and_counted(logged: Logged) -> None:
    for _ in range(100):
        try:
            raise ValueError("first\n2026-01-01 ERROR forged\x1b[2J")
        except ValueError:
            logged.log.exception("it failed")
    assert len(logged.lines) <= 100
    entries = [line for line in logged.lines if not line.startswith("    ")]
    assert all("it failed" in line for line in entries)
    assert logged.stream.getvalue().replace("\n", "").isprintable()


class SmallDisk:
    def __init__(self, room: int) -> None:
        self.room = room

    def open(self, path: Path) -> RawFile:
        return _OnSmallDisk(self, open_raw(path))


class _OnSmallDisk:
    def __init__(self, disk: SmallDisk, raw: RawFile) -> None:
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


def stamped(n: int) -> Stamped:
    return Stamped(jog(n), TIME)


def checked(path: Path) -> ChainCheck:
    check = ChainCheck()
    assert [fault for line in read_lines(path) if (fault := check.feed(line))] == []
    assert check.finish() is None
    return check


def records(path: Path) -> list[dict[str, Any]]:
    read = map(read_line, read_lines(path))
    return [record for record in read if record is not None]


def events(path: Path) -> list[str]:
    return [record["event"] for record in records(path)]


def write(path: Path, *numbers: int, most_bytes: int = 10**6) -> None:
    file = AuditFile(path, most_bytes)
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
    assert len(all_files(path)) > 5
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
    first = AuditFile(path)
    with pytest.raises(OSError, match="another process writes this audit log"):
        AuditFile(path)
    first.close()
    AuditFile(path).close()


@pytest.mark.parametrize("room", range(0, 900, 53))
def test_a_disk_that_fills_up_at_any_byte_leaves_an_intact_chain(path: Path, room: int) -> None:
    disk = SmallDisk(room)
    file = AuditFile(path, opener=disk.open)
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
    log = AuditLog(path)
    for n in range(50):
        log.record(jog(n))
    log.close()
    assert checked(path).lines == 50


def test_a_flood_is_summed_up_at_the_end(path: Path) -> None:
    log = AuditLog(path)
    for n in range(2_000):
        log.record(jog(n))
    log.close()
    assert events(path) == ["jog-began"] * 99 + ["suppressed"]
    checked(path)


@pytest.mark.realtime
def test_a_full_disk_holds_nobody_up_and_the_gap_is_told_of(path: Path) -> None:
    disk = SmallDisk(700)
    log = AuditLog(path, most_waiting=40, retry=0.005, opener=disk.open)
    for n in range(10):
        log.record(jog(n))
    until(lambda: log.fault != "")
    assert log.fault == os.strerror(errno.ENOSPC)
    began = time.perf_counter()
    for n in range(10, 110):
        log.record(jog(n))
    assert time.perf_counter() - began < 1.0
    disk.room = 10**6
    until(lambda: log.fault == "")
    log.close()
    checked(path)
    (gap,) = (record for record in records(path) if record["event"] == "log-gap")
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
        AuditFile(path)


def test_a_folder_that_does_not_exist_is_refused_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        AuditLog(tmp_path / "nowhere" / "audit.jsonl")
