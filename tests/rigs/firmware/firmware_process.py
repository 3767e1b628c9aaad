"""A simulated board as a process beside a bridge, with the calls of `KeypadProcess`."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from rigs.processes.keypad_processes import KeypadProcess

from openpendant.tools.pendants.keypad.keys import LABELS

from .simulated_board import Firmware


class FirmwareProcess(KeypadProcess):
    """The compiled firmware, its line on a pseudo-terminal behind a name that stays."""

    def __init__(self, process: asyncio.subprocess.Process, link: Path) -> None:
        super().__init__(process)
        self._board = process
        self._link = link
        self._pressed: set[str] = set()
        self.port = str(link)

    async def order(self, *words: str) -> dict[str, Any]:
        """Give a command in the words of the emulated keypad; return its answer."""
        match words:
            case ("down", label):
                self._pressed.add(label)
                return await self._tell("down", str(LABELS.index(label)))
            case ("up", "all"):
                for label in sorted(self._pressed):
                    await self.order("up", label)
                return {}
            case ("up", label):
                self._pressed.discard(label)
                return await self._tell("up", str(LABELS.index(label)))
            case ("plug",):
                told = await self._tell("plug")
                self._link.symlink_to(told["pty"])
                return told
            case ("pull",):
                self._link.unlink()
        return await self._tell(*words)

    async def _tell(self, *words: str) -> dict[str, Any]:
        assert self._board.stdin is not None
        self._board.stdin.write(f"{' '.join(words)}\n".encode())
        answer = await self.answer()
        assert "error" not in answer, answer
        return answer


@asynccontextmanager
async def firmware_keypad(
    program: Path, firmware: Firmware, link: Path
) -> AsyncIterator[FirmwareProcess]:
    """Run a board whose time goes with the clock."""
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(
        program, firmware.elf, stdin=pipe, stdout=pipe, stderr=asyncio.subprocess.DEVNULL
    )
    board = FirmwareProcess(process, link)
    try:
        await board.answer()
        await board.order("plug")
        await board.order("live")
        yield board
    finally:
        if process.returncode is None:
            process.kill()
        await process.wait()
