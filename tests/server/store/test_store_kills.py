"""Promise 22: what was acknowledged survives kill -9, and everything stays readable."""

from __future__ import annotations

import random
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest
import store_child

from openpendant.server.store.documents import DocumentKind
from openpendant.server.store.errors import NotFound
from openpendant.server.store.file_check import check_store
from openpendant.server.store.sqlite_store import open_store

KILLS_OF_ONE_FILE = 10


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


def killed_run(path: Path, delay: float, *, wait_for_the_first: bool) -> bytes:
    child = subprocess.Popen(
        [sys.executable, store_child.__file__, str(path)], stdout=subprocess.PIPE
    )
    assert child.stdout is not None
    with child.stdout as output:
        told = output.readline() if wait_for_the_first else b""
        time.sleep(delay)
        assert child.poll() is None
        child.kill()
        told += output.read()
    child.wait()
    return told


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


def kill(times: int, folder: Path, seed: int) -> int:
    """Kill a recording process so many times; return how many acknowledgements there were."""
    rng = random.Random(seed)
    total = 0
    for number in range(times):
        if number % KILLS_OF_ONE_FILE == 0:
            path = folder / f"{number}.db"
            acknowledged = Acknowledged()
        # One kill in five hits anywhere from the start of the interpreter to the first saves.
        early = rng.random() < 0.2
        delay = rng.uniform(0.05, 0.2) if early else rng.uniform(0.0, 0.02)
        acknowledged.read(killed_run(path, delay, wait_for_the_first=not early))
        if path.exists():
            check_everything(path, acknowledged)
        total += acknowledged.revision + acknowledged.chunks
    return total


def test_sixty_kills_lose_nothing_that_was_acknowledged(tmp_path: Path) -> None:
    assert kill(60, tmp_path, seed=22) > 60


@pytest.mark.soak
def test_a_thousand_kills_lose_nothing_that_was_acknowledged(tmp_path: Path) -> None:
    assert kill(1_000, tmp_path, seed=int(time.time())) > 1_000
