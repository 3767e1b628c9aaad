"""Commands and clients come in at a server with TLS, accounts and a pairing code."""

import asyncio
import ssl
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from rigs.peers.tls_certificates import make_certificate
from rigs.processes.guarded_server import PASSWORDS, GuardedServer, cheap_logins, guarded_server

from openpendant.tools import why
from openpendant.tools.pendants.client import AccountRole, PendantClient, Refused, WrongArgument
from openpendant.tools.pendants.commands import home, reset, stop
from openpendant.tools.pendants.roboanalyzer import RoboAnalyzerClient
from openpendant.tools.pendants.terminal import cli as pendant

pytestmark = pytest.mark.realtime

Command = Callable[[list[str]], int]

PLAIN: dict[str, tuple[Command, list[str], tuple[int, ...]]] = {
    "why": (why.main, [], (0, 1)),
    "pendant": (pendant.main, ["--plain"], (0,)),
    "reset": (reset.main, ["--yes"], (0,)),
}
"""Each command, what makes it need no terminal, and its exit codes where the server answers."""


@pytest.fixture(autouse=True)
def _cheap_logins() -> Iterator[None]:
    with cheap_logins():
        yield


def _address(name: str, port: int) -> list[str]:
    where = f"127.0.0.1:{port}"
    return ["--server", where] if name == "reset" else [where]


async def run(
    server: GuardedServer, name: str, ca: Path, capsys: pytest.CaptureFixture[str]
) -> tuple[bool, str]:
    """Run a command against a server as otto; return whether it was answered, and what was said."""
    main, more, good = PLAIN[name]
    arguments = [*_address(name, server.port), "--ca", str(ca), "--user", "otto", *more]
    code = await asyncio.to_thread(main, arguments)
    said = capsys.readouterr()
    return code in good, said.out + said.err


@pytest.mark.parametrize("name", PLAIN)
async def test_a_user_comes_in_with_a_certificate_and_a_password_that_is_no_argument(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    certificate, key = make_certificate(tmp_path)
    (tmp_path / "other").mkdir()
    stranger, _ = make_certificate(tmp_path / "other")
    tls = {"certificate": str(certificate), "key": str(key)}
    async with guarded_server(tmp_path, tls=tls) as server:
        monkeypatch.setenv("OPENPENDANT_PASSWORD", PASSWORDS["otto"])
        answered, said = await run(server, name, certificate, capsys)
        assert answered, said

        answered, said = await run(server, name, stranger, capsys)
        assert not answered
        assert "certificate" in said

        monkeypatch.setenv("OPENPENDANT_PASSWORD", "wrong password")
        answered, said = await run(server, name, certificate, capsys)
        assert not answered
        assert "Traceback" not in said

        monkeypatch.delenv("OPENPENDANT_PASSWORD")
        monkeypatch.setattr("getpass.getpass", lambda _: PASSWORDS["otto"])
        answered, said = await run(server, name, certificate, capsys)
        assert answered, said
        assert all(secret not in said for secret in PASSWORDS.values())


async def test_a_class_comes_in_by_its_code_without_an_account(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    async with guarded_server(tmp_path) as server:
        address = ("127.0.0.1", server.port)
        async with await PendantClient.connect(
            *address, user="ann", password=PASSWORDS["ann"]
        ) as ann:
            code = await ann.issue_pairing_code()
            async with await PendantClient.connect(*address, client="kim", pairing=code) as kim:
                assert (await kim.access.whoami())["name"] == "kim"
                # The names of guests tell them apart.
                with pytest.raises(Refused, match="NAME_TAKEN"):
                    await PendantClient.connect(*address, client="kim", pairing=code)

            monkeypatch.setattr("getpass.getpass", lambda _: code)
            arguments = [f"127.0.0.1:{server.port}", "--plain", "--pairing", "--name", "lee"]
            assert await asyncio.to_thread(pendant.main, arguments) == 0
            assert "ur5" in capsys.readouterr().out


async def test_roboanalyzer_s_calls_come_in_with_password_and_certificate(tmp_path: Path) -> None:
    certificate, key = make_certificate(tmp_path)
    trusted = ssl.create_default_context(cafile=str(certificate))

    def drive(port: int) -> float:
        with RoboAnalyzerClient(
            "127.0.0.1", port, tls=trusted, user="otto", password=PASSWORDS["otto"]
        ) as robot:
            robot.LoadRobot("ur5")  # the cell that is loaded already
            return len(robot.UpdateRobot().joints)

    tls = {"certificate": str(certificate), "key": str(key)}
    async with guarded_server(tmp_path, tls=tls) as server:
        assert await asyncio.to_thread(drive, server.port) == 6


async def test_an_account_is_added_with_its_role_or_the_word_for_it(tmp_path: Path) -> None:
    added: dict[str, AccountRole | str] = {
        "nina": "operator",
        "mike": "ADMIN",
        "vera": AccountRole.VIEWER,
    }
    async with (
        guarded_server(tmp_path) as server,
        await PendantClient.connect(
            "127.0.0.1", server.port, user="ann", password=PASSWORDS["ann"]
        ) as ann,
    ):
        for name, role in added.items():
            await ann.add_account(name, role, "correct horse battery")
        roles = {each["name"]: each["role"] for each in (await ann.users.list())["users"]}
        assert [roles[name] for name in added] == ["operator", "admin", "viewer"]
        with pytest.raises(WrongArgument, match="accepted: viewer, operator, programmer, admin"):
            await ann.add_account("olaf", "boss", "correct horse battery")


@pytest.mark.parametrize("name", PLAIN)
@pytest.mark.parametrize(
    ("is_secured", "told"),
    [
        (True, "the server may want TLS (--ca FILE"),
        (False, "may not speak TLS"),
    ],
)
async def test_tls_on_one_side_only_is_told_with_what_to_change(
    name: str, is_secured: bool, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    certificate, key = make_certificate(tmp_path)
    command, more, _ = PLAIN[name]
    tls = {"certificate": str(certificate), "key": str(key)} if is_secured else {}
    option = [] if is_secured else ["--ca", str(certificate)]
    async with guarded_server(tmp_path, tls=tls) as server:
        assert await asyncio.to_thread(command, [*_address(name, server.port), *option, *more])
    said = capsys.readouterr().err
    assert told in said
    assert said.count("\n") == 1


async def test_a_stop_asks_nobody_who_he_is_and_a_motion_does(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENPENDANT_PASSWORD", raising=False)
    monkeypatch.setattr("getpass.getpass", lambda _: pytest.fail("a password was asked for"))
    async with guarded_server(tmp_path) as server:
        where = ["--server", f"127.0.0.1:{server.port}"]
        assert await asyncio.to_thread(stop.main, where) == 0
        assert server.app.cells[0].core.cell.stop is not None
        assert await asyncio.to_thread(home.main, where) == 1
        assert "LOGIN_NEEDED" in capsys.readouterr().err
