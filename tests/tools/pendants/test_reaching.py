"""What the client says where it reaches no pendant server: whose fault it is, and what to do."""

import asyncio
import contextlib
import errno
import socket
import ssl
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from rigs.peers.scripted_pendant_server import scripted_server
from rigs.peers.tls_certificates import make_certificate
from rigs.processes.judged_server import running_emulator

from openpendant.simplemsg.pendant import Login
from openpendant.simplemsg.verdicts import CATALOGUE, VerdictCode
from openpendant.tools.pendants.client import (
    ConnectionLost,
    NotTrusted,
    NotUnderstood,
    PendantClient,
    PendantError,
    Refused,
    Unreachable,
    WrongArgument,
)
from openpendant.tools.pendants.connection_errors import unreachable

START_ONE = "nobody listens at robot:7; start a server: openpendant serve"
REFUSED = f"[Errno {errno.ECONNREFUSED}] Connect call failed"


@pytest.mark.parametrize(
    ("error", "tls", "said"),
    [
        (ConnectionRefusedError(errno.ECONNREFUSED, "Connect call failed"), False, START_ONE),
        (OSError(f"Multiple exceptions: {REFUSED} ('::1', 7), {REFUSED} (…)"), False, START_ONE),
        (
            socket.gaierror(-2, "Name or service not known"),
            False,
            "no machine is found by .*'robot'",
        ),
        (OSError(errno.EHOSTUNREACH, "No route to host"), False, "robot:7 cannot be reached: No r"),
        (OSError(), False, "robot:7 cannot be reached: OSError; check"),
        (ConnectionResetError(), True, r"robot:7 may not speak TLS \(it closed.*: check the port"),
        (ssl.SSLError(1, "WRONG_VERSION_NUMBER"), True, r"may not speak TLS \(.*WRONG_VERSION"),
    ],
)
def test_a_failure_to_connect_says_where_and_what_to_do(
    error: OSError, tls: bool, said: str
) -> None:
    told = unreachable(error, "robot", 7, tls=tls)
    assert isinstance(told, PendantError)
    assert told.errno == error.errno
    with pytest.raises(OSError, match=said):
        raise told


@pytest.mark.parametrize("port", [0, 65_536, -1, True, 11010.0, "11010"])
async def test_what_is_no_port_is_not_tried(port: Any) -> None:
    with pytest.raises(WrongArgument, match="accepted: a whole number from 1 to 65535"):
        await PendantClient.connect("127.0.0.1", port)


@pytest.mark.parametrize("host", ["a" * 70, "nul\0inside"])
async def test_what_cannot_be_a_host_is_named(host: str) -> None:
    with pytest.raises(WrongArgument, match="is no host"):
        await PendantClient.connect(host, 11010)


def test_a_refusal_is_explained_with_its_remedy_in_one_line() -> None:
    refused = Refused(VerdictCode.STOP_LATCHED, "stopped by anna", -1, 0.0, 0.0)
    remedy = CATALOGUE[VerdictCode.STOP_LATCHED].remedy
    assert refused.explained == f"STOP_LATCHED: stopped by anna -> {remedy}"
    assert refused.__notes__ == [f"Remedy: {remedy}"]
    assert Refused(65_000, "of a newer server", -1, 0.0, 0.0).explained == (
        "65000: of a newer server"
    )


def test_a_failure_without_an_entry_explains_itself() -> None:
    assert ConnectionLost("the server closed the connection").explained == (
        "the server closed the connection"
    )


@asynccontextmanager
async def peer(talk: Callable[[asyncio.StreamWriter], None]) -> AsyncIterator[int]:
    """Listen on a free port of loopback, say something to whoever connects; give the port."""
    writers: list[asyncio.StreamWriter] = []

    def greet(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writers.append(writer)
        talk(writer)

    listener = await asyncio.start_server(greet, "127.0.0.1", 0)
    try:
        yield listener.sockets[0].getsockname()[1]
    finally:
        listener.close()
        for writer in writers:
            writer.close()
            with contextlib.suppress(ConnectionError):
                await writer.wait_closed()


@pytest.mark.virtual_clock
async def test_a_peer_that_says_nothing_is_given_up_after_ten_seconds() -> None:
    began = asyncio.get_running_loop().time()
    async with peer(lambda _: None) as port:
        with pytest.raises(ConnectionLost, match=r"nothing within 10 s.*want TLS.*pendant port"):
            await PendantClient.connect("127.0.0.1", port)
    assert asyncio.get_running_loop().time() - began == pytest.approx(10.0, abs=0.5)


@pytest.mark.virtual_clock
@pytest.mark.parametrize("banner", [b"SSH-2.0-OpenSSH_9.6\r\n", b""])
async def test_a_peer_that_ends_the_connection_may_want_tls_or_is_no_pendant_port(
    banner: bytes,
) -> None:
    def talk(writer: asyncio.StreamWriter) -> None:
        writer.write(banner)
        writer.close()

    async with peer(talk) as port:
        with pytest.raises(
            ConnectionLost, match=rf"127.0.0.1:{port} did not answer the hello .*--ca.*11010"
        ):
            await PendantClient.connect("127.0.0.1", port)


@pytest.mark.realtime
async def test_a_port_of_a_controller_is_not_a_pendant_port() -> None:
    async with running_emulator() as emulator:
        for port in (emulator.motion_port, emulator.state_port):
            assert port is not None
            with pytest.raises(NotUnderstood, match=rf"{port} is not a pendant port \(default"):
                await PendantClient.connect("127.0.0.1", port)


@pytest.mark.realtime
async def test_plain_and_tls_ends_tell_each_other_s_user_what_to_change(tmp_path: Path) -> None:
    certificate, key = make_certificate(tmp_path)
    secured = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    secured.load_cert_chain(certificate, key)
    trusting = ssl.create_default_context(cafile=str(certificate))
    async with scripted_server(secured) as server:
        with pytest.raises(ConnectionLost, match=r"the server may want TLS \(--ca FILE"):
            await PendantClient.connect("127.0.0.1", server.port)
        with pytest.raises(
            NotTrusted, match=r"certificate of .* is not trusted.*--ca FILE"
        ) as told:
            await PendantClient.connect(
                "127.0.0.1", server.port, tls=ssl.create_default_context(), password="secret"
            )
        assert isinstance(told.value, ssl.SSLCertVerificationError)
        assert server.got == []
        async with await PendantClient.connect(
            "127.0.0.1", server.port, tls=trusting, user="ada", password="correct horse"
        ) as pendant:
            await pendant.next_state()
        assert server.one(Login).name == "ada"
    async with peer(lambda writer: writer.transport.abort()) as port:
        with pytest.raises(Unreachable, match=r"may not speak TLS .*: check the port"):
            await PendantClient.connect("127.0.0.1", port, tls=trusting)
