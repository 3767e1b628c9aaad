"""The keypad: from a key on its line to a set-point at the controller, and back to the ramp.

Emulator, server and bridge are processes; the keypad is emulated here, on a pseudo-terminal. A tap
on the way to the controller sees each point. The time of a key begins when its frame is written to
the line, so what it is debounced for is not in it; that of letting go ends with the first point
that is slower than those before. Beside both stands how late an idle timer of this process was.
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
from dataclasses import dataclass
from functools import cache, partial
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

PRESSES = 100

MOST_TO_POINT, MOST_TO_RAMP = 60.0, 90.0
"""One period of the beats' reading, a tick, and the lead of a jog on top [ms]."""

_HELD, _BETWEEN = 0.3, 0.35
_LOOK = 0.001
"""Between two looks of the emulated keypad at its line [s]."""

_SLOWER = 0.95
"""A point whose way is so much shorter than those before belongs to the ramp."""

_PATIENCE = 20.0
_PLUS, _MINUS = 0, 4
_READY = "T1 JOINT      * en--"


def benchmarks() -> list[Benchmark]:
    """Return the times from a key to its point, and from letting go to the ramp."""
    to_point = Bound(MOST_TO_POINT, judged=Judged.VALUE)
    to_ramp = Bound(MOST_TO_RAMP, judged=Judged.VALUE)

    def row(name: str, of: _Figure, share: int, bound: Bound | None) -> Benchmark:
        return Benchmark(f"keypad {name}", "ms", partial(_bench, of, share), bound, 1)

    return [
        row("key to point", _to_point, 50, to_point),
        row("key to point p99", _to_point, 99, None),
        row("key-up to ramp", _to_ramp, 50, to_ramp),
        row("key-up to ramp p99", _to_ramp, 99, None),
    ]


@dataclass(frozen=True, slots=True)
class _Times:
    """What was measured of all presses, and beside them [ms].

    Attributes:
        idle: how late an idle timer of the measuring process was.
    """

    to_point: list[float]
    to_ramp: list[float]
    idle: list[float]


_Figure = Callable[[_Times], list[float]]


def _to_point(times: _Times) -> list[float]:
    return times.to_point


def _to_ramp(times: _Times) -> list[float]:
    return times.to_ramp


@contextmanager
def _bench(of: _Figure, share: int) -> Iterator[Sides]:
    """Yield a percentile of one figure of all presses, beside that of the idle timer."""
    times = _measured()
    yield Sides(lambda: _percentile(of(times), share), lambda: _percentile(times.idle, share))


def _percentile(values: list[float], share: int) -> float:
    return statistics.quantiles(values, n=100, method="inclusive")[share - 1]


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


@cache
def _measured() -> _Times:
    """Run a cell with a bridge, and press a key: once for all rows.

    Raises:
        MissingRequirement: pyserial-asyncio is not installed.
    """
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
        return loop.run_until_complete(stand.presses())


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
        self._idle: list[float] = []

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
            began = time.perf_counter()
            await asyncio.sleep(_LOOK)
            self._idle.append(1e3 * (time.perf_counter() - began - _LOOK))

    async def presses(self) -> _Times:
        """Return of each press the times to its first point and to its ramp."""
        self._idle.clear()
        found = [await self._press() for _ in range(PRESSES)]
        return _Times([each for each, _ in found], [each for _, each in found], self._idle)

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
