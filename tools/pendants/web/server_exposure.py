"""The question before a gateway listens on a network: does a server demand logins of others?

Owns that a gateway does not start where one does not, and the command that mends it.
"""

from __future__ import annotations

import asyncio
import json
import socket
from collections.abc import Sequence
from typing import TypeVar

from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Message, Role
from openpendant.simplemsg.pendant import (
    MAX_PENDANT_FRAME,
    PROTOCOL_VERSION,
    Hello,
    HelloReply,
    Lobby,
    LobbyReply,
    Management,
)

from ..connection_errors import PendantError, Unreachable, answer_of
from .admission import Browser
from .server_link import GatewayIdentity, NotForwarded, Server, ServerLink, dial

_WITHIN = 5.0
"""Time for each answer [s]."""

_M = TypeVar("_M", bound=Message)


class NotAsked(Exception):
    """A server that did not answer the question; the text is for the user."""


class NotGuarded(Exception):
    """A server through which other machines would reach a robot without a login; as above."""


async def check_logins_are_demanded(servers: Sequence[Server], identity: GatewayIdentity) -> None:
    """Ask every server whether it demands logins of other machines.

    Raises:
        NotGuarded: one does not.
        NotAsked: one does not answer, or not as a server of this protocol.
    """
    for server in servers:
        try:
            is_guarded = await _demands_logins(server, identity)
        except (PendantError, NotForwarded, OSError) as error:
            raise NotAsked(f"server {server.name!r} at {server}: {error}") from None
        if not is_guarded:
            raise NotGuarded(
                f"server {server.name!r} at {server} demands no logins, so whoever reaches this"
                " gateway would be let in; add an account (openpendant users add NAME --role"
                " admin), or listen on 127.0.0.1"
            )


async def _demands_logins(server: Server, identity: GatewayIdentity) -> bool:
    """Return what a server says to `access.exposure`, after a lobby and a hello."""
    ourselves = Browser(_own_address(server), is_encrypted=server.tls is not None)
    asking = _Asking(identity.forwarded(ourselves))
    try:
        await dial(server, asking.link)
        lobby = await asking.answer(Lobby(1), LobbyReply)
        cells = answer_of(lobby).get("cells")
        first = cells[0] if isinstance(cells, list) and cells else {}
        cell = first.get("cell", "") if isinstance(first, dict) else ""
        await asking.answer(Hello(PROTOCOL_VERSION, 0.0, str(cell), "gateway"), HelloReply)
        question = Management(2, json.dumps({"op": "access.exposure"}).encode())
        told = answer_of(await asking.answer(question, Management))
        return told.get("logins_demanded") is True
    finally:
        asking.link.close()


def _own_address(server: Server) -> str:
    """Return the address that this machine reaches a server from; nothing is sent for it."""
    if server.own_address:
        return server.own_address
    found = socket.getaddrinfo(server.host, server.port, type=socket.SOCK_DGRAM)
    family, kind, _, _, address = found[0]
    with socket.socket(family, kind) as probe:
        probe.connect(address)
        return str(probe.getsockname()[0]).partition("%")[0]


class _Asking:
    """A conversation of one question at a time."""

    def __init__(self, forwarded: bytes) -> None:
        self.link = ServerLink(forwarded, self._take, self._lose)
        self._wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
        self._answers: asyncio.Queue[object] = asyncio.Queue()

    def _take(self, frames: Sequence[bytes]) -> None:
        for frame in frames:
            for message in self._wire.receive(frame):
                self._answers.put_nowait(message)

    def _lose(self, why: str) -> None:
        self._answers.put_nowait(Unreachable(None, why))

    async def answer(self, question: Message, kind: type[_M]) -> _M:
        """Ask, and return the answer; what else comes meanwhile is dropped.

        Raises:
            Unreachable: there is none in time.
        """
        self.link.relay(self._wire.send(question))
        try:
            async with asyncio.timeout(_WITHIN):
                while True:
                    told = await self._answers.get()
                    if isinstance(told, kind):
                        return told
                    if isinstance(told, Unreachable):
                        raise told
        except TimeoutError:
            raise Unreachable(None, f"no answer within {_WITHIN:g} s") from None
