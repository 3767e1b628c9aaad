"""Connection loop of a pendant: connect, log in, pass events on, reconnect after a loss.

Owns the passing of the client library's events to the core, and that a stop needs no login: it is
sent before a login is tried, and while one is pending. A new connection starts as an observer; no
motion and no held key of the last connection is restored.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable

from openpendant.simplemsg.verdicts import VerdictCode

from ..client import (
    ConnectionLost,
    PendantClient,
    PendantError,
    Refused,
    SecretUnprotected,
    WrongArgument,
)
from .commands import Command
from .panel import Panel
from .performer import Performer
from .wording import is_hopeless

RETRY = 2.0
"""Wait so long before the next attempt, unless the server says how long [s]."""

LONGEST_PAUSE = 60.0
"""Wait no longer, whatever a server says [s]."""

ATTEMPT = 10.0
"""An attempt to connect that takes longer is given up and made anew: a cable may be back, which a
system that sends ever more rarely would find out late [s]."""

_LOOK = 0.05
"""Time between two looks at whether a stop was answered [s]."""

Connect = Callable[[], Awaitable[PendantClient]]
"""Connects and says hello, no more: whoever logs in there keeps a stop waiting."""

LogIn = Callable[[PendantClient], Awaitable[None]]
"""Shows who is at the pendant; raises what `PendantClient.login` does."""


async def as_nobody(client: PendantClient) -> None:
    """Log in as nobody, which a server without accounts accepts."""


class PanelConnection:
    """The connection of one pendant, made again after each loss."""

    def __init__(
        self,
        panel: Panel,
        connect: Connect,
        log_in: LogIn = as_nobody,
        clock: Callable[[], int] = time.monotonic_ns,
        performer: Callable[[PendantClient, Panel], Performer] = Performer,
    ) -> None:
        """Make a connection that is not started.

        Args:
            connect: makes a connection; raises `OSError` or `PendantError`.
            clock: returns monotonic time [ns].
            performer: makes what carries out the commands on a connection.
        """
        self._clock = clock
        self._make_performer = performer
        self._panel = panel
        self._connect = connect
        self._log_in = log_in
        self._performer: Performer | None = None
        self._turned_away: Refused | SecretUnprotected | WrongArgument | None = None

    def perform(self, commands: list[Command]) -> None:
        """Carry out commands; without a connection they are dropped."""
        if self._performer is not None:
            self._performer.perform(commands)

    async def run(self) -> None:
        """Stay connected until cancelled.

        Raises:
            Refused: the server refuses the connection, and would refuse each further attempt.
            SecretUnprotected: others could read the password, and the connection is strict.
            WrongArgument: a request cannot be written as a message.
        """
        while True:
            pause = RETRY
            try:
                await self._once()
            except (SecretUnprotected, WrongArgument):
                raise
            except Refused as refused:
                if is_hopeless(refused):
                    raise
                if refused.code in (VerdictCode.NO_PLACE, VerdictCode.ADDRESS_BARRED):
                    pause = min(max(refused.value, RETRY), LONGEST_PAUSE)
                elif refused.code == VerdictCode.ACCOUNT_FULL:
                    pause = LONGEST_PAUSE  # each attempt costs the server a password check
                self._panel.lost(f"{refused}; trying again in {pause:g} s")
            except (OSError, PendantError, TimeoutError) as error:
                reason = str(error) or type(error).__name__
                self._panel.lost(f"{reason}; trying again in {pause:g} s")
            await asyncio.sleep(pause)

    async def _once(self) -> None:
        async with await self._connected() as client:
            performer = self._performer = self._make_performer(client, self._panel)
            try:
                self._listen(client)
                performer.perform(self._panel.greeted())
                # So that a stop leaves before the login, and the snapshot knows of it.
                await asyncio.sleep(0)
                await self._stay(client)
            except (Refused, SecretUnprotected, WrongArgument) as error:
                if self._panel.stop_key.is_awaited:
                    performer.perform(self._panel.turned_away(str(error)))
                    await self._stop_answered(client)
                raise
            finally:
                self._performer = None
                await performer.close()

    async def _stay(self, client: PendantClient) -> None:
        """Log in and serve the pendant until the connection ends or the server logs us out."""
        if self._turned_away is not None:
            raise self._turned_away
        try:
            await self._log_in(client)
            self._panel.cell.connected(client.hello, await client.snapshot())
            self.perform(self._panel.connected())
            asking = asyncio.ensure_future(self._ask_what_it_drives(client))
            try:
                async for _ in client.states():
                    pass
            finally:
                asking.cancel()
        except (Refused, SecretUnprotected, WrongArgument) as error:
            if not isinstance(error, Refused) or is_hopeless(error):
                # Not tried again on a later connection for the stop: wrong secrets are counted.
                self._turned_away = error
            raise

    async def _ask_what_it_drives(self, client: PendantClient) -> None:
        """Learn whether the controller is known to be emulated; beside all else, as it may wait."""
        try:
            known = await client.controller.describe()
        except PendantError:
            return  # what nobody says to be emulated counts as a real one
        self._panel.controller_described(is_emulated=known["emulated"])

    async def _stop_answered(self, client: PendantClient) -> None:
        """Wait for the verdict on the stop that is not confirmed.

        Raises:
            ConnectionLost: the connection ended; the stop has to be sent on the next one.
        """
        while self._panel.stop_key.is_awaited:
            if not client.is_open:
                raise ConnectionLost("the connection ended before the stop was answered")
            await asyncio.sleep(_LOOK)

    async def _connected(self) -> PendantClient:
        try:
            async with asyncio.timeout(ATTEMPT):
                return await self._connect()
        except TimeoutError as error:
            raise TimeoutError(str(error) or f"no connection within {ATTEMPT:g} s") from None

    def _listen(self, client: PendantClient) -> None:
        panel = self._panel
        client.on_state = lambda state: panel.cell.take_state(state, self._clock())
        client.on_authority = panel.cell.authority_changed
        client.on_wanted = lambda wanted: panel.messages.add(
            f"{wanted.client} asks for control; {panel.gives_control}"
        )
        client.on_stop = lambda change: self.perform(panel.stop_changed(change))
        client.on_mode = lambda change: self.perform(panel.mode_changed(change))
        client.on_controller = lambda change: panel.controller_described(
            is_emulated=bool(change.is_emulated)
        )
        client.on_program = lambda report: self.perform(panel.program_moved(report))
