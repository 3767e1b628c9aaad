"""The gateway between tabs and a server that does as it is told."""

import asyncio
import socket
import ssl
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from aiohttp import WSServerHandshakeError
from rigs.peers.loopback_peers import PING, PONG, Server, Stream
from rigs.peers.tls_certificates import make_certificate
from rigs.processes.web_gateway import (
    LOOPBACK,
    SECRET,
    WEB,
    DeafTab,
    frames_in,
    running_gateway,
)

from openpendant.simplemsg import PENDANT, ByteOrder, codec_for
from openpendant.simplemsg.pendant import Forwarded, State
from openpendant.tools.pendants.web import cli, relay
from openpendant.tools.pendants.web.relay import Ending

BIG_PING = bytes.fromhex("0000000c000000010000000200000000")
BELIEVED = bytes.fromhex("0c0000001afe00000300000001000000")
DOUBTED = bytes.fromhex("0c0000001afe00000300000002000000")
STATE = State.PLACE.msg_type


def frame(msg_type: int, size: int, mark: int = 0) -> bytes:
    """Return a little-endian topic of any size."""
    head = [size - 4, msg_type, 1, 0, mark]
    return b"".join(each.to_bytes(4, "little") for each in head).ljust(size, b"\0")


@pytest.fixture
async def server() -> AsyncIterator[Server]:
    running = Server()
    await running.start()
    yield running
    await running.close()


async def is_over(stream: Stream) -> bool:
    """Wait for the end of a connection; return whether nothing more had come."""
    return await stream.rest() == b""


async def test_what_a_tab_puts_into_one_message_reaches_the_server_in_order(
    server: Server,
) -> None:
    async with running_gateway(server.port) as rig:
        tab = await rig.tab()
        await tab.send(PING + frame(7, 60) + PING)
        await tab.send(frame(8, 20))
        stream = await server.next()
        assert await stream.read(112) == PING + frame(7, 60) + PING + frame(8, 20)


