"""Rerun: a minute of a real cell in motion, recorded once, executed again from its journals."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path

from ..pendants.client import PendantClient
from .peers import EMULATOR, SERVER, process
from .table import Benchmark, Bound, Judged, Sides

RECORDED = 60.0
"""Length of the recording [s]."""

_STEP = 0.4


def benchmarks() -> list[Benchmark]:
    """Return the time of a rerun of both journals, interpreters and libraries included."""
    name = f"rerun of {RECORDED:.0f} s of server and emulator"
    return [Benchmark(name, "s", _sides, Bound(3.0, aim=2.0, judged=Judged.VALUE), 5)]


@contextmanager
def _sides() -> Iterator[Sides]:
    with tempfile.TemporaryDirectory(prefix="openpendant-bench-") as folder:
        files = [Path(folder) / "emulator.journal", Path(folder) / "server.journal"]
        _record(*files)
        yield Sides(partial(_rerun, files))


def _record(emulator_file: Path, server_file: Path) -> None:
    with ExitStack() as stack:
        emulator = stack.enter_context(process(*EMULATOR, "--journal", str(emulator_file)))
        server = stack.enter_context(
            process(
                *(*SERVER, "--controller", f"127.0.0.1:{emulator['motion']}:{emulator['state']}"),
                *("--journal", str(server_file)),
            )
        )
        asyncio.run(_move_about(server["pendant"]))


async def _move_about(port: int) -> None:
    """Swing the first joint, by joint moves and planned paths in turn, until the time is over."""
    end = time.monotonic() + RECORDED
    async with await PendantClient.connect("127.0.0.1", port, state_rate=50) as pendant:
        await pendant.wait_until(lambda state: state.motion_possible == 1)
        async with pendant.control():
            home = pendant.joints()
            aside = (home[0] + _STEP, *home[1:])
            path = [aside, (aside[0], home[1] + _STEP / 4, *home[2:]), home]
            while time.monotonic() < end:
                await (await pendant.move_joints(aside, speed=0.2)).done()
                await (await pendant.follow_joints(path, speed=0.2)).done()


def _rerun(files: list[Path]) -> float:
    command = [sys.executable, "-m", "openpendant.tools.packets.rerun", *map(str, files)]
    began = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - began
