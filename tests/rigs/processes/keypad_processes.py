"""Processes of the keypad: an emulated one whose keys a test presses, and its bridge."""

from __future__ import annotations

import asyncio
import contextlib
import json
import sys
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from rigs.clock.busy_machine import PATIENCE

_PYTHON = (sys.executable, "-m", "openpendant.tools")


class KeypadProcess:
    """An emulated keypad in a process of its own."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self._process = process
        self.port = ""

    async def answer(self) -> dict[str, Any]:
        """Return the next line of its output."""
        assert self._process.stdout is not None
        line = await asyncio.wait_for(self._process.stdout.readline(), PATIENCE)
        told: dict[str, Any] = json.loads(line)
        return told

    async def order(self, *words: str) -> dict[str, Any]:
        """Give a command; return its answer."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{' '.join(words)}\n".encode())
        answer = await self.answer()
        assert "error" not in answer, answer
        return answer

    async def down(self, *labels: str) -> None:
        """Press keys."""
        for label in labels:
            await self.order("down", label)

    async def up(self, *labels: str) -> None:
        """Let go of keys; of all where none is said."""
        for label in labels or ("all",):
            await self.order("up", label)

    async def strike(self, labels: str, held: float = 0.1) -> None:
        """Press and let go of keys, one after the other."""
        for label in labels:
            await self.down(label)
            await asyncio.sleep(held)
            await self.up(label)
            await asyncio.sleep(0.06)

    async def lcd(self) -> list[str]:
        """Return what the display shows."""
        rows: list[str] = (await self.order("lcd"))["lcd"]
        return rows

    async def shows(self, *rows: str) -> None:
        """Wait until the first rows are these, character by character."""
        await self.meets(lambda lcd: lcd[: len(rows)] == list(rows), "\n".join(rows))

    async def meets(self, holds: Callable[[list[str]], bool], wanted: str = "") -> list[str]:
        """Wait until something holds of the display; return it."""
        lcd: list[str] = []
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(PATIENCE):
                while not holds(lcd := await self.lcd()):  # noqa: ASYNC110 - it tells nobody
                    await asyncio.sleep(0.03)
                return lcd
        pytest.fail(f"the display shows\n{chr(10).join(lcd)}\nnot\n{wanted}")


class BridgeProcess:
    """A bridge in a process of its own, and what it says."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self.process = process
        self.said: list[str] = []
        self._grown = asyncio.Event()
        self._reading = asyncio.ensure_future(self._read())

    async def _read(self) -> None:
        assert self.process.stderr is not None
        while line := await self.process.stderr.readline():
            self.said.append(line.decode().rstrip())
            self._grown.set()

    async def says(self, text: str) -> str:
        """Wait until it has said something; return the line."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(PATIENCE):
                while not (lines := [each for each in self.said if text in each]):
                    await self._grown.wait()
                    self._grown.clear()
                return lines[0]
        pytest.fail(f"{text!r} was not said: {self.said}")

    async def end(self) -> None:
        """End it, and read what it says last."""
        if self.process.returncode is None:
            self.process.terminate()
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(self.process.wait(), PATIENCE)
        if self.process.returncode is None:
            self.process.kill()
            await self.process.wait()
        await self._reading


async def _started(
    *arguments: str, stdin: int | None = None, stdout: int | None = None, stderr: int | None = None
) -> asyncio.subprocess.Process:
    return await asyncio.create_subprocess_exec(
        *_PYTHON, *arguments, stdin=stdin, stdout=stdout, stderr=stderr
    )


@asynccontextmanager
async def emulated_keypad(*options: str, link: Path | None = None) -> AsyncIterator[KeypadProcess]:
    """Run an emulated keypad."""
    where = () if link is None else ("--link", str(link))
    pipe = asyncio.subprocess.PIPE
    process = await _started(
        "emulate-keypad", "--commands", *where, *options, stdin=pipe, stdout=pipe
    )
    keypad = KeypadProcess(process)
    try:
        keypad.port = (await keypad.answer())["port"]
        yield keypad
    finally:
        if process.returncode is None:
            process.kill()
        await process.wait()


@asynccontextmanager
async def bridge(
    port: str, server: int, options: Sequence[str] = ()
) -> AsyncIterator[BridgeProcess]:
    """Run a bridge."""
    process = await _started(
        *("keypad", "--port", port, "--server", f"127.0.0.1:{server}", *options),
        stderr=asyncio.subprocess.PIPE,
    )
    running = BridgeProcess(process)
    try:
        yield running
    finally:
        await running.end()
