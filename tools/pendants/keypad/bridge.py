"""Bridge of the keypad: its port on one side, a pendant server on the other.

Owns the loop that opens the port again after each loss, the ticks of the core, and one line for
each change of state. Decides nothing about keys or motion.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass

from openpendant.simplemsg.serial_frames import PROTOCOL

from ..panel.commands import Command
from .keypad import EnablingSource, Keypad
from .line import (
    HOLDING_BAUD,
    DisplaySilent,
    KeypadLinked,
    LineEvent,
    LineLoss,
    LineLost,
    LineState,
)
from .pages import page
from .serial_port import SOCKET, KeypadPortUnusable

TICK = 0.02
"""Time between two looks at the clock, and two pages [s]."""

BACK_OFF = (0.5, 1.0, 2.0, 4.0, 5.0)
"""Time before the port is opened again, from one attempt to the next [s]."""

STEADY_NS = 10_000_000_000
"""After so long of READY the next loss begins with the shortest time again [ns]."""

_BAD_NS = 10_000_000_000
"""Bad frames are told at most so often [ns]."""

_MOST_WAITING = 4_096
"""A port that takes no more bytes than that is sent none [bytes]."""

OpenPort = Callable[[Callable[[], asyncio.Protocol]], Awaitable[asyncio.Transport]]
"""Opens the port; raises `KeypadPortUnusable`."""


class _Port(asyncio.Protocol):
    """What comes from the port."""

    def __init__(self, received: Callable[[bytes], None]) -> None:
        self.closed = asyncio.Event()
        self._received = received

    def data_received(self, data: bytes) -> None:
        self._received(data)

    def connection_lost(self, exc: Exception | None) -> None:
        self.closed.set()


@dataclass(slots=True)
class LineWords:
    """The lines about one port: one for each change, never one for each attempt."""

    port: str
    baud: int
    tell: Callable[[str], None]
    _last: str = ""

    def say(self, text: str, about: str = "") -> None:
        """Say something unless the same was said last.

        Args:
            about: what two texts with other numbers have in common.
        """
        if (about or text) != self._last:
            self._last = about or text
            self.tell(text)

    def closed_early(self) -> None:
        """Say that the port was closed before a keypad said hello."""
        if self.port.startswith(SOCKET):
            why = "no page shows its keypad, or another bridge has it. Trying every 0.5 to 5 s"
            self.say(f"{self.port} was closed at once: {why}")
        else:
            self.say(f"{self.port} was closed before a keypad said hello")

    def lost(self, lost: LineLost) -> None:
        """Say why the line is given up."""
        self.say(self._why(lost), lost.why.value)

    def _why(self, lost: LineLost) -> str:
        match lost.why:
            case LineLoss.SILENT:
                parts = "power, cable, firmware (tools/pendants/keypad/firmware)?"
                return f"nothing speaks on {self.port} within 3 s; {parts}"
            case LineLoss.FOREIGN:
                what = f"{lost.received:,} bytes, {lost.frames} frames in 3 s"
                return (
                    f"something speaks on {self.port}, but not this protocol ({what});"
                    f" baud here: {self.baud}. Another speed, or other firmware?"
                )
            case LineLoss.WRONG_VERSION:
                spoken = f"protocol {lost.protocol}" if lost.protocol else "another protocol"
                flash = "flash the firmware of this release"
                return f"the firmware speaks {spoken}, this bridge {PROTOCOL}; {flash}"
        return f"nothing came from {self.port} for 0.4 s; what it held was released. Trying again"

    def linked(self, event: KeypadLinked) -> None:
        """Say that the keypad is there."""
        self.say(f"ready (firmware {event.hello.major}.{event.hello.minor})")
        if self.baud < HOLDING_BAUD:
            self.say(f"{self.baud} baud: increments only, no hold-to-run; 115200 allows it")


class KeypadBridge:
    """The shell of one keypad.

    Attributes:
        on_page: called with each page that is shown anew; None for nobody.
    """

    def __init__(
        self,
        keypad: Keypad,
        perform: Callable[[list[Command]], None],
        open_port: OpenPort,
        words: LineWords,
        *,
        verbose: bool = False,
        clock: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Make a bridge that is not started.

        Args:
            perform: carries out commands; drops them without a connection to the server.
            verbose: tell of frames that never came, too.
            clock: returns monotonic time [ns].
        """
        self.on_page: Callable[[tuple[str, ...]], None] | None = None
        self._keypad = keypad
        self._perform = perform
        self._open_port = open_port
        self._words = words
        self._verbose = verbose
        self._clock = clock
        self._transport: asyncio.Transport | None = None
        self._shown: tuple[str, ...] = ()
        self._asked_button = False
        self._bad = self._missing = 0
        self._bad_since = 0
        self._ready_since: int | None = None
        self._failures = 0

    async def run(self) -> None:
        """Serve the port until cancelled.

        Raises:
            KeypadPortMisnamed: it is no port.
        """
        ticking = asyncio.ensure_future(self._tick_for_ever())
        try:
            while True:
                await self._once()
                await asyncio.sleep(BACK_OFF[min(self._failures, len(BACK_OFF) - 1)])
                self._failures += 1
        finally:
            ticking.cancel()
            await asyncio.gather(ticking, return_exceptions=True)

    async def _once(self) -> None:
        port = _Port(self._received)
        try:
            self._transport = await self._open_port(lambda: port)
        except KeypadPortUnusable as error:
            if type(error) is not KeypadPortUnusable:
                raise
            self._words.say(str(error))
            return
        self._keypad.line_opened(self._clock())
        if self._keypad.sends_characters:
            self._words.say(f"open: plain characters at {self._words.baud} baud, increments only")
        self._bad = self._missing = 0
        try:
            await port.closed.wait()
            if self._keypad.line.is_linked or self._keypad.sends_characters:
                self._words.say("unplugged; what it held was released. Trying again")
            elif self._keypad.line.is_open:
                self._words.closed_early()
        finally:
            self._close()

    def _close(self) -> None:
        """Close the port, if it is open, and let go of what was held."""
        transport, self._transport = self._transport, None
        if self._keypad.line.is_open or self._keypad.sends_characters:
            self._perform(self._keypad.line_closed())
        _abort(transport)

    def _received(self, data: bytes) -> None:
        self._perform(self._keypad.receive(data, self._clock()))
        self._flush()

    async def _tick_for_ever(self) -> None:
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            self.tick()
            due = max(due + TICK, loop.time())
            await asyncio.sleep(due - loop.time())

    def tick(self) -> None:
        """Advance the core, and show its page."""
        now = self._clock()
        self._perform(self._keypad.tick(now))
        shown = page(self._keypad, now)
        if shown != self._shown:
            self._shown = shown
            self._keypad.line.show(shown)
            if self.on_page is not None:
                self.on_page(shown)
        self._flush()
        self._look_at_line(now)

    def _flush(self) -> None:
        """Write what is to leave, and tell what happened on the line."""
        out = self._keypad.line.output()
        transport = self._transport
        if transport is not None and out and transport.get_write_buffer_size() < _MOST_WAITING:
            transport.write(out)
        for event in self._keypad.line_news():
            self._tell(event)

    def _tell(self, event: LineEvent) -> None:
        match event:
            case LineLost():
                self._words.lost(event)
                _abort(self._transport)
            case KeypadLinked():
                line = self._keypad.line
                self._bad, self._missing, self._bad_since = line.bad, line.missing, self._clock()
                self._words.linked(event)
            case DisplaySilent():
                self._words.say("the display takes no pages (3 unanswered); its keys go on")

    def _look_at_line(self, now: int) -> None:
        """Count how long the line is ready, and tell of bad frames and of the button."""
        line = self._keypad.line
        if line.state is not LineState.READY:
            self._ready_since = None
        elif self._ready_since is None:
            self._ready_since = now
        elif now - self._ready_since >= STEADY_NS:
            self._failures = 0
        if line.is_linked and now - self._bad_since >= _BAD_NS:
            bad, missing = line.bad - self._bad, line.missing - self._missing
            self._bad, self._missing, self._bad_since = line.bad, line.missing, now
            if bad:
                self._words.say(f"{bad} bad frames in the last 10 s: cable, ground or baud")
            if missing and self._verbose:
                self._words.say(f"{missing} frames never came in the last 10 s")
        self._ask_for_button()

    def _ask_for_button(self) -> None:
        """Say once that the enabling button is needed where the controller may be a real one."""
        keypad = self._keypad
        is_wanted = keypad.enabling_source is EnablingSource.KEY and keypad.needs_button
        has_state = keypad.cell.is_connected and keypad.is_described
        if is_wanted and has_state and not self._asked_button:
            self._asked_button = True
            self._words.say(
                "the controller is not known to be emulated: hold the enabling button (D2) as well"
                ' as a key; enabling = "button" says so in the settings'
            )


def _abort(transport: asyncio.Transport | None) -> None:
    """Close a port at once; one of pyserial that is closed already cannot be closed again."""
    if transport is not None and not transport.is_closing():
        transport.abort()
