"""Lines of an emulated keypad: a pseudo-terminal that others open as a port, or a socket.

Owns that opening the port starts the keypad anew, as it resets the board, and that a pulled cable
is the end of the port. Linux has the pseudo-terminals that this needs.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import time
from pathlib import Path
from typing import Protocol

from .emulated_keypad import EmulatedKeypad

PERIOD = 0.004
"""Time between two looks at the line [s]."""

_OPENED = 2
"""Reset cause of a board whose port is opened: its reset line is pulled."""

_MOST = 65_536


class EmulatedLine(Protocol):
    """A line that bytes come from and go to."""

    @property
    def name(self) -> str:
        """What `--port` takes."""

    def read(self) -> bytes | None:
        """Return what came; None while nobody has the line open."""

    def write(self, data: bytes) -> None:
        """Send bytes, where somebody has the line open."""

    def pull(self) -> None:
        """Pull the cable."""

    def plug(self) -> None:
        """Plug the cable in again."""

    def close(self) -> None:
        """End the line for good."""


class PtyLine:
    """A pseudo-terminal; a link to it keeps its name over a pulled cable.

    Attributes:
        link: path of the link; None for none.
    """

    def __init__(self, link: Path | None = None) -> None:
        self.link = link
        self._ours: int | None = None
        self._name = ""
        self.plug()

    @property
    def name(self) -> str:
        """The link, or the device."""
        return str(self.link or self._name)

    def plug(self) -> None:
        """Make the device, as if its cable was plugged in."""
        import tty  # not on Windows

        if self._ours is not None:
            return
        self._ours, theirs = os.openpty()
        tty.setraw(theirs)
        self._name = os.ttyname(theirs)
        # Once it was open and closed, reading tells from then on whether somebody has it open.
        os.close(theirs)
        os.set_blocking(self._ours, False)
        if self.link is not None:
            self.link.unlink(missing_ok=True)
            self.link.symlink_to(self._name)

    def pull(self) -> None:
        """Take the device away: whoever has it open reads its end."""
        if self._ours is not None:
            os.close(self._ours)
            self._ours = None
            if self.link is not None:
                self.link.unlink(missing_ok=True)

    def close(self) -> None:
        """End the line for good."""
        self.pull()

    def read(self) -> bytes | None:
        """Return what came; None while nobody has the device open."""
        if self._ours is None:
            return None
        try:
            return os.read(self._ours, _MOST)
        except BlockingIOError:
            return b""
        except OSError:
            return None

    def write(self, data: bytes) -> None:
        """Send bytes; what the device does not take is lost, as on a line."""
        if self._ours is not None:
            with contextlib.suppress(OSError):
                os.write(self._ours, data)


class SocketLine(asyncio.Protocol):
    """A socket of this machine: one bridge at a time, the newest."""

    def __init__(self) -> None:
        self._server: asyncio.Server | None = None
        self._transport: asyncio.Transport | None = None
        self._came = bytearray()
        self._port = 0
        self._is_plugged = True

    async def listen(self, port: int) -> None:
        """Listen at a port, 0 for a free one.

        Raises:
            OSError: it is taken.
        """
        loop = asyncio.get_running_loop()
        self._server = await loop.create_server(lambda: self, "127.0.0.1", port)
        self._port = self._server.sockets[0].getsockname()[1]

    @property
    def name(self) -> str:
        """Where the bridge finds it."""
        return f"socket://127.0.0.1:{self._port}"

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take a bridge; one that was there before is sent away."""
        assert isinstance(transport, asyncio.Transport)
        if not self._is_plugged:
            transport.abort()
            return
        if self._transport is not None:
            self._transport.abort()
        self._transport = transport
        self._came.clear()

    def data_received(self, data: bytes) -> None:
        """Keep bytes of the bridge until they are read."""
        self._came += data[-_MOST:]

    def connection_lost(self, exc: Exception | None) -> None:
        """Take that a bridge has gone."""
        if self._transport is not None and self._transport.is_closing():
            self._transport = None

    def read(self) -> bytes | None:
        """Return what came; None while no bridge is there."""
        if self._transport is None:
            return None
        came, self._came = bytes(self._came), bytearray()
        return came

    def write(self, data: bytes) -> None:
        """Send bytes to the bridge."""
        if self._transport is not None:
            self._transport.write(data)

    def pull(self) -> None:
        """Close the connection, and take none until it is plugged in again."""
        self._is_plugged = False
        if self._transport is not None:
            self._transport.abort()
            self._transport = None

    def plug(self) -> None:
        """Take connections again."""
        self._is_plugged = True

    def close(self) -> None:
        """Listen no more."""
        self.pull()
        if self._server is not None:
            self._server.close()


class RunningKeypad:
    """An emulated keypad on a line, in real time.

    Attributes:
        is_open: a bridge has the line open.
        has_power: the board is switched on.
    """

    def __init__(self, keypad: EmulatedKeypad, line: EmulatedLine) -> None:
        self.keypad = keypad
        self.line = line
        self.is_open = False
        self.has_power = True
        keypad.start(time.monotonic_ns())

    async def run(self) -> None:
        """Go on until cancelled."""
        while True:
            self.look()
            await asyncio.sleep(PERIOD)

    def look(self) -> None:
        """Let its time pass up to now, and hand on what came and what it says."""
        now = time.monotonic_ns()
        came = self.line.read()
        was_open, self.is_open = self.is_open, came is not None
        if self.is_open and not was_open and self.has_power:
            self.keypad.start(now, _OPENED)
        if not self.has_power:
            return
        if came:
            self.keypad.receive(came)
        self.keypad.tick(now)
        said = self.keypad.output()
        if said and self.is_open:
            self.line.write(said)

    def reset(self) -> None:
        """Press the reset button of the board."""
        self.keypad.start(time.monotonic_ns(), _OPENED)

    def switch(self, *, on: bool) -> None:
        """Switch the board on or off; its line stays where it is."""
        if on and not self.has_power:
            self.keypad.start(time.monotonic_ns())
        self.has_power = on
