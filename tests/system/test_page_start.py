"""`make pendant` without make: an emulator, a server and a gateway that come and go together."""

import asyncio
import json
import os
import signal
import sys
from pathlib import Path

import pytest
from aiohttp import ClientSession
from rigs.clock.busy_machine import PATIENCE
from rigs.processes.marked_processes import left_over
from rigs.processes.web_gateway import Tab

from openpendant.simplemsg.pendant import (
    PROTOCOL_VERSION,
    Hello,
    HelloReply,
    Lobby,
    LobbyReply,
    Management,
)

pytestmark = [
    pytest.mark.realtime,
    pytest.mark.skipif(sys.platform != "linux", reason="looks for processes in /proc"),
]


def modes_of_secrets(folder: Path) -> list[int]:
    return [each.stat().st_mode & 0o777 for each in folder.rglob("gateway.secret")]


async def test_a_page_of_this_machine_is_the_single_user_of_an_emulated_cell(
    tmp_path: Path,
) -> None:
    mark = f"OPENPENDANT_PAGE_TEST={tmp_path}"
    name, _, value = mark.partition("=")
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "openpendant.tools.start_page"),
        *("--no-open", "--port", "0", "--store", "off"),
        stdout=asyncio.subprocess.PIPE,
        env={**os.environ, name: value, "TMPDIR": str(tmp_path)},
    )
    assert process.stdout is not None
    said = (await asyncio.wait_for(process.stdout.readline(), PATIENCE)).decode()
    page = next(word for word in said.split() if word.startswith("http://127.0.0.1:"))
    async with ClientSession() as session:
        listed = await (await session.get(f"{page}servers")).json()
        (server,) = listed["servers"]
        tab = Tab(await session.ws_connect(f"{page}servers/{server['name']}"))
        await tab.tell(Lobby(1))
        (cell,) = json.loads((await tab.answer(LobbyReply)).body)["cells"]
        assert (cell["robot"], cell["emulated"], cell["login_needed"]) == ("ur5", True, False)
        await tab.tell(Hello(PROTOCOL_VERSION, 0.0, "", "page"))
        await tab.answer(HelloReply)
        await tab.tell(Management(2, b'{"op": "access.whoami"}'))
        whoami = json.loads((await tab.answer(Management)).body)
        assert whoami["basis"] == "single user"
    assert modes_of_secrets(tmp_path) == [0o600]
    process.send_signal(signal.SIGINT)
    rest = (await asyncio.wait_for(process.stdout.read(), PATIENCE)).decode()
    assert await process.wait() == 128 + signal.SIGINT
    assert "all three have ended" in rest
    assert left_over(mark, PATIENCE) == {}
