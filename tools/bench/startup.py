"""Start-up: the time until the emulator's port is open, against importing numpy and pydantic."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

from .peers import EMULATOR, SERVER, process
from .table import Benchmark, Bound, Judged, Sides


def benchmarks() -> list[Benchmark]:
    """Return the start-up times and the emulator's memory."""
    return [
        Benchmark(
            "startup emulator to open port",
            "ms",
            partial(_sides, partial(_until_ready, *EMULATOR)),
            Bound(2.5, aim=1.5),
            9,
        ),
        Benchmark(
            "startup server to open port",
            "ms",
            partial(_sides, partial(_until_ready, *SERVER, "--controller", "127.0.0.1:1:1")),
            None,
            7,
        ),
        Benchmark(
            "startup emulator memory", "MB", _memory, Bound(70.0, aim=50.0, judged=Judged.VALUE), 3
        ),
    ]


def _until_ready(*command: str) -> float:
    began = time.perf_counter()
    with process(*command):
        return (time.perf_counter() - began) * 1e3


def _import_numpy_and_pydantic() -> float:
    began = time.perf_counter()
    subprocess.run([sys.executable, "-c", "import numpy, pydantic"], check=True)
    return (time.perf_counter() - began) * 1e3


@contextmanager
def _sides(subject: Callable[[], float]) -> Iterator[Sides]:
    yield Sides(subject, _import_numpy_and_pydantic)


@contextmanager
def _memory() -> Iterator[Sides]:
    def resident() -> float:
        with process(*EMULATOR) as ready:
            for line in Path(f"/proc/{ready['pid']}/status").read_text().splitlines():
                if line.startswith("VmRSS"):
                    return int(line.split()[1]) / 1024
        raise RuntimeError("this system does not tell a process's memory")

    yield Sides(resident)
