import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator

import pytest
from rigs.peers.full_pipe import fill, filled_pipe

from openpendant.server.background_writer import BackgroundWriter, LogStream

WAIT_S = 20.0

SERVER = """
import logging
from openpendant.server.background_writer import LogStream
from openpendant.server.access.process_log import LimitedHandler
logging.basicConfig(handlers=[LimitedHandler(LogStream(2))])
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
    stream = LogStream(pipe[1])
    for number in range(100):
        stream.write(f"line {number}\n")
    stream.close()
    assert read_until(pipe[0], "line 99\n").splitlines() == [f"line {n}" for n in range(100)]


def test_entries_that_find_no_room_are_counted_and_told_once_somebody_reads(
    pipe: tuple[int, int],
) -> None:
    fill(pipe[1])
    stream = LogStream(pipe[1], most_waiting=3)
    for number in range(10):
        stream.write(f"line {number}\n")
    text = read_until(pipe[0], "left out")
    stream.close()
    kept = text.count("line ")
    assert kept in (3, 4)  # the thread may hold one that it cannot write
    assert f"{10 - kept} log entries were left out" in text


def test_the_end_does_not_wait_for_a_reader_for_ever() -> None:
    # Ends stay open: the thread stands in its write.
    _, writing = os.pipe()
    fill(writing)
    stream = LogStream(writing, farewell=0.05)
    stream.write("nobody reads this\n")
    stream.close()


def test_what_is_lost_is_counted_until_a_reader_was_told() -> None:
    may_go_on = threading.Event()
    seen: list[tuple[list[int], int]] = []

    def run(writer: BackgroundWriter[int]) -> None:
        may_go_on.wait(WAIT_S)
        is_last = False
        while not is_last:
            taken, is_last = writer.take(most=2)
            lost = writer.lost(behind_all=True)
            seen.append((taken, lost))
            writer.told(lost)

    writer = BackgroundWriter("test", run, most_waiting=3, farewell=WAIT_S)
    for entry in range(5):
        writer.put(entry)
    may_go_on.set()
    assert writer.close()
    assert [entry for taken, _ in seen for entry in taken] == [0, 1, 2]
    assert [lost for taken, lost in seen if taken] == [0, 2]
    assert writer.lost() == 0


def test_the_end_says_that_a_thread_did_not_come_to_its_own() -> None:
    may_end = threading.Event()

    def run(_: BackgroundWriter[int]) -> None:
        may_end.wait(WAIT_S)

    writer = BackgroundWriter("test", run, most_waiting=1, farewell=0.02)
    assert not writer.close()
    may_end.set()


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
