"""Download of a mesh: its chunks one after the other, as fast as the server allows, and its hash.

Owns what is believed of the chunks: where they begin, how many bytes there are at most, and nothing
of the bytes until the hash of all of them is the one that was asked for.
"""

from __future__ import annotations

import asyncio
import base64
import binascii
import hashlib
from collections.abc import Awaitable, Callable
from typing import Any

from openpendant.simplemsg.pendant.management.shapes import MOST_OF_CHUNK, MeshChunk, ReadMesh
from openpendant.simplemsg.verdicts import VerdictCode

from .connection_errors import MeshDamaged, Refused
from .loop_thread import LoopThread
from .management.calls import AsyncCalls, SyncCalls
from .management.groups import ShapeCalls

MAX_MESH_BYTES = 32 << 20
"""Most bytes of a mesh that is taken: no import keeps a larger one."""

AskChunk = Callable[[ReadMesh], Awaitable[MeshChunk]]
"""Asks for a chunk; raises `Refused`."""


async def downloaded(ask: AskChunk, mesh_hash: str) -> bytes:
    """Return the bytes of a mesh.

    Args:
        mesh_hash: SHA-256 in hexadecimal, as `shapes.meshes` tells it.

    Raises:
        Refused: there is no such mesh, or this connection may not look on.
        MeshDamaged: other bytes came than were imported.
        ConnectionLost: the connection ended.
    """
    parts: list[bytes] = []
    begins, has_more = 0, True
    while has_more:
        chunk = await _in_its_time(ask, ReadMesh(mesh_hash, begins))
        data = _bytes_of(chunk, mesh_hash, begins)
        parts.append(data)
        begins, has_more = begins + len(data), bool(chunk["more"])
    whole = b"".join(parts)
    found = hashlib.sha256(whole).hexdigest()
    if found != mesh_hash:
        raise MeshDamaged(f"{len(whole)} bytes came with the hash {found}, not {mesh_hash}")
    return whole


async def _in_its_time(ask: AskChunk, wanted: ReadMesh) -> MeshChunk:
    while True:
        try:
            return await ask(wanted)
        except Refused as refused:
            if refused.code != VerdictCode.TOO_OFTEN:
                raise
            await asyncio.sleep(refused.value)


def _bytes_of(chunk: MeshChunk, mesh_hash: str, begins: int) -> bytes:
    """Return the bytes of a chunk that goes on where the one before ended."""
    try:
        data = base64.b64decode(chunk["data"], validate=True)
    except (binascii.Error, ValueError) as error:
        raise MeshDamaged(f"a chunk of {mesh_hash} is no base64") from error
    if chunk["offset"] != begins or len(data) > MOST_OF_CHUNK:
        told = f"{len(data)} bytes from {chunk['offset']}"
        raise MeshDamaged(f"{told} came of {mesh_hash}; at most {MOST_OF_CHUNK} from {begins} fit")
    if chunk["more"] and not data:
        raise MeshDamaged(f"an empty chunk of {mesh_hash} came before its end, at {begins}")
    if begins + len(data) > MAX_MESH_BYTES:
        raise MeshDamaged(f"more than {MAX_MESH_BYTES} bytes came of {mesh_hash}")
    return data


class AsyncShapeCalls(ShapeCalls[AsyncCalls]):
    """What robots look like."""

    async def download(self, mesh_hash: str) -> bytes:
        """Return the bytes of a mesh once their hash is checked; see `downloaded`."""

        async def ask(wanted: ReadMesh) -> Any:
            return await self._way.perform(wanted, "")

        return await downloaded(ask, mesh_hash)


class SyncShapeCalls(ShapeCalls[SyncCalls]):
    """What robots look like."""

    def __init__(self, thread: LoopThread, way: SyncCalls, asked: AsyncShapeCalls) -> None:
        super().__init__(way)
        self._thread = thread
        self._asked = asked

    def download(self, mesh_hash: str) -> bytes:
        """Return the bytes of a mesh once their hash is checked; see `downloaded`."""
        return self._thread.call(self._asked.download(mesh_hash))
