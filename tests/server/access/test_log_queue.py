"""The process log on a stream that nobody reads: the server goes on, and tells what is missing."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
from full_pipe import fill, filled_pipe

from openpendant.server.access.log_queue import LogQueue

WAIT_S = 20.0

SERVER = """
import logging
from openpendant.server.access.log_queue import LogQueue
from openpendant.server.access.process_log import LimitedHandler
logging.basicConfig(handlers=[LimitedHandler(LogQueue(2))])
for number in range(50):
    logging.warning("line %d", number)
print("went on", flush=True)
"""


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    ends = os.pipe()
    yield ends
    for end in ends:
        os.close(end)


def read_until(descriptor: int, wanted: str) -> str:
    """Return what can be read until it holds the wanted text."""
    text, until = "", time.monotonic() + WAIT_S
    os.set_blocking(descriptor, False)
    while wanted not in text:
        assert time.monotonic() < until, f"{wanted!r} did not come"
        try:
            text += os.read(descriptor, 65_536).decode()
        except BlockingIOError:
            time.sleep(0.005)
    return text


def test_entries_come_in_their_order(pipe: tuple[int, int]) -> None:
    queue = LogQueue(pipe[1])
    for number in range(100):
        queue.write(f"line {number}\n")
    queue.close()
    assert read_until(pipe[0], "line 99\n").splitlines() == [f"line {n}" for n in range(100)]


def test_entries_that_find_no_room_are_counted_and_told_once_somebody_reads(
    pipe: tuple[int, int],
) -> None:
    fill(pipe[1])
    queue = LogQueue(pipe[1], most_waiting=3)
    for number in range(10):
        queue.write(f"line {number}\n")
    text = read_until(pipe[0], "left out")
    queue.close()
    kept = text.count("line ")
    assert kept in (3, 4)  # the thread may hold one that it cannot write
    assert f"{10 - kept} log entries were left out" in text


def test_the_end_does_not_wait_for_a_reader_for_ever() -> None:
    # Ends stay open: the thread stands in its write.
    _, writing = os.pipe()
    fill(writing)
    queue = LogQueue(writing, farewell=0.05)
    queue.write("nobody reads this\n")
    queue.close()


@pytest.mark.realtime
def test_a_server_whose_log_nobody_reads_goes_on_and_ends() -> None:
    with filled_pipe() as writing:
        ended = subprocess.run(
            [sys.executable, "-c", SERVER],
            stdout=subprocess.PIPE,
            stderr=writing,
            timeout=WAIT_S,
            check=True,
        )
    assert ended.stdout == b"went on\n"
