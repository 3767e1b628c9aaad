"""Passwords and pairing codes that would leave in clear text for another machine.

The scripted server is on this machine; where a test says so, its address counts as another's.
"""

import asyncio
import re
import ssl
import warnings
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from rigs.peers.scripted_pendant_server import ScriptedPendantServer, scripted_server
from rigs.peers.tls_certificates import make_certificate

from openpendant.simplemsg.pendant import Login, SetAccount, SoftwareStop
from openpendant.tools import why
from openpendant.tools.pendants import conversation
from openpendant.tools.pendants.client import (
    ConnectionLost,
    PendantClient,
    SecretUnprotected,
    SecretUnprotectedWarning,
)
from openpendant.tools.pendants.commands import home, reset, run, stop
from openpendant.tools.pendants.connection_errors import unanswered, unreachable
from openpendant.tools.pendants.conversation import Conversation, is_own_address
from openpendant.tools.pendants.roboanalyzer import RoboAnalyzerClient
from openpendant.tools.pendants.sync_client import SyncPendantClient
from openpendant.tools.pendants.terminal import cli as pendant

pytestmark = pytest.mark.realtime

PASSWORD = "canary-in-clear-4711"
CODE = "CAN4RY"


@pytest.fixture
def elsewhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Makes every server one on another machine."""
    monkeypatch.setattr(conversation, "is_own_address", lambda *_: False)


@pytest.mark.parametrize(
    ("peer", "own", "is_own"),
    [
        ("127.0.0.1", "127.0.0.1", True),
        ("127.8.9.1", "127.0.0.1", True),
        ("::1", "::1", True),
        ("::ffff:127.0.0.1", "::ffff:127.0.0.2", True),
        ("192.0.2.5", "192.0.2.5", True),
        ("fe80::1%eth0", "fe80::1%eth0", True),
        ("192.0.2.5", "192.0.2.6", False),
        ("fe80::1%eth0", "fe80::2%eth0", False),
        ("::ffff:192.0.2.5", "::ffff:192.0.2.6", False),
        ("2001:db8::1", "2001:db8::2", False),
    ],
)
def test_an_address_is_this_machines_own_if_it_is_loopback_or_the_same_at_both_ends(
    peer: str, own: str, is_own: bool
) -> None:
    assert is_own_address(peer, own) == is_own


class Wire(asyncio.Transport):
    """A transport between two addresses that sends nothing."""

    def __init__(self, peer: str, own: str, context: ssl.SSLContext | None) -> None:
        encrypted = None if context is None else type("Encrypted", (), {"context": context})
        super().__init__({"peername": (peer, 1), "sockname": (own, 2), "ssl_object": encrypted})


def unverified() -> ssl.SSLContext:
    context = ssl.create_default_context()
    context.check_hostname = False
    context.verify_mode = ssl.CERT_NONE
    return context


@pytest.mark.parametrize(
    ("peer", "context", "said"),
    [
        ("192.0.2.5", None, "in clear text for 192.0.2.5"),
        ("192.0.2.5", unverified(), "for 192.0.2.5 behind a certificate that nobody verified"),
        ("192.0.2.5", ssl.create_default_context(), ""),
        ("192.0.2.6", None, ""),
        ("127.0.0.1", None, ""),
    ],
)
def test_what_is_unprotected_is_known_from_addresses_and_certificate(
    peer: str, context: ssl.SSLContext | None, said: str
) -> None:
    talk = Conversation(lambda _: None)
    talk._transport = Wire(peer, "192.0.2.6", context)
    assert talk.unprotected == said


def test_what_goes_to_an_address_that_is_not_known_is_unprotected() -> None:
    talk = Conversation(lambda _: None)
    talk._transport = asyncio.Transport({"peername": None, "sockname": ("192.0.2.6", 2)})
    assert talk.unprotected == "in clear text for an unknown address"


@pytest.mark.parametrize("tls", [False, True])
@pytest.mark.parametrize(
    "error",
    [
        ConnectionRefusedError(),
        ConnectionResetError(),
        ssl.SSLError(1, "WRONG_VERSION_NUMBER"),
        OSError("away"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_no_failure_to_connect_advises_to_go_without_tls(error: OSError, tls: bool) -> None:
    told = str(unreachable(error, "robot", 7, tls=tls))
    told += str(unanswered(ConnectionLost("it ended"), "robot", 7, tls=tls))
    assert not re.search(r"\bleave\b|\bwithout\b|\bomit|\bdrop", told)


Send = Callable[[PendantClient], Awaitable[None]]

SECRETS: dict[str, tuple[Send, type[Login] | type[SetAccount]]] = {
    "a password": (lambda client: client.login("ada", password=PASSWORD), Login),
    "a pairing code": (lambda client: client.login("kim", pairing=CODE), Login),
    "a password of another": (
        lambda client: client.add_account("eve", "viewer", PASSWORD),
        SetAccount,
    ),
    "a new password": (lambda client: client.set_password("eve", PASSWORD), SetAccount),
}


@pytest.mark.parametrize("name", SECRETS)
async def test_a_secret_that_leaves_in_clear_text_is_warned_of_before_it_leaves(
    name: str, elsewhere: None
) -> None:
    send, kind = SECRETS[name]
    async with scripted_server() as server:
        async with await PendantClient.connect(port=server.port) as client:
            # A warning that is an error is raised where it would be told: nothing has left yet.
            with pytest.raises(SecretUnprotectedWarning, match="leaves in clear text for 127"):
                await send(client)
            await client.next_state()
            assert server.all(kind) == []
            with pytest.warns(SecretUnprotectedWarning, match=r"use TLS \(--ca FILE, in Python"):
                await send(client)
            assert len(server.all(kind)) == 1


@pytest.mark.parametrize("name", SECRETS)
async def test_a_strict_client_sends_no_secret_in_clear_text(name: str, elsewhere: None) -> None:
    send, kind = SECRETS[name]
    async with scripted_server() as server:
        async with await PendantClient.connect(port=server.port, strict=True) as client:
            with pytest.raises(SecretUnprotected, match=r"not sent: .* clear text for 127") as no:
                await send(client)
            assert PASSWORD not in str(no.value)
            assert CODE not in str(no.value)
            # Anybody may stop, whoever listens.
            await client.stop("a test")
        assert server.all(kind) == []
        assert len(server.all(SoftwareStop)) == 1


async def test_a_secret_within_this_machine_or_behind_a_certificate_is_sent_without_a_word(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    certificate, key = make_certificate(tmp_path)
    secured = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    secured.load_cert_chain(certificate, key)
    trusting = ssl.create_default_context(cafile=str(certificate))
    login = {"user": "ada", "password": PASSWORD, "strict": True}
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        async with scripted_server() as server:
            async with await PendantClient.connect(port=server.port, **login):  # type: ignore[arg-type]
                assert server.one(Login).secret == PASSWORD
        monkeypatch.setattr(conversation, "is_own_address", lambda *_: False)
        async with scripted_server(secured) as server:
            async with await PendantClient.connect(port=server.port, tls=trusting, **login):  # type: ignore[arg-type]
                assert server.one(Login).secret == PASSWORD
    assert [each for each in told if each.category is SecretUnprotectedWarning] == []


Command = Callable[[list[str]], int]

COMMANDS: dict[str, tuple[Command, list[str]]] = {
    "home": (home.main, ["--server"]),
    "run": (run.main, ["cutting", "--server"]),
    "reset": (reset.main, ["--yes", "--server"]),
    "why": (why.main, []),
    "pendant": (pendant.main, ["--plain"]),
}
"""Each command that logs in, with what stands before the server's address."""

