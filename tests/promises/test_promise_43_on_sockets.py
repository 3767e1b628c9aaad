"""Meshes of an imported robot, downloaded by both clients from a real server."""

import asyncio
import hashlib
import json
import socket
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from promises.promise_table import figure
from rigs.data.mesh_files import meshed_robot, prism, stl
from rigs.processes.warm_start import begun

from openpendant.simplemsg import PENDANT, ByteOrder, Connection, Message, Role
from openpendant.simplemsg.pendant import MAX_PENDANT_FRAME, PROTOCOL_VERSION, Hello, Management
from openpendant.simplemsg.verdicts import VerdictCode
from openpendant.tools.bench import questions
from openpendant.tools.bench.questions import served
from openpendant.tools.cli import main
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.sync_client import SyncPendantClient

pytestmark = [pytest.mark.realtime, pytest.mark.timeout(120)]

CHUNK = figure(43, "chunk").bytes
RATE = figure(43, "rate").count
UNREAD = figure(43, "unread").bytes

KERNEL = 8 * 1024
"""What the kernel may keep of a connection, of each side; it takes twice as much for it."""

ASKED = 12
"""Chunks that are asked for at their rate, unread: less long than the server waits for a reader."""


CONTENT = stl(*prism(801, 0.1, 0.3))
NAME = hashlib.sha256(CONTENT).hexdigest()


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of a robot that is imported with a mesh."""
    folder = tmp_path_factory.mktemp("imported")
    target = folder / "meshed.yaml"
    urdf = meshed_robot(folder, {"part.stl": CONTENT})
    assert main(["robots", "import", str(urdf), "--yes", "-o", str(target)]) == 0
    return target


@pytest.fixture(scope="module")
def port(robot: Path) -> Iterator[int]:
    """The pendant port of a server with that robot; no start is measured here."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(questions, "process", begun)
        with served(str(robot)) as port:
            yield port


def test_the_robot_that_is_served_below_names_its_mesh_by_the_hash(robot: Path) -> None:
    assert NAME in robot.read_text(encoding="utf-8")


async def download(port: int) -> tuple[bytes, float]:
    """Return the mesh as it was downloaded, and how long that took [s]."""
    async with await PendantClient.connect("127.0.0.1", port) as pendant:
        assert [mesh["hash"] for mesh in await pendant.shapes.meshes()] == [NAME]
        began = time.monotonic()
        content = await pendant.shapes.download(NAME)
        return content, time.monotonic() - began


def download_waiting(port: int) -> tuple[bytes, float]:
    """Do the same with the client that blocks."""
    with SyncPendantClient.connect("127.0.0.1", port) as pendant:
        assert [mesh["hash"] for mesh in pendant.shapes.meshes()] == [NAME]
        began = time.monotonic()
        content = pendant.shapes.download(NAME)
        return content, time.monotonic() - began


@pytest.mark.parametrize("client", ["asyncio", "blocking"])
def test_promise_43_a_client_downloads_a_mesh_over_a_socket(port: int, client: str) -> None:
    found, took = asyncio.run(download(port)) if client == "asyncio" else download_waiting(port)
    assert found == CONTENT
    # Two at once, and the rest at their rate.
    assert took >= (len(CONTENT) // CHUNK - 2) / RATE


class DeafPage:
    """A page that asks, and reads nothing before it is told to."""

    def __init__(self, port: int) -> None:
        self.received = 0
        self._socket = socket.socket()
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL)
        self._socket.connect(("127.0.0.1", port))
        self._socket.settimeout(30.0)
        self._wire = Connection(Role.CLIENT, PENDANT, ByteOrder.LITTLE, max_frame=MAX_PENDANT_FRAME)
        self.say(Hello(PROTOCOL_VERSION, 0.0, "", "deaf"))

    def say(self, message: Message) -> None:
        self._socket.sendall(self._wire.send(message))

    def ask(self, number: int, name: str) -> None:
        body = json.dumps({"op": "shapes.mesh", "hash": name, "offset": 0}).encode()
        self.say(Management(number, body))

    def answers(self, last: int) -> list[dict[str, object]]:
        """Read up to an answer; return all answers."""
        found: list[dict[str, object]] = []
        while True:
            data = self._socket.recv(65_536)
            assert data, "the server closed the connection"
            self.received += len(data)
            complete = self._wire.receive(data)
            while self._wire.more:
                complete += self._wire.receive(b"")
            for message in complete:
                if isinstance(message, Management):
                    found.append(json.loads(message.body))
                    if message.request_id == last:
                        return found

    def close(self) -> None:
        self._socket.close()


def test_promise_43_no_more_is_kept_of_chunks_for_a_page_that_does_not_read(
    port: int,
) -> None:
    with closing(DeafPage(port)) as page:
        page.ask(0, NAME)
        (first,) = page.answers(0)
        assert first.get("offset") == 0, first  # the process that answers has started
        time.sleep(3.0 / RATE)  # as many as may come at once may come again
        page.received = 0
        for number in range(1, ASKED + 1):
            page.ask(number, NAME)
            time.sleep(1.0 / RATE)
        told = page.answers(ASKED)
        assert page.received <= UNREAD + 4 * KERNEL
        refused = [each for each in told if "code" in each]
        assert {each["code"] for each in refused} == {VerdictCode.TOO_OFTEN}
        assert all("unread" in str(each["text"]) for each in refused)
        assert 1 <= len(told) - len(refused) <= 2
        # Who reads is given the next one.
        time.sleep(1.0 / RATE)
        page.ask(ASKED + 1, NAME)
        assert page.answers(ASKED + 1)[-1]["offset"] == 0
