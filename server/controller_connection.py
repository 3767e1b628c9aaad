"""The shell round one TCP connection to the robot controller: connects, reconnects, passes on.

Owns the attempts to connect. What a lost connection means for a motion is the core's decision.
"""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING, cast

from openpendant.simplemsg import (
    PENDANT,
    STANDARD,
    CommType,
    Connection,
    LocalProtocolError,
    Message,
    Received,
    Role,
    Unasked,
)

from .client_connection import prepare_socket
from .controller_path import ControllerPath
from .settings import ControllerLink

if TYPE_CHECKING:
    from .cell_shell import CellShell

log = logging.getLogger("openpendant.server")

_REPLY = CommType.REPLY
_CONNECT_TIMEOUT = 2.0
_FAREWELL = 0.25
UNANSWERED = 2_500
"""Longest silence of the controller's network stack [ms]: one lost probe ends no idle link.

Motion and stop link are idle between motions; in a motion, replies and feedback have far shorter
deadlines of their own.
"""


class ControllerConnection(asyncio.Protocol):
    """One path to the controller, kept up for as long as the server runs.

    Attributes:
        path: which of the paths.
        link: its name in the log and in the journal.
    """

    def __init__(self, cell: CellShell, path: ControllerPath, link: ControllerLink) -> None:
        """Make a path that is not connected yet."""
        self.path = path
        self.link = cell.label + path.name.lower()
        self._cell = cell
        self._link = link
        self._port = link.state_port if path is ControllerPath.STATE else link.motion_port
        self._transport: asyncio.Transport | None = None
        self._wire: Connection | None = None
        self._lost = asyncio.Event()
        self._complained = False
        self._ending = False
        self._is_closing = False

    @property
    def is_up(self) -> bool:
        """Whether the path is connected."""
        transport = self._transport
        if transport is None or self._is_closing:
            return False
        # The loop closes a transport by itself when the kernel reports an error.
        is_gone, journal = transport.is_closing(), self._cell.journal
        if journal.is_kept:
            is_gone = journal.answer("gone", self.link, is_gone)
        return not is_gone

    async def keep_up(self) -> None:
        """Connect, wait for the end, connect again; runs until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            self._lost.clear()
            try:
                async with asyncio.timeout(_CONNECT_TIMEOUT):
                    await loop.create_connection(lambda: self, self._link.host, self._port)
            except Exception as error:  # whatever it is: an end here would leave the robot for good
                self._complain(error)
            else:
                await self._lost.wait()
            await asyncio.sleep(self._link.reconnect_period)

    def _complain(self, error: Exception) -> None:
        """Log the first failure of a series only."""
        if not self._complained:
            self._complained = True
            is_usual, name = isinstance(error, OSError), type(error).__name__
            log.log(
                logging.WARNING if is_usual else logging.ERROR,
                "controller %s link to %s:%d: %s",
                self.link,
                self._link.host,
                self._port,
                (str(error) or name) if is_usual else f"{name}: {error}",
            )

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin a conversation and tell the core."""
        prepare_socket(transport.get_extra_info("socket"), UNANSWERED)
        now = self._cell.journal.begin("up", self.link)
        self._transport = cast(asyncio.Transport, transport)  # uvloop's are none by class
        self._is_closing = False
        # Only here it is asked for more than motion, by our own messages.
        dialect = PENDANT if self.path is ControllerPath.STATE else STANDARD
        self._wire = Connection(
            Role.CLIENT, dialect, self._link.order, real_size=self._link.real_size
        )
        self._complained = False
        log.info("controller %s link is up", self.link)
        self._cell.path_changed(self.path, True, now)

    def data_received(self, data: bytes) -> None:
        """Decode what came and hand each message to the core, on this call stack."""
        wire = self._wire
        if wire is None:
            return
        now = self._cell.journal.begin("in", self.link, data)
        cell, path = self._cell, self.path
        while True:
            awaited = wire.awaited
            batch = wire.receive(data)
            # The connection has counted all answers; each is to be judged as if it came alone.
            later = awaited - wire.awaited
            for received in batch:
                if later and _is_answer(received):
                    later -= 1
                cell.hear(path, received, wire.awaited + later, now)
            if not wire.more:
                break
            data = b""
        if wire.fault is not None:
            problem = str(wire.fault)
            self._cell.garbled(self.path, problem, now)
            self.drop(problem)

    def eof_received(self) -> bool:
        """A controller that says no more is lost."""
        return False

    def connection_lost(self, exc: Exception | None) -> None:
        """Tell the core that this path is gone."""
        now = self._cell.journal.begin("down", self.link)
        self._transport = None
        self._wire = None
        if not self._ending:
            log.warning("controller %s link was lost: %s", self.link, exc or "closed there")
        self._cell.path_changed(self.path, False, now)
        self._lost.set()

    def send(self, message: Message) -> bool:
        """Write a message in one piece; tell whether there was a connection to write to."""
        if self._wire is None or not self.is_up:
            return False
        assert self._transport is not None
        try:
            frame = self._wire.send(message)
        except LocalProtocolError:
            log.exception("controller %s link: not sent", self.link)
            return False
        if self._cell.journal.is_kept:
            self._cell.journal.out(self.link, frame)
        self._transport.write(frame)
        return True

    def end(self) -> None:
        """Close the path because the server is going down."""
        self._ending = True
        self._close()

    def drop(self, reason: str) -> None:
        """Close the path; it connects anew."""
        if self._transport is not None:
            log.warning("controller %s link dropped: %s", self.link, reason)
            self._close()

    def _close(self) -> None:
        """Close gently, so that a stop just written still leaves; by force where nobody reads."""
        transport = self._transport
        if transport is not None:
            self._is_closing = True
            transport.close()
            asyncio.get_running_loop().call_later(_FAREWELL, transport.abort)


def _is_answer(received: Received) -> bool:
    """Tell whether a message answers a request of ours, readable or not."""
    return not isinstance(received, Unasked) and received.comm_type == _REPLY
