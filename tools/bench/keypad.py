"""The keypad: from a key on its line to a set-point at the controller, and back to the ramp.

Emulator, server and bridge are processes; the keypad is emulated here, on a pseudo-terminal. A tap
on the way to the controller sees each point. The time of a key begins when its frame is written to
the line, so what it is debounced for is not in it; that of letting go ends with the first point
that is slower than those before.
"""

from __future__ import annotations

import asyncio
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import partial
from importlib.util import find_spec
from pathlib import Path

from openpendant.simplemsg import JointTrajPtFull, codec_for
from openpendant.simplemsg.framing import Mode, Splitter
from openpendant.simplemsg.serial_frames import FrameKind

from ..pendants.keypad.emulated_keypad import EmulatedKeypad
from ..pendants.keypad.emulator_line import PtyLine, RunningKeypad
from ..start import ARGUMENTS_OF_AN_EMULATED_CELL
from .peers import EMULATOR, SERVER, process
from .table import Benchmark, Bound, Judged, MissingRequirement, Sides

_SETTINGS = 'modes.initial = "manual_reduced"\njog.lead = 0.1\ncontroller.lead = 0.25\n'
"""A longer lead than usual, so that a machine that is busy for a moment ends no jog."""

PRESSES = 10
"""Of one sample."""

MOST_TO_POINT, MOST_TO_RAMP = 60.0, 90.0
"""One period of the beats' reading, a tick, and the lead of a jog on top [ms]."""

_HELD, _BETWEEN = 0.4, 0.5
_SLOWER = 0.95
"""A point whose way is so much shorter than those before belongs to the ramp."""

_PATIENCE = 20.0
_PLUS, _MINUS = 0, 4
_READY = "T1 JOINT      * en--"


def benchmarks() -> list[Benchmark]:
    """Return the time from a key to its point, and from letting go to the ramp."""
    to_point = Bound(MOST_TO_POINT, judged=Judged.VALUE)
    to_ramp = Bound(MOST_TO_RAMP, judged=Judged.VALUE)
    worst: Callable[[list[float]], float] = max
    return [
        Benchmark("keypad key to point", "ms", partial(_bench, 0, statistics.median), to_point, 3),
        Benchmark("keypad key to point, worst of 10", "ms", partial(_bench, 0, worst), None, 3),
        Benchmark("keypad key-up to ramp", "ms", partial(_bench, 1, statistics.median), to_ramp, 3),
        Benchmark("keypad key-up to ramp, worst of 10", "ms", partial(_bench, 1, worst), None, 3),
    ]


class _StampedLine(PtyLine):
    """A line that notes when the frame of a key was written to it [s]."""

    def __init__(self) -> None:
        super().__init__()
        self.written: dict[int, float] = {}

    def write(self, data: bytes) -> None:
        """Note the time of each kind of frame, and send it."""
        now = time.perf_counter()
        for piece in data.split(b"\0"):
            if len(piece) > 1:
                self.written[piece[1]] = now
        super().write(data)


class _Tap:
    """The way from the server to the controller, on which each point is noted.

    Attributes:
        points: when each came [s], with the way of joint 1 since the one before [rad].
    """

    def __init__(self, port: int) -> None:
        self.points: list[tuple[float, float]] = []
        self._port = port
        self._last = 0.0
        self._tasks: set[asyncio.Task[None]] = set()

    async def listen(self) -> int:
        server = await asyncio.start_server(self._serve, "127.0.0.1", 0)
        port: int = server.sockets[0].getsockname()[1]
        return port

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        back, on = await asyncio.open_connection("127.0.0.1", self._port)
        returning = asyncio.ensure_future(_passed(back, writer, lambda data: None))
        self._tasks.add(returning)
        splitter = Splitter(Mode.ONLOOKER)
        await _passed(reader, on, partial(self._note, splitter))
        returning.cancel()

    def _note(self, splitter: Splitter, data: bytes) -> None:
        now = time.perf_counter()
        for cut in splitter.feed(data):
            if cut.is_frame:
                message = codec_for().decode(cut.data)
                if isinstance(message, JointTrajPtFull):
                    way, self._last = message.positions[0] - self._last, message.positions[0]
                    self.points.append((now, abs(way)))


