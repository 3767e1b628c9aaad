"""The download of a mesh by the client: its chunks in their time, and only what was meant."""

import asyncio
import base64
import hashlib
import random
from typing import Any

import pytest

from openpendant.simplemsg.pendant.management.shapes import MeshChunk, ReadMesh
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.pendants.client import MeshDamaged, Refused
from openpendant.tools.pendants.mesh_download import MAX_MESH_BYTES, downloaded

CONTENT = random.Random(43).randbytes(80_000)
HASH = hashlib.sha256(CONTENT).hexdigest()


class MeshServer:
    """Answers as the server does, but for what a test changes."""

    def __init__(self, content: bytes = CONTENT, **changed: Any) -> None:
        self.content = content
        self.changed = changed
        self.refused: list[VerdictCode] = []
        self.offsets: list[int] = []

    async def ask(self, wanted: ReadMesh) -> MeshChunk:
        if self.refused:
            raise Refused(self.refused.pop(), "not now", -1, 0.001, 20.0)
        self.offsets.append(wanted.offset)
        data = self.content[wanted.offset : wanted.offset + 32_768]
        told: Any = {
            "bytes_total": len(self.content),
            "offset": wanted.offset,
            "data": base64.b64encode(data).decode(),
            "more": wanted.offset + len(data) < len(self.content),
        }
        return told | self.changed  # type: ignore[no-any-return]


def download(server: MeshServer) -> bytes:
    return asyncio.run(downloaded(server.ask, HASH))


def test_a_mesh_comes_in_chunks() -> None:
    server = MeshServer()
    assert download(server) == CONTENT
    assert server.offsets == [0, 32_768, 65_536]


def test_a_chunk_that_came_too_early_is_asked_for_again() -> None:
    server = MeshServer()
    server.refused = [VerdictCode.TOO_OFTEN, VerdictCode.TOO_OFTEN]
    assert download(server) == CONTENT


def test_another_refusal_is_raised() -> None:
    server = MeshServer()
    server.refused = [VerdictCode.UNKNOWN_MESH]
    with pytest.raises(Refused) as refused:
        download(server)
    assert refused.value.code == VerdictCode.UNKNOWN_MESH


def test_bytes_of_another_hash_are_not_kept() -> None:
    with pytest.raises(MeshDamaged, match=f"not {HASH}"):
        download(MeshServer(CONTENT[:-1] + bytes([CONTENT[-1] ^ 1])))


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"data": "*"}, "no base64"),
        ({"data": "ä"}, "no base64"),
        ({"offset": 7}, "at most 32768 from 0 fit"),
        ({"data": base64.b64encode(bytes(32_769)).decode()}, "32769 bytes from 0"),
        ({"data": "", "more": True}, "empty chunk"),
    ],
)
def test_a_chunk_that_does_not_fit_is_refused(changed: dict[str, Any], told: str) -> None:
    with pytest.raises(MeshDamaged, match=told):
        download(MeshServer(**changed))


def test_a_mesh_without_an_end_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("openpendant.tools.pendants.mesh_download.MAX_MESH_BYTES", 70_000)
    with pytest.raises(MeshDamaged, match="more than 70000 bytes"):
        download(MeshServer(more=True))
    assert MAX_MESH_BYTES == 32 << 20
