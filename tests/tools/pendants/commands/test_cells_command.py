"""`openpendant cells`: what it lists without a login, and what it exits with."""

import asyncio
import json
import socket
from pathlib import Path

import pytest
from rigs.processes.guarded_server import guarded_server

from openpendant.tools.cli import main

pytestmark = pytest.mark.realtime


async def types(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    code = await asyncio.to_thread(main, ["cells", *words])
    said = capsys.readouterr()
    return code, said.out, said.err


async def test_it_lists_the_cells_without_a_login(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    async with guarded_server(tmp_path) as server:
        at = ("--server", f"127.0.0.1:{server.port}")
        code, out, _ = await types(capsys, *at)
        as_json = await types(capsys, *at, "--json")
    assert code == 0
    assert out.split("  ", 1)[0] == "cell"
    assert "Universal Robots UR5 (CB3), " in out
    assert "login needed, free" in out
    assert as_json[0] == 0
    told = json.loads(as_json[1])
    assert (told["event"], told["cell"], told["login_needed"]) == ("cell", "cell", True)


async def test_without_a_server_it_says_so(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        port = unused.getsockname()[1]
    code, out, err = await types(capsys, "--server", f"127.0.0.1:{port}")
    assert (code, out) == (69, "")
    assert err.startswith("openpendant cells: ")
