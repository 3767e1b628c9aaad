"""The keypad pendant's firmware, compiled, on a simulated board that a test presses and reads.

`board.c` beside it says what the board takes. Its time is simulated and stands still but while a
test runs it, so a run is the same each time, on however busy a machine.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, Self, TypeVar

import pytest

from openpendant.simplemsg.serial_frames import (
    PROTOCOL,
    Ack,
    FrameReader,
    FrameWriter,
    FromKeypad,
    HostBeat,
    KeyDown,
    KeypadWelcome,
    KeyUp,
    LineWay,
    SerialFrame,
    ToKeypad,
)

HERE = Path(__file__).parent
SOURCES = HERE.parents[2] / "tools" / "pendants" / "keypad" / "firmware"
SOURCES_VARIABLE = "OPENPENDANT_FIRMWARE"
"""Names another folder of sources, with a fault planted in them."""

TOOLS = {"avr-gcc": "gcc-avr", "avr-nm": "binutils-avr", "make": "make", "cc": "gcc"}
"""Programs that are needed, with the package of each at Debian."""

STOP = 15
QUIET = 300.0
"""A time after which the board has started, said its hello, and lost bouncing contacts [ms]."""

_HEADER = Path("/usr/include/simavr/sim_avr.h")
_Frame = TypeVar("_Frame", bound=SerialFrame)


def missing_tool() -> str | None:
    """Return what the firmware tests lack on this machine, as a sentence; None for nothing."""
    for program, package in TOOLS.items():
        if shutil.which(program) is None:
            return f"no {program} here (Debian: {package}), the firmware is not tried"
    if not Path("/usr/lib/avr/include").is_dir() and shutil.which("avr-libc-config") is None:
        return "no avr-libc here, the firmware is not tried"
    if not _HEADER.is_file():
        return "no simavr here (Debian: libsimavr-dev), the firmware is not tried"
    return None


@dataclass(frozen=True)
class Firmware:
    """A compiled firmware.

    Attributes:
        said: what compiler and linker printed as warnings.
    """

    elf: Path
    said: str

    @classmethod
    def compiled(cls, folder: Path, **options: object) -> Self:
        """Compile it into a folder; `options` are variables of its Makefile."""
        sources = os.environ.get(SOURCES_VARIABLE, str(SOURCES))
        words = [f"{name}={value}" for name, value in {"BUILD": folder, **options}.items()]
        done = subprocess.run(
            ["make", "--no-print-directory", "-C", sources, *words],
            capture_output=True,
            text=True,
            check=False,
            env={name: value for name, value in os.environ.items() if "MAKE" not in name},
        )
        assert done.returncode == 0, done.stderr
        return cls(folder / "keypad.elf", done.stderr)

    @cached_property
    def symbols(self) -> dict[str, int]:
        """Address of each name in flash, or in memory."""
        listed = subprocess.run(["avr-nm", self.elf], capture_output=True, text=True, check=True)
        rows = [line.split() for line in listed.stdout.splitlines()]
        return {row[2]: int(row[0], 16) & 0x7FFFFF for row in rows if len(row) == 3}

    @cached_property
    def sizes(self) -> dict[str, int]:
        """Bytes of each section."""
        listed = subprocess.run(
            ["avr-size", "-A", self.elf], capture_output=True, text=True, check=True
        )
        rows = [line.split() for line in listed.stdout.splitlines()]
        return {row[0]: int(row[1]) for row in rows if len(row) == 3 and row[0].startswith(".")}

    def address(self, name: str) -> int:
        """Return the address of a variable in memory."""
        return self.symbols[name] & 0xFFFF


def compiled_board(folder: Path) -> Path:
    """Compile the simulated board."""
    program = folder / "board"
    sources = [str(source) for source in sorted(HERE.glob("*.c"))]
    flags = ["-std=gnu11", "-O2", "-Wall", "-Wextra", "-Werror", f"-I{_HEADER.parent}"]
    done = subprocess.run(
        ["cc", *flags, "-o", str(program), *sources, "-lsimavrparts", "-lsimavr"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    return program


@dataclass(frozen=True)
class Received:
    """A frame that the board sent.

    Attributes:
        at: when its last byte was whole [ms].
    """

    at: float
    sequence: int
    frame: SerialFrame


@dataclass
class Board:
    """A running board."""

    firmware: Firmware
    process: subprocess.Popen[str]
    raw: bytearray = field(default_factory=bytearray)
    times: list[float] = field(default_factory=list)
    log: list[Received] = field(default_factory=list)
    reader: FrameReader = field(default_factory=lambda: FrameReader(LineWay.TO_HOST))
    writer: FrameWriter = field(default_factory=FrameWriter)
    now: float = 0.0
    processor: float = 0.0

    @classmethod
    def started(cls, program: Path, firmware: Firmware, baud: int = 115_200) -> Self:
        process = subprocess.Popen(
            [program, firmware.elf, str(baud)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        board = cls(firmware, process)
        board._answer()
        return board

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *raised: object) -> None:
        self.process.kill()
        self.process.communicate()

    def order(self, *words: object) -> dict[str, Any]:
        """Give a command and return its answer."""
        assert self.process.stdin is not None
        self.process.stdin.write(" ".join(map(str, words)) + "\n")
        self.process.stdin.flush()
        return self._answer()

    def _answer(self) -> dict[str, Any]:
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line, f"the board ended with {self.process.wait()}"
        answer: dict[str, Any] = json.loads(line)
        assert "error" not in answer, answer["error"]
        if "t_us" in answer:
            self.now = answer["t_us"] / 1000
            self.processor = answer["processor_us"] / 1000
        return answer

    def run(self, time: float) -> list[Received]:
        """Let time go by [ms], and return the frames that came meanwhile."""
        self.order("run", time)
        return self.listen()

    def listen(self) -> list[Received]:
        """Return the frames that came since the last time."""
        answer = self.order("sent")
        data = bytes.fromhex(answer["bytes"])
        came: list[Received] = []
        for byte, at in zip(data, answer["at_us"], strict=True):
            for sequence, frame in self.reader.receive(bytes([byte])):
                came.append(Received(at / 1000, sequence, frame))
        self.raw += data
        self.times += [at / 1000 for at in answer["at_us"]]
        self.log += came
        return came

    def send(self, frame: ToKeypad) -> int:
        """Send a frame to the board and return its sequence."""
        sequence, data = self.writer.write(frame)
        self.send_bytes(data)
        return sequence

    def send_bytes(self, data: bytes) -> None:
        self.order("send", data.hex())

    def talk(self, time: float) -> list[Received]:
        """Let time go by [ms] with the beats of a bridge, and return what came."""
        came: list[Received] = []
        end = self.now + time
        while self.now < end - 1e-3:
            self.send(HostBeat(0))
            came += self.run(min(250.0, end - self.now))
        return came

    def welcome(self, *, beat: int = 50, debounce: int = 5) -> None:
        """Greet as a bridge does, and wait for the acknowledgement and the frame of empty keys."""
        sequence = self.send(KeypadWelcome(PROTOCOL, beat, debounce, 0))
        came = self.run(QUIET)
        assert Ack(sequence, 0) in [each.frame for each in came]

    def lcd(self) -> list[str]:
        """Return the rows of the display."""
        rows: list[str] = self.order("lcd")["lcd"]
        return rows

    def down(self, key: int, bounce: float = 0.0) -> None:
        """Press a key whose contact bounces for some time [ms]."""
        self.order("down", key, round(bounce * 1000))

    def up(self, key: int, bounce: float = 0.0) -> None:
        self.order("up", key, round(bounce * 1000))

    def poke(self, name: str, value: bytes) -> None:
        """Write a variable of the firmware."""
        self.order("poke", self.firmware.address(name), value.hex())


def frames_of(received: Sequence[Received], kind: type[_Frame]) -> list[_Frame]:
    """Return the frames of one kind."""
    return [each.frame for each in received if isinstance(each.frame, kind)]


def events_of(received: Sequence[Received]) -> list[FromKeypad]:
    """Return what keys did, without the beats."""
    return [each.frame for each in received if isinstance(each.frame, KeyDown | KeyUp)]


def skip_without_tools() -> None:
    """Skip a test aloud where a tool is missing."""
    if (missing := missing_tool()) is not None:
        pytest.skip(missing)
