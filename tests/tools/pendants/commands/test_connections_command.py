"""`openpendant connections`: what it shows, closes and bars, and what it exits with."""

import asyncio
import json
from pathlib import Path
from typing import Any

import pytest
from rigs.processes.guarded_server import PASSWORDS, GuardedServer, guarded_server

from openpendant.simplemsg.verdicts import VerdictCode as V
from openpendant.tools.cli import main
from openpendant.tools.pendants.client import PendantClient

pytestmark = pytest.mark.realtime


class Admin:
    """Somebody who types the command."""

    def __init__(self, server: GuardedServer, capsys: pytest.CaptureFixture[str]) -> None:
        self._server = ["--server", f"127.0.0.1:{server.port}"]
        self._capsys = capsys

    async def types(self, *words: str, user: str = "ann") -> tuple[int, str]:
        """Return the exit code, and all that was written."""
        command = ["connections", *self._server, "--user", user, *words]
        code = await asyncio.to_thread(main, command)
        said = self._capsys.readouterr()
        return code, said.out + said.err

    async def lists(self) -> list[dict[str, Any]]:
        code, said = await self.types("--json")
        assert code == 0, said
        return [json.loads(line) for line in said.splitlines()]


@pytest.fixture(autouse=True)
def password(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENPENDANT_PASSWORD", PASSWORDS["ann"])


async def test_an_admin_sees_closes_and_bars(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    async with guarded_server(tmp_path) as server:
        admin = Admin(server, capsys)
        stranger = await PendantClient.connect(port=server.port, client="esc\x1b[31m")
        async with stranger:
            theirs, own = await admin.lists()
            assert (theirs["standing"], theirs["session"]) == ("stranger", stranger.hello.session)
            assert (own["standing"], own["name"], own["role"]) == ("account", "ann", "admin")
            code, said = await admin.types()
            assert code == 0
            assert "stranger" in said
            assert "ann (admin)" in said
            assert "\x1b" not in said
            assert (await admin.types("close", str(theirs["session"])))[0] == 0
            await asyncio.sleep(0.1)
            assert not stranger.is_open
        assert (await admin.types("bar", "192.0.2.66", "--minutes", "90"))[0] == 0
        (bar,) = [each for each in await admin.lists() if each["event"] == "bar"]
        assert bar["address"] == "192.0.2.66"
        assert 80 * 60 < bar["remaining"] <= 90 * 60
        assert (await admin.types("unbar", "192.0.2.66"))[0] == 0
        assert [each["event"] for each in await admin.lists()] == ["connection"]


@pytest.mark.parametrize(
    ("words", "name"),
    [
        (("close", "999999"), V.UNKNOWN_CONNECTION.name),
        (("bar", "127.0.0.1"), V.BAR_REFUSED.name),
        (("bar", "somewhere"), V.BAD_ARGUMENT.name),
        (("unbar", "192.0.2.66"), V.BAD_ARGUMENT.name),
    ],
)
async def test_what_the_server_refuses_is_said_and_fails(
    words: tuple[str, ...], name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    async with guarded_server(tmp_path) as server:
        code, said = await Admin(server, capsys).types(*words)
        assert code == 1
        assert name in said
        assert "Traceback" not in said


async def test_an_operator_may_not(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPENPENDANT_PASSWORD", PASSWORDS["otto"])
    async with guarded_server(tmp_path) as server:
        code, said = await Admin(server, capsys).types(user="otto")
        assert code == 1
        assert V.ROLE_TOO_LOW.name in said


@pytest.mark.parametrize(
    "words",
    [
        ("close",),
        ("close", "x"),
        ("close", "0"),
        ("close", "-1"),
        ("list", "1"),
        ("bar",),
        ("bar", "192.0.2.66", "--minutes", "0"),
        ("bar", "192.0.2.66", "--minutes", "1441"),
        ("open", "1"),
    ],
)
def test_wrong_usage_is_said_before_anybody_is_asked(words: tuple[str, ...]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["connections", *words])
    assert ended.value.code == 2