async def test_frames_that_the_server_sends_in_pieces_arrive_whole(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tab = await rig.tab()
        stream = await server.next()
        for piece in (PONG[:1], PONG[1:9], PONG[9:] + PONG + PONG[:3], PONG[3:]):
            stream.write(piece)
            await asyncio.sleep(0.005)
        found: list[bytes] = []
        while len(found) < 3:
            found += frames_in([await tab.read()])
        assert found == [PONG] * 3


async def test_a_tab_may_speak_either_byte_order_to_a_server_that_knows_no_gateway(
    server: Server,
) -> None:
    async with running_gateway(server.port) as rig:
        tab = await rig.tab()
        await tab.send(BIG_PING)
        assert await (await server.next()).read(16) == BIG_PING


async def test_each_tab_has_a_connection_of_its_own(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        one, other = await rig.tab(), await rig.tab()
        await one.send(PING)
        await other.send(frame(7, 20))
        streams = [await server.next(), await server.next()]
        found = {await streams[0].read(16), await streams[1].read(16)}
        assert found == {PING, frame(7, 20)[:16]}


# Whose a connection is.


async def forwarded(stream: Stream) -> Forwarded:
    codec = codec_for(PENDANT, ByteOrder.LITTLE)
    size = int.from_bytes(await stream.read(4), "little")
    data = size.to_bytes(4, "little") + await stream.read(size)
    message = codec.decode(data)
    assert isinstance(message, Forwarded)
    return message


async def test_nothing_of_a_tab_is_sent_before_the_server_believes_whose_it_is(
    server: Server,
) -> None:
    async with running_gateway(server.port, WEB) as rig:
        tab = await rig.tab()
        await tab.send(PING)
        stream = await server.next()
        assert await forwarded(stream) == Forwarded("web", SECRET, "127.0.0.1", 0)
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(stream.reader.read(1), 0.1)
        stream.write(BELIEVED + PONG)
        assert await stream.read(16) == PING
        assert await tab.read() == PONG


@pytest.mark.parametrize("answer", [DOUBTED, PONG, b""], ids=["refused", "something else", "end"])
async def test_a_server_that_does_not_believe_the_gateway_gets_nothing_of_the_tab(
    server: Server, answer: bytes
) -> None:
    async with running_gateway(server.port, WEB) as rig:
        tab = await rig.tab()
        await tab.send(PING)
        stream = await server.next()
        await forwarded(stream)
        stream.write(answer)
        if not answer:
            stream.writer.close()
        code, reason = await tab.closed()
        assert (code, await stream.rest()) == (Ending.NOT_FORWARDED, b""), reason


async def test_what_a_known_proxy_states_is_what_the_server_is_told(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def is_guarded(*_: object) -> None:
        """Take the server for one that demands logins, which this one cannot say."""

    monkeypatch.setattr(cli, "check_logins_are_demanded", is_guarded)
    async with running_gateway(server.port, WEB, proxies=[LOOPBACK]) as rig:
        await rig.tab(X_Forwarded_For="192.0.2.7", X_Forwarded_Proto="https")
        stream = await server.next()
        assert await forwarded(stream) == Forwarded("web", SECRET, "192.0.2.7", 1)
        stream.write(BELIEVED)


async def test_a_page_that_came_by_the_gateways_own_tls_is_said_to_have(
    server: Server, tmp_path: Path
) -> None:
    certificate, key = make_certificate(tmp_path)
    own = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    own.load_cert_chain(certificate, key)
    trusted = ssl.create_default_context(cafile=str(certificate))
    async with running_gateway(server.port, WEB, tls=own, trusted=trusted) as rig:
        assert rig.page.startswith("https://")
        await rig.tab()
        stream = await server.next()
        assert await forwarded(stream) == Forwarded("web", SECRET, "127.0.0.1", 1)
        stream.write(BELIEVED)


# What ends a pair, and no other.

NO_FRAMES: dict[str, bytes | str] = {
    "a frame cut short": PING + PING[:7],
    "bytes behind a frame": PING + b"\0",
    "an impossible length": bytes.fromhex("03000000") + PING,
    "no bytes at all": b"",
    "text": "PING",
}


@pytest.mark.parametrize("sent", NO_FRAMES.values(), ids=list(NO_FRAMES))
async def test_a_message_that_holds_no_whole_frames_ends_its_pair_only(
    server: Server, sent: bytes | str
) -> None:
    async with running_gateway(server.port) as rig:
        tab, other = await rig.tab(), await rig.tab()
        streams = [await server.next(), await server.next()]
        await (tab.socket.send_str(sent) if isinstance(sent, str) else tab.send(sent))
        code, _ = await tab.closed()
        assert code == Ending.NO_FRAMES
        await other.send(PING)
        # A stop in front of rubbish still stops: whole frames before the fault go their way.
        whole = PING if isinstance(sent, bytes) and sent.startswith(PING) else b""
        done, waiting = await asyncio.wait(
            [asyncio.ensure_future(each.rest()) for each in streams],
            return_when=asyncio.FIRST_COMPLETED,
        )
        assert [each.result() for each in done] == [whole]
        assert len(waiting) == 1
        await other.socket.close()
        assert await waiting.pop() == PING


async def test_a_message_larger_than_any_is_refused(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tab = await rig.tab()
        await tab.send(bytes(relay.MOST_IN_MESSAGE + 1))
        assert await is_over(await server.next())


async def test_a_tab_that_leaves_ends_its_connection_at_once(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tab = await rig.tab()
        stream = await server.next()
        await tab.send(PING)
        await tab.socket.close()
        assert await stream.rest() == PING


async def test_a_tab_is_told_that_the_server_ended_after_all_that_it_said(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tab = await rig.tab()
        stream = await server.next()
        stream.write(PONG)
        stream.writer.close()
        assert await tab.read() == PONG
        assert await tab.closed() == (Ending.SERVER_ENDED, "the server closed the connection")


async def test_a_tab_is_told_that_the_link_broke(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tab = await rig.tab()
        (await server.next()).reset()
        assert await tab.closed() == (Ending.SERVER_ENDED, "the link broke")


async def test_a_server_that_sends_no_frames_is_left(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tab = await rig.tab()
        stream = await server.next()
        stream.write(PONG + b"HTTP/1.1 400 Bad Request\r\n\r\n")
        assert await tab.read() == PONG
        assert (await tab.closed())[0] == Ending.SERVER_ENDED
        assert await is_over(stream)


async def test_a_tab_is_told_that_nobody_listens() -> None:
    # Held, so that the gateway itself does not happen to get this port.
    with socket.socket() as held:
        held.bind(("127.0.0.1", 0))
        port = held.getsockname()[1]
        async with running_gateway(port) as rig:
            code, reason = await (await rig.tab()).closed()
        assert code == Ending.SERVER_UNREACHABLE
        assert f"127.0.0.1:{port}" in reason


async def test_a_tab_that_leaves_while_its_server_is_dialled_is_noticed_at_once(
    server: Server,
) -> None:
    """A server that never says whether it believes FORWARDED is dialled for five seconds."""
    async with running_gateway(server.port, WEB) as rig:
        tab = await rig.tab()
        stream = await server.next()
        await tab.socket.close()
        async with asyncio.timeout(2.0):
            await stream.rest()


async def test_what_a_tab_sends_while_its_server_is_dialled_goes_there_in_order(
    server: Server,
) -> None:
    async with running_gateway(server.port, WEB) as rig:
        tab = await rig.tab()
        stream = await server.next()
        await tab.send(PING)
        await tab.send(frame(7, 60))
        await asyncio.sleep(0.1)
        await forwarded(stream)
        stream.write(BELIEVED)
        assert await stream.read(76) == PING + frame(7, 60)


async def test_a_server_that_nobody_named_is_not_dialled(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        with pytest.raises(WSServerHandshakeError) as refused:
            await rig.tab(f"127.0.0.1:{server.port}")
        assert refused.value.status == 404
        answer = await rig.session.get(f"{rig.page}servers")
        listed = {"name": "cell", "address": f"127.0.0.1:{server.port}"}
        assert await answer.json() == {"servers": [listed]}


@pytest.mark.parametrize("name", ["", "cell"])
async def test_a_page_that_knows_no_name_gets_the_first_server(server: Server, name: str) -> None:
    async with running_gateway(server.port) as rig:
        await (await rig.tab(name)).send(PING)
        assert await (await server.next()).read(16) == PING


async def test_no_more_pairs_than_a_server_has_places(
    server: Server, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(relay, "MOST_PAIRS", 1)
    async with running_gateway(server.port) as rig:
        await rig.tab()
        with pytest.raises(WSServerHandshakeError) as refused:
            await rig.tab()
        assert refused.value.status == 503


# Who reads too slowly.

_LARGE = 60_000


async def deaf(rig_port: int, server: Server) -> tuple[DeafTab, Stream]:
    tab = DeafTab(rig_port)
    await tab.open()
    return tab, await server.next()


async def test_a_tab_that_does_not_read_is_spared_states_and_gets_all_else(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tab, stream = await deaf(rig.port, server)
        for number in range(400):
            stream.write(frame(STATE, _LARGE, number))
            if number % 100 == 99:
                stream.write(frame(7, 40, number))
            await asyncio.wait_for(stream.writer.drain(), 5.0)
        stream.writer.close()
        found, code = await tab.messages()
        frames = frames_in(found)
        kept = [int.from_bytes(each[16:20], "little") for each in frames if len(each) == 40]
        assert kept == [99, 199, 299, 399]
        assert 0 < len(frames) - len(kept) < 300
        assert code == Ending.SERVER_ENDED
        tab.close()


async def test_a_tab_that_leaves_too_much_else_unread_is_given_up(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tab, stream = await deaf(rig.port, server)
        for _ in range(400):
            stream.write(frame(7, _LARGE))
        await stream.is_reset()
        stream.writer.transport.abort()
        found, _ = await tab.messages()
        assert len(found) < 400
        tab.close()


# The end of the gateway.


async def test_all_pairs_are_closed_in_order_where_the_gateway_ends(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tabs = [await rig.tab() for _ in range(3)]
        streams = [await server.next() for _ in tabs]
        ended = [asyncio.ensure_future(tab.closed()) for tab in tabs]
        await rig.gateway.close()
        assert await asyncio.gather(*ended) == [(Ending.GOING_AWAY, "the gateway ends")] * 3
        assert all([await is_over(each) for each in streams])


async def test_a_tab_that_takes_no_part_in_the_end_does_not_hold_it_up(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tab, stream = await deaf(rig.port, server)
        async with asyncio.timeout(3.0):
            await rig.gateway.close()
        assert await is_over(stream)
        tab.close()


# Signs of life.


@pytest.mark.virtual_clock
async def test_a_tab_that_gives_no_sign_of_life_is_given_up(server: Server) -> None:
    loop = asyncio.get_running_loop()
    async with running_gateway(server.port) as rig:
        tab, stream = await deaf(rig.port, server)
        began = loop.time()
        assert await stream.reader.read() == b""
        silent = loop.time() - began
        assert relay.SILENCE <= silent <= relay.SILENCE + relay.HEARTBEAT
        tab.close()


@pytest.mark.virtual_clock
async def test_a_tab_that_answers_is_kept_however_long_nobody_speaks(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        tab = await rig.tab()
        stream = await server.next()
        reading = asyncio.ensure_future(tab.read())  # which answers what it is asked meanwhile
        await asyncio.sleep(10 * relay.SILENCE)
        stream.write(PONG)
        assert await reading == PONG


# Whose page may talk.

STRANGERS = {
    "a page of a stranger": {"Origin": "https://stranger.example"},
    "a page without an origin of its own": {"Origin": "null"},
    "a name that a stranger leads here": {
        "Host": "stranger.example",
        "Origin": "http://stranger.example",
    },
    "a proxy that nobody named": {"X-Forwarded-For": "127.0.0.1"},
}


@pytest.mark.parametrize("headers", STRANGERS.values(), ids=list(STRANGERS))
async def test_a_stranger_gets_no_connection(server: Server, headers: dict[str, str]) -> None:
    async with running_gateway(server.port) as rig:
        with pytest.raises(WSServerHandshakeError) as refused:
            await rig.tab(**headers)
        assert refused.value.status == 403
        assert server.accepted.empty()


async def test_a_request_for_the_page_is_refused_with_the_reason(server: Server) -> None:
    async with running_gateway(server.port) as rig:
        answer = await rig.session.get(rig.page, headers={"Via": "1.1 somewhere"})
        assert answer.status == 403
        assert "name it in its file, proxies" in await answer.text()
