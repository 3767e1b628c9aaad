"""`openpendant web`: its ready line, its exit codes, and a process that stands still a while."""

import asyncio
import json
import signal
import socket
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from aiohttp import ClientSession
from rigs.clock.busy_machine import PATIENCE
from rigs.peers.loopback_peers import PING, Server
from rigs.processes.web_gateway import SECRET

from openpendant.tools.console import ExitCode
from openpendant.tools.pendants.web.cli import main
from openpendant.tools.pendants.web.relay import Ending

pytestmark = pytest.mark.realtime


@pytest.fixture
def secret(tmp_path: Path) -> str:
    file = tmp_path / "secret"
    file.write_text(SECRET)
    file.chmod(0o600)
    return str(file)


NOBODY = ("--server", "127.0.0.1:1")

REFUSED: dict[str, tuple[tuple[str, ...], ExitCode, str]] = {
    "a port beyond all": (("--port", "70000"), ExitCode.USAGE, "port"),
    "no such option": (("--prot", "1"), ExitCode.USAGE, "--prot"),
    "a file that is not there": (("--config", "none.toml"), ExitCode.USAGE, "none.toml"),
    "no server's address": (("--server", "127.0.0.1:0"), ExitCode.USAGE, "HOST or HOST:PORT"),
    "no certificate": (("--ca", "none.pem"), ExitCode.USAGE, "none.pem"),
    "others, without a secret": (("--host", "0.0.0.0"), ExitCode.USAGE, "[[gateways]]"),
    "a gateway without a file": (("--gateway", "web"), ExitCode.USAGE, "secret_file"),
}


@pytest.mark.parametrize(("arguments", "code", "said"), REFUSED.values(), ids=list(REFUSED))
def test_what_cannot_be_served_is_said_in_one_line(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], code: ExitCode, said: str
) -> None:
    assert main(arguments) == code
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("openpendant web: ")
    assert said in line


def test_a_port_that_somebody_has_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert main(["--port", str(port)]) == ExitCode.REFUSED
    assert f"127.0.0.1:{port}" in capsys.readouterr().err


def test_a_server_that_cannot_be_asked_is_unavailable(
    capsys: pytest.CaptureFixture[str], secret: str
) -> None:
    code = main(["--host", "0.0.0.0", "--port", "0", "--secret-file", secret, *NOBODY])
    assert code == ExitCode.UNAVAILABLE
    assert "nobody listens at 127.0.0.1:1" in capsys.readouterr().err


def test_arguments_go_before_the_file(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    file = tmp_path / "web.toml"
    file.write_text('host = "0.0.0.0"\nport = 0\n[[servers]]\nname = "x"\naddress = "x"\n')
    assert main(["--config", str(file)]) == ExitCode.USAGE
    assert "every browser would count as this machine" in capsys.readouterr().err
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        own = ["--host", "127.0.0.1", "--port", str(taken.getsockname()[1])]
        assert main(["--config", str(file), *own]) == ExitCode.REFUSED


@asynccontextmanager
async def web(*arguments: str) -> AsyncIterator[tuple[asyncio.subprocess.Process, str]]:
    """Run the command; yields it and the address of its page."""
    command = [sys.executable, "-m", "openpendant.tools", "web", "--port", "0", "--json"]
    process = await asyncio.create_subprocess_exec(
        *command, *arguments, stdout=asyncio.subprocess.PIPE
    )
    try:
        assert process.stdout is not None
        line = await asyncio.wait_for(process.stdout.readline(), PATIENCE)
        ready = json.loads(line)
        assert ready["event"] == "ready"
        assert ready["pid"] == process.pid
        yield process, ready["page"]
    finally:
        if process.returncode is None:
            process.send_signal(signal.SIGCONT)
            process.terminate()
            await asyncio.wait_for(process.wait(), PATIENCE)


async def test_what_a_tab_said_while_the_gateway_stood_still_arrives_whole_and_in_order() -> None:
    server = Server()
    await server.start()
    async with (
        web("--server", f"cell=127.0.0.1:{server.port}") as (process, page),
        ClientSession() as session,
        session.ws_connect(f"{page}servers/cell") as tab,
    ):
        stream = await server.next()
        await tab.send_bytes(PING)
        assert await stream.read(16) == PING
        process.send_signal(signal.SIGSTOP)
        for _ in range(5):
            await tab.send_bytes(PING + PING)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(stream.reader.read(1), 0.2)
        process.send_signal(signal.SIGCONT)
        assert await stream.read(160) == PING * 10
        await tab.send_bytes(PING)
        assert await stream.read(16) == PING
    await server.close()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
async def test_an_interrupted_gateway_ends_its_tabs_and_itself_in_order(
    number: signal.Signals,
) -> None:
    server = Server()
    await server.start()
    async with (
        web("--server", f"cell=127.0.0.1:{server.port}") as (process, page),
        ClientSession() as session,
        session.ws_connect(f"{page}servers/cell") as tab,
    ):
        stream = await server.next()
        process.send_signal(number)
        message = await tab.receive(timeout=PATIENCE)
        assert (message.data, message.extra) == (Ending.GOING_AWAY, "the gateway ends")
        assert await stream.rest() == b""
        assert await asyncio.wait_for(process.wait(), PATIENCE) == 0
    await server.close()