SNAPSHOT: dict[str, Any] = {
    "robot": "ur5",
    "joints": [
        {"name": f"joint {n}", "unit": "rad", "lower": -2.0, "upper": 2.0} for n in "123456"
    ],
    "frames": ["base"],
    "program": None,
    "owner": None,
    "stop": None,
}


@pytest.fixture
async def told(
    elsewhere: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., Awaitable[tuple[int, str, ScriptedPendantServer]]]:
    """Run a command against a server on another machine; its exit code and what it said."""
    monkeypatch.setenv("OPENPENDANT_PASSWORD", PASSWORD)
    monkeypatch.setattr("getpass.getpass", lambda _: CODE)

    async def begin(name: str, *more: str) -> tuple[int, str, ScriptedPendantServer]:
        main, before = COMMANDS[name]
        async with scripted_server() as server:
            server.answers["snapshot"] = SNAPSHOT
            where = f"127.0.0.1:{server.port}"
            code = await asyncio.to_thread(main, [*before, where, *more])
            return code, capsys.readouterr().err, server

    return begin


@pytest.mark.parametrize("secret", [["--user", "ada"], ["--pairing", "--user", "kim"]])
@pytest.mark.parametrize("name", COMMANDS)
async def test_every_command_that_logs_in_warns_in_one_line(
    name: str, secret: list[str], told: Any
) -> None:
    if name == "why" and "--pairing" in secret:
        pytest.skip("why has no pairing")
    _, said, server = await told(name, *secret)
    (warning,) = [line for line in said.splitlines() if "clear text" in line]
    assert warning.startswith(f"openpendant {name}: warning: a p")
    assert server.all(Login)
    assert PASSWORD not in said
    assert CODE not in said


