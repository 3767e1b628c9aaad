"""Promise 42: whoever speaks version 2 notices nothing of version 3."""

import gzip
import re

import pytest
from frozen.conversations import CONVERSATIONS
from frozen.frozen_files import JOURNALS
from rigs.cells.emulated_cell import EmulatedCell
from rigs.peers.server_clients import Pendant

from openpendant.simplemsg.pendant import (
    ControllerChanged,
    DocumentChanged,
    Hello,
)

HELLO = re.compile(f"54000000{int(Hello.PLACE.msg_type).to_bytes(4, 'little').hex()}".encode())
_OF_VERSION_2 = re.compile(HELLO.pattern + b"0200000000000000" + b"02000000")


@pytest.mark.parametrize("name", CONVERSATIONS)
def test_promise_42_each_recorded_conversation_with_a_pendant_is_of_version_2(name: str) -> None:
    content = gzip.decompress((JOURNALS / f"{name}.server.journal.gz").read_bytes())
    assert len(HELLO.findall(content)) == len(_OF_VERSION_2.findall(content))


def test_promise_42_most_of_what_is_recorded_is_with_pendants() -> None:
    files = [JOURNALS / f"{name}.server.journal.gz" for name in CONVERSATIONS]
    assert sum(bool(HELLO.search(gzip.decompress(file.read_bytes()))) for file in files) >= 10


def conversation(cell: EmulatedCell, pendant: Pendant) -> list[str]:
    """Return all that a pendant of version 2 is told in a session with somebody else beside it."""
    pendant.hello("older", 0.0, version=2)
    other = cell.pendant("newer")
    pendant.ask("frames.show")
    other.ask("programs.create", name="by somebody else")
    cell.wait(100)
    pendant.take()
    pendant.ask("dance")
    pendant.ask("why", kind="jog")
    cell.wait(200)
    return [repr(each) for each in pendant.got]


def test_promise_42_what_the_file_says_of_the_controller_changes_nothing() -> None:
    told = []
    for emulated in (False, True):
        cell = EmulatedCell(has_surroundings=True, controller={"emulated": emulated})
        told.append(conversation(cell, cell.stranger()))
    assert told[0] == told[1]
    assert len(told[0]) > 5


def test_promise_42_no_message_of_version_3_comes() -> None:
    cell = EmulatedCell(has_surroundings=True, controller={"emulated": True})
    pendant = cell.stranger()
    conversation(cell, pendant)
    assert all(each.PLACE.since == 2 for each in pendant.got if hasattr(each, "PLACE"))
    assert not pendant.all(ControllerChanged)
    assert not pendant.all(DocumentChanged)
