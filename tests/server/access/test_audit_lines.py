"""Audit lines and the process log: bounded, and one entry never looks like two (promise 30)."""

import io
import json
import logging
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from promises.promise_table import figure

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
from openpendant.server.access.audit_file import AuditFile, Stamped
from openpendant.server.access.lockout import SECOND_NS
from openpendant.server.access.process_log import MOST_LINES, LimitedHandler, LineLimit, printable

TIME = "2026-01-02T03:04:05.678+00:00"


def lines(count: int = 5, last: Link | None = None) -> list[bytes]:
    link, written = last or Link(), []
    for n in range(count):
        line, link = write_line(AuditEntry(AuditEvent.JOG_BEGAN, n, who="ann"), TIME, link)
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


def test_an_untouched_chain_is_intact() -> None:
    assert faults(lines()) == []


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
    assert faults(change(lines())) != []


@given(st.integers(0, 4), st.integers(0, 10_000), st.integers(1, 255))
def test_every_changed_byte_is_noticed(row: int, place: int, flip: int) -> None:
    chain = lines()
    line = bytearray(chain[row])
    line[place % len(line)] ^= flip
    chain[row] = bytes(line)
    assert faults(chain) != []


def test_a_torn_line_that_the_next_accounts_for_is_no_fault() -> None:
    chain = lines()
    torn = b'{"n":6,"time'
    entry = AuditEntry(AuditEvent.LOG_RECOVERED, 0, detail=torn_detail(torn))
    record = read_line(chain[-1])
    assert record is not None
    recovered, _ = write_line(entry, TIME, Link(5, record["hash"]))
    assert faults([*chain, torn, recovered.removesuffix(b"\n")]) == []


def test_a_whole_line_that_was_altered_is_not_excused_by_a_recovery() -> None:
    chain = lines()
    altered = chain[-1].replace(b"ann", b"bob")
    record = read_line(chain[-2])
    assert record is not None
    entry = AuditEntry(AuditEvent.LOG_RECOVERED, 0, detail=torn_detail(altered))
    recovered, _ = write_line(entry, TIME, Link(4, record["hash"]))
    assert faults([*chain[:-1], altered, recovered.removesuffix(b"\n")]) != []


@given(st.text(), st.dictionaries(st.text(), st.text() | st.floats() | st.integers(), max_size=30))
def test_no_text_can_break_a_line_or_command_a_terminal(who: str, detail: dict[str, str]) -> None:
    """Promise 30: control characters are escaped, and no entry looks like two."""
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
    """Promise 30: flooding."""
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


def test_a_flood_of_failed_logins_does_not_hide_a_motion() -> None:
    limit = LineLimit()
    noise = [AuditEntry(AuditEvent.LOGIN_FAILED, n, source="192.0.2.1") for n in range(5_000)]
    motion = AuditEntry(AuditEvent.MOTION_BEGAN, 5_000, who="ann")
    written = flood(limit, [*noise, motion])
    assert motion in written
    assert written[-1].detail["event login-failed"] == 5_000 - 49


def test_a_quiet_log_has_no_summary() -> None:
    entries = [AuditEntry(AuditEvent.STOP, n * SECOND_NS) for n in range(100)]
    assert flood(LineLimit(), entries) == entries


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


def test_the_disk_keeps_what_was_appended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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