async def _passed(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, note: Callable[[bytes], None]
) -> None:
    with suppress(asyncio.CancelledError, ConnectionError):
        while data := await reader.read(65_536):
            writer.write(data)
            note(data)
    writer.close()


@contextmanager
def _bench(figure: int, of: Callable[[list[float]], float]) -> Iterator[Sides]:
    """Run a cell with a bridge; yields one figure of some presses of a key."""
    if find_spec("serial_asyncio") is None:
        raise MissingRequirement("pyserial-asyncio is not installed (extra serial)")
    loop = asyncio.new_event_loop()
    with ExitStack() as stack:
        stack.callback(_close, loop)
        emulator = stack.enter_context(process(*EMULATOR))
        tap = _Tap(emulator["motion"])
        motion = loop.run_until_complete(tap.listen())
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        config = Path(folder) / "cell.toml"
        config.write_text(_SETTINGS, "utf-8")
        server = stack.enter_context(
            process(
                *SERVER,
                *("--config", str(config), "--store", "off", *ARGUMENTS_OF_AN_EMULATED_CELL),
                *("--controller", f"127.0.0.1:{motion}:{emulator['state']}"),
            )
        )
        line = _StampedLine()
        stack.callback(line.close)
        keypad = EmulatedKeypad()
        stack.enter_context(_bridge(line.name, server["pendant"]))
        stand = _Stand(RunningKeypad(keypad, line), line, tap)
        loop.run_until_complete(stand.take_control())

        def subject() -> float:
            return of([each[figure] for each in loop.run_until_complete(stand.presses())])

        yield Sides(subject)


def _close(loop: asyncio.AbstractEventLoop) -> None:
    """End what still runs on a loop, and the loop."""
    tasks = asyncio.all_tasks(loop)
    for task in tasks:
        task.cancel()
    loop.run_until_complete(asyncio.gather(*tasks, return_exceptions=True))
    loop.close()


@contextmanager
def _bridge(port: str, server: int) -> Iterator[None]:
    command = ("-m", "openpendant.tools", "keypad", "--port", port)
    child = subprocess.Popen(
        [sys.executable, *command, "--server", f"127.0.0.1:{server}"], stderr=subprocess.DEVNULL
    )
    try:
        yield
    finally:
        child.terminate()
        child.wait(_PATIENCE)


class _Stand:
    """A keypad whose first key is pressed to and fro."""

    def __init__(self, running: RunningKeypad, line: _StampedLine, tap: _Tap) -> None:
        self._running = running
        self._line = line
        self._tap = tap
        self._count = 0

    async def take_control(self) -> None:
        """Press a key until the display says that we are in control."""
        await self._shows("T1 JOINT      o en--")
        self._running.keypad.press(_PLUS)
        await self._shows("CONTROL: YOURS      ")
        self._running.keypad.let_go(_PLUS)
        await self._shows(_READY)

    async def _shows(self, row: str) -> None:
        async with asyncio.timeout(_PATIENCE):
            while self._running.keypad.lcd[0] != row:
                await self._live(0.02)

    async def _live(self, seconds: float) -> None:
        """Let the keypad's time pass."""
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            self._running.look()
            await asyncio.sleep(0.001)

    async def presses(self) -> list[tuple[float, float]]:
        """Return of each press the times to its first point and to its ramp [ms]."""
        return [await self._press() for _ in range(PRESSES)]

    async def _press(self) -> tuple[float, float]:
        self._count += 1
        key = _PLUS if self._count % 2 else _MINUS
        keypad, points = self._running.keypad, self._tap.points
        points.clear()
        keypad.press(key)
        await self._live(_HELD)
        # The way to the first point is that from the last press, and tells no speed.
        fastest, count = statistics.median(way for _, way in points[1:]), len(points)
        first = points[0][0] - self._line.written[FrameKind.KEY_DOWN]
        keypad.let_go(key)
        await self._live(_BETWEEN)
        slower = next((at for at, way in points[count - 1 :] if way < _SLOWER * fastest), None)
        if slower is None:
            raise RuntimeError("the robot did not slow down where the key came up")
        return 1e3 * first, 1e3 * (slower - self._line.written[FrameKind.KEY_UP])
