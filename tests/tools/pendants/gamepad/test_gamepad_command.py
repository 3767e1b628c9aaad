"""`openpendant gamepad`: arguments, exit codes, and what its user is told at the end."""

import asyncio
import signal
import sys
from pathlib import Path
from typing import Any

import pytest
from rigs.cells.panel_rig import snapshot
from rigs.data.device_bytes import STOP, button, opening
from rigs.peers.plugged_device import PluggedDevice
from rigs.peers.scripted_pendant_server import scripted_server

from openpendant.simplemsg import pendant as messages
from openpendant.tools.console import ExitCode
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.gamepad import cli
from openpendant.tools.pendants.gamepad.settings import GamepadSettings
from openpendant.tools.pendants.panel.command_line import ConnectionFailed, Unusable
from openpendant.tools.pendants.panel.connection import Connect, LogIn, as_nobody


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--server", "here:0"], "gamepad.server: "),
        (["--config", "absent.toml"], "absent.toml: cannot be read: No such file"),
        (["--config", "wrong.toml"], "wrong.toml: gamepad.speed: unknown key"),
        (["--config", "broken.toml"], "broken.toml: is no TOML"),
        (["--ca", "absent.pem"], "absent.pem: "),
        (["--fire"], "--fire"),
    ],
)
def test_wrong_usage_is_one_line_and_begins_nothing(
    arguments: list[str],
    told: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrong.toml").write_text("[gamepad]\nspeed = 1\n")
    (tmp_path / "broken.toml").write_text("[gamepad\n")
    assert cli.main(arguments) == ExitCode.USAGE
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert told in said.err


class Served:
    """What the command would have served, in the place of a server."""

    settings: GamepadSettings
    options: dict[str, Any]
    where: tuple[str, int]
    logins: list[tuple[str, dict[str, str]]]

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.logins = []
        monkeypatch.setattr(cli, "_serve", self.serve)
        monkeypatch.setattr(PendantClient, "connect", self.connect)

    async def connect(self, host: str, port: int, **options: Any) -> "Served":
        self.where, self.options = (host, port), options
        return self

    async def login(self, user: str, **secret: str) -> None:
        self.logins.append((user, secret))

    async def serve(self, settings: GamepadSettings, connect: Connect, log_in: LogIn) -> None:
        self.settings = settings
        await log_in(await connect())


def test_arguments_reach_the_connection_and_arguments_go_before_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    served = Served(monkeypatch)
    file = tmp_path / "pad.toml"
    file.write_text('[gamepad]\ndevice = "/dev/input/js7"\nserver = "far:1"\ndeadline = 0.1\n')
    arguments = ["--config", str(file), "--server", "near:2", "--cell", "left", "--name", "pad"]
    assert cli.main(arguments) == 0
    assert served.settings.device == "/dev/input/js7"
    assert served.where == ("near", 2)
    named = ("cell", "client", "enabling_deadline", "strict")
    assert [served.options[name] for name in named] == ["left", "pad", 0.1, False]
    assert served.logins == []


@pytest.mark.parametrize(
    ("arguments", "login"),
    [
        (["--user", "ada"], ("ada", {"password": "pass word"})),
        (["--pairing", "--user", "kim"], ("kim", {"pairing": "1234"})),
        (["--pairing", "--name", "kims"], ("kims", {"pairing": "1234"})),
    ],
)
def test_a_secret_comes_from_the_environment_or_is_asked_for(
    arguments: list[str], login: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    served = Served(monkeypatch)
    monkeypatch.setenv("OPENPENDANT_PASSWORD", "pass word")
    monkeypatch.setattr("getpass.getpass", lambda _: "1234")
    assert cli.main(arguments) == 0
    assert served.logins == [login]


def test_another_system_is_told_where_to_go(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    Served(monkeypatch)
    monkeypatch.setattr(sys, "platform", "darwin")
    assert cli.main([]) == ExitCode.UNAVAILABLE
    assert "elsewhere use the pendant in a browser" in capsys.readouterr().err


def serving(port: int, device: Path) -> "asyncio.Task[None]":
    settings = GamepadSettings(device=str(device), server=f"127.0.0.1:{port}")

    async def connect() -> PendantClient:
        return await PendantClient.connect("127.0.0.1", port)

    return asyncio.ensure_future(cli._serve(settings, connect, as_nobody))


@pytest.mark.virtual_clock
async def test_a_cell_that_is_not_there_ends_it_as_wrong_usage(tmp_path: Path) -> None:
    async with scripted_server() as server:
        server.cells = ("left", "right")
        with pytest.raises(Unusable, match="here: left, right"):
            await serving(server.port, tmp_path / "js0")


@pytest.mark.virtual_clock
async def test_a_stop_that_was_not_confirmed_is_told_at_the_end(tmp_path: Path) -> None:
    plug = PluggedDevice(tmp_path / "js0")
    plug.plug()
    async with scripted_server() as server:
        server.answers["snapshot"] = {**snapshot()}
        running = serving(server.port, plug.path)
        await asyncio.sleep(0.2)
        server.mutes = True
        plug.write(opening() + button(STOP, down=True))
        await asyncio.sleep(0.2)
        assert server.all(messages.SoftwareStop)
        signal.raise_signal(signal.SIGTERM)
        with pytest.raises(ConnectionFailed, match="ended before its stop was confirmed"):
            await running
    plug.pull()
