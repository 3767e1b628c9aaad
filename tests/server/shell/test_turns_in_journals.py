"""Journals of turns that ended by their cost, and of bodies that were read elsewhere, run again."""

import asyncio
import json
import socket
from pathlib import Path

import pytest
from rigs.cells.journalled_cell import journalled_cell
from rigs.clock.virtual_clock import VirtualLoop
from rigs.processes.app_on_loop import said

from openpendant.server.planning.jobs import BodyRead
from openpendant.server.shell import client_connection
from openpendant.simplemsg import Message
from openpendant.simplemsg.codec import PENDANT, codec_for
from openpendant.simplemsg.pendant import (
    Authority,
    AuthorityAction,
    Management,
    ResetStop,
    SoftwareStop,
)
from openpendant.tools.packets.journals.reenactment import rerun

pytestmark = pytest.mark.virtual_clock

CODEC = codec_for(PENDANT)
LARGE = 5_000


def frames(*messages: Message) -> bytes:
    return b"".join(map(CODEC.encode, messages))


def question(number: int, size: int = 0) -> Management:
    return Management(number, json.dumps({"op": "why"}).encode().ljust(size))


def kept(folder: Path, loop: VirtualLoop, *said_then: bytes, leaves: bool = False) -> Path:
    """Keep the journal of a pendant that says something every 20 ms; return its file."""
    file = folder / "server.journal"

    async def live() -> None:
        running = asyncio.get_running_loop()
        async with journalled_cell(folder / "emulator.journal", file) as cell:
            sock = socket.socket()
            sock.setblocking(False)
            await running.sock_connect(sock, ("127.0.0.1", cell.pendant_port))
            await running.sock_sendall(sock, said(Authority(1, AuthorityAction.REQUEST)))
            await asyncio.sleep(0.05)
            for data in said_then:
                await running.sock_sendall(sock, data)
                if not leaves:
                    await asyncio.sleep(0.02)
            sock.close()
            await asyncio.sleep(0.3)

    loop.run_until_complete(live())
    return file


def asks(file: Path, question: str) -> list[str]:
    lines = map(json.loads, file.read_text("ascii").splitlines())
    return [line["link"] for line in lines if line.get("ask") == question]


def planned(file: Path) -> list[str]:
    lines = map(json.loads, file.read_text("ascii").splitlines())
    return [line["kind"] for line in lines if line.get("on") == "planned" and "kind" in line]


SAID = (
    frames(*(question(number) for number in range(2, 30))),
    frames(question(30, LARGE), question(31), SoftwareStop(32, "now"), ResetStop(33)),
    frames(question(34, LARGE), question(35)),
)


@pytest.mark.parametrize("share", [0, 10**15], ids=["a frame each", "sixteen frames each"])
def test_a_run_whose_turns_ended_by_their_cost_runs_again_with_identical_bytes(
    share: int, tmp_path: Path, virtual_loop: VirtualLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_connection, "TURN_NS", share)
    file = kept(tmp_path, virtual_loop, *SAID)
    turns = asks(file, "turn")
    assert not turns if share else len(turns) > 28
    assert asks(file, "apart") == ["1", "1"]
    assert planned(file) == [BodyRead.__name__] * 2
    # By the journal alone, however fast the machine is that runs it again.
    monkeypatch.setattr(client_connection, "TURN_NS", 10**15 - share)
    outcome = rerun(file)
    assert (outcome.difference, outcome.is_cut) == (None, False)


def test_a_run_in_which_clients_waited_for_their_share_runs_again_with_identical_bytes(
    tmp_path: Path, virtual_loop: VirtualLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_connection, "SHARE_NS", 0)
    file = kept(tmp_path, virtual_loop, *SAID)
    assert "1/0" in asks(file, "turn")
    monkeypatch.undo()
    outcome = rerun(file)
    assert (outcome.difference, outcome.is_cut) == (None, False)


def test_a_turn_that_ended_elsewhere_is_told(
    tmp_path: Path, virtual_loop: VirtualLoop, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(client_connection, "TURN_NS", 0)
    file = kept(tmp_path, virtual_loop, *SAID)
    lines = file.read_text("ascii").splitlines(keepends=True)
    (at, *_) = [number for number, line in enumerate(lines) if '"ask": "turn"' in line]
    file.write_text("".join(lines[:at] + lines[at + 1 :]), "ascii")
    assert rerun(file).difference is not None


def test_a_body_that_outlived_its_connection_runs_again(
    tmp_path: Path, virtual_loop: VirtualLoop
) -> None:
    file = kept(tmp_path, virtual_loop, frames(question(2, LARGE), question(3)), leaves=True)
    assert asks(file, "apart") == ["1"]
    outcome = rerun(file)
    assert (outcome.difference, outcome.is_cut) == (None, False)
