"""`openpendant users pair`: an admin gets a code that a guest may use, and ends it."""

import asyncio
import json
from pathlib import Path

import pytest
from rigs.processes.guarded_server import PASSWORDS, GuardedServer, guarded_server

from openpendant.tools.cli import main
from openpendant.tools.pendants.client import PendantClient, Refused

pytestmark = pytest.mark.realtime


async def types(server: GuardedServer, user: str, *words: str) -> int:
    command = ["users", "pair", "--server", f"127.0.0.1:{server.port}", "--user", user, *words]
    return await asyncio.to_thread(main, command)


async def test_an_admin_gets_a_code_with_which_a_guest_logs_in_until_it_is_ended(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPENPENDANT_PASSWORD", PASSWORDS["ann"])
    async with guarded_server(tmp_path) as server:
        assert await types(server, "ann", "--json") == 0
        code = json.loads(capsys.readouterr().out)["code"]
        async with await PendantClient.connect(port=server.port, user="kim", pairing=code) as guest:
            assert (await guest.access.whoami())["role"] == "operator"
        assert await types(server, "ann", "--end") == 0
        with pytest.raises(Refused):
            await PendantClient.connect(port=server.port, user="lea", pairing=code)


async def test_the_code_stands_with_the_command_for_this_very_server(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPENPENDANT_PASSWORD", PASSWORDS["ann"])
    async with guarded_server(tmp_path) as server:
        assert await types(server, "ann") == 0
        told = f"openpendant pendant 127.0.0.1:{server.port} --pairing\n"
        assert capsys.readouterr().out.endswith(told)


async def test_nobody_but_an_admin_gets_one(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    who = next(name for name in PASSWORDS if name != "ann")
    monkeypatch.setenv("OPENPENDANT_PASSWORD", PASSWORDS[who])
    async with guarded_server(tmp_path) as server:
        assert await types(server, who) == 1
        assert capsys.readouterr().err.startswith("openpendant users pair: ")
