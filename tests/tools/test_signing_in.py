"""`openpendant why` and `openpendant pendant` at a server with TLS and accounts."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from pathlib import Path

import pytest
from guarded_server import PASSWORDS, GuardedServer, guarded_server
from tls_certificates import make_certificate

from openpendant.tools import why
from openpendant.tools.pendants.terminal import cli as pendant

pytestmark = [pytest.mark.realtime, pytest.mark.asyncio]

Command = Callable[[list[str]], int]

PLAIN: dict[str, tuple[Command, list[str], tuple[int, ...]]] = {
    "why": (why.main, [], (0, 1)),
    "pendant": (pendant.main, ["--plain"], (0,)),
}
"""Each command, what makes it need no terminal, and its exit codes where the server answers."""


async def run(
    server: GuardedServer, name: str, ca: Path, capsys: pytest.CaptureFixture[str]
) -> tuple[bool, str]:
    """Run a command against a server as otto; return whether it was answered, and what was said."""
    main, more, good = PLAIN[name]
    arguments = [f"127.0.0.1:{server.port}", "--ca", str(ca), "--user", "otto", *more]
    code = await asyncio.to_thread(main, arguments)
    said = capsys.readouterr()
    return code in good, said.out + said.err


@pytest.mark.parametrize("name", PLAIN)
async def test_a_user_comes_in_with_a_certificate_and_a_password_that_is_no_argument(
    name: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
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
