"""A large file that is read: progress on a terminal, and the end by Ctrl-C or a closed pipe."""

import io
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from openpendant.tools.packets import show
from openpendant.tools.packets.reading import progress
from openpendant.tools.packets.reading.progress import WatchedInput, in_words, watched
from openpendant.tools.packets.trace import Packet, TraceDirection, entry_line, header_line

PATIENCE = 60.0

PIPE = 64 * 1024
"""So many bytes a pipe holds that nobody reads; of more than that some were read."""

AT_WORK = 8 * PIPE
"""Who was given so many bytes has written as well, unless nobody takes that."""

STUCK = 0.2
"""Who reads and has read nothing more for so long waits for somebody to take its output [s]."""

PING = bytes.fromhex("0c000000010000000200000000000000")


def lines(count: int) -> bytes:
    """Return entries of a trace."""
    ping = [Packet(1_000 * n, TraceDirection.TO_SERVER, PING, 11000) for n in range(count)]
    return "".join(f"{entry_line(each)}\n" for each in ping).encode()


@pytest.mark.parametrize(
    ("done", "total", "seconds", "said"),
    [
        (0, None, 1.0, "read 0 bytes"),
        (1_234_000, None, 1.0, "read 1.23 MB"),
        (250_000, 1_000_000, 2.0, "read 250 kB of 1 MB, 25%, 6 s left"),
        (0, 1_000, 2.0, "read 0 bytes of 1 kB, 0%, 0 s left"),
        (2_000, 1_000, 2.0, "read 2 kB"),
        (5 * 10**15, None, 2.0, "read 5e+03 TB"),
    ],
)
def test_progress_says_how_much_was_read_and_how_long_the_rest_takes(
    done: int, total: int | None, seconds: float, said: str
) -> None:
    assert in_words(done, total, seconds) == said


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class Clock:
    """A second a look."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        self.now += 1.0
        return self.now


def test_a_line_is_renewed_while_it_is_read_and_taken_away_before_anything_else(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    errors = Terminal()
    monkeypatch.setattr(sys, "stderr", errors)
    watch = WatchedInput(io.BytesIO(1_000 * b"x"), 1_000, Clock())
    assert io.BufferedReader(watch, 500).read(500) == 500 * b"x"
    assert errors.getvalue() == "\rread 500 bytes of 1 kB, 50%, 1 s left\x1b[K"
    watch.clear()
    watch.clear()
    assert errors.getvalue().endswith("left\x1b[K\r\x1b[K")


def test_nothing_is_said_where_nobody_sits(monkeypatch: pytest.MonkeyPatch) -> None:
    errors = io.StringIO()
    monkeypatch.setattr(sys, "stderr", errors)
    watch = WatchedInput(io.BytesIO(1_000 * b"x"), 1_000, Clock())
    assert io.BufferedReader(watch).read() == 1_000 * b"x"
    assert errors.getvalue() == ""


def test_progress_is_shown_twice_a_second_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    errors = Terminal()
    monkeypatch.setattr(sys, "stderr", errors)
    times = iter(n / 10 for n in range(100))
    watch = WatchedInput(io.BytesIO(5_000 * b"x"), 5_000, lambda: next(times))
    stream = io.BufferedReader(watch, 100)
    assert sum(len(stream.read(100)) for _ in range(50)) == 5_000
    assert 9 <= errors.getvalue().count("\r") <= 11


def test_what_is_watched_reads_as_it_was_and_is_still_open(tmp_path: Path) -> None:
    file = tmp_path / "trace"
    file.write_bytes(lines(1_000))
    with file.open("rb") as below:
        with watched(below) as (stream, _):
            assert stream.read() == lines(1_000)
            stream.close()
        assert not below.closed


def test_reading_ends_where_nobody_takes_the_output(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "trace.jsonl"
    file.write_bytes(f"{header_line('now')}\n".encode() + lines(20_000))
    monkeypatch.setattr(progress, "PERIOD", 0.0)
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as nobody, monkeypatch.context() as patched:
        patched.setattr(sys, "stdout", nobody)
        # No packet fits the filter, so nothing is ever written.
        assert show.main([str(file), "--type", "status"]) == 1


@contextmanager
def shown(*arguments: str, terminal: int | None = None) -> Iterator[subprocess.Popen[bytes]]:
    """Run `openpendant packets`, fed from a pipe."""
    process = subprocess.Popen(
        [sys.executable, "-m", "openpendant.tools", "packets", *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE if terminal is None else terminal,
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        for stream in (process.stdout, process.stderr):
            if stream is not None:
                stream.close()
        if process.stdin is not None:
            with suppress(BrokenPipeError):
                process.stdin.close()


class Feeder(threading.Thread):
    """Writes entries of a trace to a process until it is stopped, or nobody reads any more.

    Attributes:
        taken: how many bytes the pipe to the process took.
    """

    def __init__(self, process: subprocess.Popen[bytes]) -> None:
        super().__init__()
        assert process.stdin is not None
        self.taken = 0
        self.stopped = threading.Event()
        self._pipe = process.stdin

    def run(self) -> None:
        entries = lines(200)
        with suppress(BrokenPipeError):  # it has ended
            while not self.stopped.is_set():
                self._pipe.write(entries)
                self._pipe.flush()
                self.taken += len(entries)

    def wait_until_at_work(self) -> None:
        """Wait until the process has read much, or until it has begun and cannot go on."""
        until = time.monotonic() + PATIENCE
        seen, since = 0, until
        while seen < AT_WORK and (seen <= PIPE or time.monotonic() < since + STUCK):
            assert time.monotonic() < until
            time.sleep(0.005)
            if self.taken > seen:
                seen, since = self.taken, time.monotonic()


@pytest.mark.parametrize(
    "arguments",
    [
        ("show", "-"),
        ("show", "-", "--count"),
        ("show", "-", "--type", "status"),
        ("decode", "-"),
    ],
    ids=" ".join,
)
@pytest.mark.parametrize("is_read", [True, False])
def test_an_endless_trace_is_ended_by_ctrl_c_without_a_traceback(
    arguments: tuple[str, ...], is_read: bool
) -> None:
    """Also where its output pipe is full, because nobody reads."""
    with shown(*arguments) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        assert process.stderr is not None
        feeder = Feeder(process)
        feeder.start()
        taken: list[bytes] = []
        reader = threading.Thread(target=lambda: taken.append(process.stdout.read()))  # type: ignore[union-attr]  # a pipe
        if is_read:
            reader.start()
        feeder.wait_until_at_work()
        process.send_signal(signal.SIGINT)
        if not is_read:
            reader.start()
        try:
            assert process.wait(PATIENCE) == 130
            assert b"Traceback" not in process.stderr.read()
        finally:
            feeder.stopped.set()
            process.kill()
            feeder.join()
            reader.join()


def test_a_reader_that_goes_away_ends_it_without_a_traceback() -> None:
    with shown("show", "-") as process:
        feeder = Feeder(process)
        feeder.start()
        try:
            assert process.stdout is not None
            assert process.stderr is not None
            assert process.stdout.readline()
            process.stdout.close()
            assert process.wait(PATIENCE) == 1
            assert process.stderr.read() == b""
        finally:
            feeder.stopped.set()
            process.kill()
            feeder.join()


def test_on_a_terminal_progress_is_seen_and_leaves_nothing_behind() -> None:
    outer, inner = os.openpty()
    with shown("show", "-", "--count", terminal=inner) as process:
        os.close(inner)
        feeder = Feeder(process)
        feeder.start()
        try:
            seen = b""
            while b"read " not in seen:
                seen += os.read(outer, 1_000)
            assert b"\x1b[K" in seen
            feeder.stopped.set()
            feeder.join()
            assert process.stdin is not None
            process.stdin.close()
            assert process.stdout is not None
            assert b"ping" in process.stdout.read()
            assert process.wait(PATIENCE) == 0
            assert os.read(outer, 100_000).endswith(b"\r\x1b[K")
        finally:
            feeder.stopped.set()
            process.kill()
            feeder.join()
            os.close(outer)
