"""`make pendant` without make: emulator, server, gateway and bridge come and go together."""

import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import pytest
from aiohttp import ClientSession
from rigs.clock.busy_machine import PATIENCE
from rigs.processes.marked_processes import left_over, processes_marked
from rigs.processes.web_gateway import Tab

from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSION,
    Hello,
    HelloReply,
    Lobby,
    LobbyReply,
    Management,
)
from openpendant.simplemsg.serial_frames import FrameKind, FrameReader, LineWay
from openpendant.tools.pendants.keypad.emulated_keypad import MS, EmulatedKeypad

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc"),
]


@dataclass
class StartedPage:
    """The command, which was started and not waited for, and the folder of all that it writes.

    Attributes:
        mark: of its process and of those that it starts.
    """

    process: subprocess.Popen[str]
    folder: Path
    mark: str

    @cached_property
    def address(self) -> str:
        """Wait until the command says where the page is."""
        assert self.process.stdout is not None
        words = self.process.stdout.readline().split()
        return next(word for word in words if word.startswith("http://127.0.0.1:"))

    def wait_for_log(self, part: str) -> None:
        """Wait until a part is being started, which begins with its log."""
        deadline = time.monotonic() + PATIENCE
        while not list(self.folder.glob(f"*/{part}.log")):
            assert time.monotonic() < deadline, f"no {part} is started"
            time.sleep(0.02)

    def command(self, words: str) -> re.Match[str]:
        """Wait until one of the processes has a command like that."""
        deadline = time.monotonic() + PATIENCE
        while True:
            for command in processes_marked(self.mark).values():
                if (found := re.search(words, command)) is not None:
                    return found
            assert time.monotonic() < deadline, f"none with {words}"
            time.sleep(0.05)

    def modes_of_secrets(self) -> list[int]:
        return [each.stat().st_mode & 0o777 for each in self.folder.rglob("gateway.secret")]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[StartedPage]:
    folder = tmp_path_factory.mktemp("page")
    mark = f"OPENPENDANT_PAGE_TEST={folder}"
    name, _, value = mark.partition("=")
    with subprocess.Popen(
        [
            *(sys.executable, "-m", "openpendant.tools.start_page"),
            *("--no-open", "--port", "0", "--store", "off", "--keypad"),
        ],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, name: value, "TMPDIR": str(folder)},
    ) as process:
        yield StartedPage(process, folder, mark)
        if process.poll() is None:
            process.terminate()
            process.communicate(timeout=PATIENCE)


def test_the_secret_is_for_nobody_else_s_eyes_before_a_server_reads_it(page: StartedPage) -> None:
    page.wait_for_log("server")
    assert page.modes_of_secrets() == [0o600]


def test_the_gateway_is_led_to_a_server_that_listens_already(page: StartedPage) -> None:
    page.wait_for_log("gateway")
    port = page.command(r" --server emulated=127\.0\.0\.1:(\d+) ")[1]
    socket.create_connection(("127.0.0.1", int(port))).close()


async def test_a_page_of_this_machine_is_the_single_user_of_an_emulated_cell(
    page: StartedPage,
) -> None:
    async with ClientSession() as session:
        listed = await (await session.get(f"{page.address}servers")).json()
        (server,) = listed["servers"]
        tab = Tab(await session.ws_connect(f"{page.address}servers/{server['name']}"))
        await tab.tell(Lobby(1))
        (cell,) = json.loads((await tab.answer(LobbyReply)).body)["cells"]
        assert (cell["robot"], cell["emulated"], cell["login_needed"]) == ("ur5", True, False)
        await tab.tell(Hello(PROTOCOL_VERSION, 0.0, "", "page"))
        await tab.answer(HelloReply)
        await tab.tell(Management(2, b'{"op": "access.whoami"}'))
        whoami = json.loads((await tab.answer(Management)).body)
        assert whoami["basis"] == "single user"
    assert page.modes_of_secrets() == [0o600]


async def test_the_keypad_of_the_page_is_welcomed_by_its_bridge(page: StartedPage) -> None:
    keypad, reader = EmulatedKeypad(), FrameReader(LineWay.TO_DEVICE)
    keypad.start(0)
    keypad.tick(20 * MS)
    async with ClientSession() as session:
        line = await session.ws_connect(f"{page.address}keypad")
        hello, kinds = keypad.output(), list[FrameKind]()
        while FrameKind.WELCOME not in kinds:
            await line.send_bytes(hello)  # the bridge comes by and by, and hears what is said then
            try:
                data = await line.receive_bytes(timeout=0.3)
            except TimeoutError:
                continue
            kinds += [frame.KIND for _, frame in reader.receive(data)]
        await line.close()


def test_an_interrupted_command_ends_all_four(page: StartedPage) -> None:
    assert page.address
    page.process.send_signal(signal.SIGINT)
    rest, _ = page.process.communicate(timeout=PATIENCE)
    assert page.process.returncode == 128 + signal.SIGINT
    assert "all four have ended" in rest
    assert left_over(page.mark, PATIENCE) == {}
