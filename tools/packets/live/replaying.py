"""Replay of a recording's sessions on real sockets, as client or as server.

Owns connections, deadlines and the order of sessions; what is sent when, and whether the answer is
right, is `playback`'s business.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections import defaultdict
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass

from ...console import ExitCode
from ..console import PeerError
from .endpoints import Endpoint, Peer, PeerSilentError, in_short
from .playback import Pace, PlayedSide, Player, RecordedSession

LINGER = 0.2
"""After everything came, one more packet would be noticed within this time [s]."""

_NANOSECONDS = 1e9

_Acceptor = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class ReplaySummary:
    """Result of a replay."""

    sent: int
    received: int
    differences: int
    first: str
    failure: str

    @property
    def code(self) -> ExitCode:
        """Exit code of the process."""
        if self.failure:
            return ExitCode.REFUSED
        return ExitCode.FAILED if self.differences else ExitCode.OK


class Replay:
    """Plays all sessions of a recording."""

    def __init__(
        self, sessions: Sequence[RecordedSession], part: PlayedSide, pace: Pace, within: float
    ) -> None:
        """Make a replay that waits so long for the peer [s]; needs a running loop."""
        self._sessions = sessions
        self._players = {id(session): Player(session, part, pace) for session in sessions}
        self._part = part
        self._pace = pace
        self._within = within
        self._loop = asyncio.get_running_loop()
        self._failures: list[str] = []
        self._servers: list[asyncio.Server] = []
        self._over = {id(session): asyncio.Event() for session in sessions}
        self._waiting: dict[int, list[RecordedSession]] = defaultdict(list)
        self._connected = asyncio.Event()
        self._began = min((session.opened for session in sessions), default=0)

    @property
    def _now(self) -> int:
        return round(self._loop.time() * _NANOSECONDS)

    async def play_client(self, targets: dict[int, Endpoint]) -> ReplaySummary:
        """Connect to the peers and play the client's side."""
        async with asyncio.TaskGroup() as group:
            for session in self._sessions:
                group.create_task(self._connect(session, targets[session.port]))
        return self._summary()

    async def _connect(self, session: RecordedSession, target: Endpoint) -> None:
        if self._pace.speed is None:
            await self._predecessors(session)
        else:
            await asyncio.sleep(self._seconds_until(session))
        try:
            peer = await Peer.connect(target, self._within)
        except PeerError as error:
            self._failures.append(str(error))
            self._over[id(session)].set()
            return
        await self._play(session, peer)

    def _seconds_until(self, session: RecordedSession) -> float:
        """Return the time from the beginning to a session, as it is played [s]."""
        return (session.opened - self._began) / (self._pace.speed or 1.0) / _NANOSECONDS

    async def _predecessors(self, session: RecordedSession) -> None:
        """Wait for the connections that had ended before this one started."""
        for other in self._sessions:
            if other is not session and other.ended <= session.opened:
                await self._over[id(other)].wait()

    async def listen(self, listens: dict[int, Endpoint]) -> dict[int, int]:
        """Listen, and return the ports in use; raise PeerError where one cannot be used."""
        for session in self._sessions:
            self._waiting[session.port].append(session)
        ports: dict[int, int] = {}
        for recorded, listen in listens.items():
            try:
                server = await asyncio.start_server(
                    self._acceptor(recorded), listen.host, listen.port
                )
            except (OSError, UnicodeError) as error:
                await self.close()
                raise PeerError(f"cannot listen on {listen}: {in_short(error)}") from None
            self._servers.append(server)
            ports[recorded] = server.sockets[0].getsockname()[1]
        return ports

    def _acceptor(self, recorded: int) -> _Acceptor:
        async def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            peer = Peer(f"the client on port {recorded}", reader, writer)
            waiting = self._waiting[recorded]
            if waiting:
                session = waiting.pop(0)
                self._connected.set()
                await self._play(session, peer)
            else:
                await peer.close()

        return accept

    async def play_server(self) -> ReplaySummary:
        """Wait until all sessions were played with the clients that connect."""
        for session in self._sessions:
            await self._until_over(session)
        await self.close()
        return self._summary()

    async def _until_over(self, session: RecordedSession) -> None:
        over = self._over[id(session)]
        try:
            async with asyncio.timeout(self._within + self._seconds_until(session)):
                while session in self._waiting[session.port] and not over.is_set():
                    await self._connected.wait()
                    self._connected.clear()
        except TimeoutError:
            self._waiting[session.port].remove(session)
            self._failures.append(
                f"no client connected for connection {session.number} of port {session.port}"
                f" within {self._within:g} s"
            )
            return
        await over.wait()

    async def close(self) -> None:
        """Stop listening."""
        for server in self._servers:
            server.close()
        for server in self._servers:
            await server.wait_closed()
        self._servers.clear()

    async def _play(self, session: RecordedSession, peer: Peer) -> None:
        player = self._players[id(session)]
        try:
            await self._converse(player, peer)
            with contextlib.suppress(PeerError, TimeoutError):
                async with asyncio.timeout(LINGER):
                    while not player.take(await peer.next_piece(self._within)):
                        pass
        except PeerError as error:
            self._failures.append(f"{error}; {player.missing} packets are missing")
        finally:
            self._over[id(session)].set()
            await peer.close()

    async def _converse(self, player: Player, peer: Peer) -> None:
        player.start(self._now)
        progress = self._now
        while not player.is_over(self._now):
            packets = player.due(self._now)
            for packet in packets:
                await peer.send(packet, self._within)
            if packets:
                progress = self._now
                continue
            due = player.next_due(self._now)
            until = progress + round(self._within * _NANOSECONDS) if due is None else due
            try:
                piece = await peer.next_piece(max(0, until - self._now) / _NANOSECONDS)
            except PeerSilentError:
                if due is not None:
                    continue
                raise
            except PeerError:
                if player.all_sent and not player.missing:
                    return
                raise
            if player.take(piece):
                progress = self._now
            elif due is None and self._now >= until:
                raise PeerSilentError(f"no reply from {peer.name} within {self._within:g} s")

    def _summary(self) -> ReplaySummary:
        players = list(self._players.values())
        return ReplaySummary(
            sent=sum(player.sent for player in players),
            received=sum(player.received for player in players),
            differences=sum(player.differences for player in players),
            first=next((player.first for player in players if player.first), ""),
            failure=self._failures[0] if self._failures else "",
        )
