"""`examples/minimum_controller.c`, compiled and running, and a client that speaks its frames."""

from __future__ import annotations

import asyncio
import contextlib
import json
import shutil
import signal
import subprocess
from collections.abc import AsyncIterator, Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import pytest
from rigs.clock.busy_machine import PATIENCE

from openpendant.simplemsg import (
    STANDARD,
    CommType,
    JointPosition,
    JointTrajPt,
    Message,
    ReplyCode,
    Status,
    codec_for,
    joint_array,
)

SOURCE = Path(__file__).parents[3] / "examples" / "minimum_controller.c"
WARNINGS = ("-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror")
SANITIZERS = ("-g", "-O1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all")
HOME = (0.0, -1.5707964, 1.5707964, -1.5707964, -1.5707964, 0.0)
ACCELERATION = 6.2832
"""What the program allows itself [rad/s²]."""

REPORT_PERIOD = 0.01
CODEC = codec_for(STANDARD)
STOP = JointTrajPt(sequence=-4, joints=joint_array(()), velocity=0.0, duration=0.0)


def compiled(folder: Path, *flags: str) -> Path:
    """Compile the program, or skip the test and say why that is not possible here."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler here")
    program = folder / "minimum_controller"
    command = [compiler, "-std=c99", "-O2", "-D_POSIX_C_SOURCE=200809L", *WARNINGS, *flags]
    done = subprocess.run(
        [*command, "-o", str(program), str(SOURCE), "-lm"],
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode and flags and "cannot find" in done.stderr:
        pytest.skip(f"the compiler has no runtime for {' '.join(flags)}")
    assert (done.returncode, done.stderr) == (0, "")
    return program


@dataclass
class Controller:
    """A running controller."""

    process: asyncio.subprocess.Process
    motion: int
    state: int

    @classmethod
    async def start(cls, program: Path, *ports: int, joints: Sequence[float] = HOME) -> Self:
        words = [str(port) for port in ports or (0, 0)] + [str(len(joints)), *map(str, joints)]
        process = await asyncio.create_subprocess_exec(
            program,
            *words,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        assert process.stdout is not None
        line = await asyncio.wait_for(process.stdout.readline(), PATIENCE)
        ready = json.loads(line)
        assert ready["event"] == "ready"
        return cls(process, ready["motion"], ready["state"])

    def press(self, button: signal.Signals) -> None:
        self.process.send_signal(button)

    async def end(self) -> None:
        """Switch it off; it must leave in order, and a sanitizer must have had nothing to say."""
        if self.process.returncode is None:
            self.press(signal.SIGTERM)
        _, errors = await asyncio.wait_for(self.process.communicate(), PATIENCE)
        assert (self.process.returncode, errors.decode()) in ((0, ""), (-signal.SIGKILL, ""))

    @contextlib.asynccontextmanager
    async def link(self) -> AsyncIterator[Wire]:
        async with _connected(self.motion) as wire:
            yield wire

    @contextlib.asynccontextmanager
    async def listener(self) -> AsyncIterator[Wire]:
        async with _connected(self.state) as wire:
            yield wire


@contextlib.asynccontextmanager
async def _connected(port: int) -> AsyncIterator[Wire]:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    try:
        yield Wire(reader, writer)
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()


@dataclass
class Wire:
    """One connection, frame by frame."""

    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter

    async def frame(self) -> bytes:
        async with asyncio.timeout(PATIENCE):
            prefix = await self.reader.readexactly(4)
            return prefix + await self.reader.readexactly(int.from_bytes(prefix, "little"))

    async def ask(self, request: Message | bytes) -> int:
        """Send a request and return its reply's code; the reply must be a bare header."""
        data = request if isinstance(request, bytes) else CODEC.encode(request)
        self.writer.write(data)
        return await self.code(int.from_bytes(data[4:8], "little"))

    async def code(self, msg_type: int = 11) -> int:
        """Wait for a bare reply of a type and return its code."""
        reply = await self.frame()
        assert len(reply) == 16
        assert int.from_bytes(reply[4:8], "little") == msg_type
        assert int.from_bytes(reply[8:12], "little") == CommType.REPLY
        return int.from_bytes(reply[12:16], "little")

    async def is_silent(self, seconds: float = 0.1) -> bool:
        try:
            await asyncio.wait_for(self.reader.read(1), seconds)
        except TimeoutError:
            return True
        return False

    async def is_closed(self) -> bool:
        """Read to the end; False where there is none."""
        with contextlib.suppress(ConnectionError):
            async with asyncio.timeout(PATIENCE):
                while await self.reader.read(65_536):
                    pass
        return True

    async def rounds(self, last: Callable[[Status], bool]) -> list[tuple[JointPosition, Status]]:
        """Collect rounds of the state port up to the first whose status meets a condition.

        Raises:
            TimeoutError: none met it; rounds come all the same, each of them in time.
        """
        seen: list[tuple[JointPosition, Status]] = []
        async with asyncio.timeout(PATIENCE):
            while not seen or not last(seen[-1][1]):
                joints, status = CODEC.decode(await self.frame()), CODEC.decode(await self.frame())
                assert isinstance(joints, JointPosition)
                assert isinstance(status, Status)
                seen.append((joints, status))
        return seen

    async def status(self) -> Status:
        return (await self.rounds(lambda status: True))[-1][1]

    async def until_rest(self) -> list[tuple[JointPosition, Status]]:
        return await self.rounds(lambda status: status.in_motion == 0)

    async def until_rest_after_motion(self) -> list[tuple[JointPosition, Status]]:
        """Collect the rounds of a motion; those of the rest before it may still be to be read."""
        began = await self.rounds(lambda status: status.in_motion == 1)
        return began[-1:] + await self.until_rest()


def point(
    sequence: int, joints: Sequence[float], duration: float, ratio: float = 0.1
) -> JointTrajPt:
    return JointTrajPt(
        sequence=sequence, joints=joint_array(joints), velocity=ratio, duration=duration
    )


def turned(joint: int, by: float) -> list[float]:
    """Return home with one joint moved."""
    joints = list(HOME)
    joints[joint] += by
    return joints


def sharpest(rounds: Sequence[tuple[JointPosition, Status]]) -> float:
    """Return the greatest acceleration between equally spaced reports [rad/s²]."""
    rows = [message.joints for message, _ in rounds]
    return max(
        abs(a - 2 * b + c) / REPORT_PERIOD**2
        for before, here, after in zip(rows, rows[1:], rows[2:], strict=False)
        for a, b, c in zip(before, here, after, strict=True)
    )


SUCCESS, FAILURE = int(ReplyCode.SUCCESS), int(ReplyCode.FAILURE)
