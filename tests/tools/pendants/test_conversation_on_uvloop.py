"""The client library in an application that runs on uvloop."""

import asyncio
import socket

import pytest

from openpendant.simplemsg import Message
from openpendant.simplemsg.pendant import AuthorityBeat
from openpendant.tools.pendants.conversation import Conversation

uvloop = pytest.importorskip(
    "uvloop", reason="uvloop is not installed: the extra 'fast' of openpendant adds it"
)


def ignore(_: Message) -> None:
    """Take no interest in the news."""


async def said(near: socket.socket, far: socket.socket) -> bytes:
    """Return what a conversation sends, and wait until it has closed."""
    conversation = Conversation(ignore)
    async with asyncio.timeout(10):
        loop = asyncio.get_running_loop()
        await loop.create_connection(lambda: conversation, sock=near)
        conversation.write(AuthorityBeat())
        data = await loop.sock_recv(far, 64)
        conversation.close()
        await conversation.closed.wait()
    return data


@pytest.mark.realtime
def test_a_pendant_talks_and_takes_its_leave() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        near = socket.create_connection(listener.getsockname())
        far, _ = listener.accept()
    with far:
        for end in (near, far):
            end.setblocking(False)
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            assert len(runner.run(said(near, far))) == 16
