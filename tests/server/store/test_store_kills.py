"""Promise 22: what was acknowledged survives kill -9, and everything stays readable."""

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from promises.promise_table import figure
from rigs.cells.expectations import known
from rigs.clock.busy_machine import PATIENCE
from rigs.processes import store_child

from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.sqlite_store import check_store, open_store
from openpendant.server.store.store_errors import NotFound

KILLS_OF_ONE_FILE = 10
KILLS = figure(22, "kills").count


@dataclass
class Acknowledged:
    revision: int = 0
    chunks: int = 0

    def read(self, lines: bytes) -> None:
        # The last line may be cut short by the kill; it was not told then.
        for line in lines.splitlines(keepends=True):
            if line.endswith(b"\n"):
                kind, number = line.split()
                if kind == b"p":
                    self.revision = max(self.revision, int(number))
                else:
                    self.chunks = max(self.chunks, int(number) + 1)


def killed_early(path: Path, delay: float) -> bytes:
    command = [sys.executable, store_child.__file__, str(path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as child:
        time.sleep(delay)
        assert child.poll() is None
        child.kill()
        return known(child.stdout).read()


KilledLate = Callable[[Path, float], bytes]


@pytest.fixture
def killed_late(tmp_path: Path) -> Iterator[KilledLate]:
    fifo = tmp_path / "told"
    os.mkfifo(fifo)
    command = [sys.executable, store_child.__file__]
    with subprocess.Popen(command, stdin=subprocess.PIPE, text=True, bufsize=1) as forks:
        paths = known(forks.stdin)

        def killed(path: Path, delay: float) -> bytes:
            paths.write(f"{path} {fifo}\n")
            with fifo.open("rb") as output:
                word, pid = output.readline().split()
                assert word == b"i"
                told = output.readline()
                time.sleep(delay)
                os.kill(int(pid), signal.SIGKILL)
                return told + output.read()

        yield killed
        forks.communicate(timeout=PATIENCE)
    assert forks.returncode == 0


def check_everything(path: Path, acknowledged: Acknowledged) -> None:
    store = open_store(path)
    assert store.set_aside is None
    try:
        program = store.load(DocumentKind.PROGRAM, store_child.PROGRAM)
        assert program.heading.revision >= acknowledged.revision
        assert program.body == store_child.program_body(program.heading.revision)
        extent = store.extent(store_child.RECORDING)
        assert extent.chunks >= acknowledged.chunks
        chunks = store.load_chunks(store_child.RECORDING, 0, extent.chunks)
        assert all(data == store_child.chunk(number) for number, data in enumerate(chunks))
        assert len(chunks) == extent.chunks
    except NotFound:
        assert acknowledged == Acknowledged()
    finally:
        store.close()
    assert check_store(path).problems == ()


def kill(times: int, folder: Path, seed: int, killed_late: KilledLate) -> int:
    rng, total = random.Random(seed), 0
    for number in range(times):
        if number % KILLS_OF_ONE_FILE == 0:
            path = folder / f"{number}.db"
            acknowledged = Acknowledged()
        # One kill in five hits anywhere from the start of the interpreter to the first saves.
        if rng.random() < 0.2:
            told = killed_early(path, rng.uniform(0.05, 0.2))
        else:
            told = killed_late(path, rng.uniform(0.0, 0.02))
        acknowledged.read(told)
        if path.exists():
            check_everything(path, acknowledged)
        total += acknowledged.revision + acknowledged.chunks
    return total


def test_twenty_kills_lose_nothing_that_was_acknowledged(
    tmp_path: Path, killed_late: KilledLate
) -> None:
    assert kill(20, tmp_path, 22, killed_late) > 20


@pytest.mark.soak
def test_a_thousand_kills_lose_nothing_that_was_acknowledged(
    tmp_path: Path, killed_late: KilledLate
) -> None:
    assert kill(KILLS, tmp_path, int(time.time()), killed_late) > KILLS
