"""Meshes of an imported robot, downloaded by both clients from a real server."""

import asyncio
import hashlib
import time
from pathlib import Path

import pytest
from promises.promise_table import figure
from rigs.data.mesh_files import meshed_robot, prism, stl
from rigs.processes.warm_start import begun

from openpendant.tools.bench import questions
from openpendant.tools.bench.questions import served
from openpendant.tools.cli import main
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(120)]

CHUNK = figure(43, "chunk").bytes
RATE = figure(43, "rate").count


async def downloads(port: int, name: str) -> tuple[bytes, float]:
    """Return a mesh that was downloaded, and how long that took [s]."""
    async with await PendantClient.connect("127.0.0.1", port) as pendant:
        assert [mesh["hash"] for mesh in await pendant.shapes.meshes()] == [name]
        began = time.monotonic()
        content = await pendant.shapes.download(name)
        return content, time.monotonic() - began


def test_promise_43_a_client_downloads_a_mesh_over_a_socket(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(questions, "process", begun)
    points, faces = prism(801, 0.1, 0.3)
    content = stl(points, faces)
    name = hashlib.sha256(content).hexdigest()
    target = tmp_path / "meshed.yaml"
    urdf = meshed_robot(tmp_path, {"part.stl": content})
    assert main(["robots", "import", str(urdf), "--yes", "-o", str(target)]) == 0
    with served(str(target)) as port:
        found, took = asyncio.run(downloads(port, name))
        assert found == content
        # Two at once, and the rest at their rate.
        assert took >= (len(content) // CHUNK - 2) / RATE
        with SyncPendantClient.connect("127.0.0.1", port) as pendant:
            assert pendant.shapes.download(name) == content