@pytest.mark.parametrize("name", COMMANDS)
async def test_every_command_that_logs_in_sends_nothing_where_it_is_strict(
    name: str, told: Any
) -> None:
    code, said, server = await told(name, "--user", "ada", "--strict")
    assert code == 2
    (line,) = said.splitlines()
    assert line.startswith(f"openpendant {name}: not sent: a password leaves in clear text")
    assert server.all(Login) == []


async def test_a_stop_needs_no_secret_and_has_no_warning(
    elsewhere: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("OPENPENDANT_PASSWORD", PASSWORD)
    async with scripted_server() as server:
        assert await asyncio.to_thread(stop.main, ["--server", f"127.0.0.1:{server.port}"]) == 0
        assert server.all(SoftwareStop)
        assert server.all(Login) == []
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("connect", [SyncPendantClient.connect, RoboAnalyzerClient])
async def test_the_blocking_clients_are_strict_likewise(connect: Any, elsewhere: None) -> None:
    async with scripted_server() as server:

        def enter() -> None:
            connect(port=server.port, user="ada", password=PASSWORD, strict=True)

        with pytest.raises(SecretUnprotected):
            await asyncio.to_thread(enter)
        assert server.all(Login) == []


async def test_the_full_screen_pendant_shows_the_warning_and_ends_where_it_is_strict(
    elsewhere: None,
) -> None:
    from openpendant.tools.pendants.credentials import told_of_unprotected_secrets
    from openpendant.tools.pendants.terminal.app import PendantApp

    async def log_in(client: PendantClient) -> None:
        await client.login("ada", password=PASSWORD)

    for strict in (False, True):
        async with scripted_server() as server:
            server.answers["snapshot"] = SNAPSHOT

            async def connect(port: int = server.port, strict: bool = strict) -> PendantClient:
                return await PendantClient.connect(port=port, state_rate=25, strict=strict)

            app = PendantApp(connect, log_in)
            with told_of_unprotected_secrets(app.panel.messages.add):
                async with app.run_test() as pilot:
                    async with asyncio.timeout(20):
                        while not (app.panel.messages.lines if not strict else app._exit):
                            await pilot.pause(0.02)
            if strict:
                assert isinstance(app.return_value, SecretUnprotected)
                assert server.all(Login) == []
            else:
                assert "in clear text" in app.panel.messages.lines[0]
