"""What is told to a person who shall attach another pendant, as it has to be typed."""

import asyncio
import sys
from types import SimpleNamespace
from typing import cast

import pytest

from openpendant.tools.pendants import attaching
from openpendant.tools.pendants.attaching import attach_command
from openpendant.tools.pendants.client import PendantClient
from openpendant.tools.pendants.connection_errors import DEFAULT_PORT, server_address
from openpendant.tools.pendants.panel import commands as do
from openpendant.tools.pendants.panel.panel import Panel
from openpendant.tools.pendants.panel.performer import Performer
from openpendant.tools.pendants.terminal import cli
from openpendant.tools.pendants.terminal.app import PendantApp


@pytest.fixture(autouse=True)
def activated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(attaching, "as_typed", lambda: "openpendant")


@pytest.mark.parametrize(
    ("host", "port", "command"),
    [
        ("127.0.0.1", DEFAULT_PORT, "openpendant pendant"),
        ("127.0.0.1", 11011, "openpendant pendant 127.0.0.1:11011"),
        ("192.168.1.20", DEFAULT_PORT, "openpendant pendant 192.168.1.20"),
        ("::1", DEFAULT_PORT, "openpendant pendant [::1]"),
        ("::1", 11011, "openpendant pendant [::1]:11011"),
    ],
)
def test_the_command_names_the_address_where_it_is_not_the_default(
    host: str, port: int, command: str
) -> None:
    assert attach_command(host, port) == command
    for address in command.split()[2:]:
        assert server_address(address) == (host, port)


def test_an_option_is_quoted_where_a_shell_would_part_it() -> None:
    command = attach_command("127.0.0.1", DEFAULT_PORT, "--cell", "cell two")
    assert command == "openpendant pendant --cell 'cell two'"


async def test_a_pairing_code_stands_with_the_address_of_its_server() -> None:
    panel = Panel()
    panel.attach_command = attach_command("127.0.0.1", 11011)

    async def issued() -> str:
        return "123456"

    performer = Performer(cast(PendantClient, SimpleNamespace(issue_pairing_code=issued)), panel)
    performer.perform([do.AskPairingCode()])
    for _ in range(5):
        await asyncio.sleep(0)
    await performer.close()
    told = "pairing code 123456: openpendant pendant 127.0.0.1:11011 --pairing"
    assert panel.messages.newest == told


def test_the_pendant_knows_the_command_for_the_server_and_cell_it_was_given(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    known: list[str] = []

    def run(self: PendantApp, **options: object) -> None:
        known.append(self.panel.attach_command)

    monkeypatch.setattr(PendantApp, "run", run)
    monkeypatch.setattr(cli, "end_with_terminal", lambda descriptors: None)
    for stream in ("stdin", "stdout", "stderr"):
        terminal = SimpleNamespace(isatty=lambda: True, fileno=lambda: 0, write=len, flush=int)
        monkeypatch.setattr(sys, stream, terminal)
    assert cli.main(["127.0.0.1:11011", "--cell", "left"]) == 0
    assert known == ["openpendant pendant 127.0.0.1:11011 --cell left"]
